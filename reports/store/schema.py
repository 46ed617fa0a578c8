"""Where a run file holds what: the groups that the writer and the reader share, of the quantities of `iapb.run`.

    /scene, /law, /coupling   texts: name, YAML source, every setting as JSON
    /trajectory               states at n + 1 instants
    /steps                    forces, impulse and contact state of the n steps between them
    /contacts                 ragged: those of step k are the rows offsets[k]:offsets[k + 1]
    /impacts                  one row per step and island of a colliding group
    /energy                   the ledger, on instants and on steps
    /effects                  what was on, and why
    /struck                   only where an impact of bare numbers broke a law: see reports.store.impact
    /timings, /provenance     outside the content hash: they differ from one machine to the next

Each group carries its own dimension scales, so that it opens as one xarray dataset.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.run import STATE_NAMES, ContactTable, ImpactTable, Quantity, Run, quantities

FORMAT = "iapb run"
TABLE_FORMAT = "iapb table"
FORMAT_VERSION = 2  # 2: names and units of velocities, which quaternions need

# group -> its quantities, the record that holds them, and the quantity that a plotting tool shows first
GROUPS: dict[str, tuple[tuple[Quantity, ...], Callable[[Run], Any], str]] = {
    "trajectory": (quantities(Run, "time"), lambda run: run, "v"),
    "steps": (quantities(Run, "step"), lambda run: run, "environment_force"),
    "contacts": (quantities(ContactTable), lambda run: run.contacts, "gap"),
    "impacts": (quantities(ImpactTable), lambda run: run.impacts, "energy_lost"),
    "timings": (quantities(Run, "chunk"), lambda run: run, "chunk_seconds"),
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
SENTENCES = ("remarks", "distrust")  # lists of sentences, as JSON in attributes of the file; a file may lack them

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
