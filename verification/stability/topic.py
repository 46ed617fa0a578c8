"""Topic: the stability of sampled contact with penalties and impulses (C20, C21), and its
rate-hardness."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from verification.check import Check, Study, Topic
from verification.finding import Part
from verification.stability.peg import PEG
from verification.stability.port import EDGES, PORT, port_numbers
from verification.stability.walls import (
    GRIDS,
    GROWS,
    LAWS,
    PAPER_DAMPING,
    SETTLES,
    Contact,
    Loop,
    grid,
    loops,
    maps_of,
)
from verification.table import Row, Table


def _maps(study: Study, loop: Loop) -> tuple[Contact, Contact]:
    return study.once(loop, lambda: maps_of(loop, *grid(study.depth)))


def _loop(loop: Loop) -> Row:
    return {
        "rate [Hz]": loop.rate,
        "sensors": "late" if loop.delay else "ideal",
        "device damping [N s/m]": loop.device_damping,
    }


def _marks(study: Study, loop: Loop) -> Iterator[Row]:
    """Yield a row per stiffness, with one mark per damping for its outcome."""
    both = [one.outcomes for one in _maps(study, loop)]
    for i, K in enumerate(grid(study.depth)[0]):
        marks = ["".join(one[:, i]) for one in both]
        yield {
            **_loop(loop),
            "stiffness [N/m]": float(K),
            "passive up to [N s/m]": max(float(loop.passive_damping(K)), 0.0),
            "penalties": marks[0],
            "impulses": marks[1],
        }


def _of_maps(table: Table) -> Iterator[Part]:
    """Yield the parts on stable walls, on the condition b >= KT/2 + |B|, and on a device without
    damping."""
    theirs, ours = (
        np.array([list(marks) for marks in table.column(law)]) for law in ("penalties", "impulses")
    )
    damping = next(grid(depth)[1] for depth in GRIDS if GRIDS[depth][1] == theirs.shape[1])
    rate, b, K = (np.array(table.column(key)) for key in ("rate", "device damping", "stiffness"))
    passive = (b - 0.5 * K * (1.0 / rate))[:, None] >= damping
    told = (np.array(table.column("sensors")) == "ideal") & (b > 0.0)
    loop = table.select(["rate", "sensors", "device damping"]).rows
    groups = [[k for k, own in enumerate(loop) if own == one] for one in dict.fromkeys(loop)]
    settled = theirs == SETTLES, ours == SETTLES
    more = [settled[1][of].sum() / settled[0][of].sum() for of in groups]
    yield Part.on(
        "stable walls with impulses over those with springs, least of the loops",
        float(min(more)),
        1.0,
        least=True,
    )
    yield Part.on("walls that only springs settle", int((settled[0] & ~settled[1]).sum()), 0)
    yield Part.on(
        "walls that are passive by Colgate’s condition, at which the motion grows",
        int((passive & (theirs == GROWS))[told].sum()),
        0,
    )


def _hardness(study: Study, loop: Loop) -> Iterator[Row]:
    """Yield a row per law and stiffness at the paper's damping."""
    stiffness, damping = grid(study.depth)
    at = int(np.flatnonzero(damping == PAPER_DAMPING)[0])
    for law, one in zip(LAWS, _maps(study, loop), strict=True):
        for i, K in enumerate(stiffness):
            yield {
                **_loop(loop),
                "law": law,
                "stiffness [N/m]": float(K),
                "rate-hardness [N/m]": float(one.rate_hardness[at, i]),
                "penetration [mm]": 1e3 * float(one.penetration[at, i]),
            }


def _hard(table: Table) -> Iterator[Part]:
    """Yield the targets of rate-hardness and penetration, impulses over springs: a median a loop."""
    of_law = [table.where(law=law) for law in LAWS]
    size = len(set(table.column("stiffness")))
    harder, deeper = (
        np.median(
            np.divide(*(np.array(one.column(key)) for one in of_law[::-1])).reshape(-1, size),
            axis=1,
        )
        for key in ("rate-hardness", "penetration")
    )
    yield Part.on(
        "first rise of the force over a spring’s, least of the loops",
        float(min(harder)),
        1.0,
        least=True,
    )
    yield Part.on("penetration over a spring’s, largest of the loops", float(max(deeper)), 1.0)


MAPS = Check(
    key="maps",
    question="At which walls does the mass come to rest?",
    cases=lambda study: loops(),
    row=_marks,
    targets=_of_maps,
)
HARDNESS = Check(
    key="hardness",
    question="How hard does a wall feel?",
    cases=lambda study: loops(),
    row=_hardness,
    targets=_hard,
)

contact_stability = Topic(
    key="stability",
    title="Stability of contact",
    question="A virtual wall in a sampled loop can feed energy to the hand. First, a constant force pushes a mass of 2 "
    "kg against many walls of stiffness K and damping B. A loop has a rate (512 Hz or 1 kHz), a "
    "device damping b, and "
    "ideal or late sensors: late readings are rounded to 1 µm, and readings and forces each come "
    "one step late. A wall "
    "is stable if the mass comes to rest: in the last quarter of three seconds the mass is slower "
    "than 1 mm/s and "
    "never leaves the wall. Second, the engine pushes the paper's peg into a corner. Third, a "
    "hand moves the device, "
    "and we measure the energy that it draws from the loop. Colgate's condition, b >= KT/2 + |B| "
    "with the period T, "
    "makes a wall of spring and damper passive for every hand, if the sensors are ideal.",
    checks=(MAPS, HARDNESS, PEG, PORT, EDGES),
    numbers=port_numbers,
)
