"""The study: runs are injected, shared and sorted by what a world can see; swapped worlds refute
the claims."""

from dataclasses import replace

import pytest

from iapb import find_scene, load_scene
from iapb.errors import ArgumentError
from reference.worlds import run_world
from verification.check import Study
from verification.claims import check_claims, peg
from verification.claims.conditions import Condition, drawn, start_conditions
from verification.claims.peg import trace
from verification.finding import NOT_TESTABLE, REFUTED, REPRODUCED, WHERE
from verification.region import Region
from verification.scenes.measures import peak_force

FEW = tuple(Condition(tilt, friction=0.1) for tilt in (0.0, *(0.1 + 0.01 * n for n in range(10))))
SWAPPED = {"IAPB": "PB", "PB": "IAPB"}


@pytest.fixture
def few(monkeypatch):
    """Eleven starts only, one device limit, worlds that are compiled: seconds, not a minute."""
    monkeypatch.setattr(peg, "start_conditions", lambda depth: FEW)
    monkeypatch.setattr(peg, "limited_conditions", lambda depth: FEW)


def swapped(scene, world, rendering):
    return run_world(scene, SWAPPED[world], "full")


def test_each_simulation_is_run_once(few):
    calls = []

    def run(scene, world, rendering):
        calls.append((scene.source_text, world, rendering))
        return run_world(scene, world, rendering)

    said = []
    check_claims(run=run, ids=["C14", "C16"], progress=lambda *done: said.append(done))
    assert (
        calls
        and len(calls) == len(set(calls))
        and said == [(0, 2, "C14"), (1, 2, "C16"), (2, 2, "")]
    )


def test_a_region_that_the_shared_sequence_misses_gets_starts_of_its_own():
    tested = [Condition(tilt, clearance=0.01) for tilt in (0.02, 0.03)]
    found = drawn(tested, Region((("tilt", "rad", 0.02, 0.03),)), seed=3, count=4)
    assert len(found) == 4 and all(
        0.02 <= one.tilt <= 0.03 and one.clearance == 0.01 for one in found
    )


def test_rigid_worlds_do_not_see_friction_or_penalties():
    seen = []
    run = run_world(load_scene(find_scene("peg_corner")), "PB", "full")

    def remember(scene, world, rendering):
        seen.append((world, scene.contact.friction, scene.contact.stiffness))
        return run

    asked = Study(remember)
    for condition in (Condition(friction=0.3), Condition(stiffness=250.0), Condition()):
        trace(asked, condition, "ideal")
    trace(asked, Condition(friction=0.3), "PB")
    assert seen == [("ideal", 0.0, 1000.0), ("PB", 0.3, 1000.0)]


def test_worlds_under_the_wrong_name_are_found_out(few):
    right = {result.key: result for result in check_claims(ids=["C14", "C15"])}
    wrong = {result.key: result for result in check_claims(run=swapped, ids=["C14", "C15", "C16"])}
    assert (right["C14"].verdict, right["C15"].verdict) == (WHERE, REPRODUCED)
    assert (wrong["C14"].verdict, wrong["C15"].verdict) == (REFUTED, REFUTED)
    assert wrong["C16"].verdict == NOT_TESTABLE  # a world without impulses reaches no limit


def test_a_limited_device_clips_the_forces_of_both_laws():
    asked = Study(run_world)
    hard = replace(Condition(), force_limit=0.2)
    forces = {
        (world, limit): peak_force(trace(asked, replace(hard, force_limit=limit), world, rendering))
        for world, rendering in (("PB", "full"), ("IAPB", "spread"))
        for limit in (0.2, 1.0)
    }
    assert forces["PB", 0.2][:2] == pytest.approx([3.0, 3.0]) == forces["IAPB", 0.2][:2]
    assert 3.0 < forces["PB", 1.0][0] < 10.0 < forces["IAPB", 1.0][0]


def test_regions_that_overlap_share_the_starts_that_confirm_them():
    tested = start_conditions("quick")
    wide, narrow = (
        drawn(tested, Region((("tilt", "rad", None, high),)), 1, 40) for high in (0.3, 0.15)
    )
    assert len(wide) == len(narrow) == 40 and all(start.tilt <= 0.15 for start in narrow)
    assert set(narrow) >= {start for start in wide if start.tilt <= 0.15}
    friction = drawn(tested, Region((("friction", "", 0.1, None),)), 1, 40)
    assert all(start.friction >= 0.1 for start in friction)
    assert [start.seen_by("ideal", "full") for start in friction] == [
        start.seen_by("ideal", "full") for start in wide
    ]


def test_unknown_claims_and_depths_are_refused():
    with pytest.raises(ArgumentError, match="C99"):
        check_claims(ids=["C99"])
    with pytest.raises(ArgumentError, match="depth"):
        check_claims(depth="deep")
