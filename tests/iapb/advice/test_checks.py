"""Warnings before a run: each number in closed form, each remedy silences its warning, and what is
right gets none."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from iapb.advice.checks import Start, check_scene, step_limits
from iapb.scene import Scene, SpatialScene, find_scene, load_scene, scene_names

FLOOR = {"name": "floor", "kind": "half_plane", "point": [0, 0], "normal": [0, 1]}
PLATE = {"name": "plate", "kind": "box", "size": [1.0, 0.05], "center": [0, 0]}
POST = {"name": "post", "kind": "box", "size": [0.12, 2.0], "center": [0, 0]}
SIDES = [
    {"name": name, "kind": "box", "size": [0.2, 2], "center": [x, 0]}
    for name, x in (("l", -0.13), ("r", 0.13))
]
SIDE = 0.1
MASS = 1.0


def box(i: int = 0, height: float = 0.0, **values: Any) -> dict[str, Any]:
    return {
        "name": f"box_{i}",
        "joint": "planar",
        "mass": MASS,
        "inertia": MASS * SIDE**2 / 6.0,
        "shapes": [{"kind": "box", "size": [SIDE, SIDE]}],
        "position": [0, 0.5 * SIDE + height, 0],
        **values,
    }


def scene(
    *bodies: dict[str, Any],
    walls: Any = (FLOOR,),
    rate: float = 1000.0,
    duration: float = 0.2,
    gravity: Any = (0, -9.81),
    **contact: Any,
) -> Scene:
    return Scene.model_validate(
        {
            "name": "made",
            "rate": rate,
            "duration": duration,
            "gravity": gravity,
            "bodies": list(bodies),
            "walls": list(walls),
            "contact": {"forces": "paper"} | contact,
        }
    )


def stack(n: int, **values: Any) -> Scene:
    return scene(*(box(i, SIDE * i) for i in range(n)), **values)


# Friction (6), sliding and rocking together: tᵀ(J M⁻¹ Jᵀ)t of two corners with N/2 each is (1/m +
# h²/I) N.
SLOWEST = 0.5 * 0.5 * 9.81 * 2.5 * 1e-3
BALL = SpatialScene.model_validate(
    {
        "name": "made",
        "dimensions": 3,
        "rate": 1000,
        "duration": 0.2,
        "integrator": "semi_implicit_euler",
        "bodies": [
            {
                "name": "ball",
                "joint": "free_flyer",
                "mass": 0.5,
                "inertia": [1e-3] * 3,
                "position": [0, 0, 1, 0, 0, 0, 1],
                "shapes": [{"kind": "sphere", "radius": 0.05}],
            }
        ],
        "walls": [{"name": "floor", "kind": "half_space", "point": [0, 0, 0], "normal": [0, 0, 1]}],
    }
)
DOOR = {
    "name": "door",
    "joint": "prismatic",
    "axis": [0, 1],
    "mass": 1,
    "joint_limits": [-0.1, 0.1],
}

# scene, kinds of warnings in their order, what the last one says, values each of which silences
# them
WARNED: dict[str, tuple[Scene, list[str], list[str], list[dict[str, Any]]]] = {
    "too stiff": (
        scene(box(height=0.15), stiffness=1e9),
        ["stiffness"],
        ["<= 330000", "rate >= 55000 Hz"],
        [{"contact.stiffness": 330000.0}, {"rate": 55000.0}],
    ),
    "too much damping": (
        scene(box(), stiffness=1e4, damping=2000.0),
        ["damping"],
        ["<= 660", "rate >= 3100 Hz"],
        [{"contact.damping": 660.0}, {"rate": 3100.0}],
    ),
    "sag": (
        stack(5),
        ["sag"],
        [f"{1e3 * 5 * MASS * 9.81 / 2000.0:.3g} mm", ">= 2500"],
        [{"contact.stiffness": 2500.0}],
    ),
    "sag of a joint": (
        scene(DOOR, stiffness=100.0),
        ["sag"],
        ["by 0.49", ">= 500", "lower limit of door"],
        [{"contact.stiffness": 500.0}, {"bodies.door.joint_limits": [-1.0, 1.0]}],
    ),
    "friction (6)": (
        scene(box(), stiffness=1e4, friction=0.5),
        ["friction"],
        [f">= {math.ceil(1e4 * SLOWEST) / 1e4:g}"],
        [{"contact.friction_velocity": 1.01 * SLOWEST}, {"contact.forces": "implicit"}],
    ),
    "behind": (
        scene(box(height=-5.0), stiffness=1e4),
        ["overlap"],
        ["[0, 5] m"],
        [{"bodies.box_0.position": [0, 0.05, 0]}],
    ),
    "inside": (
        scene(box(height=-0.03), stiffness=1e4),
        ["overlap"],
        ["[0, 0.03] m"],
        [{"bodies.box_0.position": [0, 0.0496, 0]}],
    ),
    "wedged": (
        scene(box(height=-0.05), walls=SIDES, stiffness=1e4),
        ["overlap", "overlap", "wedged"],
        ["40 mm"],
        [{"walls.l.center": [-0.151, 0.0], "walls.r.center": [0.151, 0.0]}],
    ),
    "held inside": (
        scene(box(joint="prismatic", axis=[0, 1], position=[0.0]), walls=[POST], stiffness=1e4),
        ["overlap"],
        ["no joint can move it out"],
        [{"walls": []}],
    ),
    "fast": (
        scene(box(height=0.5, velocity=[0, -100.0, 0]), walls=[PLATE], stiffness=1e4),
        ["fast"],
        ["100 m/s", "rate >= 8100 Hz"],
        [
            {"bodies.box_0.velocity": [0, -10.0, 0]},
            {"rate": 8100.0},
            {"contact.forces": "implicit"},  # it strikes at the touch
        ],
    ),
    "faster than a step is searched": (
        scene(box(height=0.5, velocity=[0, -2000.0, 0]), walls=[PLATE], forces="implicit"),
        ["fast"],
        ["2e+03 m/s"],
        [{"bodies.box_0.velocity": [0, -100.0, 0]}],
    ),
    "fast tool": (
        scene(
            box(height=0.5, velocity=[0, -100.0, 0]), walls=[PLATE], forces="implicit"
        ).with_values(
            {
                "hand": {"body": "box_0"},
                "couplings": {"four_channel": {"stiffness": [0.0] * 3, "damping": [0.0] * 3}},
            }
        ),
        ["fast"],
        ["rate >= 8100 Hz"],
        [{"bodies.box_0.velocity": [0, -10.0, 0]}],
    ),
    "inertia": (
        scene(box(height=0.15, inertia=1e-5), forces="implicit"),
        ["inertia"],
        ["0.006 times"],
        [{"bodies.box_0.inertia": 1e-3}],
    ),
    "implicit in space": (
        BALL,
        ["integrator"],
        ["gain energy with the integrator semi_implicit_euler"],
        [{"integrator": "momentum"}, {"contact.forces": "paper"}, {"walls": []}],
    ),
}


@pytest.mark.parametrize("name", WARNED)
def test_each_fault_is_named_with_what_helps_and_that_helps(name: str) -> None:
    made, kinds, said, remedies = WARNED[name]
    found = check_scene(made)
    assert [caution.kind for caution in found] == kinds
    assert all(text in found[-1].text for text in said), found[-1].text
    for values in remedies:
        assert not check_scene(made.with_values(values)), values


@pytest.mark.parametrize(
    "made", [load_scene(find_scene(name)) for name in scene_names()], ids=scene_names()
)
def test_shipped_scenes_get_no_warning(made: Scene) -> None:
    assert not check_scene(made)


def test_a_law_hears_nothing_of_what_it_does_not_use() -> None:
    rigid: Any = SimpleNamespace(uses={"impulses"})
    assert not check_scene(WARNED["too stiff"][0], rigid)


# Limits of the step


@pytest.mark.parametrize("damping", [0.0, 50.0, 150.0])
def test_the_step_holds_k_plus_2b_up_to_4_at_the_lightest_mode_of_a_box_on_two_corners(
    damping: float,
) -> None:
    """Rocking: J M⁻¹ Jᵀ of two corners has the eigenvalue 2 a²/I = 3/m, a half a side; k ≤ 1 for
    what meets."""
    limits = step_limits(Start(scene(box(), damping=damping, stiffness=1e4)))
    dt = 1e-3
    mobility = 3.0 / MASS
    assert limits is not None and limits.mass == pytest.approx(MASS / 3.0)
    expected = min(1.0, 4.0 - 2.0 * damping * mobility * dt) / (mobility * dt**2)
    assert limits.stiffness == pytest.approx(expected, rel=1e-6)
    assert limits.damping == pytest.approx(
        (4.0 - 1e4 * mobility * dt**2) / (2.0 * mobility * dt), rel=1e-6
    )


def test_in_a_stack_all_contacts_swing_together() -> None:
    """Heaving of n boxes on springs 2K: the largest eigenvalue of 2/m tridiag(−1, 2, −1), free end;
    rocking 3/2."""
    heave = 2.0 / MASS * (2.0 + 2.0 * math.cos(2.0 * math.pi / 11))
    assert Start(stack(5)).critical[0][0] == pytest.approx(3.0 / 2.0 * heave, rel=1e-6)


@pytest.mark.parametrize(
    ("moments", "kinds"),
    [([1e-3, 1e-3, 1e-2], ["inertia"]), ([1e-3, 1e-3, 2e-3], []), ([0.0, 1e-3, 1e-3], [])],
)
def test_moments_of_inertia_that_no_body_has_are_named(moments, kinds) -> None:
    body = {"name": "ball", "joint": "revolute", "mass": 0.5, "inertia": moments, "axis": [0, 0, 1]}
    spatial = {"name": "made", "dimensions": 3, "rate": 1000, "duration": 0.1, "bodies": [body]}
    assert [one.kind for one in check_scene(SpatialScene.model_validate(spatial))] == kinds


# Degrees


def test_angles_in_degrees_are_named_with_their_place_and_radians_are_not(tmp_path) -> None:
    path = tmp_path / "turned.yaml"
    path.write_text(
        """name: turned
rate: 1000
duration: 0.1
bodies:
  - {name: box, joint: planar, mass: 1, inertia: 0.01, position: [0, 0.3, 45],
     shapes: [{kind: box, size: [0.1, 0.1], angle: -30}]}
  - {name: arm, joint: revolute, mass: 1, inertia: 0.01, position: [10], joint_limits: [-90, 20]}
walls:
  - {name: block, kind: box, size: [1, 0.1], center: [0, -1], angle: 7}
""",
        encoding="utf-8",
    )
    found = [one for one in check_scene(load_scene(path)) if one.kind == "degrees"]
    assert {one.text.partition(": ")[0].rpartition(":")[0]: one.where for one in found} == {
        f"{path}:5": "bodies[0].position[2]",
        f"{path}:6": "bodies[0].shapes[0].angle",
        f"{path}:7": "bodies[1].joint_limits[0]",
        f"{path}:9": "walls[0].angle",
    }
    assert any("set 0.785398" in one.text for one in found)
    for angle, kinds in ((6.0, []), (-math.tau, []), (12.3, []), (90, ["degrees"])):
        assert [one.kind for one in check_scene(scene(box(position=[0, 1, angle])))] == kinds
