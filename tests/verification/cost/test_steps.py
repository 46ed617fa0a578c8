"""Steps and impacts over their size: scenes raced against MuJoCo are the same and rest; growth,
budgets, rates."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.system import System
from reference.mujoco import joint_places, set_state
from verification.check import Study
from verification.cost import growth, steps
from verification.cost.accuracy import BUDGET_ROWS, Stopped
from verification.cost.calls import PRINTED
from verification.cost.resting import RESTING
from verification.cost.steps import OwnLoop
from verification.finding import NOT_COMPUTED
from verification.table import table_from


@pytest.mark.parametrize("name", RESTING)
def test_masses_are_the_same(name: str) -> None:
    mujoco = pytest.importorskip("mujoco")
    theirs = steps.TheirLoop(RESTING[name], "Newton", 1)
    system = System(theirs.scene)
    data = mujoco.MjData(theirs.model)
    set_state(joint_places(theirs.scene, theirs.model), data, *system.start)
    mujoco.mj_forward(theirs.model, data)
    mass = np.zeros((theirs.model.nv, theirs.model.nv))
    mujoco.mj_fullM(theirs.model, data, mass)
    np.testing.assert_allclose(mass, system.make_state().mass_matrix, rtol=1e-9, atol=1e-12)
    assert theirs.model.opt.timestep == system.dt


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


def test_without_mujoco_the_race_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(steps, "find_spec", lambda name: None)
    [part] = steps.RACES.sentences(steps.RACES.table(Study()))
    assert part.verdict == NOT_COMPUTED and "MuJoCo is not installed" in part.sentence


def test_pairs_tested_grow_linearly_where_all_pairs_grow_quadratically() -> None:
    """All pairs give 2 in the limit; the density of the field, and with it the neighbours of a
    disc, changes a little."""
    costs = steps.BODIES.table(Study(), (20, 50, 100))
    assert growth.power_law(costs.column("bodies"), costs.column("pairs tested")) < 1.2
    assert growth.power_law(costs.column("bodies"), costs.column("pairs of shapes")) > 1.9


def test_the_most_contacts_are_the_last_in_time() -> None:
    keys = ("method", "deadline", "coordinates", "contacts", "late calls")
    rows = [
        ("a", growth.MILLISECOND, 3, contacts, late)
        for contacts, late in ((6, 0), (12, growth.ALLOWED), (30, growth.ALLOWED + 1))
    ]
    rows += [("a", growth.PAPER_STEP, 3, 30, 0), ("b", growth.MILLISECOND, 3, 6, 9)]
    trials = table_from(dict(zip(keys, row, strict=True)) for row in rows)
    assert growth.most_contacts(trials) == {"a": {3: 12}, "b": {3: 0}}


def test_exponents_and_the_steepest_range_are_those_of_the_method_and_the_axis() -> None:
    power = {
        growth.FACTORED: (1.0, 2.0),
        PRINTED: (0.5, 3.0),
    }  # over contacts and coordinates, above the smallest size
    sizes = [(12, c) for c in (30, 60, 120)] + [(d, 60) for d in (6, 24)]
    table = table_from(
        {
            "method": method,
            "coordinates": d,
            "contacts": c,
            "time [µs]": (max(c, 60) / 60) ** a * (d / 12) ** b,
        }
        for method, (a, b) in power.items()
        for d, c in sizes
    )
    for method, (over_contacts, over_coordinates) in power.items():
        row = growth.fitted(table, method, "contacts")
        assert (row["steepest from"], row["to"], row["there"]) == (
            60,
            120,
            pytest.approx(over_contacts),
        )
        row = growth.fitted(table, method, "coordinates")
        assert (row["exponent"], row["there"]) == (
            pytest.approx(over_coordinates),
            pytest.approx(over_coordinates),
        )


def test_every_budget_is_passive_and_the_whole_one_meets_restitution() -> None:
    rows = BUDGET_ROWS.table(
        Study(), [Stopped(12, 60, budget) for budget in (0, 3, 7, 8)]
    ).records()
    assert max(row["largest relative gain"] for row in rows) <= 0.0
    assert [row["largest residual"] < 1e-13 for row in rows] == [
        row["budget"] == row["rank"] for row in rows
    ]
    none, few, _, every = (row["share of the loss"] for row in rows)
    assert none == 0.0 < few < every == pytest.approx(1.0)


def test_sizes_are_timed_by_both_methods() -> None:
    """Times themselves are never judged by a test: that is for `iapb bench`."""
    found = growth.scaling(Study(), ((3, 4), (12, 600)))
    timed = [(row["method"], row["contacts"]) for row in found]
    assert timed == [(growth.FACTORED, 4), (PRINTED, 4), (growth.FACTORED, 600)]
    assert all(0.0 < row["lower quartile [µs]"] <= row["upper quartile [µs]"] for row in found)
    assert {(12, contacts) for contacts in growth.FACTORS} <= set(
        growth.SIZES
    )  # the printed formula has targets there
