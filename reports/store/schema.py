"""What a run file holds, and where: the table that the writer and the reader share.

    /scene, /law, /coupling   texts: name, YAML source, every setting as JSON
    /trajectory               states at n + 1 instants
    /steps                    forces, impulse and contact state of the n steps between them
    /contacts                 ragged: those of step k are the rows offsets[k]:offsets[k + 1]
    /impacts                  one row per colliding group and step
    /energy                   the ledger, on instants and on steps
    /effects                  what was on, and why
    /struck                   only where an impact of bare numbers broke a law: see reports.store.impact
    /timings, /provenance     outside the content hash: they differ from one machine to the next

Each group carries its own dimension scales, so that it opens as one xarray dataset.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.run import STATE_NAMES, Run

FORMAT = "iapb run"
TABLE_FORMAT = "iapb table"
FORMAT_VERSION = 2  # 2: names and units of velocities, which quaternions need

# Units of generalized quantities follow the unit of their coordinate or of their velocity.
POSITION = {"m": "m", "rad": "rad", "1": "1"}
# "1": an impact of bare numbers, which no scene gives a unit.
VELOCITY = {"m/s": "m/s", "rad/s": "rad/s", "1": "1"}
FORCE = {"m/s": "N", "rad/s": "N m", "1": "1"}
IMPULSE = {"m/s": "N s", "rad/s": "N m s", "1": "1"}


@dataclass(frozen=True)
class Quantity:
    """One dataset: its name (also the attribute of the record), dimensions, unit and meaning.

    A `unit` that is a mapping belongs to a generalized quantity: the unit for each unit of coordinate
    or, along velocities, of velocity.
    """

    name: str
    dimensions: tuple[str, ...]
    unit: str | dict[str, str]
    meaning: str


TRAJECTORY = (
    Quantity("q", ("time", "coordinate"), POSITION, "generalized configuration"),
    Quantity("v", ("time", "velocity"), VELOCITY, "generalized velocity"),
    Quantity("device_q", ("time", "device_coordinate"), POSITION, "configuration of the device"),
    Quantity("device_v", ("time", "device_velocity"), VELOCITY, "velocity of the device"),
)

STEPS = (
    Quantity("hand_force", ("step", "velocity"), FORCE, "generalized force of the hand on the tool"),
    Quantity("coupling_force", ("step", "velocity"), FORCE, "force of the coupling on the tool"),
    Quantity("penalty_force", ("step", "velocity"), FORCE, "normal contact forces, or constraint forces"),
    Quantity("friction_force", ("step", "velocity"), FORCE, "friction forces"),
    Quantity("impulse", ("step", "velocity"), IMPULSE, "generalized collision impulse of the step"),
    Quantity("environment_force", ("step", "velocity"), FORCE, "contact forces + impulse / dt (26)"),
    Quantity("device_force", ("step", "device_velocity"), FORCE, "what the device's actuators apply"),
    Quantity("state", ("step",), "1", "contact state of the tool's group"),
)

CONTACTS = (
    Quantity("offsets", ("step_edge",), "1", "first row of each step's contacts; the last entry closes"),
    Quantity("body_a", ("contact",), "1", "moving body that the normal points into"),
    Quantity("body_b", ("contact",), "1", "other body, -1 = the static world"),
    Quantity("point", ("contact", "axis"), "m", "contact point, world axes"),
    Quantity("normal", ("contact", "axis"), "1", "unit normal, from b into a"),
    Quantity("gap", ("contact",), "m", "distance, negative = overlap"),
    Quantity("normal_velocity", ("contact",), "m/s", "before the step's impulse, positive separates"),
    Quantity("normal_force", ("contact",), "N", "force on a along the normal"),
    Quantity("friction_force", ("contact", "axis"), "N", "friction force on a"),
    Quantity("impulse", ("contact",), "N s", "collision impulse on a along the normal"),
    Quantity("is_new", ("contact",), "1", "1 where the contact was not there in the step before"),
)

IMPACTS = (
    Quantity("step", ("impact",), "1", "step in which it happened"),
    Quantity("group", ("impact",), "1", "first tree of those resolved together"),
    Quantity("v_minus", ("impact", "velocity"), VELOCITY, "generalized velocity before"),
    Quantity("v_plus", ("impact", "velocity"), VELOCITY, "generalized velocity after"),
    Quantity("impulse", ("impact", "velocity"), IMPULSE, "generalized impulse"),
    Quantity("rows", ("impact",), "1", "rows given to the resolver"),
    Quantity("rank", ("impact",), "1", "rows it found independent and used"),
    Quantity("energy_lost", ("impact",), "J", "kinetic energy before minus after"),
    Quantity("scale", ("impact",), "1", "factor by which the device limit scaled the impulse"),
    Quantity("clamp", ("impact",), "1", "factor of the final energy clamp"),
    Quantity("friction_share", ("impact",), "1", "factor by which friction was reduced (energy, cones)"),
    Quantity("approaching", ("impact",), "1", "rows that approach still afterwards, -1 = the law does not say"),
    Quantity("solved", ("impact",), "1", "0 where the law is not met (friction reduced); passive all the same"),
)

TIMINGS = (
    Quantity("chunk_steps", ("chunk",), "1", "steps per timed chunk"),
    Quantity("chunk_seconds", ("chunk",), "s", "wall time of each chunk"),
)

# group -> its quantities, the record that holds them, and the quantity that a plotting tool shows first
GROUPS: dict[str, tuple[tuple[Quantity, ...], Callable[[Run], Any], str]] = {
    "trajectory": (TRAJECTORY, lambda run: run, "v"),
    "steps": (STEPS, lambda run: run, "environment_force"),
    "contacts": (CONTACTS, lambda run: run.contacts, "gap"),
    "impacts": (IMPACTS, lambda run: run.impacts, "energy_lost"),
    "timings": (TIMINGS, lambda run: run, "chunk_seconds"),
}
RESULT_GROUPS = ("trajectory", "steps", "contacts", "impacts")  # with the energy ledger: the content hash

# (group, name, attribute of Run): texts; those of `JSON_TEXTS` are stored as JSON
TEXTS = (
    ("scene", "name", "scene_name"),
    ("scene", "source", "scene_source"),
    ("scene", "resolved", "scene_resolved"),
    ("law", "name", "law"),
    ("law", "settings", "law_settings"),
    ("law", "world", "world"),
    ("law", "kernel", "kernel"),
    ("coupling", "name", "coupling"),
    ("coupling", "settings", "coupling_settings"),
)
JSON_TEXTS = frozenset({"scene_resolved", "law_settings", "coupling_settings"})

STATE_ATTRIBUTES = {
    "flag_values": np.arange(len(STATE_NAMES), dtype=np.int8),
    "flag_meanings": " ".join(STATE_NAMES),
}


def energy_dimension(run: Run, name: str) -> str:
    """Return the dimension of a ledger entry: ``time`` when it has n + 1 values, ``step`` when it has n."""
    length = len(run.energy[name])
    return {run.steps + 1: "time", run.steps: "step"}.get(length, f"{name}_entry")


def unit_of(quantity: Quantity, run: Run) -> str:
    """Return the unit of `quantity` in `run`: one, or one per column where the columns differ."""
    if isinstance(quantity.unit, str):
        return quantity.unit
    units = [quantity.unit[unit] for unit in _along(run, quantity.dimensions[1])[1]]
    return units[0] if len(set(units)) == 1 else ", ".join(units) or "1"


def coordinates_of(run: Run, dimension: str, length: int) -> tuple[NDArray[Any] | tuple[str, ...], str]:
    """Return the values along a dimension and their unit: labels, instants, or 0, 1, 2 …"""
    if dimension == "time":
        return np.asarray(run.time, np.float64), "s"
    labels = ("x", "y", "z") if dimension == "axis" else _along(run, dimension)[0]
    if labels and len(labels) == length:
        return labels, "1"
    return np.arange(length, dtype=np.int64), "1"


def _along(run: Run, dimension: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return names and units along a dimension of generalized quantities; none along others."""
    q, v = slice(*run.tool_coordinates), slice(*run.tool_dofs)
    return {
        "coordinate": (run.coordinate_names, run.coordinate_units),
        "velocity": (run.velocity_names, run.velocity_units),
        "device_coordinate": (run.coordinate_names[q], run.coordinate_units[q]),
        "device_velocity": (run.velocity_names[v], run.velocity_units[v]),
    }.get(dimension, ((), ()))
