"""Run: the plain record of one simulation. Everything after the engine works from this alone.

States are sampled at n + 1 instants, step quantities belong to the n steps between them; d is the number
of generalized velocities, d_t that of the hand-held tool (and of the device, kinematically its equal).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

FREE, COLLIDING, RESTING = 0, 1, 2  # contact states of the paper, section III
STATE_NAMES = ("free", "colliding", "resting")

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class ContactTable:
    """Contacts of all steps, ragged: those of step k are the rows ``offsets[k]:offsets[k + 1]``."""

    offsets: Integers  # (n + 1,)
    body_a: Integers  # (m,) moving body that the normal points into
    body_b: Integers  # (m,) other body, -1 = the static world
    point: Floats  # (m, 3) [m] world
    normal: Floats  # (m, 3) unit, from b into a
    gap: Floats  # (m,) [m] negative = overlap
    normal_velocity: Floats  # (m,) [m/s] positive separates, before the step's impulse
    normal_force: Floats  # (m,) [N] penalty or constraint force on a along the normal
    friction_force: Floats  # (m, 3) [N] on a
    impulse: Floats  # (m,) [N s] on a along the normal; minimum norm where not unique
    is_new: NDArray[np.bool_]  # (m,)


@dataclass(frozen=True)
class ImpactTable:
    """Collisions resolved, one row per step and island of a colliding group (paper section V).

    An island are the trees that contacts of the collision link: what only touches them is not in it.
    """

    step: Integers  # (k,) the step in which it happened
    group: Integers  # (k,) first tree of the island
    v_minus: Floats  # (k, d) [m/s, rad/s] generalized velocity before
    v_plus: Floats  # (k, d) after
    impulse: Floats  # (k, d) generalized impulse J^T p [N s, N m s]
    rows: Integers  # (k,) rows given to the resolver
    rank: Integers  # (k,) rows it found independent and used
    energy_lost: Floats  # (k,) [J] kinetic energy before minus after
    scale: Floats  # (k,) factor by which the device limit scaled the impulse, 1 = not at all
    clamp: Floats  # (k,) factor of the final energy clamp, 1 = not active
    friction_share: Floats  # (k,) factor by which friction was reduced: no gain of energy, no cone left; 1 = not at all
    approaching: Integers  # (k,) rows that approach still afterwards, -1 = the law does not say
    solved: NDArray[np.bool_]  # (k,) False: the law is not met (friction reduced, no unequal e); passive all the same


@dataclass(frozen=True)
class EffectRow:
    """One line of the effects table: what was on, and why."""

    name: str
    active: bool
    reason: str


@dataclass(frozen=True)
class Run:
    """One simulation: scene, law, coupling and everything that came of it (SI units)."""

    scene_name: str
    scene_source: str  # YAML text
    scene_resolved: dict[str, Any]  # every field with its value, defaults included
    world: str  # "IAPB", "PB", "ideal", "CBuc" or a name of the caller's
    law: str
    law_settings: dict[str, Any]
    coupling: str  # "none" where no device takes part
    coupling_settings: dict[str, Any]
    dt: float  # [s]
    complete: bool  # False: interrupted, the arrays end at the last step done
    coordinate_names: tuple[str, ...]  # (nq,)
    coordinate_units: tuple[str, ...]  # (nq,)
    velocity_names: tuple[str, ...]  # (d,) of each entry of v, and of generalized forces and impulses
    velocity_units: tuple[str, ...]  # (d,) m/s or rad/s: a force has N, N m, an impulse N s, N m s
    body_names: tuple[str, ...]
    tool_dofs: tuple[int, int]  # start, stop of the tool in v; (0, 0) without a hand
    tool_coordinates: tuple[int, int]  # the same in q: quaternions are longer than their velocities

    time: Floats  # (n + 1,) [s]
    q: Floats  # (n + 1, nq)
    v: Floats  # (n + 1, d)
    device_q: Floats  # (n + 1, d_t)
    device_v: Floats  # (n + 1, d_t)

    hand_force: Floats  # (n, d) generalized force of the hand on the tool
    coupling_force: Floats  # (n, d) of the position channels (or the coupler) on the tool
    penalty_force: Floats  # (n, d) normal contact forces; constraint forces of rigid worlds
    friction_force: Floats  # (n, d)
    impulse: Floats  # (n, d) generalized collision impulse of the step [N s]
    environment_force: Floats  # (n, d) F_env = contact forces + impulse / dt, as the tool gets it (26)
    device_force: Floats  # (n, d_t) what the device's actuators apply (after its limits)
    state: NDArray[np.int8]  # (n,) contact state of the tool's group: FREE, COLLIDING, RESTING
    contacts: ContactTable
    impacts: ImpactTable
    energy: dict[str, Floats]  # the ledger, see iapb.mechanics.energy
    effects: tuple[EffectRow, ...]

    chunk_steps: Integers = field(default_factory=lambda: np.zeros(0, np.int64))  # steps per timed chunk
    chunk_seconds: Floats = field(default_factory=lambda: np.zeros(0))  # wall time of each chunk
    kernel: str = "compiled"  # or "python"
    stopped: str = ""  # why an incomplete run ends where it does; empty for a complete one

    @property
    def steps(self) -> int:
        """Number of steps done."""
        return len(self.time) - 1
