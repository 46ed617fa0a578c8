"""The peg of Figure 4 in the loop of the device: when it comes to rest, and how often it
bounces."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np

from verification.check import Check, Study
from verification.finding import Part
from verification.scenes.measures import bounces, settling_time, trace_of
from verification.table import Table

SCENE = "peg_corner"
STIFFNESSES = {
    "quick": (500.0, 1000.0, 4000.0, 16000.0),
    "full": (250.0, 500.0, 1e3, 2e3, 4e3, 8e3, 16e3, 32e3),
}
DAMPINGS = {"quick": (0.0, 50.0, 200.0), "full": (0.0, 12.5, 25.0, 50.0, 100.0, 200.0, 400.0)}
# name: (rate [Hz], device), which emulate the paper's experiments as in the report's device runs
LATE: dict[str, Any] = {"device.delay": 1, "device.position_resolution": [1e-6, 1e-6, 1e-5]}
DEVICES: dict[str, tuple[float, dict[str, Any]]] = {
    "512 Hz": (512.0, {}),
    "512 Hz, late sensors": (512.0, LATE),
    "1 kHz": (1000.0, {}),
    "1 kHz, late sensors": (1000.0, LATE),
}


def _contacts(study: Study, case: tuple[str, float, float]) -> Iterator[dict[str, Any]]:
    """Yield the row of a device and a wall with penalties, then with impulses; runs may be
    incomplete."""
    device, K, B = case
    rate, sensors = DEVICES[device]
    values = {"rate": rate, "contact.stiffness": K, "contact.damping": B, **sensors}
    changed = study.scene(SCENE).with_values(values)
    for world in ("PB", "IAPB"):
        run = study.run(changed, world, keep=False, partial=True)
        trace = trace_of(run)
        yield {
            "device": device,
            "stiffness [N/m]": K,
            "damping [N s/m]": B,
            "world": run.world,
            "settles after [s]": settling_time(trace) if run.complete else None,
            "bounces": bounces(trace),
        }


def peg(pegs: Table) -> tuple[Part, Part]:
    """Return the targets: in how many combinations of device and wall the peg comes to rest later,
    or bounces more often, with impulses than with springs.

    A wall at which the peg rests under neither law, or equally soon, gives no outcome.
    """
    rows = pegs.records()
    pairs = list(zip(rows[::2], rows[1::2], strict=True))
    times = [
        tuple(np.inf if row["settles after"] is None else row["settles after"] for row in pair)
        for pair in pairs
    ]
    told = [ours > theirs for theirs, ours in times if ours != theirs]
    more = [ours["bounces"] > theirs["bounces"] for theirs, ours in pairs]
    return (
        Part.on("walls at which the peg rests later with impulses", sum(told) if told else None, 0),
        Part.on("walls at which the peg bounces more with impulses", sum(more), 0),
    )


PEG = Check(
    key="peg",
    question="Does the peg come to rest no later with impulses than with penalties?",
    cases=lambda study: product(DEVICES, STIFFNESSES[study.depth], DAMPINGS[study.depth]),
    row=_contacts,
    targets=peg,
)
