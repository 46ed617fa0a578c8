"""What the couplings of the paper, and walls from the literature, need of a device, by `check_force`.

The scene is a disc before a wall: `verification.port.coupled`. Springs and dampers are the paper's,
the device is bare: no damping, no friction, exact and prompt sensors.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from verification.check import Check, Study
from verification.numbers import Values
from verification.port.baselines.coupler import UnilateralWall
from verification.port.baselines.energy_bounding import EnergyBounding
from verification.port.baselines.implicit_wall import ImplicitWall
from verification.port.baselines.midpoint_wall import MidpointWall
from verification.port.baselines.passivity_control import PassivityControl
from verification.port.baselines.penalty import PenaltyWall
from verification.port.coupled import CoupledLoop, wall_scene
from verification.port.device import BareDevice
from verification.port.kit import ForceReport, check_force
from verification.table import Row, Table

# of the paper's walls and coupler [N/m, N s/m]
STIFFNESS = 1000.0
DAMPING = 50.0
RATE = 512.0
LIMIT = 15.0  # [N] of the paper's device
REACH = 0.01  # [m]: the wall is 1 mm away
FASTEST = 10.0  # [Hz]
EFFORT = {"quick": 0.5, "full": 1.0}
_WALL = PenaltyWall(STIFFNESS, DAMPING)


def _coupled(world: str, damping: float, rendering: str = "full") -> CoupledLoop:
    limit = None if rendering == "full" else LIMIT
    return CoupledLoop(wall_scene(world, STIFFNESS, damping, RATE, limit=limit), world, rendering)


# name: the law, and its stiffness and damping for Colgate's bound KT/2 + B
COUPLINGS: dict[str, tuple[Any, float]] = {
    "CBuc": (UnilateralWall(STIFFNESS, DAMPING), DAMPING),
    "CBuc without damping": (UnilateralWall(STIFFNESS), 0.0),
    "PB": (_coupled("PB", DAMPING), DAMPING),
    "IAPB": (_coupled("IAPB", DAMPING), DAMPING),
    "IAPB, saturated": (_coupled("IAPB", DAMPING, "saturate"), DAMPING),
    "IAPB, spread": (_coupled("IAPB", DAMPING, "spread"), DAMPING),
    "wall alone": (_WALL, DAMPING),
    "wall, passivity control": (PassivityControl(_WALL), DAMPING),
    "wall, energy bounding for 5 N s/m": (EnergyBounding(_WALL, 5.0), DAMPING),
    "wall, implicit": (ImplicitWall(STIFFNESS, DAMPING, 2.0), DAMPING),
    "wall, midpoint": (MidpointWall(STIFFNESS, 2.0), 0.0),
}


def report_of(study: Study, name: str) -> ForceReport:
    """Return the report on a law, with its edge; made once."""
    law, _ = COUPLINGS[name]
    start = law.start(1) if isinstance(law, CoupledLoop) else np.array([-1e-3])
    device = BareDevice(RATE, reach=REACH)
    options: dict[str, Any] = {"laws": ["energy"], "edge": True, "effort": EFFORT[study.depth]}
    return study.once(
        ("port", name),
        lambda: check_force(law, device, start=start, fastest=FASTEST, **options),
    )


def _needs(study: Study, name: str) -> Row:
    """Return what a law needs of a device without friction."""
    report = report_of(study, name)
    bound = 0.5 * STIFFNESS / RATE + COUPLINGS[name][1]
    enough = bool(np.isfinite(report.damping_needed))
    return {
        "law": name,
        "KT/2 + |B| [N s/m]": bound,
        "damping needed [N s/m]": report.damping_needed if enough else None,
        "no damping is enough": not enough,
        "needed / bound": report.damping_needed / bound if enough else None,
        "slow hands need [N s/m]": report.slow_damping,
        "calls": report.calls,
    }


def _edge(study: Study, name: str) -> Iterator[Row]:
    """Yield points of the edge of a law's passive set."""
    for damping, friction in report_of(study, name).edge:
        yield {"law": name, "damping [N s/m]": float(damping), "friction [N]": float(friction)}


PORT = Check(
    key="hand port",
    question="How much damping does a device need so that no hand draws energy from the loop?",
    cases=lambda study: COUPLINGS,
    row=_needs,
)
EDGES = Check(
    key="edges",
    question="On which devices is each loop passive?",
    cases=lambda study: [name for name in COUPLINGS if "," not in name],
    row=_edge,
)


def port_numbers(tables: Mapping[str, Table]) -> Values:
    """Return what the page quotes: dampings needed [N s/m], and as multiples of KT/2 + B."""
    if PORT.key not in tables:
        return {}
    rows = {row["law"]: row for row in tables[PORT.key].records()}
    found = {name.lower(): rows[name]["damping needed"] for name in ("PB", "IAPB", "CBuc")}
    return {f"{name}_needed": value for name, value in found.items()} | {
        "cbuc_over_bound": rows["CBuc"]["needed / bound"],
        "cbuc_undamped_over_bound": rows["CBuc without damping"]["needed / bound"],
    }
