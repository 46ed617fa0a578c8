"""A scene as mechanism, shapes and candidate pairs, in the plane and in space; robots from URDF."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from iapb.contact.geometry import CIRCLE, HALF_PLANE, POLYGON
from iapb.errors import SceneError
from iapb.mechanics.mechanism import Mechanism
from iapb.scene import Scene, load_scene, scene_from_text
from iapb.scene.mechanism import mechanism_of, shapes_of, start_of
from iapb.system import System

# A bracket on the world carries a chain of three links, the last with a welded tool; two pucks lie
# free.
CHAIN = scene_from_text("""\
name: chain
rate: 1000
duration: 1
bodies:
  - {name: bracket, joint: fixed, origin: [1, 2], angle: 1.5707963267948966,
     shapes: [{kind: circle, radius: 0.1, center: [3, 0]}]}
  - {name: one, parent: bracket, joint: revolute, inertia: 1, shapes: [{kind: circle, radius: 0.1}]}
  - {name: two, parent: one, joint: revolute, inertia: 1, shapes: [{kind: circle, radius: 0.1}]}
  - {name: three, parent: two, joint: revolute, inertia: 1, shapes: [{kind: circle, radius: 0.1}]}
  - {name: tool, parent: three, joint: fixed, shapes: [{kind: box, size: [0.1, 0.2], center: [1, 0], angle: 0.3}]}
  - {name: puck, joint: planar, mass: 2, inertia: 3, shapes: [{kind: circle, radius: 0.1}]}
walls:
  - {name: floor, kind: half_plane, point: [0, 0], normal: [0, 2]}
contact: {self_collisions: true}
""")
BRACKET, ONE, TWO, THREE, TOOL, PUCK, FLOOR = range(7)  # shapes, in this order


def pairs(scene: Scene) -> set[frozenset[int]]:
    return {frozenset(map(int, pair)) for pair in System(scene).pairs}


def test_q_and_v_are_the_positions_and_velocities_in_the_order_of_the_bodies() -> None:
    scene = CHAIN.with_values({"bodies.two.position": [0.5], "bodies.puck.velocity": [1, 2, 3]})
    mechanism = mechanism_of(scene)
    q, v = start_of(scene)
    assert mechanism.names == tuple(body.name for body in scene.bodies)
    assert q.shape == (mechanism.nq,) and q[mechanism.coordinate_names.index("two.angle")] == 0.5
    assert v.shape == (mechanism.nv,) and v[-3:].tolist() == [1, 2, 3]
    # of the free puck
    np.testing.assert_array_equal(mechanism.mass_matrix(q)[-3:, -3:], np.diag([2.0, 2.0, 3.0]))


def test_prismatic_axis_lies_in_the_plane_and_has_length_one() -> None:
    scene = CHAIN.with_values(
        {"bodies.puck": {"name": "puck", "joint": "prismatic", "axis": [0, 5], "mass": 2}}
    )
    mechanism = mechanism_of(scene)
    q, _ = start_of(scene)
    step = np.zeros(mechanism.nv)
    step[-1] = 0.25
    moved = mechanism.placements(mechanism.integrate(q, step, 1.0))[1] - mechanism.placements(q)[1]
    np.testing.assert_allclose(moved[-1], [0.0, 0.25, 0.0], atol=1e-15)


def test_shapes_of_a_body_that_nothing_moves_are_static_and_in_world_axes() -> None:
    shapes = shapes_of(CHAIN)
    assert list(shapes.body) == [-1, 1, 2, 3, 4, 5, -1]
    assert list(shapes.kind) == [CIRCLE] * 4 + [POLYGON, CIRCLE, HALF_PLANE]
    # turned by 90°
    np.testing.assert_allclose(shapes.vertices[shapes.first[BRACKET]], [1.0, 5.0], atol=1e-15)
    np.testing.assert_array_equal(shapes.vertices[shapes.first[FLOOR] + 1], [0.0, 1.0])


def test_moving_shapes_meet_walls_and_other_trees_neighbours_never_meet() -> None:
    others = {
        *(frozenset((link, FLOOR)) for link in (ONE, TWO, THREE, TOOL, PUCK)),
        *(frozenset((link, PUCK)) for link in (BRACKET, ONE, TWO, THREE, TOOL)),
    }
    # one tree: more than one joint apart, and apart at the start; the tool is welded to link three
    own = {
        *map(
            frozenset,
            ((BRACKET, TWO), (BRACKET, THREE), (BRACKET, TOOL), (ONE, TOOL)),
        )
    }
    assert pairs(CHAIN) == others | own
    (said,) = System(CHAIN).remarks
    assert said.startswith("one and three overlap at the start")
    assert pairs(CHAIN.with_values({"contact.self_collisions": False})) == others
    chain = System(CHAIN)
    assert (chain.shapes.body[chain.pairs[:, 0]] >= 0).all()  # the first shape of a pair moves


BODY = """name: thing
dimensions: 3
rate: 1000
duration: 0.1
bodies:
  - {name: thing, joint: free_flyer, mass: 1, inertia: [1, 2, 3]%s}
