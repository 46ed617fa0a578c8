"""Worlds and engines on random scenes: each planted fault breaks its own law, and a wrong name is
refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from runpy import run_path
from typing import Any

import numpy as np
import pytest

from iapb.run import Run
from iapb.scene import Scene
from iapb.system import System
from verification.laws.worlds import judge_world

HERE = "tests.verification.laws.test_worlds"


EXAMPLE = Path(__file__).parents[3] / "examples" / "own_engine.py"
Springs: Any = run_path(str(EXAMPLE))["Springs"]


class Flight(Springs):
    """The engine of the example without its springs."""

    settings = {"substeps": 1}

    def ignored(self, scene: Scene) -> tuple[str, ...]:
        return ("hand",) * (scene.hand is not None)

    def push(self, system: System, q: np.ndarray) -> np.ndarray:
        return np.zeros(system.mechanism.nv)


class Backwards(Flight):
    """Reports the velocity of the motion back."""

    def run(self, *given: Any) -> Run:
        made: Run = super().run(*given)
        return replace(made, v=-made.v)


class Rising(Flight):
    """Everything falls upwards."""

    def push(self, system: System, q: np.ndarray) -> np.ndarray:
        return np.asarray(2.0 * system.mechanism.gravity(q, system.gravity))


def broken(engine: str) -> set[str]:
    counts, left_out = judge_world(f"{HERE}:{engine}", scenes=8)
    assert 0 < left_out < 8
    return {count.law for count in counts if count.failures}


@pytest.mark.parametrize(
    ("engine", "breaks", "keeps"),
    [
        ("Flight", "overlap", "velocity"),
        ("Backwards", "velocity", "finite"),
        ("Rising", "energy", "velocity"),
    ],
)
def test_each_fault_breaks_its_law(engine: str, breaks: str, keeps: str) -> None:
    found = broken(engine)
    assert breaks in found and keeps not in found


def test_mujoco_keeps_the_laws() -> None:
    pytest.importorskip("mujoco")
    counts, _ = judge_world("mujoco", scenes=8)
    assert {count.law for count in counts} == {"finite", "velocity", "energy", "overlap"}
    assert not any(count.failures for count in counts)
