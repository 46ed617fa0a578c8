"""Friction in the impacts of a run: the compiled step does what `resolve_frictional_impact` says, and never gains."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iapb import ArgumentError, resolve_frictional_impact
from iapb.contact.laws import ImpulseAugmented
from iapb.mechanics.energy import Floats
from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene, scene_from_text
from iapb.scene.mechanism import mechanism_of
from iapb.simulation import simulate

LAW = ImpulseAugmented(friction_in_impacts=True)
PLANE = scene_from_text("""\
name: thrown_box
rate: 1000
duration: 0.6
gravity: [0, -9.81]
bodies:
  - {name: box, joint: planar, mass: 0.5, inertia: 1e-3, shapes: [{kind: box, size: [0.2, 0.1]}],
     position: [0, 0.3, 0], velocity: [1.0, 0, 0]}
walls: [{name: floor, kind: half_plane, point: [0, 0], normal: [0, 1]}]
contact: {forces: paper, friction: 0.2, restitution: 0.6, stiffness: 0, damping: 0}
""")
SPACE = scene_from_text("""\
name: thrown_cuboid
dimensions: 3
rate: 1000
duration: 0.6
gravity: [0, 0, -9.81]
bodies:
  - {name: box, joint: free_flyer, mass: 0.5, inertia: [1e-3, 2e-3, 3e-3], shapes: [{kind: box, size: [0.2, 0.1, 0.1]}],
     position: [0, 0, 0.3, 0, 0, 0, 1], velocity: [1.0, 0.5, 0, 3, 2, 1]}
walls: [{name: floor, kind: half_space, point: [0, 0, 0], normal: [0, 0, 1]}]
contact: {forces: paper, friction: 0.2, restitution: 0.6, stiffness: 0, damping: 0}
""")


@cache
def thrown(space: bool) -> Run:
    return simulate(SPACE if space else PLANE, LAW)


def rows_of(scene: Scene, run: Run, impact: int) -> tuple[Floats, Floats, Floats]:
    """M, normals' and tangents' rows of a recorded impact of one body, from the run and the scene alone."""
    mechanism, step, contacts = mechanism_of(scene), run.impacts.step[impact], run.contacts
    q, rows, tangents = run.q[step], [], []
    for i in range(contacts.offsets[step], contacts.offsets[step + 1]):
        if contacts.gap[i] <= 0.0 and contacts.normal_velocity[i] < -scene.contact.approach_velocity:
            jacobian, n = mechanism.point_jacobian(q, contacts.body_a[i], contacts.point[i]), contacts.normal[i]
            across = np.linalg.svd(n[None])[2][1:] if scene is SPACE else np.array([[n[1], -n[0], 0.0]])
            rows.append(n @ jacobian)
            tangents.append(across @ jacobian)
    return mechanism.mass_matrix(q), np.array(rows), np.array(tangents)


@pytest.mark.parametrize("space", [False, True])
def test_every_impact_of_a_run_is_the_functions(space: bool) -> None:
    """On the same rows; the tangents may be turned in their plane, Coulomb's disc is round."""
    scene, run = (SPACE, thrown(True)) if space else (PLANE, thrown(False))
    assert len(run.impacts.step) >= 2 and run.impacts.solved.all()
    for k in range(len(run.impacts.step)):
        M, J, T = rows_of(scene, run, k)
        v, contact = run.impacts.v_minus[k], scene.contact
        found = resolve_frictional_impact(M, J, T, v, contact.restitution, contact.friction)
        assert found.status == "complete" and run.impacts.rows[k] == len(J)
        np.testing.assert_allclose(run.impacts.v_plus[k], found.velocity, rtol=0, atol=1e-10 * np.abs(v).max())
        assert run.impacts.friction_share[k] == pytest.approx(found.friction_share, abs=1e-8)
        rows = slice(run.contacts.offsets[run.impacts.step[k]], run.contacts.offsets[run.impacts.step[k] + 1])
        pushed = run.contacts.impulse[rows][run.contacts.normal_velocity[rows] < -contact.approach_velocity]
        np.testing.assert_allclose(J.T @ (pushed - found.impulses), 0.0, atol=1e-9)


