"""Moreau-Jean time stepping with theta, for systems whose coordinates may be added (balls, blocks, cradles).

    v_free = v + h M⁻¹ f,   contact i is active when gap_i + h gamma_i / 2 <= 0,
    0 <= p ⟂ gamma_plus + e gamma_minus >= 0 on the active contacts,   q⁺ = q + h (theta v⁺ + (1 − theta) v)

Source: Jean, Comput. Methods Appl. Mech. Eng. 177 (1999); Acary and Brogliato (2008), section 10.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.errors import ArgumentError
from reference.rigid_step import nearest_velocity

Floats = NDArray[np.float64]


class UnilateralSystem(Protocol):
    """Constant mass matrix M (d, d) and force f (d,), gaps (c,) [m] and their gradient (c, d) at q (d,).

    `reference.event_driven.LinearSystem` is one.
    """

    @property
    def mass_matrix(self) -> Floats: ...

    @property
    def force(self) -> Floats: ...

    @property
    def restitution(self) -> float: ...

    def gap(self, q: Floats) -> Floats: ...

    def jacobian(self, q: Floats) -> Floats: ...


@dataclass(frozen=True)
class Trajectory:
    """States at n + 1 instants: time (n+1,), q and v (n+1, d); impulse (n+1, c) of the step ending there."""

    time: Floats
    q: Floats
    v: Floats
    impulse: Floats


def moreau_jean(
    system: UnilateralSystem, q: ArrayLike, v: ArrayLike, dt: float, steps: int, theta: float = 0.5
) -> Trajectory:
    """Return `steps` Moreau-Jean steps of length dt [s] from q, v (d,)."""
    if not (dt > 0.0 and 0.0 <= theta <= 1.0):
        raise ArgumentError("dt, theta", (dt, theta), "dt > 0 and theta in [0, 1]")
    states = [(np.array(q, np.float64), np.array(v, np.float64))]
    impulses = [np.zeros(len(system.gap(states[0][0])))]
    acceleration = np.linalg.solve(system.mass_matrix, system.force)
    for _ in range(steps):
        q_now, v_now = states[-1]
        rows = system.jacobian(q_now)
        gamma = rows @ v_now
        active = system.gap(q_now) + 0.5 * dt * gamma <= 0.0
        bound = np.where(active, -system.restitution * gamma, -np.inf)
        step = nearest_velocity(system.mass_matrix, v_now + dt * acceleration, rows, bound)
        states.append((q_now + dt * (theta * step.velocity + (1.0 - theta) * v_now), step.velocity))
        impulses.append(step.impulse)
    positions, velocities = (np.array(x) for x in zip(*states, strict=True))
    time: Floats = np.linspace(0.0, dt * steps, steps + 1)
    return Trajectory(time, positions, velocities, np.array(impulses))
