"""Steps and impacts over their size: scenes raced against MuJoCo are the same and rest; growth and
rates."""

from __future__ import annotations

import numpy as np
import pytest

from verification.check import Study
from verification.clock import Times
from verification.cost import growth, impact_times, steps
from verification.cost.accuracy import COMPILED, IAPB, LEMKE, PYTHON
from verification.cost.calls import PRINTED, Call
from verification.cost.resting import RESTING
from verification.cost.steps import OwnLoop


@pytest.mark.parametrize("name", ["peg in the corner", "free box on a plane"])
def test_our_scene_rests_and_carries_the_load(name: str) -> None:
    loop = OwnLoop(RESTING[name], 64)
    loop.sample()
    assert loop.contacts == 4.0
    assert loop.moved < 1e-12
    simulation = loop.simulation
    load = simulation.port.applied - (
        0.0 if name.startswith("peg") else np.array([0, 0, 9.81, 0, 0, 0])
    )
    np.testing.assert_allclose(simulation.state.penalty_force, -load, atol=1e-9)


def test_a_race_states_contacts_of_both_and_keeps_every_solver() -> None:
    pytest.importorskip("mujoco")
    races = list(steps.race(Study(), "peg in the corner", 32))
    # two walls; each touches the plate at two corners, or at the four of both faces
    assert {row["MuJoCo's contacts"] for row in races} <= {4.0, 8.0}
    assert {row["MuJoCo's solver"] for row in races} == set(steps.SOLVERS)
    assert {row["iapb's contacts"] for row in races} == {4.0} and max(
        row["MuJoCo's drift"] for row in races
    ) < 1e-6


def test_pairs_tested_grow_linearly_where_all_pairs_grow_quadratically() -> None:
    """All pairs give 2 in the limit; the density of the field, and with it the neighbours of a
    disc, changes a little."""
    costs = steps.BODIES.table(Study(), (20, 60))
    assert growth.power_law(costs["bodies"], costs["pairs tested"]) < 1.2
    assert growth.power_law(costs["bodies"], costs["pairs of shapes"]) > 1.9


def test_methods_called_from_python_are_timed_on_the_same_impact() -> None:
    rows = list(impact_times.compare(Study(), impact_times.Size("patch", PYTHON, 4)))
    names = {row["method"] for row in rows}
    assert names == {PRINTED, impact_times.DAQP, *impact_times.SOLVERS}
    assert all(row["apart"] < impact_times.SOLVED for row in rows)
    assert all(row["lower quartile"] <= row["ratio"] <= row["upper quartile"] for row in rows)


def test_our_method_is_never_dropped_since_the_others_are_compared_with_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def only_ours_is_slow(made: dict[str, Call], *_: object, **__: object) -> dict[str, Times]:
        return {name: Times((1.0 if name == IAPB else 1e-6,) * 3) for name in made}

    monkeypatch.setattr(impact_times, "take_turns", only_ours_is_slow)
    study = Study()
    for _ in range(2):
        [row] = impact_times.compare(study, impact_times.Size("patch", COMPILED, 1))
        assert row["method"] == LEMKE
