"""Warnings before a run and distrust after it: each number in closed form, and nothing said of what is right."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from iapb.advice.checks import Start, check_scene, settled, step_limits
from iapb.advice.distrust import distrust_of
from iapb.contact.laws import ImpulseAugmented
from iapb.scene import Scene, SpatialScene, find_scene, load_scene, scene_from_text, scene_names
from iapb.simulation import simulate

FLOOR = {"name": "floor", "kind": "half_plane", "point": [0, 0], "normal": [0, 1]}
SIDE, MASS = 0.1, 1.0
INERTIA = MASS * SIDE**2 / 6.0


def box(i: int = 0, height: float = 0.0, **values: Any) -> dict[str, Any]:
    return {"name": f"box_{i}", "joint": "planar", "mass": MASS, "inertia": INERTIA,
            "shapes": [{"kind": "box", "size": [SIDE, SIDE]}], "position": [0, 0.5 * SIDE + height, 0], **values}


def scene(*bodies: dict[str, Any], walls: Any = (FLOOR,), rate: float = 1000.0, duration: float = 0.2,
          gravity: Any = (0, -9.81), **contact: Any) -> Scene:
    return Scene.model_validate({
        "name": "made", "rate": rate, "duration": duration, "gravity": gravity, "bodies": list(bodies),
        "walls": list(walls), "contact": {"forces": "paper"} | contact})


def kinds(found: Scene) -> set[str]:
    return {caution.kind for caution in check_scene(found)}


@pytest.mark.parametrize("damping", [0.0, 50.0, 150.0])
def test_the_step_holds_k_plus_2b_up_to_4_at_the_lightest_mode_of_a_box_on_two_corners(damping: float) -> None:
    """Rocking: J M⁻¹ Jᵀ of two corners has the eigenvalue 2 a²/I = 3/m, a half a side; k ≤ 1 for what meets."""
    limits, dt, mobility = step_limits(Start(scene(box(), damping=damping, stiffness=1e4))), 1e-3, 3.0 / MASS
    assert limits is not None and limits.mass == pytest.approx(MASS / 3.0)
    expected = min(1.0, 4.0 - 2.0 * damping * mobility * dt) / (mobility * dt**2)
    assert limits.stiffness == pytest.approx(expected, rel=1e-6)
    assert limits.damping == pytest.approx((4.0 - 1e4 * mobility * dt**2) / (2.0 * mobility * dt), rel=1e-6)


def test_angles_in_degrees_are_named_with_their_place_and_radians_are_not(tmp_path) -> None:
    path = tmp_path / "turned.yaml"
    path.write_text("""name: turned
rate: 1000
duration: 0.1
bodies:
  - {name: box, joint: planar, mass: 1, inertia: 0.01, position: [0, 0.3, 45],
     shapes: [{kind: box, size: [0.1, 0.1], angle: -30}]}
  - {name: arm, joint: revolute, mass: 1, inertia: 0.01, position: [10], joint_limits: [-90, 20]}
walls:
  - {name: block, kind: box, size: [1, 0.1], center: [0, -1], angle: 7}
