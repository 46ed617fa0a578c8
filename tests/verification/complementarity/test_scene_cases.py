"""Impacts of scenes, rebuilt from their runs."""

from __future__ import annotations

from dataclasses import replace

import pytest

from iapb.errors import IapbError
from iapb.scene import find_scene, load_scene
from reference.worlds import run_world
from verification.complementarity.agreement import compare_cases
from verification.complementarity.of_runs import impacts_of_run


def test_the_peg_in_the_corner_has_an_impact_that_truly_pulls() -> None:
    scene = load_scene(find_scene("peg_corner"))
    run = run_world(scene, "IAPB")
    found = impacts_of_run(run, scene)
    assert len(found.cases) == len(run.impacts.step) and found.left_out == 0
    compared = compare_cases(found.cases)
    assert all(c.agrees == c.pushes for c in compared)
    assert {c.adhesion for c in compared} >= {"none"}


def test_a_run_that_does_not_belong_to_its_scene_is_refused() -> None:
    scene = load_scene(find_scene("two_discs"))
    run = run_world(scene, "IAPB")
    wrong = replace(run, impacts=replace(run.impacts, v_plus=0.5 * run.impacts.v_plus))
    with pytest.raises(IapbError, match="rebuilt from its run"):
        impacts_of_run(wrong, scene)


def test_per_body_rows_are_counted_as_left_out() -> None:
    scene = load_scene(find_scene("two_discs")).with_values({"contact.self_collision_rows": "per_body"})
    found = impacts_of_run(run_world(scene, "IAPB"), scene)
    assert not found.cases and found.left_out == 1
