"""The rigid world on scenes: every scheme runs, friction stops the box where the textbook says."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.errors import ArgumentError, SolverError
from iapb.run import COLLIDING, FREE, RESTING
from iapb.scene import Scene, SpatialScene, find_scene, load_scene, scene_from_text
from iapb.simulation import simulate
from iapb.system import System
from reference import rigid_step, time_stepping
from reference.contact_rows import find_rows, mechanics_of
from reference.rigid_step import friction_step
from reference.time_stepping import RigidConstraints, cost_of
from reference.worlds import run_world

SCENES = (
    "peg_corner", "peg_hole", "newton_cradle", "box_stack", "three_link_arm_elastic", "arm_obstacles", "peg_hole_space",
    "tumbling_body",
)  # fmt: skip
FLOOR = """
name: on_the_floor
dimensions: 3
rate: 1000
duration: 1
gravity: [0, 0, -9.81]
bodies:
  - name: body
    joint: free_flyer
    mass: 1
    inertia: [4e-4, 4e-4, 4e-4]
    shapes: [%s]
    position: [0, 0, %s, 0, 0, 0, 1]
    velocity: [0.3, 0.4, 0, 0, 0, 0]
walls: [{name: floor, kind: half_space, point: [0, 0, 0], normal: [0, 0, 1]}]
contact: {restitution: 0, friction: 0.6, stiffness: 1e4, damping: 0, friction_velocity: 1e-2}
"""
BOX = FLOOR % ("{kind: box, size: [0.2, 0.2, 0.02]}", 0.01)
BALL = FLOOR % ("{kind: sphere, radius: 0.0316227766}", 0.0316227766)  # 2/5 m r² = 4e-4 kg m²


@pytest.mark.parametrize("scheme", ["moreau", "stewart-trinkle"])
@pytest.mark.parametrize("name", SCENES)
def test_every_scheme_runs_and_says_what_it_is(name: str, scheme: str) -> None:
    run = simulate(load_scene(find_scene(name)), RigidConstraints(scheme=scheme, stabilization=0.2), steps=120)
    assert run.complete and np.isfinite(run.q).all()
    assert run.law == "rigid constraints" and run.law_settings["scheme"] == scheme


def test_a_tight_elastic_hole_does_not_end_the_run() -> None:
    """Walls that face one another with e > 0: Newton's law has no solution, the step takes Poisson's."""
    scene = load_scene(find_scene("peg_hole")).with_values({"contact.restitution": 0.5})
    run = simulate(scene, RigidConstraints(), steps=400)
    assert run.complete and np.abs(run.v).max() < 1.0


@pytest.mark.parametrize("friction", ["coulomb", "relaxed"])
def test_a_box_slides_straight_in_space_and_stops_where_the_textbook_says(friction: str) -> None:
    """v²/(2 μ g) = 21 mm along (0.6, 0.8); the relaxed law throws it up, at μ v at most."""
    run = simulate(scene_from_text(BOX), RigidConstraints(friction=friction), steps=110)
    expected, near = 0.5**2 / (2.0 * 0.6 * 9.81), {"coulomb": 1e-3, "relaxed": 2e-3}[friction]
    assert run.complete and run.q[-1, :2] == pytest.approx(expected * np.array([0.6, 0.8]), abs=near)
    assert np.abs(run.v[-1]).max() < 2e-2
    assert run.q[:, 2].max() <= 0.01 + {"coulomb": 1e-9, "relaxed": (0.6 * 0.5) ** 2 / (2.0 * 9.81)}[friction]


@pytest.mark.parametrize(("friction", "expected"), [("coulomb", 5.0 / 7.0), ("none", 1.0)])
def test_a_ball_slides_until_it_rolls_at_five_sevenths_of_its_speed(friction: str, expected: float) -> None:
    """After 2 v/(7 μ g) = 24 ms, to the 1 % that it turns in a step. Without friction it never rolls: the fault."""
    run = simulate(scene_from_text(BALL), RigidConstraints(friction=friction), steps=40)
    assert np.hypot(*np.diff(run.q[-2:, :2], axis=0)[0]) * 1000.0 == pytest.approx(0.5 * expected, rel=1e-2)
    rolling = np.linalg.norm(run.v[-1, 3:]) * 0.0316227766
    assert rolling == pytest.approx(0.5 * expected if friction != "none" else 0.0, rel=1e-2)


@pytest.mark.parametrize("size", [2, 3])
def test_friction_never_leaves_its_cone_and_leaves_no_contact_closing(size: int) -> None:
    """Contacts left out of the solved problem are those that the answer does not close."""
    rng = np.random.default_rng(size)
    for _ in range(20):
        rows = rng.normal(size=(6, size, 5))
        bound, v_free = rng.normal(size=6) * 0.1 - 0.3, rng.normal(size=5)
        v, normal, tangential = friction_step(np.eye(5), v_free, rows[:, 0], rows[:, 1:], bound, 0.4)
        assert (rows[:, 0] @ v - bound).min() >= -1e-6 * np.abs(v_free).max()
        assert (np.linalg.norm(tangential, axis=1) <= 0.4 * normal + 1e-9).all()
        change = np.einsum("ck,ckd->d", np.column_stack([normal, tangential]), rows)
        assert v - v_free == pytest.approx(change, abs=1e-9)


def test_contacts_without_a_common_body_are_solved_apart() -> None:
    rng = np.random.default_rng(5)
    parts, v_free, rows = rng.normal(size=(2, 3, 3, 6)), rng.normal(size=12), np.zeros((6, 3, 12))
    rows[::2, :, :6], rows[1::2, :, 6:] = parts
    v, normal, _ = friction_step(np.eye(12), v_free, rows[:, 0], rows[:, 1:], np.zeros(6), 0.3)
    for part, at in zip(parts, (slice(0, 6), slice(6, 12)), strict=True):
        alone, _, _ = friction_step(np.eye(6), v_free[at], part[:, 0], part[:, 1:], np.zeros(3), 0.3)
        assert v[at] == pytest.approx(alone, abs=1e-9)
    assert (normal > 0.0).any()


def test_a_step_without_solution_says_how_many_contacts_it_had(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rigid_step, "FRICTION_TOLERANCE", -1.0)
    monkeypatch.setattr(rigid_step, "CONVERGED", -1.0)
    with pytest.raises(SolverError, match="1 contacts.*nsgs.*cvxpy_socp"):
        friction_step(np.eye(2), np.array([0.3, -1.0]), np.eye(2)[1:], np.eye(2)[None, :1], np.zeros(1), 0.5)


@pytest.mark.parametrize("wrong", [{"scheme": "euler"}, {"friction": "viscous"}])
def test_unknown_schemes_and_friction_laws_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ArgumentError, match=next(iter(wrong))):
        RigidConstraints(**wrong)


def test_the_parts_of_a_step_add_up_to_the_change_of_momentum_and_the_peg_comes_to_rest() -> None:
    system = System(load_scene(find_scene("peg_corner")))
    state, force, dt, law = system.make_state(), np.array([-3.2, 4.0, 0.0]), 1.0 / 512, RigidConstraints()
    mass, deepest, states = mechanics_of(system).mass_matrix(state.q), 0.0, set()
    for _ in range(1500):
        before = state.v.copy()
        result = law.advance(system, state, force, dt)
        change = dt * (force + result.penalty_force + result.friction_force) + result.impulse
        assert np.abs(mass @ (result.v - before) - change).max() <= 1e-12
        assert (result.state == COLLIDING) == bool(state.impacts.logged[0])
        state.q[:], state.v[:] = result.q, result.v
        states.add(result.state)
        deepest = min(deepest, state.contacts.gap[: state.contact_count[0]].min(initial=0.0))
    assert states == {FREE, COLLIDING, RESTING} and deepest >= -1e-4  # corners turn while they touch
    assert np.abs(state.v).max() <= 1e-9 and np.abs(result.penalty_force + force).max() <= 1e-6


def test_an_elastic_peg_keeps_its_energy_over_many_bounces() -> None:
    scene = load_scene(find_scene("peg_corner")).with_values({"contact.restitution": 1.0})
    system = System(scene)
    state, law = system.make_state(), RigidConstraints(margin=0.0)
    state.v[:] = [-0.4, 0.5, 1.0]
    mass, bounces = mechanics_of(system).mass_matrix(state.q), 0
    energy = state.v @ mass @ state.v
    for _ in range(300):
        result = law.advance(system, state, np.zeros(3), 1.0 / 512)
        state.q[:], state.v[:] = result.q, result.v
        bounces += result.state == COLLIDING
    assert bounces >= 2 and state.v @ mass @ state.v == pytest.approx(energy, rel=1e-13)


def test_the_bar_on_two_posts_gains_nothing_and_follows_the_law_of_the_scheme() -> None:
    """Posts with e = 0 and 1, on which equalities end with 12.167 J: Poisson's law loses what the near post stops.

    Newton's law (Moreau's step, both posts closed) lets the far post alone return all: 0.5 J are kept.
    """
    scene = load_scene(find_scene("bar_on_posts"))
    engine = simulate(scene).energy["kinetic"][-1]
    for scheme, expected in (("automatic", engine), ("moreau", 0.5), ("stewart-trinkle", engine)):
        kinetic = simulate(scene, RigidConstraints(scheme=scheme)).energy["kinetic"]
        assert kinetic.max() <= 0.5 * (1.0 + 1e-12) and kinetic[-1] == pytest.approx(expected, rel=1e-3)
    half = simulate(scene.with_values({"walls.far.restitution": 0.5}), RigidConstraints(scheme="moreau"))
    assert half.energy["kinetic"][-1] == pytest.approx(0.40625, rel=1e-3)  # ½ − ½ (1 − e²) γ²/W, W = 4


BALLS = (
    "{name: b%d, joint: prismatic, axis: [1, 0], mass: 1, shapes: [{kind: circle, radius: 0.1}], position: [%g],"
    " velocity: [%g]}"
)


def test_a_blow_through_resting_balls_is_one_impact_and_a_load_elsewhere_is_none() -> None:
    """One of three equal balls strikes two that touch, e = 0: they go on at a third, 1/3 J is lost; two stand apart."""
    line = [BALLS % (k, x, v) for k, (x, v) in enumerate([(0.0, 1.0), (0.2, 0.0), (0.4, 0.0), (5.0, 0.0), (5.2, 0.0)])]
    scene = scene_from_text(
        f"{{name: line, rate: 1000, duration: 0.01, bodies: [{', '.join(line)}], contact: {{restitution: 0}},"
        " hand: {body: b3, force: [3, 0, 0]}}"
    )
    run = simulate(scene, RigidConstraints(), steps=5)
    assert len(run.impacts.step) == 1 and run.impacts.energy_lost[0] == pytest.approx(1.0 / 3.0, rel=1e-12)
    assert run.impacts.v_plus[0, :3] == pytest.approx([1.0 / 3.0] * 3) and not run.impacts.impulse[0, 3:].any()
    assert run.penalty_force[0, 3:] == pytest.approx([-1.5, 1.5], rel=1e-9)  # the pushed pair shares the hand's force


# --- cost ---------------------------------------------------------------------------------------------------------
def row(count: int, space: bool, shape: dict[str, Any]) -> Scene:
    """Bodies of one shape in a row on a floor."""
    kind, inertia, turn = ("free_flyer", [1e-3] * 3, [0.05, 0, 0, 0, 1]) if space else ("planar", 1e-3, [0.0])
    bodies = [{"name": f"b{i}", "joint": kind, "mass": 1.0, "shapes": [shape], "inertia": inertia,
               "position": [0.12 * i, 0.0 if space else 0.05, *turn]} for i in range(count)]
    floor = {"name": "floor", "kind": "half_space" if space else "half_plane", "point": [0] * (2 + space),
             "normal": [0, 0, 1] if space else [0, 1]}
    given = {"name": "row", "rate": 1000.0, "duration": 0.003, "bodies": bodies, "walls": [floor]}
    return (SpatialScene if space else Scene).model_validate(given | ({"dimensions": 3} if space else {}))


CIRCLE, BALL_ = {"kind": "circle", "radius": 0.05}, {"kind": "sphere", "radius": 0.05}
SQUARE, CUBE = {"kind": "box", "size": [0.1, 0.1]}, {"kind": "box", "size": [0.1, 0.1, 0.1]}


@pytest.mark.parametrize(("space", "shape", "most"), [(False, CIRCLE, 1.0), (True, BALL_, 1.0), (False, SQUARE, 1.0),
                                                      (True, CUBE, 2.0)])  # fmt: skip
def test_the_contacts_are_those_of_a_step_or_at_most_twice_as_many(space: bool, shape: Any, most: float) -> None:
    system = System(row(8, space, shape))
    state, cost = system.make_state(), cost_of(system)
    given = len(find_rows(system, state.q, state.v, np.inf).gap)
    assert given <= cost.contacts * 1.3 and cost.contacts <= most * given * 1.2
    assert cost.coordinates == system.mechanism.nv and cost.seconds > 0.0 and not cost.too_large


def test_too_many_are_refused_before_the_first_step(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(time_stepping, "MOST_ENTRIES", 500)
    assert run_world(row(4, False, CIRCLE), "ideal").complete
    for world in ("ideal", "ideal-friction"):
        with pytest.raises(ArgumentError, match=r"at most 500 numbers .* 36 contacts of 24 coordinates have 864"):
            run_world(row(8, False, CIRCLE), world)