""", encoding="utf-8")
    found = [one for one in check_scene(load_scene(path)) if one.kind == "degrees"]
    lines = path.read_text(encoding="utf-8").splitlines()
    assert {one.where: one.text.partition(": ")[0] for one in found} == {
        name: f"{path}:{line}:{lines[line - 1].index(value) + 1}" for name, line, value in (
            ("bodies[0].position[2]", 5, "45"), ("bodies[0].shapes[0].angle", 6, "-30"),
            ("bodies[1].joint_limits[0]", 7, "-90"), ("walls[0].angle", 9, "7}"))}
    assert any("45 rad looks like degrees: set 0.785398" in one.text for one in found)
    for angle in (1.0, 6.0, -math.tau, math.pi, 7.25, 12.3):  # the last two: a body that has turned before
        assert "degrees" not in kinds(scene(box(position=[0, 1, angle])))
    assert "degrees" in kinds(scene(box(position=[0, 1, 90])))
    solid = box(joint="free_flyer", inertia=[0.1, 0.1, 0.1, 0, 0, 0], rpy=[0, 90, 0], position=[])
    spatial = {"name": "made", "dimensions": 3, "rate": 1000, "duration": 0.1, "bodies": [
        solid | {"shapes": [{"kind": "box", "size": [0.1, 0.1, 0.1]}]}]}
    named = {one.where for one in check_scene(SpatialScene.model_validate(spatial))}
    assert named == {"bodies[0].rpy[1]"}


def test_in_a_stack_all_contacts_swing_together() -> None:
    """Heaving of n boxes on springs 2K: the largest eigenvalue of 2/m tridiag(−1, 2, −1), free end."""
    n = 5
    start = Start(scene(*(box(i, SIDE * i) for i in range(n))))
    heave = 2.0 / MASS * (2.0 + 2.0 * math.cos(2.0 * math.pi / (2 * n + 1)))
    assert start.critical[0][0] == pytest.approx(3.0 / 2.0 * heave, rel=1e-6)  # the same chain, rocking


def test_what_no_damping_makes_stable_under_the_midpoint_rule_is_said() -> None:
    limits = step_limits(Start(scene(box(), damping=0.0)), "midpoint")
    assert limits is not None and limits.stiffness < 1e-3 * MASS / 3.0 / 1e-6


def test_too_stiff_is_said_with_a_stiffness_and_a_rate_that_are_right() -> None:
    made = scene(box(height=0.15), stiffness=1e9)
    (caution,) = check_scene(made)
    assert caution.kind == "stiffness" and "<= 330000" in caution.text and "rate >= 55000 Hz" in caution.text
    assert not check_scene(made.with_values({"contact.stiffness": 330000.0}))
    assert not check_scene(made.with_values({"rate": 55000.0}))
    assert kinds(scene(box(), stiffness=1e4, damping=2000.0)) == {"damping"}


def test_sag_is_the_weight_above_over_two_springs() -> None:
    made = scene(*(box(i, SIDE * i) for i in range(5)))
    (caution,) = check_scene(made)
    assert caution.kind == "sag" and f"{1e3 * 5 * MASS * 9.81 / 2000.0:.3g} mm" in caution.text
    assert not check_scene(made.with_values({"contact.stiffness": 2500.0}))


def test_regularised_friction_is_judged_by_its_limit() -> None:
    """Sliding and rocking together: tᵀ(J M⁻¹ Jᵀ)t of two corners with N/2 each is (1/m + h²/I) N = 2.5 g here."""
    made = scene(box(), stiffness=1e4, friction=0.5, friction_law="regularised")
    (caution,) = check_scene(made)
    least = 0.5 * 0.5 * 9.81 * 2.5 * 1e-3
    assert caution.kind == "friction" and f">= {math.ceil(1e4 * least) / 1e4:g}" in caution.text
    assert not check_scene(made.with_values({"contact.friction_velocity": 1.01 * least}))
    assert not check_scene(made.with_values({"contact.friction_law": "coulomb"}))


@pytest.mark.parametrize(("height", "kind"), [(-5.0, "outside"), (-0.03, "overlap"), (-4e-4, None)])
def test_bodies_that_start_inside_or_behind_a_wall_are_named(height: float, kind: str | None) -> None:
    found = check_scene(scene(box(height=height), stiffness=1e4))
    assert [caution.kind for caution in found] == ([kind] if kind else [])
    assert all(f"move it by [0, {-height:g}] m" in caution.text for caution in found)


def test_a_stack_that_starts_where_its_springs_carry_it_is_no_overlap() -> None:
    assert not check_scene(load_scene(find_scene("box_stack")))


def test_a_body_wider_than_its_gap_is_wedged() -> None:
    walls = [{"name": name, "kind": "box", "size": [0.2, 2], "center": [x, 0]}
             for name, x in (("l", -0.13), ("r", 0.13))]
    found = check_scene(scene(box(height=-0.05), walls=walls, stiffness=1e4))
    assert [caution.kind for caution in found] == ["overlap", "overlap", "wedged"] and "40 mm" in found[-1].text


def test_a_link_that_no_joint_can_move_out_of_a_wall() -> None:
    post = {"name": "post", "kind": "box", "size": [0.2, 0.2], "center": [0, 0]}
    slide = box(height=-0.05, joint="prismatic", axis=[0, 1], position=[0.0])
    found = check_scene(scene(slide, walls=[post | {"size": [0.12, 2.0]}], stiffness=1e4))
    assert any("no joint can move it out" in caution.text for caution in found)


@pytest.mark.parametrize(("speed", "said"), [(-100.0, True), (-10.0, False)])
def test_what_passes_half_a_shape_in_a_step_is_said(speed: float, said: bool) -> None:
    plate = {"name": "plate", "kind": "box", "size": [1.0, 0.05], "center": [0, 0]}
    made = scene(box(height=0.5, velocity=[0, speed, 0]), walls=[plate], stiffness=1e4)
    assert ("fast" in kinds(made)) == said


def test_a_law_without_springs_hears_nothing_of_stiffness() -> None:
    class Rigid:
        name, settings, uses = "rigid", {}, frozenset({"impulses"})

        def advance(self, *_: Any) -> Any:
            raise NotImplementedError

    assert not check_scene(scene(box(height=0.15), stiffness=1e9), Rigid())


@pytest.mark.parametrize("name", scene_names())
def test_shipped_scenes_get_no_warning(name: str) -> None:
    assert not check_scene(load_scene(find_scene(name)))


# contact: auto


def test_auto_chooses_what_the_step_holds_and_what_is_given_stays() -> None:
    text = "name: made\nrate: 1000\nduration: 0.1\ngravity: [0, -9.81]\nbodies:\n  - {name: b, joint: planar, " \
           "mass: 1, inertia: 0.0016666666, shapes: [{kind: box, size: [0.1, 0.1]}], position: [0, 0.2, 0]}\nwalls:\n" \
           "  - {name: floor, kind: half_plane, point: [0, 0], normal: [0, 1]}\n"
    chosen, (said,) = settled(scene_from_text(text + "contact: {forces: paper, auto: true}\n"))
    assert chosen.contact.stiffness == 66000.0 and chosen.contact.damping == 160.0  # 0.2 and 0.5 of m/3 and steps
    assert "stiffness = 66000 N/m" in said and not check_scene(chosen)
    given, (said,) = settled(scene_from_text(
        text + "contact: {forces: paper, auto: true, stiffness: 2000, friction: 0.3}\n"))
    assert given.contact.stiffness == 2000.0 and given.contact.friction == 0.3 and "stiffness" not in said
    lighter = scene_from_text(text + "contact: {forces: paper, auto: true}\n")
    heavier = lighter.with_values({"bodies.b.mass": 2.0, "bodies.b.inertia": 0.003333})
    assert settled(heavier)[0].contact.stiffness == pytest.approx(2 * 66000.0, rel=0.02)
    again = scene_from_text(chosen.source_text)
    assert again == chosen and settled(again) == (again, ())


def test_auto_carries_a_stack_for_a_second_and_the_run_says_what_was_chosen() -> None:
    made = scene(*(box(i, SIDE * i) for i in range(5)), duration=0.3, auto=True)
    run = simulate(made)
    assert run.scene_resolved["contact"]["stiffness"] == settled(made)[0].contact.stiffness
    assert not run.distrust and "contact.auto chose" in run.remarks[0]
    sag = 15.0 * MASS * 9.81 / (2.0 * run.scene_resolved["contact"]["stiffness"])  # of the top box: 5 + 4 + 3 + 2 + 1
    assert np.abs(run.q[-1] - run.q[0]).max() < 1.2 * sag


# After a run


def run_of(made: Scene, law: Any = None) -> Any:
    return simulate(made, law or ImpulseAugmented())


def test_a_run_that_gains_energy_says_so() -> None:
    run = run_of(scene(box(height=0.05), stiffness=1e9, duration=0.2))
    assert any("above start and work" in why for why in run.distrust)
    assert "not to be trusted" in repr(run) and "Not to be trusted" in run._repr_html_()


def ball(position: Any, velocity: Any = (0, 0, 0), radius: float = 0.005) -> dict[str, Any]:
    return {"name": "ball", "joint": "planar", "mass": MASS, "inertia": 1e-3,
            "shapes": [{"kind": "circle", "radius": radius, "center": [0.01, 0]}], "position": position,
            "velocity": velocity}


@pytest.mark.parametrize("turned", [0.0, 0.5, -2.0])
@pytest.mark.parametrize("kind", ["box", "polygon"])
def test_a_ball_that_tunnels_is_not_trusted(kind: str, turned: float) -> None:
    """40 mm in a step, through a plate of 4 mm; beside the plate's end it may pass."""
    corners = [[-0.1, -0.002], [0.1, -0.002], [0.1, 0.002], [-0.1, 0.002]]
    form = {"size": [0.2, 0.004]} if kind == "box" else {"vertices": corners}
    plate = {"name": "plate", "kind": kind, "center": [0.3, 0.2], "angle": turned, **form}
    c, s = math.cos(turned), math.sin(turned)

    def told(along: float) -> list[str]:
        start = [0.3 + c * along - s * 0.1 - 0.01, 0.2 + s * along + c * 0.1, 0.0]  # the circle is 10 mm beside
        run = run_of(scene(ball(start, [40.0 * s, -40.0 * c, 0.0]), walls=[plate], gravity=(0, 0), duration=0.02,
                           stiffness=1e4))  # fmt: skip
        return [why for why in run.distrust if "passes through plate" in why]

    assert told(0.05) and told(0.05)[0].endswith("in the step to 0.003 s") and not told(0.12)


