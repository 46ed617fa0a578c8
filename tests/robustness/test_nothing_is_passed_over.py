"""What is misspelt in a robot is refused, never replaced by a default in silence; sizes are bounded."""

from __future__ import annotations

import gzip
import json
import re
from pathlib import Path

import pytest

from iapb.errors import ArgumentError, IapbError
from iapb.mechanics.urdf import read_collisions, read_urdf
from iapb.scene import load_scene, scene_folder
from reference.datasets import DatasetError, read_problem

ROBOT = scene_folder() / "robots" / "seven_axis_arm.urdf"  # it has collision elements
READ = ("link", "joint", "inertial", "collision", "origin", "mass", "inertia", "axis", "parent", "child", "geometry")


@pytest.mark.parametrize("tag", READ)
def test_no_element_of_a_robot_can_be_misspelt(tag: str, tmp_path: Path) -> None:
    """One letter lost, anywhere in the file; alike for the two readers of it."""
    text, wrong = ROBOT.read_text(), tag[:-2] + tag[-1]
    places = [found.start() for found in re.finditer(rf"<{tag}\b", text)]
    for at in places:
        damaged = text[:at] + re.sub(rf"(</?){tag}\b", rf"\1{wrong}", text[at:])
        (tmp_path / "robot.urdf").write_text(damaged)
        with pytest.raises(ArgumentError):
            read_urdf(tmp_path / "robot.urdf")
            read_collisions(tmp_path / "robot.urdf")


@pytest.mark.parametrize(("text", "said"), [
    ("<link name='a'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>"
     "<origin xzy='1 0 0'/></inertial></link>", "xzy"),
    ("<link name='a'><inertial/><inertial/></link>", "twice"),
])  # fmt: skip
def test_slips_of_a_robot_are_named(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "robot.urdf").write_text(f"<robot name='r'>{text}</robot>")
    with pytest.raises(ArgumentError, match=said):
        read_urdf(tmp_path / "robot.urdf")


def test_what_others_add_to_a_robot_is_let_through(tmp_path: Path) -> None:
    (tmp_path / "robot.urdf").write_text(
        "<robot name='r'><gazebo/><link name='a'><contact/><visual/></link><transmission name='t'/></robot>"
    )
    assert len(read_urdf(tmp_path / "robot.urdf")) == 1


def test_a_few_packed_bytes_cannot_ask_for_any_memory(tmp_path: Path) -> None:
    (tmp_path / "bomb.lcp.gz").write_bytes(gzip.compress(b"0 " * (40 << 20), 1))
    with pytest.raises(DatasetError, match="MB"):
        read_problem(tmp_path / "bomb.lcp.gz")


def test_many_robots_are_refused_before_one_is_read(tmp_path: Path) -> None:
    robots = [{"name": f"r{k}", "urdf": "absent.urdf"} for k in range(1000)]
    scene = {"name": "s", "dimensions": 3, "rate": 100, "duration": 1, "bodies": [], "robots": robots}
    (tmp_path / "s.yaml").write_text(json.dumps(scene))
    with pytest.raises(IapbError, match="at most 100 robots"):
        load_scene(tmp_path / "s.yaml")
