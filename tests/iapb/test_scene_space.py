"""Scenes in space: what they may say, and robots from URDF."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from iapb.errors import SceneError
from iapb.scene import SpatialScene, find_scene, load_scene, scene_from_text
from iapb.scene.mechanism import mechanism_of, pairs_of, shapes_of, start_of
from iapb.scene.robots import angles_of, rotation_of

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


def test_position_defaults_to_rest_and_must_hold_a_unit_quaternion() -> None:
    scene = scene_from_text(BODY % "")
    assert isinstance(scene, SpatialScene)
    np.testing.assert_array_equal(start_of(scene)[0], [0, 0, 0, 0, 0, 0, 1])
    assert "length one" in mistakes_of(BODY % ", position: [0, 0, 0, 0, 0, 1, 1]")
    assert "7 numbers" in mistakes_of(BODY % ", position: [0, 0, 0]")


@pytest.mark.parametrize(
    ("written", "matrix"),
    [
        ("[1, 2, 3]", np.diag([1.0, 2.0, 3.0])),
        ("[1, 2, 3, 0.1, 0.2, 0.3]", np.array([[1, 0.1, 0.2], [0.1, 2, 0.3], [0.2, 0.3, 3]])),
        ("[[1, 0.1, 0], [0.1, 2, 0], [0, 0, 3]]", np.array([[1, 0.1, 0], [0.1, 2, 0], [0, 0, 3]])),
    ],
)
def test_inertia_as_three_six_or_nine_numbers(written: str, matrix: np.ndarray) -> None:
    scene = scene_from_text((BODY % "").replace("[1, 2, 3]", written))
    np.testing.assert_array_equal(mechanism_of(scene).bodies[0].inertia, matrix)


def test_planar_words_are_refused_in_space_and_the_other_way_round() -> None:
    assert "joint" in mistakes_of((BODY % "").replace("free_flyer", "planar"))
    assert "dimensions" in mistakes_of((BODY % "").replace("dimensions: 3", "dimensions: 2"))
    assert "bodies[0].joint" in mistakes_of((BODY % "").replace("dimensions: 3\n", ""))


def test_values_change_in_a_spatial_scene() -> None:
    scene = scene_from_text(BODY % "").with_values({"bodies.thing.mass": 2.0, "gravity": [0, 0, -9.81]})
    assert isinstance(scene, SpatialScene)
    assert scene.bodies[0].mass == 2.0
    assert scene_from_text(scene.source_text).resolved() == scene.resolved()


def scene_with_robot(folder: Path, urdf: str = "r.urdf", more: str = "") -> str:
    (folder / "r.urdf").write_text(URDF)
    robot = f"robots: [{{name: rob, urdf: {urdf}, shapes: {{arm: [{{kind: sphere, radius: 0.1}}]}}{more}}}]\n"
    return (BODY % "") + robot


def test_robot_becomes_bodies_and_the_scene_needs_its_file_no_more(tmp_path: Path) -> None:
    from iapb.mechanics.mechanism import Mechanism

    path = tmp_path / "scene.yaml"
    path.write_text(scene_with_robot(tmp_path, more=", origin: [1, 0, 0], position: {arm: [0.4]}"))
    scene = load_scene(path)
    assert [body.name for body in scene.bodies] == ["thing", "rob_base", "rob_arm"]
    again = scene_from_text(scene.source_text)
    assert again.resolved() == scene.resolved()
    own, read = mechanism_of(scene), Mechanism.from_urdf(tmp_path / "r.urdf")
    R, p = own.placements(start_of(scene)[0])
    R_read, p_read = read.placements([0.4])
    np.testing.assert_allclose(R[2], R_read[1], atol=1e-15)
    np.testing.assert_allclose(p[2], p_read[1] + [1, 0, 0], atol=1e-15)


@pytest.mark.parametrize("urdf", ["../r.urdf", "/etc/hostname", "sub/../../r.urdf", "link.urdf"])
def test_urdf_paths_stay_in_the_scene_folder(tmp_path: Path, urdf: str) -> None:
    folder = tmp_path / "inner"
    folder.mkdir()
    (tmp_path / "r.urdf").write_text(URDF)
    (folder / "link.urdf").symlink_to(tmp_path / "r.urdf")
    assert "inside the scene's folder" in mistakes_of(scene_with_robot(folder, urdf), str(folder / "scene.yaml"))


def test_unknown_links_and_bad_files_are_mistakes_of_the_scene(tmp_path: Path) -> None:
    file = str(tmp_path / "scene.yaml")
    assert "a link of it: arm, base" in mistakes_of(scene_with_robot(tmp_path, more=", position: {leg: [1]}"), file)
    assert "readable" in mistakes_of(scene_with_robot(tmp_path, "missing.urdf"), file)


@pytest.mark.parametrize("rpy", [(0.0, 0.0, 0.0), (0.3, -1.2, 2.9), (0.0, np.pi / 2, 0.7), (3.0, 0.1, -3.1)])
def test_angles_give_back_the_rotation(rpy: tuple[float, float, float]) -> None:
    rotation: Any = rotation_of(rpy)
    np.testing.assert_allclose(rotation_of(angles_of(rotation)), rotation, atol=1e-12)


def test_neighbouring_links_of_the_arm_are_no_pairs() -> None:
    scene = load_scene(find_scene("arm_obstacles"))
    shapes = shapes_of(scene)
    names = [body.name for body in scene.bodies]
    joined = {(names.index("arm_upper_arm"), names.index("arm_forearm"))}
    bodies = {tuple(sorted((int(shapes.body[a]), int(shapes.body[b])))) for a, b in pairs_of(scene, shapes)}
    assert not joined & bodies
    assert (names.index("arm_upper_arm"), names.index("arm_tool")) in bodies
