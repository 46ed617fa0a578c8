"""A small made-up run: every array filled, nothing simulated."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from iapb.run import ContactTable, EffectRow, ImpactTable, Run


def _contacts(rng: np.random.Generator, steps: int, count: int) -> ContactTable:
    splits = np.sort(rng.integers(0, count + 1, steps - 1))
    return ContactTable(
        offsets=np.concatenate([[0], splits, [count]]).astype(np.int64),
        body_a=np.zeros(count, np.int64),
        body_b=np.full(count, -1, np.int64),
        point=rng.normal(size=(count, 3)),
        normal=rng.normal(size=(count, 3)),
        gap=-rng.random(count),
        normal_velocity=rng.normal(size=count),
        normal_force=rng.random(count),
        friction_force=rng.normal(size=(count, 3)),
        impulse=rng.random(count),
        is_new=rng.random(count) < 0.5,
    )


def _impacts(rng: np.random.Generator, count: int, d: int) -> ImpactTable:
    return ImpactTable(
        step=np.arange(count, dtype=np.int64),
        group=np.zeros(count, np.int64),
        v_minus=rng.normal(size=(count, d)),
        v_plus=rng.normal(size=(count, d)),
        impulse=rng.normal(size=(count, d)),
        rows=np.full(count, 2, np.int64),
        rank=np.full(count, 1, np.int64),
        energy_lost=rng.random(count),
        scale=np.ones(count),
        clamp=np.ones(count),
        friction_share=np.ones(count),
        approaching=np.zeros(count, np.int64),
        solved=np.ones(count, np.bool_),
        mass_digest=np.zeros(count, np.int64),
    )


@pytest.fixture(scope="session")
def make_run() -> Callable[..., Run]:
    """Return a maker of runs: ``make_run(steps=20, contacts=7, impacts=3, seed=0, **fields)``."""

    def make(steps: int = 20, contacts: int = 7, impacts: int = 3, seed: int = 0, **fields: Any) -> Run:
        rng = np.random.default_rng(seed)
        d = 3
        tool_dofs = fields.pop("tool_dofs", (0, d))
        d_tool = tool_dofs[1] - tool_dofs[0]
        values: dict[str, Any] = {
            "scene_name": "peg",
            "scene_source": "name: peg\n# with a comment, é\n",
            "scene_resolved": {"name": "peg", "rate": 512, "bodies": [{"mass": 2.0}]},
            "world": "IAPB",
            "law": "impulse augmented",
            "law_settings": {"restitution": 0.0, "limits": [15.0, 15.0, 1.0]},
            "coupling": "four channel",
            "coupling_settings": {"stiffness": [100.0, 100.0, 0.5]},
            "dt": 1 / 512,
            "complete": True,
            "coordinate_names": ("peg.x", "peg.y", "peg.theta"),
            "coordinate_units": ("m", "m", "rad"),
            "velocity_names": ("peg.x", "peg.y", "peg.theta"),
            "velocity_units": ("m/s", "m/s", "rad/s"),
            "body_names": ("peg",),
            "tool_dofs": tool_dofs,
            "tool_coordinates": tool_dofs,
            "time": np.arange(steps + 1) / 512,
            "q": rng.normal(size=(steps + 1, d)),
            "v": rng.normal(size=(steps + 1, d)),
            "device_q": rng.normal(size=(steps + 1, d_tool)),
            "device_v": rng.normal(size=(steps + 1, d_tool)),
            "pose": rng.normal(size=(steps + 1, 1, 3)),
            "state": rng.integers(0, 3, steps).astype(np.int8),
            "contacts": _contacts(rng, steps, contacts),
            "impacts": _impacts(rng, impacts, d),
            "energy": {"kinetic": rng.random(steps + 1), "impact_loss": rng.random(steps)},
            "effects": (EffectRow("gravity", False, "the scene names none"), EffectRow("friction", True, "μ = 0.3"),
                        EffectRow("contact_damping", False, "no springs", "damping")),
            "chunk_steps": np.array([steps], np.int64),
            "chunk_seconds": np.array([0.5]),
        }
        for name in ("hand", "coupling", "penalty", "friction", "environment"):
            values[f"{name}_force"] = rng.normal(size=(steps, d))
        values["impulse"] = rng.normal(size=(steps, d))
        values["device_force"] = rng.normal(size=(steps, d_tool))
        return Run(**{**values, **fields})

    return make
