"""Run: the plain record of one simulation, and the one list of what is recorded.

Everything after the engine works from a Run alone. Each recorded array says once, where it stands, along which
dimensions it goes, its unit and its meaning; the loop's record (`iapb.recording`), the run file
(`reports.store.schema`) and the test of docs/notation.md are made from that. States are sampled at n + 1 instants
(dimension time), step quantities belong to the n steps between them; velocity is the dimension of the d generalized
velocities, device_velocity that of the hand-held tool (and of the device, kinematically its equal).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

FREE, COLLIDING, RESTING = 0, 1, 2  # contact states of the paper, section III
STATE_NAMES = ("free", "colliding", "resting")

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]
States = NDArray[np.int8]
_TYPES = {"Floats": np.float64, "Integers": np.int64, "Booleans": np.bool_, "States": np.int8}

# Units of generalized quantities follow the unit of their coordinate or of their velocity.
POSITION = {"m": "m", "rad": "rad", "1": "1"}
# "1": an impact of bare numbers, which no scene gives a unit.
VELOCITY = {"m/s": "m/s", "rad/s": "rad/s", "1": "1"}
FORCE = {"m/s": "N", "rad/s": "N m", "1": "1"}
IMPULSE = {"m/s": "N s", "rad/s": "N m s", "1": "1"}


@dataclass(frozen=True)
class Quantity:
    """A recorded array: its name (also the attribute of the record), type, dimensions, unit and meaning.

    A `unit` that is a mapping belongs to a generalized quantity: the unit for each unit of coordinate
    or, along velocities, of velocity.
    """

    name: str
    dtype: type
    dimensions: tuple[str, ...]
    unit: str | dict[str, str]
    meaning: str


def _along(dimensions: str, unit: str | dict[str, str], meaning: str) -> dict[str, Any]:
    """What a field of a record says of itself."""
    return {"dimensions": tuple(dimensions.split()), "unit": unit, "meaning": meaning}


def quantities(record: type, first: str = "") -> tuple[Quantity, ...]:
    """Return the recorded arrays of a record class in order; those along dimension `first` alone, if it is given."""
    found = (Quantity(f.name, _TYPES[str(f.type)], **f.metadata) for f in fields(record) if f.metadata)
    return tuple(quantity for quantity in found if first in ("", quantity.dimensions[0]))


def blank(listed: Iterable[Quantity], lengths: Mapping[str, int]) -> dict[str, NDArray[Any]]:
    """Return an array of zeros for each quantity, by name; `lengths` are those of the dimensions."""
    return {each.name: np.zeros([lengths[name] for name in each.dimensions], each.dtype) for each in listed}


@dataclass(frozen=True)
class ContactTable:
    """Contacts of all steps, ragged: those of step k are the rows ``offsets[k]:offsets[k + 1]``."""

    offsets: Integers = field(metadata=_along(
        "step_edge", "1", "first row of each step's contacts; the last entry closes"))
    body_a: Integers = field(metadata=_along("contact", "1", "moving body that the normal points into"))
    body_b: Integers = field(metadata=_along("contact", "1", "other body, -1 = the static world"))
    point: Floats = field(metadata=_along("contact axis", "m", "contact point, world axes"))
    normal: Floats = field(metadata=_along("contact axis", "1", "unit normal, from b into a"))
    gap: Floats = field(metadata=_along("contact", "m", "distance, negative = overlap"))
    normal_velocity: Floats = field(metadata=_along(
        "contact", "m/s", "before the step's impulse, positive separates"))
    normal_force: Floats = field(metadata=_along("contact", "N", "force on a along the normal"))
    friction_force: Floats = field(metadata=_along("contact axis", "N", "friction force on a"))
    impulse: Floats = field(metadata=_along(  # of least norm where it is not unique
        "contact", "N s", "collision impulse on a along the normal"))
    is_new: Booleans = field(metadata=_along("contact", "1", "1 where the contact was not there in the step before"))


@dataclass(frozen=True)
class ImpactTable:
    """Collisions resolved, one row per step and island of a colliding group (paper section V).

    An island are the trees that contacts of the collision link: what only touches them is not in it.
    """

    step: Integers = field(metadata=_along("impact", "1", "step in which it happened"))
    group: Integers = field(metadata=_along("impact", "1", "first tree of those resolved together"))
    v_minus: Floats = field(metadata=_along("impact velocity", VELOCITY, "generalized velocity before"))
    v_plus: Floats = field(metadata=_along("impact velocity", VELOCITY, "generalized velocity after"))
    impulse: Floats = field(metadata=_along("impact velocity", IMPULSE, "generalized impulse"))
    rows: Integers = field(metadata=_along("impact", "1", "rows given to the resolver"))
    rank: Integers = field(metadata=_along("impact", "1", "rows it found independent and used"))
    energy_lost: Floats = field(metadata=_along("impact", "J", "kinetic energy before minus after"))
    scale: Floats = field(metadata=_along("impact", "1", "factor by which the device limit scaled the impulse"))
    clamp: Floats = field(metadata=_along("impact", "1", "factor of the final energy clamp"))
    friction_share: Floats = field(metadata=_along(
        "impact", "1", "factor by which friction was reduced (energy, cones)"))
    approaching: Integers = field(metadata=_along(
        "impact", "1", "rows that approach still afterwards, -1 = the law does not say"))
    solved: Booleans = field(metadata=_along(
        "impact", "1", "0 where the law is not met (friction reduced); passive all the same"))


@dataclass(frozen=True)
class EffectRow:
    """One line of the effects table: what was on, and why; `ignores`: the field of the scene that the law ignored."""

    name: str
    active: bool
    reason: str
    ignores: str = ""


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
    q: Floats = field(metadata=_along("time coordinate", POSITION, "generalized configuration"))
    v: Floats = field(metadata=_along("time velocity", VELOCITY, "generalized velocity"))
    device_q: Floats = field(metadata=_along("time device_coordinate", POSITION, "configuration of the device"))
    device_v: Floats = field(metadata=_along("time device_velocity", VELOCITY, "velocity of the device"))

    hand_force: Floats = field(metadata=_along("step velocity", FORCE, "generalized force of the hand on the tool"))
    coupling_force: Floats = field(metadata=_along("step velocity", FORCE, "force of the coupling on the tool"))
    penalty_force: Floats = field(metadata=_along(
        "step velocity", FORCE, "normal contact forces, or constraint forces"))
    friction_force: Floats = field(metadata=_along("step velocity", FORCE, "friction forces"))
    impulse: Floats = field(metadata=_along("step velocity", IMPULSE, "generalized collision impulse of the step"))
    environment_force: Floats = field(metadata=_along("step velocity", FORCE, "contact forces + impulse / dt (26)"))
    device_force: Floats = field(metadata=_along("step device_velocity", FORCE, "what the device's actuators apply"))
    state: States = field(metadata=_along("step", "1", "contact state of the tool's group"))
    contacts: ContactTable
    impacts: ImpactTable
    energy: dict[str, Floats]  # the ledger, see iapb.mechanics.energy
    effects: tuple[EffectRow, ...]

    chunk_steps: Integers = field(
        default_factory=lambda: np.zeros(0, np.int64), metadata=_along("chunk", "1", "steps per timed chunk"))
    chunk_seconds: Floats = field(
        default_factory=lambda: np.zeros(0), metadata=_along("chunk", "s", "wall time of each chunk"))
    kernel: str = "compiled"  # or "python"
    stopped: str = ""  # why an incomplete run ends where it does; empty for a complete one
    remarks: tuple[str, ...] = ()  # what was chosen for the scene, such as by contact.auto
    distrust: tuple[str, ...] = ()  # why the result is not to be trusted (`iapb.checks`); empty where nothing is wrong

    @property
    def steps(self) -> int:
        """Number of steps done."""
        return len(self.time) - 1
