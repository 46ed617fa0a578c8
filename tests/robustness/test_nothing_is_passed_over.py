"""What is misspelt in a robot is refused, never replaced by a default in silence; sizes are bounded."""

import gzip
import json
import re

import pytest

from iapb.errors import ArgumentError, IapbError
from iapb.mechanics.urdf import read_collisions, read_urdf
from iapb.scene import load_scene, scene_folder
from reference.datasets import DatasetError, read_problem

ROBOT = scene_folder() / "robots" / "seven_axis_arm.urdf"  # it has collision elements
READ = ("link", "joint", "inertial", "collision", "origin", "mass", "inertia", "axis", "parent", "child", "geometry")


@pytest.fixture
def robot(tmp_path):
    """Write a robot; return its file."""
    def written(text):
        (tmp_path / "robot.urdf").write_text(text)
        return tmp_path / "robot.urdf"

    return written


@pytest.mark.parametrize("tag", READ)
def test_no_element_of_a_robot_can_be_misspelt(tag, robot):
    """One letter lost, anywhere in the file; alike for the two readers of it."""
    text, wrong = ROBOT.read_text(), tag[:-2] + tag[-1]
    for found in re.finditer(rf"<{tag}\b", text):
        path = robot(text[: found.start()] + re.sub(rf"(</?){tag}\b", rf"\1{wrong}", text[found.start() :]))
        with pytest.raises(ArgumentError):
            read_urdf(path)
            read_collisions(path)


@pytest.mark.parametrize(("text", "said"), [
    ("<link name='a'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>"
     "<origin xzy='1 0 0'/></inertial></link>", "xzy"),
    ("<link name='a'><inertial/><inertial/></link>", "twice"),
])  # fmt: skip
def test_slips_of_a_robot_are_named_and_what_others_add_is_let_through(text, said, robot):
    with pytest.raises(ArgumentError, match=said):
        read_urdf(robot(f"<robot name='r'>{text}</robot>"))
    added = "<gazebo/><link name='a'><contact/><visual/></link><transmission name='t'/>"
    assert len(read_urdf(robot(f"<robot name='r'>{added}</robot>"))) == 1


def test_neither_a_few_packed_bytes_nor_many_robots_can_ask_for_any_memory_or_time(tmp_path):
    (tmp_path / "bomb.lcp.gz").write_bytes(gzip.compress(b"0 " * (40 << 20), 1))
    with pytest.raises(DatasetError, match="MB"):
        read_problem(tmp_path / "bomb.lcp.gz")
    robots = [{"name": f"r{k}", "urdf": "absent.urdf"} for k in range(1000)]
    scene = {"name": "s", "dimensions": 3, "rate": 100, "duration": 1, "bodies": [], "robots": robots}
    (tmp_path / "s.yaml").write_text(json.dumps(scene))
    with pytest.raises(IapbError, match="at most 100 robots"):
        load_scene(tmp_path / "s.yaml")
