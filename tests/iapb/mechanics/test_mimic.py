"""Joints that follow others have no coordinates: M = Gᵀ M_full G, and so on, as in Pinocchio."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from iapb.errors import ArgumentError
from iapb.mechanics.bodies import Body
from iapb.mechanics.joints import Joint, Mimic, ranges_of
from iapb.mechanics.mechanism import Mechanism
from iapb.mechanics.urdf import read_urdf
from iapb.scene import scene_from_text
from iapb.scene.mechanism import mechanism_of
from iapb.simulation import simulate
from reference.rigid_body import calls_from_urdf, model_from_urdf, model_of
from verification.mechanics.against_pinocchio import AGREEMENT, compare

INERTIA = np.diag([0.1, 0.2, 0.25])
AT = (np.eye(3), np.array([0.3, 0.1, -0.2]))


def link(name: str, parent: str | None, kind: str, axis: tuple[float, ...], mimic=None) -> Body:
    return Body(name, parent, Joint(kind, axis), AT, 1.5, [0.1, -0.2, 0.3], INERTIA, mimic)


def tree(*mimics: Mimic | None) -> Mechanism:
    """A free base with two branches; all but the base may follow another joint."""
    return Mechanism([
        link("base", None, "free_flyer", (0, 0, 1)),
        link("a", "base", "revolute", (0, 1, 0), mimics[0]),
        link("b", "a", "prismatic", (1, 1, 0), mimics[1]),
        link("c", "b", "revolute", (1, 0, 0), mimics[2]),
        link("d", "base", "revolute", (0, 1, 1), mimics[3]),
        link("e", "d", "spherical", (0, 0, 1)),
    ])  # fmt: skip


FOLLOWED = {
    "along a chain": (None, Mimic("a", -0.5, 0.2), Mimic("a", 2.0), None),
    "another branch": (None, None, None, Mimic("c", 3.0, 0.1)),
    "a later joint": (Mimic("d", 0.7), None, None, None),
    "prismatic leader": (Mimic("b", 2.0, -0.3), None, Mimic("b", -1.0), Mimic("b")),
}


@pytest.mark.parametrize("mimics", FOLLOWED.values(), ids=FOLLOWED)
def test_all_quantities_agree_with_pinocchio(mimics: tuple[Mimic | None, ...]) -> None:
    mechanism = tree(*mimics)
    rng = np.random.default_rng(0)
    followers = sum(mimic is not None for mimic in mimics)
    assert (mechanism.nq, mechanism.nv) == (15 - followers, 13 - followers)
    assert len(mechanism.coordinate_names) == mechanism.nq == len(mechanism.neutral())
    for _ in range(3):
        q = mechanism.integrate(mechanism.neutral(), rng.normal(size=mechanism.nv))
        v = rng.normal(size=mechanism.nv)
        found = compare(mechanism, model_of(mechanism), q, v)
        assert max(found.values()) < AGREEMENT
        back = mechanism.difference(mechanism.neutral(), q)
        np.testing.assert_allclose(mechanism.integrate(mechanism.neutral(), back), q, atol=1e-12)


def test_a_urdf_is_read_as_pinocchio_reads_it_with_mimic(tmp_path: Path) -> None:
    inertial = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    links = "".join(f'<link name="{name}">{inertial}</link>' for name in "pabc")
    path = tmp_path / "r.urdf"
    path.write_text(
        f'<robot name="r">{links}'
        '<joint name="k" type="revolute"><parent link="p"/><child link="a"/><axis xyz="0 1 0"/>'
        '<limit lower="-1" upper="2" effort="1" velocity="1"/><origin xyz="1 0 0"/></joint>'
        '<joint name="l" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="2" effort="1" velocity="1"/><mimic joint="k" multiplier="-2" '
        'offset="0.1"/></joint><joint name="m" type="revolute"><parent link="p"/>'
        '<child link="c"/><axis xyz="0 0 1"/><mimic joint="k"/>'
        '<limit lower="-1" upper="2" effort="1" velocity="1"/></joint></robot>'
    )
    mechanism = Mechanism.from_urdf(path)
    theirs = model_from_urdf(path)
    assert mechanism.nv == theirs.nv == 1
    assert read_urdf(path)[2].mimic == Mimic("a", -2.0, 0.1)
    q = np.array([0.4])
    v = np.array([1.3])
    assert max(compare(mechanism, theirs, q, v).values()) < AGREEMENT
    # what is timed is Pinocchio's own model, which includes gravity
    mass, _ = calls_from_urdf(path)
    np.testing.assert_allclose(mass(q), mechanism.mass_matrix(q), rtol=AGREEMENT)


def test_limits_of_what_follows_bound_the_leader() -> None:
    follow = Mimic("a", -2.0, 1.0)
    assert ranges_of([("a", (-1.0, 1.0), None), ("b", (0.0, 2.0), follow)])["a"] == (-0.5, 0.5)
    assert ranges_of([("b", (0.0, 2.0), follow), ("a", None, None)])["a"] == (-0.5, 0.5)
    assert ranges_of([("a", None, None), ("b", None, follow)]) == {"a": None}


@pytest.mark.parametrize("leader", ["base", "e", "b", "nobody"])
def test_a_leader_without_one_coordinate_is_refused(leader: str) -> None:
    with pytest.raises(ArgumentError, match="mimic"):
        tree(None, Mimic("a"), Mimic(leader), None)


def test_free_motion_keeps_energy_and_momentum_where_joints_follow() -> None:
    solid = "mass: 1, inertia: [0.1, 0.2, 0.2], center_of_mass: [0.3, 0.1, 0.1]"
    scene = scene_from_text(f"""name: free
dimensions: 3
rate: 1000
duration: 1
bodies:
  - {{name: base, joint: free_flyer, {solid}, velocity: [0.1, 0.2, -0.1, 0.5, 1, 0.3]}}
  - {{name: a, parent: base, joint: revolute, axis: [0, 1, 0], origin: [0.3, 0, 0], {solid}, velocity: [2]}}
  - {{name: b, parent: a, joint: revolute, axis: [1, 0, 0], origin: [0.5, 0, 0], {solid},
     joint_mimic: {{body: a, multiplier: -1.5, offset: 0.3}}}}
  - {{name: c, parent: base, joint: prismatic, axis: [0, 0, 1], {solid}, joint_mimic: {{body: a}}}}
""")
    run = simulate(scene)
    mechanism = mechanism_of(scene)
    kinetic = run.energy["kinetic"]
    assert np.ptp(kinetic) < 1e-11 * kinetic[0] and not run.distrust
    first, last = (mechanism.centroidal_momentum(run.q[k], run.v[k]) for k in (0, -1))
    np.testing.assert_allclose(first, last, atol=1e-10)
    assert np.ptp(run.q[:, 7]) > 1.0


def test_mujoco_moves_a_gripper_as_the_engine_does() -> None:
    scene = scene_from_text("""name: gripper
rate: 1000
duration: 0.5
gravity: [0, -9.81]
bodies:
  - {name: left, joint: prismatic, axis: [0, 1], mass: 1, joint_limits: [-0.1, 0.1]}
  - {name: right, parent: left, joint: revolute, mass: 1, center_of_mass: [0.1, 0], inertia: 0.1,
     joint_mimic: {body: left, multiplier: 5, offset: 0.3}}
""")
    engine = simulate(scene, steps=100)
    mujoco = simulate(scene, steps=100, world="mujoco")
    np.testing.assert_allclose(mujoco.q, engine.q, atol=1e-3)
    assert engine.q[-1, 0] < -0.02
