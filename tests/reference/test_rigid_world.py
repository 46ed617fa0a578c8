"""The rigid world on scenes: every scheme runs, friction stops the box where the textbook says."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.errors import ArgumentError
from iapb.scene import load_scene
from iapb.scene_files import find_scene
from iapb.simulation import simulate
from reference.time_stepping import RigidConstraints

SCENES = ("peg_corner", "peg_hole", "newton_cradle", "box_stack", "three_link_arm_elastic")


@pytest.mark.parametrize("scheme", ["moreau", "stewart-trinkle"])
@pytest.mark.parametrize("name", SCENES)
def test_every_scheme_runs_and_says_what_it_is(name: str, scheme: str) -> None:
    law = RigidConstraints(scheme=scheme, stabilization=0.2)
    run = simulate(load_scene(find_scene(name)), law, steps=120)
    assert run.complete and np.isfinite(run.q).all()
    assert run.law == "rigid constraints" and run.law_settings["scheme"] == scheme
    assert "Poisson" in run.law_settings["restitution where Newton's law has no solution"]


def test_a_tight_elastic_hole_does_not_end_the_run() -> None:
    """Walls that face one another with e > 0: Newton's law has no solution, the step takes Poisson's."""
    scene = load_scene(find_scene("peg_hole")).with_values({"contact.restitution": 0.5})
    run = simulate(scene, RigidConstraints(), steps=400)
    assert run.complete and np.abs(run.v).max() < 1.0


@pytest.mark.parametrize("friction", ["coulomb", "relaxed"])
def test_the_sliding_box_stops_where_the_textbook_says(friction: str) -> None:
    """v²/(2 μ g) = 42.5 mm, started on the floor, not sunk into it."""
    scene = load_scene(find_scene("sliding_box")).with_values({"bodies.box.position": [0.0, 0.025, 0.0]})
    run = simulate(scene, RigidConstraints(friction=friction), steps=300)
    expected = 0.5**2 / (2.0 * 0.3 * 9.81)
    assert run.q[-1, 0] == pytest.approx(expected, rel=0.02)
    assert np.abs(run.v[-1]).max() < 2e-2
    dragged = run.friction_force[:150, 0] + run.impulse[:150, 0] / run.dt
    assert np.mean(dragged) == pytest.approx(-0.3 * 9.81, rel=0.05)


def test_unknown_schemes_and_friction_laws_are_refused() -> None:
    with pytest.raises(ArgumentError, match="scheme"):
        RigidConstraints(scheme="euler")
    with pytest.raises(ArgumentError, match="friction"):
        RigidConstraints(friction="viscous")