def test_a_ball_that_tunnels_in_space_is_not_trusted() -> None:
    made = {"name": "made", "dimensions": 3, "rate": 1000.0, "duration": 0.02,
            "bodies": [{"name": "ball", "joint": "free_flyer", "mass": 1.0, "inertia": [1e-3, 1e-3, 1e-3],
                        "shapes": [{"kind": "sphere", "radius": 0.005, "center": [0, 0, 0.03]}],
                        "position": [0, 0, 0.13, 1, 0, 0, 0], "velocity": [0, 0, 40.0, 0, 0, 0]}],  # upside down
            "walls": [{"name": "plate", "kind": "box", "size": [0.2, 0.2, 0.004], "rpy": [0.2, 0.1, 0.3]}],
            "contact": {"forces": "paper", "stiffness": 1e4}}  # fmt: skip
    assert any("passes through plate" in why for why in run_of(SpatialScene.model_validate(made)).distrust)


@pytest.mark.parametrize(("wide", "said"), [(0.07, True), (0.0602, False)])
def test_a_ball_that_falls_through_a_gap_too_narrow_for_it_is_not_trusted(wide: float, said: bool) -> None:
    walls = [{"name": name, "kind": "box", "size": [0.2, 4], "center": [x, 0]}
             for name, x in (("l", -0.13), ("r", 0.13))]
    run = run_of(scene(ball([-0.01, 1.0, 0.0], radius=0.5 * wide), walls=walls, stiffness=1e4, duration=0.4))
    assert any("narrower than it" in why for why in run.distrust) == said


