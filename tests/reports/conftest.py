"""A small made-up run: every array filled, nothing simulated."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from iapb.run import ContactTable, EffectRow, ImpactTable, Run
from iapb.schema import Quantity, blank, quantities

NAMES = ("peg.x", "peg.y", "peg.theta")
TEXTS: dict[str, Any] = {
    "scene_name": "peg", "scene_source": "name: peg\n# with a comment, é\n", "world": "IAPB",
    "scene_resolved": {"name": "peg", "rate": 512, "bodies": [{"mass": 2.0}]},
    "law": "impulse augmented", "law_settings": {"restitution": 0.0, "limits": [15.0, 15.0, 1.0]},
    "coupling": "four channel", "coupling_settings": {"stiffness": [100.0, 100.0, 0.5]}, "dt": 1 / 512,
    "complete": True, "coordinate_names": NAMES, "coordinate_units": ("m", "m", "rad"), "velocity_names": NAMES,
    "velocity_units": ("m/s", "m/s", "rad/s"), "body_names": ("peg",),
    "effects": (EffectRow("gravity", False, "the scene names none"), EffectRow("friction", True, "μ = 0.3"),
                EffectRow("contact_damping", False, "no springs", "damping")),
}  # fmt: skip


@pytest.fixture(scope="session")
def make_run() -> Callable[..., Run]:
    """Return a maker of runs: ``make_run(steps=20, contacts=7, impacts=3, seed=0, **fields)``."""

    def make(steps: int = 20, contacts: int = 7, impacts: int = 3, seed: int = 0, **fields: Any) -> Run:
        rng = np.random.default_rng(seed)
        tool_dofs = fields.pop("tool_dofs", (0, 3))
        device = tool_dofs[1] - tool_dofs[0]
        lengths = {"time": steps + 1, "step": steps, "step_edge": steps + 1, "contact": contacts, "impact": impacts,
                   "coordinate": 3, "velocity": 3, "device_coordinate": device, "device_velocity": device, "body": 1,
                   "placement": 3, "axis": 3}  # fmt: skip

        def filled(listed: tuple[Quantity, ...]) -> dict[str, np.ndarray]:
            return {name: rng.normal(size=array.shape) if array.dtype.kind == "f" else
                    rng.integers(0, 2, array.shape).astype(array.dtype)
                    for name, array in blank(listed, lengths).items()}  # fmt: skip

        contact, impact = filled(quantities(ContactTable)), filled(quantities(ImpactTable))
        contact |= {"offsets": np.array([0, *np.sort(rng.integers(0, contacts + 1, steps - 1)), contacts]),
                    "gap": -np.abs(contact["gap"])}  # fmt: skip
        impact |= {"step": np.arange(impacts), "energy_lost": np.abs(impact["energy_lost"])}
        values = TEXTS | filled((*quantities(Run, "time"), *quantities(Run, "step"))) | {
            "tool_dofs": tool_dofs, "tool_coordinates": tool_dofs, "time": np.arange(steps + 1) / 512,
            "contacts": ContactTable(**contact), "impacts": ImpactTable(**impact),
            "energy": {"kinetic": rng.random(steps + 1), "impact_loss": rng.random(steps)},
            "chunk_steps": np.array([steps], np.int64), "chunk_seconds": np.array([0.5]),
        }  # fmt: skip
        return Run(**{**values, **fields})

    return make
