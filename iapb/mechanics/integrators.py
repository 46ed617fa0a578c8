"""Time integrators as data: each declares its order, and tests measure the order.

`momentum`, the default of a scene, applies forces at the start of a step and then moves the bodies freely
(`iapb.mechanics.kernels.free_motion`): linear and angular momentum are kept to rounding in the world's axes. Trees
without contact get half of gravity before and half after they move, so they move with order 2 under gravity, and a
free rigid body with order 4. With contact, or under forces of a hand or device, the order is 1.

All others are explicit and start a step from (q, v) alone (an impulse may have changed v just before). Stage i lies at
the fraction `fraction[i]` of the step; it is reached from the start of the step with velocity and acceleration of the
stage before it, and has the weight `weight[i]`. The compiled step reads these numbers; `Integrator.step` does the same
in Python for any acceleration. COMMUTATOR_FREE_4 exists in Python only; it keeps its fourth order where rotations do
not commute. On quaternions and other groups q moves by integrate(q, v, dt), never by addition.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
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

    def step(
        self, integrate: Integrate, acceleration: Acceleration, q: Floats, v: Floats, dt: float
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


class _CommutatorFree4(Integrator):
    """Commutator-free method of fourth order (Celledoni, Marthinsen and Owren, 2003).

    On vector coordinates it is the classical Runge-Kutta method.
    """

    __slots__ = ()

    def step(
        self, integrate: Integrate, acceleration: Acceleration, q: Floats, v: Floats, dt: float
    ) -> tuple[Floats, Floats]:
        """Return (q, v) after one step of dt [s], at fourth order on every configuration space."""
        v1, a1 = v, acceleration(q, v)
        q2, v2 = integrate(q, v1, 0.5 * dt), v + 0.5 * dt * a1
        a2 = acceleration(q2, v2)
        q3, v3 = integrate(q, v2, 0.5 * dt), v + 0.5 * dt * a2
        a3 = acceleration(q3, v3)
        q4, v4 = integrate(q2, v3 - 0.5 * v1, dt), v + dt * a3
        a4 = acceleration(q4, v4)
        q_half = integrate(q, (3.0 * v1 + 2.0 * v2 + 2.0 * v3 - v4) / 12.0, dt)
        q_next = integrate(q_half, (3.0 * v4 + 2.0 * v3 + 2.0 * v2 - v1) / 12.0, dt)
        return q_next, v + dt * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0


_STAGES_4 = (0.0, 0.5, 0.5, 1.0), (1 / 6, 1 / 3, 1 / 3, 1 / 6)
# The integrators that a contact law may name.
INTEGRATORS: dict[str, Integrator] = {
    method.name: method
    for method in (
        Integrator("momentum", 1, 4, (0.0,), (1.0,), semi_implicit=True, conserving=True),
        Integrator("semi_implicit_euler", 1, 1, (0.0,), (1.0,), semi_implicit=True),
        Integrator("midpoint", 2, 2, (0.0, 0.5), (0.0, 1.0)),
        Integrator("runge_kutta_4", 4, 2, *_STAGES_4),
    )
}
COMMUTATOR_FREE_4 = _CommutatorFree4("commutator_free_4", 4, 4, *_STAGES_4)