def test_a_run_that_is_right_is_trusted_and_each_reason_is_found_in_its_arrays() -> None:
    run = run_of(scene(box(height=0.01), stiffness=1e4, duration=0.1))
    assert run.distrust == distrust_of(run) == () and len(repr(run)) < 160
    gained = run.energy["kinetic"] + np.linspace(0.0, 1.0, run.steps + 1)
    assert "above start" in distrust_of(replace(run, energy=run.energy | {"kinetic": gained}))[0]
    driven = np.linspace(0.0, 1.0, run.steps)
    assert "friction drove" in distrust_of(replace(run, energy=run.energy | {"friction_work": driven}))[0]
    deep = replace(run.contacts, gap=run.contacts.gap - 0.51 * SIDE)
    assert "more than half of 100 mm" in distrust_of(replace(run, contacts=deep))[0]
    far = run.q.copy()
    far[-1, 0] = 1e3
    assert "can be explained" in distrust_of(replace(run, q=far))[0]
    far[-1, 0] = np.nan
    assert distrust_of(replace(run, q=far)) == ("positions or velocities are not finite",)


@pytest.mark.parametrize(("values", "warned"), [
    ({}, True), ({"contact.friction": 0.0}, False), ({"bodies.box_0.velocity": [0.0, 0.0, 0.0]}, False),
    ({"bodies.box_0.position": [0.0, 0.05, 0.0]}, False), ({"bodies.box_0.friction": 0.0}, False),
    ({"hand": {"body": "box_0"}}, False),
])
def test_a_body_that_lands_sliding_needs_friction_in_its_impacts(values: dict[str, Any], warned: bool) -> None:
    thrown = box(height=0.1, velocity=[1.0, 0.0, 0.0])
    made = scene(thrown, duration=0.4, stiffness=1e4, friction=0.5, restitution=0.5).with_values(values)
    assert ("impact friction" in kinds(made)) == warned
    assert not {c.kind for c in check_scene(made, ImpulseAugmented(friction_in_impacts=True))} & {"impact friction"}
    if not values:
        (said,) = (caution.text for caution in check_scene(made) if caution.kind == "impact friction")
        assert "meet at 1.4 m/s and slide at 1 m/s" in said
        paper, rough = simulate(made).q[-1, 0], simulate(made, ImpulseAugmented(friction_in_impacts=True)).q[-1, 0]
        assert paper - rough > 0.05 * SIDE  # so much farther it goes without


