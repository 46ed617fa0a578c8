"""A robot's joints are what its URDF says, and nothing that the file says is ignored in silence."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from iapb.errors import ArgumentError, SceneError
from iapb.scene import Scene, scene_from_text
from iapb.scene.mechanism import mechanism_of, start_of
from iapb.simulation import simulate

Load = Callable[..., Scene]
SCENE = """name: robot
dimensions: 3
rate: 1000
duration: {duration}
gravity: [0, 0, -9.81]
robots: [{{name: r, urdf: r.urdf{more}}}]
"""


def link(name: str, mass: float = 0.1, inside: str = "") -> str:
    inertia = " ".join(
        f'{k}="{1e-2 * mass * (k[1] == k[2])}"' for k in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    inertial = f'<inertial><mass value="{mass}"/><inertia {inertia}/></inertial>' if mass else ""
    return f'<link name="{name}">{inertial}{inside}</link>'


def joint(
    name: str, child: str, kind: str = "prismatic", inside: str = "", parent: str = "palm"
) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0.1 0 0"/><axis xyz="0 0 1"/>{inside}</joint>'
    )


RANGE = '<limit lower="-0.02" upper="0.04" effort="10" velocity="1"/>'
PALM = link("palm", 1.0)
FINGER = link("finger")
SLIDE = joint("slide", "finger", inside=RANGE)


@pytest.fixture
def load(tmp_path: Path) -> Load:
    def load(*elements: str, more: str = "", duration: float = 0.5, bodies: str = "") -> Scene:
        (tmp_path / "r.urdf").write_text(f'<robot name="r">{"".join(elements)}</robot>')
        text = SCENE.format(more=more and f", {more}", duration=duration) + bodies
        return scene_from_text(text, str(tmp_path / "scene.yaml"))

    return load


def refusal(load: Load, *elements: str, more: str = "", bodies: str = "") -> str:
    with pytest.raises(SceneError) as caught:
        load(*elements, more=more, bodies=bodies)
    assert len(caught.value.mistakes) == 1  # no second mistake that the first one makes
    return str(caught.value)


# limits


def test_a_finger_rests_on_the_limit_of_its_joint(load: Load) -> None:
    scene = load(PALM, FINGER, SLIDE)
    assert scene.bodies[1].joint_limits == (-0.02, 0.04)
    run = simulate(scene)
    assert run.q.min() == pytest.approx(-0.02, abs=1e-4) and run.q[-1, 0] < -0.0199
    assert not run.distrust


def test_a_start_at_rest_outside_the_limits_moves_to_the_nearest_one_and_is_said(
    load: Load,
) -> None:
    scene = load(PALM, FINGER, joint("slide", "finger", inside='<limit lower="0.1" upper="0.3"/>'))
    assert start_of(scene)[0] == 0.1
    assert scene.remarks[-1].startswith("robot r: finger starts at 0.1, the limit of joint slide")
    scene = load(PALM, FINGER, joint("s", "finger", inside='<limit lower="-3" upper="-0.5"/>'))
    assert start_of(scene)[0] == -0.5


@pytest.mark.parametrize("start", [-0.021, 0.05])
def test_a_given_start_outside_the_limits_is_refused(load: Load, start: float) -> None:
    said = refusal(load, PALM, FINGER, SLIDE, more=f"position: {{finger: [{start}]}}")
    assert "link finger" in said and "joint slide" in said and "[-0.02, 0.04]" in said


@pytest.mark.parametrize(
    ("limit", "kept"),
    [
        ('<limit lower="-1e16" upper="1e16"/>', None),
        ('<limit lower="-1e16" upper="2"/>', (-1e9, 2.0)),
        ('<limit lower="0" upper="1e16"/>', (0.0, 1e9)),
        ("", None),
    ],
)
def test_bounds_that_no_joint_reaches_are_none(
    load: Load, limit: str, kept: tuple[float, float] | None
) -> None:
    scene = load(PALM, FINGER, joint("turn", "finger", "revolute", limit))
    assert scene.bodies[1].joint_limits == kept
    assert any("without <limit>" in said and "turn" in said for said in scene.remarks) == (
        not limit
    )


@pytest.mark.parametrize(
    ("inside", "named"),
    [
        ('<limit lower="1" upper="-1"/>', "leave_out: {slide: [limit]}"),
        ('<limit lower="a" upper="1"/>', "'slide'> limit lower"),
        ('<limit lowr="-1" upper="1"/>', "did you mean lower"),
        ('<limt lower="-1" upper="1"/>', "misspelt"),
        ('<dynamics damping="-1"/>', "dynamics damping"),
        ('<dynamics dampng="1"/>', "did you mean damping"),
    ],
)
def test_a_wrong_limit_or_damping_is_refused_by_name(load: Load, inside: str, named: str) -> None:
    assert named in refusal(load, PALM, FINGER, joint("slide", "finger", inside=inside))


# mimic and friction


def follower(mimic: str, inside: str = RANGE, kind: str = "prismatic") -> str:
    return joint("follow", "thumb", kind, f"{inside}<mimic {mimic}/>")


THUMB = link("thumb")


def test_what_a_joint_has_in_the_file_its_body_has(load: Load) -> None:
    slide = joint("slide", "finger", inside=RANGE + '<dynamics damping="5" friction="1"/>')
    parts = PALM, FINGER, THUMB, slide, follower('joint="slide" multiplier="-1"')
    scene = load(*parts)
    bodies = {body.name: body for body in scene.bodies}
    finger = bodies["r_finger"]
    assert (finger.joint_damping, finger.joint_friction) == ((5.0,), (1.0,))
    mimic = bodies["r_thumb"].joint_mimic
    assert (mimic.body, mimic.multiplier, mimic.offset) == ("r_finger", -1.0, 0.0)
    assert mechanism_of(scene).nv == 1
    left = {body.name: body for body in load(*parts, more="leave_out: {slide: [dynamics]}").bodies}
    assert not left["r_finger"].joint_damping and not left["r_finger"].joint_friction


def test_a_start_follows_the_leader_and_stays_within_both_ranges(load: Load) -> None:
    parts = PALM, FINGER, THUMB, SLIDE
    scene = load(*parts, follower('joint="slide" offset="-0.05"'))
    assert start_of(scene)[0] == pytest.approx(0.03)
    assert "position" in refusal(
        load, *parts, follower('joint="slide"'), more="position: {thumb: [0]}"
    )
    point = '<limit lower="0.02" upper="0.04"/>'  # of its negative: one point of the leader's range
    for other in (
        follower('joint="slide" offset="1"'),
        follower('joint="slide" multiplier="-1"', point),
    ):
        assert "range in common" in refusal(load, *parts, other)
    with pytest.raises(ArgumentError, match="of what follows it"):
        simulate(scene.with_values({"bodies.r_thumb.joint_mimic.offset": 0.1}))


# what is ignored is said, once


def test_one_remark_counts_what_has_no_effect(load: Load) -> None:
    shapes = "<visual><geometry><box/></geometry></visual><collision/><collision/>"
    slide = SLIDE.replace('<axis xyz="0 0 1"/>', '<axis xyz="0 0 1" rpy="0 0 0"/>')
    scene = load(PALM, link("finger", inside=shapes), slide, "<gazebo/><gazebo reference='palm'/>")
    (said,) = scene.remarks
    for what in ("effort of <limit> (1)", "<collision> (2)", "rpy of <axis> (1)", "<gazebo> (2)"):
        assert said.count(what) == 1
    assert simulate(scene, steps=1).remarks[0] == said
    assert scene.with_values({"rate": 500}).remarks == scene.remarks


# what cannot be simulated is refused, and can be left out


THUMBS = PALM, FINGER, THUMB, link("wheel"), SLIDE, joint("turn", "wheel", "continuous")
ROD = PALM, FINGER, link("rod"), SLIDE, joint("a", "rod"), joint("b", "rod", parent="finger")
BOLT = joint("bolt", "nut", "screw"), joint("tip", "end", "fixed", parent="nut")
LEFT_OUT = [  # elements; joint and what of it cannot be simulated; a field of the bodies without it
    *(
        (
            (PALM, FINGER, joint("turn", "finger", "revolute", limit)),
            "turn: [limit]",
            "joint_limits",
            [None] * 2,
        )
        for limit in ('<limit effort="1" velocity="2"/>', '<limit lower="1" upper="1"/>')
    ),
    *(
        (
            (*THUMBS, follower(f'joint="{leader}"', "", kind)),
            "follow: [mimic]",
            "joint_mimic",
            [None] * 4,
        )
        for leader, kind in (
            ("none", "prismatic"),
            ("follow", "prismatic"),
            ("turn", "prismatic"),
            ("slide", "floating"),
        )
    ),
    *(
        (
            (PALM, FINGER, joint("move", "finger", kind, f'<dynamics {field}="1"/>')),
            "move: [dynamics]",
            f"joint_{field}",
            [()] * 2,
        )
        for kind in ("planar", "floating")
        for field in ("damping", "friction")
    ),
    (
        (PALM, FINGER, link("nut"), link("end"), SLIDE, *BOLT),
        "bolt: [joint]",
        "joint",
        ["fixed"] * 3 + ["prismatic"],
    ),
    (ROD, "b: [joint]", "parent", ["world", "r_palm", "r_palm"]),  # a loop is cut
]


@pytest.mark.parametrize(("elements", "left", "field", "expected"), LEFT_OUT)
def test_what_cannot_be_simulated_is_refused_and_can_be_left_out(
    load: Load, elements: tuple[str, ...], left: str, field: str, expected: list[str | None]
) -> None:
    option = f"leave_out: {{{left}}}"
    assert option in refusal(load, *elements)
    assert [getattr(body, field) for body in load(*elements, more=option).bodies] == expected


def test_a_loop_can_be_cut_at_any_of_its_joints(load: Load) -> None:
    scene = load(*ROD, more="leave_out: {a: [joint]}")
    assert [body.parent for body in scene.bodies] == ["world", "r_palm", "r_finger"]


# a refused robot makes no second mistake


@pytest.mark.parametrize(
    "bodies",
    [
        "bodies: [{name: tool, parent: r_finger, joint: fixed}]",
        "hand: {body: r_finger}\ndevice: {force_limit: [1]}\n"
        "couplings: {unilateral: {stiffness: [1], damping: [1]}}",
    ],
)
def test_a_refused_robot_is_the_only_mistake(load: Load, bodies: str) -> None:
    assert "screw" in refusal(load, PALM, FINGER, joint("s", "finger", "screw"), bodies=bodies)


def test_a_real_second_mistake_is_still_told(load: Load) -> None:
    with pytest.raises(SceneError) as caught:
        load(PALM, FINGER, joint("s", "finger", "screw"), bodies="contact: {friction: -1}")
    assert len(caught.value.mistakes) == 2


def test_a_mistake_of_a_robots_body_names_robot_link_and_joint(load: Load) -> None:
    said = refusal(load, PALM, link("finger", 1e10), SLIDE)
    assert "robots[0]: mass of link 'finger', joint 'slide'" in said
    assert "bodies[" not in said and "default" not in said


# joints that move no mass

YAML = """name: chain
dimensions: 3
rate: 1000
duration: 0.01
bodies:
"""
SOLID = "mass: 1, inertia: [0.1, 0.2, 0.2]"
MOVED = {
    "a massless slide that carries a body": [
        "{name: a, joint: prismatic, axis: [1, 0, 0]}",
        f"{{name: b, parent: a, joint: prismatic, axis: [0, 1, 0], {SOLID}}}",
    ],
    "a massless free base": [
        "{name: a, joint: free_flyer}",
        f"{{name: b, parent: a, joint: fixed, origin: [0, 0, 1], {SOLID}}}",
    ],
    "a point on an arm": [
        "{name: a, joint: revolute, axis: [0, 0, 1], mass: 1, center_of_mass: [1, 0, 0]}"
    ],
}
NOT_MOVED = {
    "finger: no mass turns about it": [
        f"{{name: arm, joint: revolute, axis: [0, 0, 1], {SOLID}}}",
        "{name: finger, parent: arm, joint: revolute, axis: [0, 1, 0]}",
    ],
    "finger: no mass moves along it": [
        f"{{name: arm, joint: revolute, axis: [0, 0, 1], {SOLID}}}",
        "{name: finger, parent: arm, joint: prismatic, axis: [0, 1, 0], inertia: [1, 1, 1]}",
    ],
    "b: no mass lies between it": [
        "{name: a, joint: prismatic, axis: [1, 0, 0]}",
        f"{{name: b, parent: a, joint: prismatic, axis: [1, 0, 0], {SOLID}}}",
    ],
    "ball: no mass turns about it": ["{name: ball, joint: free_flyer, mass: 1}"],
}


@pytest.mark.parametrize("bodies", MOVED.values(), ids=MOVED)
def test_a_massless_body_loads_where_its_joint_moves_mass(bodies: list[str]) -> None:
    scene = scene_from_text(YAML + "".join(f"  - {body}\n" for body in bodies))
    values = np.linalg.eigvalsh(mechanism_of(scene).mass_matrix(start_of(scene)[0]))
    assert values[0] > 0.0
    assert simulate(scene).complete


@pytest.mark.parametrize(("said", "bodies"), NOT_MOVED.items(), ids=NOT_MOVED)
def test_a_joint_that_moves_no_mass_is_named(said: str, bodies: list[str]) -> None:
    text = YAML + "".join(f"  - {body}\n" for body in bodies)
    with pytest.raises(SceneError) as caught:
        scene_from_text(text, "wrong.yaml")
    (mistake,) = caught.value.mistakes
    name = said.split(":")[0]
    assert mistake.path == f"joint of {name}" and said in mistake.expected
    assert mistake.line == 5 + len(bodies) and "default" not in mistake.value


# planar joints


@pytest.mark.parametrize("axis", ["0 0 1", "1 2 -2"])
def test_a_planar_joint_moves_across_its_axis(load: Load, axis: str) -> None:
    slide = joint("move", "finger", "planar").replace('"0 0 1"', f'"{axis}"')
    scene = load(PALM, FINGER, slide, more="position: {finger: [0.3, 0.2, 0.5]}")
    normal = np.array(axis.split(), float)
    R, p = mechanism_of(scene).placements(start_of(scene)[0])
    moved = p[-1] - [0.1, 0.0, 0.0]
    assert np.linalg.norm(moved) == pytest.approx(np.hypot(0.3, 0.2))
    assert moved @ normal == pytest.approx(0.0, abs=1e-15)
    np.testing.assert_allclose(R[-1] @ normal, normal, atol=1e-14)
    assert np.trace(R[-1]) == pytest.approx(1.0 + 2.0 * np.cos(0.5))