def test_a_flat_bounce_takes_friction_times_the_blow_of_the_tangential_speed() -> None:
    """Δv_t = −μ (1 + e) |v_n| while it slides, as the function says; without the option nothing is taken."""
    scene = PLANE.with_values({"bodies.box.inertia": 1e9})  # does not turn: each bounce is flat
    run, paper = simulate(scene, LAW), simulate(scene)
    v_n, v_t = run.impacts.v_minus[:, 1], run.impacts.v_minus[:, 0]
    wanted = v_t - np.minimum(v_t, 0.2 * 1.6 * -v_n)
    assert len(v_n) >= 2
    np.testing.assert_allclose(run.impacts.v_plus[:, 0], wanted, atol=1e-12)
    np.testing.assert_allclose(run.impacts.v_plus[:, 1], -0.6 * v_n, atol=1e-12)
    assert np.array_equal(paper.impacts.v_plus[:, 0], paper.impacts.v_minus[:, 0])


@settings(max_examples=25)
@given(st.floats(0.0, 1.0), st.floats(0.0, 2.0), st.floats(-1.5, 1.5), st.floats(-30.0, 30.0))
def test_no_impact_gains_energy_and_restitution_is_met(e: float, mu: float, angle: float, spin: float) -> None:
    run = simulate(PLANE.with_values({
        "contact.restitution": e, "contact.friction": mu, "bodies.box.position.2": angle, "bodies.box.velocity.2": spin,
    }), LAW, steps=400)
    kinetic = 0.5 * run.impacts.v_minus**2 @ [0.5, 0.5, 1e-3]
    assert np.all(run.impacts.energy_lost >= -1e-13 * kinetic)
    assert not run.impacts.approaching.any()
    assert np.all((run.impacts.friction_share >= 0.0) & (run.impacts.friction_share <= 1.0))


def test_in_space_no_impact_gains_energy_and_all_of_the_tangential_impulse_is_within_the_cone() -> None:
    run = thrown(True)
    assert run.impacts.energy_lost.min() >= 0.0 and not run.impacts.approaching.any()
    R = mechanism_of(SPACE)
    for k in range(len(run.impacts.step)):
        pose = R.placements(run.q[run.impacts.step[k]])[0][0]
        force = pose @ run.impacts.impulse[k, :3]
        assert np.hypot(*force[:2]) <= 0.2 * force[2] * (1.0 + 1e-9)


def test_unequal_restitution_and_friction_in_one_impact() -> None:
    """The bar on its posts, sliding: Poisson's normal impulses, Coulomb's friction, no gain, the posts left behind."""
    scene = load_scene(find_scene("bar_on_posts"))
    run = simulate(scene.with_values({"contact.friction": 0.5, "bodies.bar.velocity.0": 1.0}), LAW)
    plain = simulate(scene.with_values({"bodies.bar.velocity.0": 1.0}), LAW)
    first, without = run.impacts, plain.impacts
    assert first.rows[0] == 2 and first.solved.all() and not first.approaching.any()
    assert first.energy_lost.min() >= 0.0
    assert 0.0 <= first.v_plus[0, 0] < 1.0 == without.v_plus[0, 0]


def test_the_law_says_what_it_is() -> None:
    assert LAW.name != ImpulseAugmented().name
    assert LAW.settings["friction_in_impacts"] is True
    assert ImpulseAugmented().within(PLANE).friction_in_impacts is False  # forces: paper
    assert ImpulseAugmented().within(PLANE.with_values({"contact.forces": "implicit"})).friction_in_impacts is True
    assert thrown(False).law == LAW.name and thrown(False).law_settings["friction_in_impacts"] is True
    with pytest.raises(ArgumentError, match="friction_in_impacts"):
        ImpulseAugmented(friction_in_impacts="yes")  # type: ignore[arg-type]


def test_without_friction_in_the_scene_the_option_changes_no_bit() -> None:
    scene = PLANE.with_values({"contact.friction": 0, "bodies.box.velocity.2": 3.0})
    assert np.array_equal(simulate(scene, LAW).q, simulate(scene).q)