def in_gap(wide: float, **contact: Any) -> Scene:
    """A box between two walls that stand apart by less or more than its side."""
    walls = [{"name": name, "kind": "box", "size": [0.5, 1.0], "center": [side * (0.25 + 0.5 * wide), 0.0]}
             for name, side in (("left", -1.0), ("right", 1.0))]
    return scene(box(height=-0.5 * SIDE), walls=walls, duration=0.5, stiffness=1e4, damping=50.0, **contact)


@pytest.mark.parametrize(("wide", "said"), [(0.06, True), (0.095, False), (0.11, False)])
def test_a_box_that_falls_through_a_gap_too_narrow_for_it_is_not_trusted(wide: float, said: bool) -> None:
    run = simulate(in_gap(wide))
    assert run.q[-1, 1] < -SIDE
    assert any("in a gap that is 40 mm narrower" in why for why in run.distrust) == said
    held = simulate(in_gap(wide, friction=0.5))
    assert not any("narrower" in why for why in held.distrust)  # friction holds it there, or it has room


# contact.resting_start


def on_slope(**values: Any) -> Scene:
    """A box of 1 kg on a slope of 20 degrees, its face on it; gravity turns instead of the floor."""
    tilt = math.radians(20.0)
    made = scene(box(), stiffness=1e4, damping=100.0, friction=0.5, duration=10.0,
                 gravity=[9.81 * math.sin(tilt), -9.81 * math.cos(tilt)])
    return made.with_values(values)


