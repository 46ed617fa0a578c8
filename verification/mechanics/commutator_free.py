"""A commutator-free integrator of fourth order, in Python only: it keeps its order where rotations do not commute."""

from __future__ import annotations

from iapb.mechanics.integrators import INTEGRATORS, Acceleration, Floats, Integrate, Integrator


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


COMMUTATOR_FREE_4 = _CommutatorFree4(*INTEGRATORS["runge_kutta_4"]._replace(name="commutator_free_4", group_order=4))
