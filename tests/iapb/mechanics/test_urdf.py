"""Reading URDF: what the specification says, and errors that name the element."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from iapb.errors import ArgumentError
from iapb.mechanics.mechanism import Mechanism
from iapb.mechanics.urdf import read_urdf
from iapb.scene import scene_folder

INERTIAL = """<inertial><origin xyz="0.1 0 0" rpy="0 0 1.5707963267948966"/><mass value="2"/>
  <inertia ixx="1" ixy="0.1" ixz="0" iyy="2" iyz="0" izz="3"/></inertial>"""


def link(name, inside=INERTIAL):
    return f'<link name="{name}">{inside}</link>'


def joint(name, parent, child, kind="revolute", inside=""):
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>'


@pytest.fixture
def read(tmp_path):
    def read(*elements, floating_base=False):
        path = tmp_path / "robot.urdf"
        path.write_text(f'<?xml version="1.0"?><robot name="r">{"".join(elements)}</robot>')
        return Mechanism.from_urdf(path, floating_base)

    return read


def test_a_link_and_its_joint_are_read_as_the_specification_says(read):
    """Inertia in link axes; the default axis is x, and rpy turns about fixed axes. Pinocchio reads
    the rest alike."""
    origin = '<origin xyz="1 2 3" rpy="0.1 0.2 0.3"/>'
    body = read(link("base"), link("arm"), joint("j", "base", "arm", inside=origin)).bodies[1]
    assert (
        body.mass == 2.0
        and list(body.center_of_mass) == [0.1, 0.0, 0.0]
        and body.joint.axis == (1.0, 0.0, 0.0)
    )
    np.testing.assert_allclose(body.inertia, [[2, -0.1, 0], [-0.1, 1, 0], [0, 0, 3]], atol=1e-15)
    np.testing.assert_allclose(
        body.placement[0], Rotation.from_euler("xyz", [0.1, 0.2, 0.3]).as_matrix(), atol=1e-15
    )
    assert list(body.placement[1]) == [1.0, 2.0, 3.0]


def test_children_come_depth_first_in_the_order_of_joint_names_with_their_kinds(read):
    links = [link(name) for name in ("z", "y", "x", "w", "u", "base")]
    joints = [
        joint("b", "base", "x", "planar", '<axis xyz="0 0 1"/>'),
        joint("a", "base", "y", "fixed"),
        joint("c", "y", "w", "continuous"),
        joint("B", "base", "z", "prismatic"),
        joint("d", "w", "u", "floating"),
    ]
    mechanism = read(*links, *joints)
    assert mechanism.names == ("base", "z", "y", "w", "u", "x")  # upper case sorts before lower
    kinds = [body.joint.kind for body in mechanism.bodies]
    assert kinds == ["fixed", "prismatic", "fixed", "continuous", "free_flyer", "planar"]


def test_a_floating_base_moves_freely(read):
    elements = [link("base"), link("arm", ""), joint("j", "base", "arm", "fixed")]
    assert read(*elements).nv == 0
    floating = read(*elements, floating_base=True)
    assert (floating.nq, floating.nv, floating.bodies[1].mass) == (7, 6, 0.0)


BASE = link("base")
ARM = link("arm")
MISTAKES = {
    "no such link": ([BASE, joint("elbow", "base", "hand")], "elbow.*child"),
    "zero axis": (
        [BASE, ARM, joint("elbow", "base", "arm", inside='<axis xyz="0 0 0"/>')],
        "elbow.*axis",
    ),
    "not a number": (
        [BASE, ARM, joint("j", "base", "arm", inside='<origin rpy="0 0 pi"/>')],
        "'j'.*origin rpy",
    ),
    "negative mass": ([link("base", INERTIAL.replace('value="2"', 'value="-2"'))], "base.*mass"),
    "no mass": ([link("base", "<inertial><origin/></inertial>")], "base.*inertial"),
    "wrong attribute": ([link("base", INERTIAL.replace("xyz", "xzy"))], "xzy"),
    "no child": (
        [BASE, '<joint name="j" type="fixed"><parent link="base"/></joint>'],
        "'j'.*child",
    ),
    "nothing": ([], "root"),
}


@pytest.mark.parametrize(("elements", "named"), MISTAKES.values(), ids=MISTAKES)
def test_mistakes_name_the_element(read, elements, named):
    with pytest.raises(ArgumentError, match=named):
        read(*elements)


@pytest.mark.parametrize(
    "tag", ["link", "joint", "inertial", "origin", "mass", "inertia", "axis", "parent", "child"]
)
def test_no_element_can_be_misspelt(tag, tmp_path):
    """One letter lost, anywhere in a shipped file."""
    text = (scene_folder() / "robots" / "seven_axis_arm.urdf").read_text()
    wrong = tag[:-2] + tag[-1]
    text = re.sub("<collision>.*?</collision>", "", text, flags=re.DOTALL)
    for found in re.finditer(rf"<{tag}\b", text):
        path = tmp_path / "robot.urdf"
        path.write_text(
            text[: found.start()] + re.sub(rf"(</?){tag}\b", rf"\1{wrong}", text[found.start() :])
        )
        with pytest.raises(ArgumentError):
            read_urdf(path)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("<robot><link name='a'></robot>", "well-formed"),
        ("<model/>", "<robot>"),
        ("", "well-formed"),
        (
            '<!DOCTYPE r [<!ENTITY a "1"><!ENTITY b "&a;&a;">]><robot><link name="&b;"/></robot>',
            "DOCTYPE",
        ),
    ],
)
def test_files_that_are_no_urdf_are_refused(tmp_path, text, named):
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    with pytest.raises(ArgumentError, match=named):
        Mechanism.from_urdf(path)