def test_a_box_that_sticks_tilts_on_its_springs_and_no_more() -> None:
    """The lower edge carries more: the springs' tilt moves the centre, by statics, while the edges stay."""
    run = simulate(on_slope())
    tilt = -9.81 * math.sin(math.radians(20.0)) * 0.5 * SIDE / (2.0 * 1e4 * (0.5 * SIDE) ** 2)
    x, y, theta = (run.q[:, k] - run.q[0, k] for k in range(3))
    assert theta[-1] == pytest.approx(tilt, rel=0.02)
    edges = [x - 0.5 * SIDE * -np.sin(theta) + side * 0.5 * SIDE * (np.cos(theta) - 1.0) for side in (-1.0, 1.0)]
    assert max(np.abs(edge).max() for edge in edges) < 1e-4 * 0.5  # sticking: below 0.1 mm in 10 s
    assert abs(x[-1]) > 1e-4  # its centre is what moves so far


def test_from_a_resting_start_it_moves_by_less_than_a_micrometre_in_ten_seconds() -> None:
    run = simulate(on_slope(**{"contact.resting_start": True}))
    assert np.abs(run.q - run.q[0]).max() < 1e-6
    assert "contact.resting_start moved what touches by up to 0.003" in run.remarks[0]
    assert run.scene_resolved["contact"]["resting_start"] is False  # the record has the start that was used
    again = simulate(scene_from_text(run.scene_source))
    assert np.array_equal(again.q, run.q)


def test_a_stack_starts_with_the_sag_of_its_weights() -> None:
    made = scene(*(box(i, SIDE * i) for i in range(3)), stiffness=1e4, damping=50.0, friction=0.3, duration=1.0)
    run = simulate(made.with_values({"contact.resting_start": True}))
    assert np.abs(run.q - run.q[0]).max() < 1e-8
    weights = 9.81 / 2e4 * np.cumsum([3.0, 2.0, 1.0])
    assert run.q[0, 1::3] - (np.arange(3) + 0.5) * SIDE == pytest.approx(-weights, rel=1e-6)
    assert np.abs(simulate(made).q[-1] - run.q[-1]).max() < 1e-5


def test_a_ball_in_space_and_a_box_on_four_corners_rest() -> None:
    bodies = [{"name": "ball", "joint": "free_flyer", "mass": 2.0, "inertia": [1e-3] * 3,
               "shapes": [{"kind": "sphere", "radius": 0.05}], "position": [1.0, 0, 0.05, 0, 0, 0, 1]},
              {"name": "cube", "joint": "free_flyer", "mass": 1.0, "inertia": [1e-3] * 3,
               "shapes": [{"kind": "box", "size": [0.1] * 3}], "position": [0, 0, 0.05, 0, 0, 0, 1]}]
    floor = {"name": "floor", "kind": "half_space", "point": [0, 0, 0], "normal": [0, 0, 1]}
    run = simulate(SpatialScene.model_validate({
        "name": "made", "dimensions": 3, "rate": 1000.0, "duration": 0.5, "gravity": [0, 0, -9.81], "bodies": bodies,
        "walls": [floor], "integrator": "semi_implicit_euler",
        "contact": {"forces": "paper", "stiffness": 1e4, "damping": 20.0, "friction": 0.4, "resting_start": True}}))
    assert run.q[0, [2, 9]] - 0.05 == pytest.approx([-2.0 * 9.81 / 1e4, -9.81 / 4e4], rel=1e-6)
    assert np.abs(run.q - run.q[0]).max() < 1e-8


@pytest.mark.parametrize(("values", "why"), [
    ({"contact.friction": 0.2}, "slide, tip or fall"), ({"bodies.box_0.velocity": [0.1, 0, 0]}, "moves"),
    ({"bodies.box_0.position": [0, 0.5, 0]}, "nothing touches"), ({"contact.stiffness": 0.0}, "no spring"),
    ({"gravity": [9.81, -9.81], "contact.friction": 2.0, "bodies.box_0.shapes": [{"kind": "box", "size": [0.02, 0.1]}]},
     "slide, tip or fall"),
])
def test_what_no_spring_holds_starts_as_given_and_that_is_said(values: dict[str, Any], why: str) -> None:
    given = on_slope(**values)
    found, (said,) = settled(given.with_values({"contact.resting_start": True}))
    assert why in said and "left as given" in said
    assert found.resolved() == given.resolved()
