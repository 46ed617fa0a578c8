"""The names under which the report asks for runs of the peg in the corner, and what the figures call them.

Left: the curve's name in the paper, which is also its style. Right: the run's name among the report's inputs.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from iapb.run import Run

UNLIMITED = {"ideal": "corner/ideal", "IAPB": "corner/IAPB", "PB": "corner/PB", "CBuc": "corner/CBuc"}
LIMITED = {**UNLIMITED, "IAPB": "corner/IAPB-spread"}
STRATEGIES = {
    "ideal": "corner/ideal", "pfull": "corner/IAPB", "psaturated": "corner/IAPB-saturate",
    "pscaled": "corner/IAPB-scale", "pspread": "corner/IAPB-spread",
}
DEVICE = {"IAPB": "device/IAPB", "IAPB LM": "device/IAPB-LM", "PB": "device/PB"}


def runs_of(names: Mapping[str, str], inputs: Mapping[str, Any]) -> dict[str, Run]:
    """Return the runs by the name of their curve."""
    return {curve: inputs[name] for curve, name in names.items()}


def legend_of(names: Mapping[str, str]) -> tuple[tuple[str, str], ...]:
    """Return the legend: each curve under its own style."""
    return tuple((curve, curve) for curve in names)

