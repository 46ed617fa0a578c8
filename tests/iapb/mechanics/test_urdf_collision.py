"""Collision elements of URDF: read as the specification says, wrong ones named; robots of scenes that take them."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from iapb.errors import ArgumentError, SceneError
from iapb.mechanics.urdf import read_collisions
from iapb.scene import load_scene, scene_from_text
from iapb.simulation import simulate

ROBOTS = Path(__file__).parents[4] / "shared" / "robots"
ARM = """<robot name="r"><link name="base">{base}</link>
<link name="arm"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>
  <inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>{arm}</link>
<joint name="j" type="revolute"><parent link="base"/><child link="arm"/>
  <origin xyz="0 0 0.3"/><axis xyz="0 1 0"/></joint>
</robot>"""
SCENE = """name: arm
dimensions: 3
rate: 1000
duration: 1
gravity: [0, 0, -9.81]
robots:
  - name: rob
    urdf: r.urdf
    {lines}
bodies: []
walls: [{{name: floor, kind: half_space, point: [0, 0, 0], normal: [0, 0, 1]}}]
contact: {{stiffness: 1e4, damping: 20, restitution: 0, friction: 0, friction_velocity: 1e-2}}
"""


def collision(geometry: str, origin: str = "") -> str:
    return f"<collision>{origin}<geometry>{geometry}</geometry></collision>"


BALL = collision('<sphere radius="0.05"/>', '<origin xyz="0.4 0 0"/>')
BAR = collision('<box size="0.4 0.02 0.04"/>', '<origin xyz="0.2 0 0" rpy="0.1 0.2 0.3"/>')


def write(folder: Path, arm: str, base: str = "", lines: str = "collisions: urdf") -> Path:
    (folder / "r.urdf").write_text(ARM.format(arm=arm, base=base))
    (folder / "scene.yaml").write_text(SCENE.format(lines=lines))
    return folder / "scene.yaml"


def test_shapes_are_read_in_link_axes_and_in_the_order_of_the_file(tmp_path: Path) -> None:
    write(tmp_path, BALL + BAR + collision('<cylinder radius="0.1" length="2"/>') + collision('<mesh filename="m"/>'))
    read = read_collisions(tmp_path / "r.urdf")
    assert read["base"] == () and [shape.kind for shape in read["arm"]] == ["sphere", "box", "cylinder", "mesh"]
    assert read["arm"][0].center == pytest.approx([0.4, 0.0, 0.0])
    assert read["arm"][1].lengths == pytest.approx([0.4, 0.02, 0.04])
    cosines, sines = np.cos([0.1, 0.2, 0.3]), np.sin([0.1, 0.2, 0.3])
    assert read["arm"][1].rotation[:, 0] == pytest.approx(
        [cosines[2] * cosines[1], sines[2] * cosines[1], -sines[1]]
    )
    assert read["arm"][2].lengths == pytest.approx([0.1, 2.0])


@pytest.mark.parametrize(
    ("element", "said"),
    [
        ("<collision/>", "geometry.*nothing"),
        (collision("<cone/>"), "<cone>.*one of <box>"),
        (collision('<sphere radius="1"/><sphere radius="1"/>'), "<sphere>, <sphere>"),
        (collision('<sphere radius="-1"/>'), "lengths > 0"),
        (collision('<sphere radius="nan"/>'), "sphere radius.*finite"),
        (collision('<box size="1 2"/>'), "box size.*3 finite numbers"),
        (collision("<capsule radius='1'/>"), "capsule length"),
    ],
)
def test_wrong_elements_are_named_with_their_link(tmp_path: Path, element: str, said: str) -> None:
    write(tmp_path, element)
    with pytest.raises(ArgumentError, match=f"(?s)link name='arm'.*{said}"):
        read_collisions(tmp_path / "r.urdf")


def test_a_scene_takes_them_where_it_says_so_and_keeps_them_in_its_text(tmp_path: Path) -> None:
    scene = load_scene(write(tmp_path, BALL + BAR))
    assert [shape.kind for shape in scene.bodies[1].shapes] == ["sphere", "box"]
    assert scene.bodies[1].shapes[1].rpy == pytest.approx((0.1, 0.2, 0.3))
    assert scene_from_text(scene.source_text).resolved() == scene.resolved()
    assert load_scene(write(tmp_path, BALL, lines="floating: false")).bodies[1].shapes == ()


def test_the_ball_at_the_end_of_the_arm_meets_the_floor(tmp_path: Path) -> None:
    """It falls from 0.3 m until sin(angle) = 0.25/0.4; without its collision element it swings through."""
    angle = np.arcsin(0.25 / 0.4)
    run = simulate(load_scene(write(tmp_path, BALL)), steps=900)
    assert run.q[-1, 0] == pytest.approx(angle, abs=1e-2)
    assert simulate(load_scene(write(tmp_path, "")), steps=900).q[:, 0].max() > 1.5


def test_what_the_scene_cannot_hold_is_a_mistake_with_its_place_until_shapes_replace_it(tmp_path: Path) -> None:
    file = write(tmp_path, collision('<cylinder radius="0.1" length="2"/>'), collision('<mesh filename="m.stl"/>'))
    with pytest.raises(SceneError) as caught:
        load_scene(file)
    (mistake,) = (found for found in caught.value.mistakes if found.path.startswith("robots"))
    assert (mistake.line, mistake.column) == (9, 17) and mistake.path == "robots[0].collisions"
    assert "base <mesh>, arm <cylinder>" in mistake.value and "under shapes" in mistake.expected
    lines = "collisions: urdf\n    shapes: {base: [], arm: [{kind: sphere, radius: 0.1}]}"
    file.write_text(SCENE.format(lines=lines))
    assert [len(body.shapes) for body in load_scene(file).bodies] == [0, 1]


@pytest.mark.parametrize(("lines", "line", "path"), [
    ("collisions: mesh", 9, "robots[0].collisions"),
    ("shapes: {arm: [{kind: sphere, radius: -1}]}", 9, "robots[0].shapes.arm"),
    ("floating: false\n    position: {leg: [0]}", 10, "robots[0].position of robot rob"),
])
def test_mistakes_of_a_robot_say_line_and_column(tmp_path: Path, lines: str, line: int, path: str) -> None:
    with pytest.raises(SceneError) as caught:
        load_scene(write(tmp_path, BALL, lines=lines))
    found = caught.value.mistakes[0]
    assert found.line == line and found.column > 4 and found.path.startswith(path)


@pytest.mark.skipif(not (ROBOTS / "allegro_left_hand.urdf").exists(), reason="shared robot files are not here")
def test_a_hand_of_boxes_and_spheres_falls_on_the_floor(tmp_path: Path) -> None:
    file = write(tmp_path, BALL, lines="collisions: urdf\n    floating: true\n    origin: [0, 0, 0.15]")
    shutil.copy(ROBOTS / "allegro_left_hand.urdf", tmp_path / "r.urdf")
    scene = load_scene(file)
    assert "rob_link_15_0_tip" in {body.name for body in scene.bodies}  # link_15.0_tip there
    assert sum(len(body.shapes) for body in scene.bodies) == 21
    run = simulate(scene, steps=250)
    assert run.complete and np.diff(run.contacts.offsets).max() > 0


@pytest.mark.skipif(not (ROBOTS / "panda.urdf").exists(), reason="shared robot files are not here")
def test_an_arm_of_meshes_is_refused_by_the_names_of_its_links(tmp_path: Path) -> None:
    file = write(tmp_path, BALL)
    shutil.copy(ROBOTS / "panda.urdf", tmp_path / "r.urdf")
    with pytest.raises(SceneError, match="panda_link0 <mesh>"):
        load_scene(file)
