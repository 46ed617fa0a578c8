"""Worlds and engines on random scenes: each planted fault breaks its own law, and a wrong name is
refused."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from iapb.engines import run_of_states
from iapb.errors import ArgumentError
from iapb.run import Run
from iapb.scene import Scene
from iapb.system import System
from iapb.worlds import find_world
from verification.laws.worlds import judge_world

HERE = "tests.verification.laws.test_worlds"


class Flight:
    """Free motion by semi-implicit Euler, without contact."""

    name = "flight"
    settings: dict[str, Any] = {}
    # factors of gravity and of the reported velocity
    field = 1.0
    reported = 1.0

    def ignored(self, scene: Scene) -> tuple[str, ...]:
        return ("hand",) * (scene.hand is not None)

    def run(
        self,
        scene: Scene,
        steps: int | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> Run:
        system = System(scene)
        mechanism = system.mechanism
        q, v = system.start
        places = [q]
        rates = [v]
        for _ in range(steps or scene.steps):
            force = -mechanism.bias(q, v) - self.field * mechanism.gravity(q, system.gravity)
            v = v + scene.step * np.linalg.solve(mechanism.mass_matrix(q), force)
            q = mechanism.integrate(q, v, scene.step)
            places.append(q)
            rates.append(v)
        return run_of_states(scene, self, np.array(places), self.reported * np.array(rates))


class Backwards(Flight):
    """Reports the velocity of the motion back."""

    reported = -1.0


class Rising(Flight):
    """Everything falls upwards."""

    field = -1.0


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


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("no_such:engine", "can be imported"),
        ("json:dumps", "an engine: an object with name"),
        (f"{HERE}:Flit", "did you mean Flight"),
        ("mujocco", "did you mean mujoco"),
    ],
)
def test_a_wrong_name_is_refused(name: str, said: str) -> None:
    with pytest.raises(ArgumentError, match=said):
        find_world(name)
