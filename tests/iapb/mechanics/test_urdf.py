"""Reading URDF: what the specification says, and errors that name the element."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.errors import ArgumentError
from iapb.mechanics.mechanism import Mechanism

INERTIAL = """<inertial><origin xyz="0.1 0 0" rpy="0 0 1.5707963267948966"/><mass value="2"/>
  <inertia ixx="1" ixy="0.1" ixz="0" iyy="2" iyz="0" izz="3"/></inertial>"""


def link(name, inside=INERTIAL):
    return f'<link name="{name}">{inside}</link>'


def joint(name, parent, child, kind="revolute", inside=""):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>'
    )


@pytest.fixture
def read(tmp_path):
    def read(*elements, floating_base=False):
        path = tmp_path / "robot.urdf"
        path.write_text(f'<?xml version="1.0"?><robot name="r">{"".join(elements)}</robot>')
        return Mechanism.from_urdf(path, floating_base)

    return read


def test_inertia_is_turned_into_link_axes(read):
    mechanism = read(link("base"), link("arm"), joint("j", "base", "arm"))
    arm = mechanism.bodies[1]
    assert arm.mass == 2.0 and list(arm.center_of_mass) == [0.1, 0.0, 0.0]
    np.testing.assert_allclose(arm.inertia, [[2, -0.1, 0], [-0.1, 1, 0], [0, 0, 3]], atol=1e-15)


def test_the_default_axis_is_x_and_rpy_turns_about_fixed_axes(read):
    origin = '<origin xyz="1 2 3" rpy="0.1 0.2 0.3"/>'
    body = read(link("base"), link("arm"), joint("j", "base", "arm", inside=origin)).bodies[1]
    assert body.joint.axis == (1.0, 0.0, 0.0)
    (cx, cy, cz), (sx, sy, sz) = np.cos([0.1, 0.2, 0.3]), np.sin([0.1, 0.2, 0.3])
    first_column = [cz * cy, sz * cy, -sy]
    np.testing.assert_allclose(body.placement[0][:, 0], first_column, atol=1e-15)
    np.testing.assert_allclose(body.placement[0][2], [-sy, cy * sx, cy * cx], atol=1e-15)
    assert list(body.placement[1]) == [1.0, 2.0, 3.0]


def test_children_come_depth_first_in_the_order_of_joint_names(read):
    links = [link(name) for name in ("z", "y", "x", "w", "base")]
    joints = [joint("b", "base", "x"), joint("a", "base", "y"), joint("c", "y", "w"), joint("B", "base", "z")]
    assert read(*links, *joints).names == ("base", "z", "y", "w", "x")  # upper case sorts before lower


def test_each_type_gives_its_layout(read):
    types = ["fixed", "revolute", "continuous", "prismatic", "planar", "floating"]
    links = [link("base"), *(link(f"l{i}") for i in range(len(types)))]
    joints = [joint(f"j{i}", "base", f"l{i}", kind) for i, kind in enumerate(types)]
    mechanism = read(*links, *joints)
    assert (mechanism.nq, mechanism.nv) == (0 + 1 + 2 + 1 + 4 + 7, 0 + 1 + 1 + 1 + 3 + 6)
    kinds = [body.joint.kind for body in mechanism.bodies]
    assert kinds == ["fixed", "fixed", "revolute", "continuous", "prismatic", "planar_se2", "free_flyer"]


def test_a_floating_base_moves_freely(read):
    elements = [link("base"), link("arm", ""), joint("j", "base", "arm", "fixed")]
    assert read(*elements).nv == 0
    floating = read(*elements, floating_base=True)
    assert (floating.nq, floating.nv, floating.bodies[1].mass) == (7, 6, 0.0)


def test_mimic_joints_are_independent(read):
    links = [link("base"), link("a"), link("b")]
    joints = [joint("j", "base", "a"), joint("k", "base", "b", inside='<mimic joint="j" multiplier="2"/>')]
    assert read(*links, *joints).nv == 2


def test_a_chain_of_thousands_of_links_is_read(read):
    n = 3000
    links = [link(f"l{i}", "") for i in range(n)]
    joints = [joint(f"j{i}", f"l{i}", f"l{i + 1}", "fixed") for i in range(n - 1)]
    assert len(read(*links, *joints).names) == n


BASE, ARM = link("base"), link("arm")

MISTAKES = {
    "unknown type": ([BASE, ARM, joint("elbow", "base", "arm", "hinge")], "elbow.*type"),
    "no such link": ([BASE, joint("elbow", "base", "hand")], "elbow.*child"),
    "two parents": ([BASE, ARM, joint("a", "base", "arm"), joint("b", "base", "arm")], "'b'.*child"),
    "zero axis": ([BASE, ARM, joint("elbow", "base", "arm", inside='<axis xyz="0 0 0"/>')], "elbow.*axis"),
    "two numbers": ([BASE, ARM, joint("elbow", "base", "arm", inside='<axis xyz="0 1"/>')], "elbow.*axis"),
    "not a number": (
        [BASE, ARM, joint("j", "base", "arm", inside='<origin rpy="0 0 pi"/>')],
        "'j'.*origin rpy",
    ),
    "infinite": ([BASE, ARM, joint("j", "base", "arm", inside='<origin xyz="0 0 inf"/>')], "'j'.*origin xyz"),
    "negative mass": ([link("base", INERTIAL.replace('value="2"', 'value="-2"'))], "base.*mass"),
    "no mass": ([link("base", "<inertial><origin/></inertial>")], "base.*inertial"),
    "no izz": ([link("base", INERTIAL.replace("izz", "i_zz"))], "base.*izz"),
    "name twice": ([BASE, BASE], "base"),
    "no name": (["<link/>"], "name"),
    "no child": ([BASE, '<joint name="j" type="fixed"><parent link="base"/></joint>'], "'j'.*child"),
    "two roots": ([BASE, ARM], "base.*arm"),
    "nothing": ([], "root"),
    "ring": ([BASE, ARM, link("c"), joint("a", "arm", "c"), joint("b", "c", "arm")], "ring"),
}


@pytest.mark.parametrize(("elements", "named"), MISTAKES.values(), ids=MISTAKES)
def test_mistakes_name_the_element(read, elements, named):
    with pytest.raises(ArgumentError, match=named):
        read(*elements)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("<robot><link name='a'></robot>", "well-formed"),
        ("<model/>", "<robot>"),
        ("", "well-formed"),
        ('<!DOCTYPE r [<!ENTITY a "1"><!ENTITY b "&a;&a;">]><robot><link name="&b;"/></robot>', "DOCTYPE"),
    ],
)
def test_files_that_are_no_urdf_are_refused(tmp_path, text, named):
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    with pytest.raises(ArgumentError, match=named):
        Mechanism.from_urdf(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ArgumentError, match=r"nowhere\.urdf"):
        Mechanism.from_urdf(tmp_path / "nowhere.urdf")


def test_an_entity_bomb_is_refused_at_once(tmp_path):
    levels = "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 10}">' for i in range(1, 20))
    path = tmp_path / "bomb.urdf"
    path.write_text(f'<!DOCTYPE r [<!ENTITY e0 "lol">{levels}]><robot name="&e19;"/>')
    with pytest.raises(ArgumentError, match="DOCTYPE"):
        Mechanism.from_urdf(path)
