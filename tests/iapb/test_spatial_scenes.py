"""The spatial scenes run in the compiled step and do what their comments promise."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.run import Run
from iapb.scene import find_scene, load_scene
from iapb.simulation import simulate


@pytest.fixture(scope="module")
def peg() -> Run:
    return simulate(load_scene(find_scene("peg_hole_space")))


def test_dozens_of_collisions_at_once_are_resolved_without_gain(peg: Run) -> None:
    assert peg.complete
    assert peg.impacts.rows.max() >= 24
    assert (peg.impacts.rank <= np.minimum(peg.impacts.rows, peg.v.shape[1])).all()
    assert (peg.impacts.rank < peg.impacts.rows).any()  # redundant rows among them
    assert peg.impacts.energy_lost.min() > -1e-15


def test_peg_ends_in_the_hole_and_normals_are_unit_and_finite(peg: Run) -> None:
    assert -0.001 < peg.q[-1, 2] < 0.01  # its middle, 3 cm above its front: a good 2.5 cm deep
    assert np.abs(peg.q[-1, :2]).max() < 1e-3
    np.testing.assert_allclose(np.linalg.norm(peg.contacts.normal, axis=1), 1.0, atol=1e-12)
    assert peg.contacts.gap.min() > -4e-3


def test_links_of_the_arm_meet_obstacles_and_the_block() -> None:
    run = simulate(load_scene(find_scene("arm_obstacles")))
    names = np.array([*run.body_names, "world"])
    met = {frozenset((names[a], names[b])) for a, b in zip(run.contacts.body_a, run.contacts.body_b, strict=True)}
    arm = {name for name in run.body_names if name.startswith("arm_")}
    assert any("world" in pair and pair & arm for pair in met)
    assert any("block" in pair and pair & arm for pair in met)
    assert len(run.impacts.step) > 0
    assert run.impacts.energy_lost.min() > -1e-12
    assert np.isfinite(run.q).all()


def test_a_scene_in_space_and_its_planar_twin_move_alike() -> None:
    """A disc sliding off a floor and a ball without spin: the same numbers from both grammars."""
    from iapb.scene import scene_from_text

    common = "rate: 1000\nduration: 0.3\ncontact: {stiffness: 500, damping: 2, restitution: 0.5}\n"
    planar = scene_from_text(
        "name: p\n" + common + "gravity: [0, -9.81]\nbodies:\n  - {name: b, joint: planar, mass: 0.1, inertia: 1e-5, "
        "shapes: [{kind: circle, radius: 0.02}], position: [0, 0.1, 0], velocity: [0.2, 0, 0]}\n"
        "walls:\n  - {name: w, kind: half_plane, point: [0, 0], normal: [0, 1]}\n"
    )
    spatial = scene_from_text(
        "name: s\ndimensions: 3\n" + common + "gravity: [0, 0, -9.81]\nbodies:\n  - {name: b, joint: free_flyer, "
        "mass: 0.1, inertia: [1e-5, 1e-5, 1e-5], shapes: [{kind: sphere, radius: 0.02}], "
        "position: [0, 0, 0.1, 0, 0, 0, 1], velocity: [0.2, 0, 0, 0, 0, 0]}\n"
        "walls:\n  - {name: w, kind: half_space, point: [0, 0, 0], normal: [0, 0, 1]}\n"
    )
    flat, solid = simulate(planar), simulate(spatial)
    assert len(flat.impacts.step) > 0
    np.testing.assert_allclose(solid.q[:, [0, 2]], flat.q[:, :2], atol=1e-14)