"""
URDF = """<robot name="r"><link name="base"/><link name="arm"><inertial><mass value="1"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="turn" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0 0 1" rpy="0.1 0.2 0.3"/>
<axis xyz="0 1 0"/></joint></robot>"""


def mistakes_of(text: str, file: str = "(text)") -> str:
    with pytest.raises(SceneError) as failure:
        scene_from_text(text, file)
    return str(failure.value)


@pytest.mark.parametrize(
    ("written", "matrix"),
    [
        ("[1, 2, 3]", [[1, 0, 0], [0, 2, 0], [0, 0, 3]]),
        ("[1, 2, 3, 0.1, 0.2, 0.3]", [[1, 0.1, 0.2], [0.1, 2, 0.3], [0.2, 0.3, 3]]),
        ("[[1, 0.1, 0], [0.1, 2, 0], [0, 0, 3]]", [[1, 0.1, 0], [0.1, 2, 0], [0, 0, 3]]),
    ],
)
def test_inertia_as_three_six_or_nine_numbers_and_the_start_at_rest(
    written: str, matrix: list[list[float]]
) -> None:
    scene = scene_from_text((BODY % "").replace("[1, 2, 3]", written))
    assert mechanism_of(scene).bodies[0].inertia.tolist() == matrix
    assert start_of(scene)[0].tolist() == [0, 0, 0, 0, 0, 0, 1]


def scene_with_robot(folder: Path, urdf: str = "r.urdf", more: str = "") -> str:
    (folder / "r.urdf").write_text(URDF)
    robot = f"robots: [{{name: rob, urdf: {urdf}, shapes: {{arm: [{{kind: sphere, radius: 0.1}}]}}{more}}}]\n"
    return (BODY % "") + robot


def test_robot_becomes_bodies_and_the_scene_needs_its_file_no_more(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(scene_with_robot(tmp_path, more=", origin: [1, 0, 0], position: {arm: [0.4]}"))
    scene = load_scene(path)
    assert [body.name for body in scene.bodies] == ["thing", "rob_base", "rob_arm"]
    again = scene_from_text(scene.source_text)
    assert again.resolved() == scene.resolved()
    R, p = mechanism_of(scene).placements(start_of(scene)[0])
    R_read, p_read = Mechanism.from_urdf(tmp_path / "r.urdf").placements([0.4])
    np.testing.assert_allclose(R[2], R_read[1], atol=1e-15)
    np.testing.assert_allclose(p[2], p_read[1] + [1, 0, 0], atol=1e-15)


@pytest.mark.parametrize("urdf", ["../r.urdf", "/etc/hostname", "sub/../../r.urdf", "link.urdf"])
def test_urdf_paths_stay_in_the_scene_folder(tmp_path: Path, urdf: str) -> None:
    folder = tmp_path / "inner"
    folder.mkdir()
    (tmp_path / "r.urdf").write_text(URDF)
    (folder / "link.urdf").symlink_to(tmp_path / "r.urdf")
    assert "inside the scene's folder" in mistakes_of(
        scene_with_robot(folder, urdf), str(folder / "scene.yaml")
    )
