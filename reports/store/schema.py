"""The layout of a run file: the groups of the quantities of `iapb.run`, shared by writer and
reader.

    /scene, /law, /coupling   texts: name, YAML source, every setting as JSON
    /trajectory               states at n + 1 instants
    /steps                    forces, impulse and contact state of the n steps between them
    /contacts                 a ragged table: the contacts of step k are the rows
                              offsets[k]:offsets[k + 1]
    /impacts                  one row per step and island of a colliding group
    /energy                   the energy balance, at instants and over steps
    /effects                  the active effects, and the reasons
    /timings, /provenance     outside of the content hash, because they depend on the machine

If the attribute `every` of the file is N > 1, the record is thinned (`iapb.thinning`): its steps
are every N-th step and each step with an impact. Kept step i begins at time[i]; impacts count the
kept steps; energies are those at the kept instants, computed from all steps.

Each group has its own dimension scales, so that it opens as one xarray dataset.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from iapb.numerics.schema import Quantity, quantities
from iapb.run import STATE_NAMES, ContactTable, ImpactTable, Run

FORMAT = "iapb run"
TABLE_FORMAT = "iapb table"
# 2: names and units of velocities, which quaternions need; 3: poses; 4: digests of M; 5: names of
# energies, every; 6: the seal in the user block, time and q of impacts
FORMAT_VERSION = 6

# group -> its quantities, and the record that holds them
GROUPS: dict[str, tuple[tuple[Quantity, ...], Callable[[Run], Any]]] = {
    "trajectory": (quantities(Run, "time"), lambda run: run),
    "steps": (quantities(Run, "step"), lambda run: run),
    "contacts": (quantities(ContactTable), lambda run: run.contacts),
    "impacts": (quantities(ImpactTable), lambda run: run.impacts),
    "timings": (quantities(Run, "chunk"), lambda run: run),
}
# with the energy balance: the content hash
RESULT_GROUPS = ("trajectory", "steps", "contacts", "impacts")

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
# lists of sentences, as JSON in attributes of the file; a file may lack them
SENTENCES = ("remarks", "distrust")

# attributes of a file by which it is read; others may be added
ATTRIBUTES = (
    "format",
    "format_version",
    "title",
    "status",
    "stopped",
    "run_key",
    "content_hash",
    "dt",
    "energies",
    "every",
    "tool_dofs",
    "tool_coordinates",
    *SENTENCES,
)

STATE_ATTRIBUTES = {
    "flag_values": np.arange(len(STATE_NAMES), dtype=np.int8),
    "flag_meanings": " ".join(STATE_NAMES),
}
