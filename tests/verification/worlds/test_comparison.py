"""Worlds on one scene: distances are those of closed forms, what fails is named, impacts are
compared with the LCP."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from iapb.errors import IapbError, SolverError
from iapb.scene import Scene, load_scene
from reference.worlds import run_world
from verification import compare_worlds, worlds
from verification.complementarity.of_runs import RUBBING, impacts_of_run
from verification.finding import MIXED, NOT_COMPUTED

HERE = Path(__file__).parent
SLOPE = load_scene(HERE / "slope.yaml").with_values({"duration": 0.2})
DOOR = load_scene(HERE / "door.yaml").with_values({"duration": 0.3})


def row(finding, world):
    return next(one for one in finding.tables["worlds"].records() if one["world"] == world)


def test_a_box_that_slides_is_apart_from_one_that_sticks_by_the_closed_forms():
    found = compare_worlds(SLOPE, ["ideal", "ideal-friction"])
    slides = row(found, "ideal")
    down = 9.81 * np.sin(np.pi / 9.0)
    assert found.details["against"] == "ideal-friction"
    # Half a step of 1 ms in 0.2 s: 0.5 % of the way; the others are exact.
    assert slides["configuration, end"] == pytest.approx(0.5 * down * 0.2**2, rel=0.006)
    assert slides["velocity, end"] == pytest.approx(down * 0.2, rel=1e-6)
    # the friction that is missing, m = 1 kg
    assert slides["impulse, end"] == pytest.approx(1.0 * down * 0.2, rel=1e-6)
    assert slides["configuration, most"] == slides["configuration, end"]
    sticks = row(found, "ideal-friction")
    assert sticks["configuration, most"] < 1e-9  # at rest at any step: its own error is rounding
    assert (slides["ignores"], sticks["ignores"]) == (
        "friction, stiffness, damping",
        "stiffness, damping",
    )
    assert min(slides["times the fastest"], sticks["times the fastest"]) == 1.0


def test_a_hinge_and_a_ball_count_by_their_inertia(monkeypatch):
    monkeypatch.setattr(worlds, "INSTANTS", 10)  # the deepest overlap lies between two of them
    found = compare_worlds(DOOR, ["PB", "IAPB"], "IAPB")
    runs = {name: run_world(DOOR, name) for name in ("PB", "IAPB")}
    turn, *ball = runs["PB"].q[-1] - runs["IAPB"].q[-1]
    about_hinge = 0.43 + 8.0 * 0.4**2
    squares = about_hinge * turn**2 + 0.5 * (ball[0] ** 2 + ball[1] ** 2) + 5e-4 * ball[2] ** 2
    assert row(found, "PB")["configuration, end"] == pytest.approx(np.sqrt(squares / 8.5), rel=1e-9)
    overlap = -runs["PB"].contacts.gap.min()
    assert row(found, "PB")["deepest overlap"] == pytest.approx(1e3 * overlap)
    seen = found.tables["over time"].where(world="PB")["penetration"]
    assert len(seen) == 11 and max(seen) == pytest.approx(overlap)
    lost = 1.045 - runs["IAPB"].energy["kinetic"][-1]  # ½ 0.5 (0.3² + 2²) at the start
    assert row(found, "IAPB")["energy lost"] == pytest.approx(lost - 0.0225, abs=1e-9)


def test_a_world_that_fails_is_named_and_the_others_are_compared(monkeypatch):
    def breaks(scene, world, **options):
        if world == "PB":
            raise SolverError("no solution")
        return run_world(scene, world, **options)

    monkeypatch.setattr(worlds, "run_world", breaks)
    short = SLOPE.with_values({"duration": 0.002})
    found = compare_worlds(short, ["IAPB", "PB", "ideal"], "ideal")
    assert found.tables["worlds"]["world"] == ["IAPB", "ideal"]
    assert found.verdict == NOT_COMPUTED
    assert [(one.case, one.reason) for one in found.failures] == [("world PB", "no solution")]
    with pytest.raises(
        IapbError, match="cannot be simulated in the reference world PB.*no solution"
    ):
        compare_worlds(short, ["IAPB", "PB"], "PB")


@pytest.mark.parametrize(("moved", "ordered"), [(1e-4, True), (1e-2, False)])
def test_worlds_are_ordered_only_beyond_the_error_of_the_reference(moved, ordered, monkeypatch):
    """`moved`: what half the step changes, here planted. PB is made to end 1 mm behind IAPB."""

    def planted(scene, world, **options):
        run = run_world(scene, "IAPB", **options)
        far = {"IAPB": 1e-2, "PB": 1.1e-2, "ideal": moved if run.dt < 1e-3 else 0.0}[world]
        return replace(run, q=run.q + [far, 0.0, 0.0])

    monkeypatch.setattr(worlds, "run_world", planted)
    short = SLOPE.with_values({"duration": 0.02})
    found = compare_worlds(short, ["IAPB", "PB", "ideal"], "ideal")
    assert ("Closest to ideal is IAPB" in found.answer) == ordered
    assert ("Equally close to ideal: IAPB 10, PB 11 mm" in found.answer) != ordered
    own = row(found, "ideal")["configuration, rms"]
    assert own == pytest.approx(moved, rel=1e-2)
    assert f"ideal itself moves by {1e3 * own:.3g} mm at half its step" in found.answer


def test_worlds_that_stop_early_or_are_not_to_be_trusted_are_not_ranked(monkeypatch):
    def spoilt(scene, world, **options):
        run = run_world(scene, world, **options | ({"steps": 7} if world == "PB" else {}))
        return replace(run, distrust=("the box flew",)) if world == "IAPB-friction" else run

    monkeypatch.setattr(worlds, "run_world", spoilt)
    short = SLOPE.with_values({"duration": 0.02})
    found = compare_worlds(short, ["IAPB", "PB", "IAPB-friction", "ideal"], "IAPB")
    assert row(found, "PB")["simulated until"] == pytest.approx(0.007)
    assert len(found.tables["over time"].where(world="PB").rows) == 8
    # nearest, for it stopped
    assert row(found, "PB")["configuration, rms"] < row(found, "ideal")["configuration, rms"]
    assert "Closest to IAPB is ideal" in found.answer
    (part,) = found.parts
    assert "PB stopped" in part.sentence and "IAPB-friction not to be trusted" in part.sentence
    assert (part.verdict, part.held, part.decided) == (MIXED, 2, 4)
    alone = compare_worlds(short, ["IAPB", "PB"], "PB")
    assert "the reference PB stopped" in alone.answer


# Two balls fall on walls of their own; the second also on one without friction.
BALLS = Scene.model_validate(
    {
        "name": "balls",
        "rate": 1000,
        "duration": 0.05,
        "bodies": [
            {
                "name": name,
                "joint": "planar",
                "mass": 1.0,
                "inertia": 4e-3,
                "shapes": [{"kind": "circle", "radius": 0.1}],
                "position": [x, 0.11, 0.0],
                "velocity": [0.3, -1.0, 0.0],
            }
            for name, x in (("left", -0.5), ("right", 0.5))
        ],
        "walls": [
            {"name": "soft", "kind": "box", "size": [1, 1], "center": [-0.5, -0.5]}
            | {"restitution": 0.2, "friction": 0.4},
            {"name": "hard", "kind": "box", "size": [1, 1], "center": [0.5, -0.5]}
            | {"restitution": 0.9, "friction": 0.0},
        ],
    }
)


def test_each_impact_is_compared_with_its_own_restitution_and_without_friction():
    one, other = impacts_of_run(run_world(BALLS, "IAPB"), BALLS)
    assert (one.case.restitution, other.case.restitution) == (0.2, 0.9)
    assert (one.other_law, other.other_law) == (RUBBING, "")
    found = compare_worlds(BALLS, ["IAPB"], "IAPB")
    assert "moves as the LCP in 1 of 1 impacts; in 0 an impulse pulls" in found.answer
    assert f"Not compared: 1 with {RUBBING}." in found.answer
    paper = BALLS.with_values({"contact.forces": "paper"})
    assert "in 2 of 2 impacts" in compare_worlds(paper, ["IAPB"], "IAPB").answer
