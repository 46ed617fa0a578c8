"""Time integrators as data: each declares its order, and tests measure the order.

`momentum`, the default of a scene, applies forces at the start of a step and then moves the bodies freely
(`iapb.mechanics.kernels.free_motion`): linear and angular momentum are kept to rounding in the world's axes. Trees
without contact get half of gravity before and half after they move, so they move with order 2 under gravity, and a
free rigid body with order 4. With contact, or under forces of a hand or device, the order is 1.

All others are explicit and start a step from (q, v) alone (an impulse may have changed v just before). Stage i lies at
the fraction `fraction[i]` of the step; it is reached from the start of the step with velocity and acceleration of the
stage before it, and has the weight `weight[i]`. The compiled step reads these numbers; `Integrator.step` does the same
in Python for any acceleration. On quaternions and other groups q moves by integrate(q, v, dt), never by addition.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from iapb.schema import Floats

Integrate = Callable[[Floats, Floats, float], Floats]  # q, v, dt [s] -> q
Acceleration = Callable[[Floats, Floats], Floats]  # q, v -> dv/dt


class Integrator(NamedTuple):
    """An explicit integrator.

    `order`: the error after a given time falls as dt^order. `group_order` is the order where rotations do not
    commute; it can be lower, because the step combines the stages' velocities into one displacement.
    """

    name: str
    order: int
    group_order: int
    fraction: tuple[float, ...]  # time of each evaluation, as a fraction of the step
    weight: tuple[float, ...]  # weight of each evaluation, sum 1
    semi_implicit: bool = False  # the new velocity moves the configuration
    conserving: bool = False  # Coriolis terms belong to the motion, which keeps momentum; `step` leaves them out

    def step(self, integrate: Integrate, acceleration: Acceleration, q: Floats, v: Floats, dt: float,
             ) -> tuple[Floats, Floats]:
        """Return (q, v) after one step of dt [s]."""
        rate, change = v, acceleration(q, v)
        mean_rate, mean_change = self.weight[0] * rate, self.weight[0] * change
        for fraction, weight in zip(self.fraction[1:], self.weight[1:], strict=True):
            place = integrate(q, rate, fraction * dt)
            rate = v + fraction * dt * change
            change = acceleration(place, rate)
            mean_rate, mean_change = mean_rate + weight * rate, mean_change + weight * change
        v_next = v + dt * mean_change
        return integrate(q, v_next if self.semi_implicit else mean_rate, dt), v_next


# The integrators that a contact law may name.
INTEGRATORS: dict[str, Integrator] = {
    method.name: method
    for method in (
        Integrator("momentum", 1, 4, (0.0,), (1.0,), semi_implicit=True, conserving=True),
        Integrator("semi_implicit_euler", 1, 1, (0.0,), (1.0,), semi_implicit=True),
        Integrator("midpoint", 2, 2, (0.0, 0.5), (0.0, 1.0)),
        Integrator("runge_kutta_4", 4, 2, (0.0, 0.5, 0.5, 1.0), (1 / 6, 1 / 3, 1 / 3, 1 / 6)),
    )
}
