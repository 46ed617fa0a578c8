"""Friction by body and pair, a hand's force over time, damping and limits of joints: each against a law of its own."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from iapb.advice.checks import check_scene
from iapb.contact.laws import ImpulseAugmented, Penalty
from iapb.elementary import sine_cosine
from iapb.errors import IapbError
from iapb.mechanics.integrators import INTEGRATORS
from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene, scene_from_text
from iapb.scene.expressions import function_of
from iapb.scene.mechanism import frictions_of, pairs_of, shapes_of
from iapb.simulation import Simulation, simulate

TILT = math.radians(20.0)
PEG = load_scene(find_scene("peg_corner"))


def on_slope(**values: Any) -> Scene:
    """A box that lies on the floor while gravity is tilted by 20 degrees."""
    box = {"name": "box", "joint": "planar", "mass": 1.0, "inertia": 0.0017, "position": [0, 0.05, 0],
           "shapes": [{"kind": "box", "size": [0.1, 0.1]}]}
    scene = Scene.model_validate({
        "name": "slope", "rate": 1000.0, "duration": 0.3, "bodies": [box],
        "gravity": [9.81 * math.sin(TILT), -9.81 * math.cos(TILT)],
        "walls": [{"name": "floor", "kind": "half_plane", "point": [0, 0], "normal": [0, 1]}],
        "contact": {"forces": "paper", "stiffness": 1e4, "damping": 100.0}})
    return scene.with_values(values)


def slid(scene: Scene, **options: Any) -> float:
    return float(simulate(scene, **options).q[-1, 0])


FREE_SLIDE = 0.5 * 9.81 * math.sin(TILT) * 0.3**2


# Friction


@pytest.mark.parametrize(("box", "floor", "general", "pair"), [
    (0.5, 0.5, 0.0, 0.5), (0.2, 0.8, 0.3, 0.4), (0.25, None, 0.7, 0.25), (None, 0.25, 0.7, 0.25), (0.0, 0.9, 0.5, 0.0),
    (None, None, 0.3, 0.3),
])
def test_of_two_values_the_geometric_mean_counts(
    box: float | None, floor: float | None, general: float, pair: float
) -> None:
    scene = on_slope(**{"bodies.box.friction": box, "walls.floor.friction": floor, "contact.friction": general})
    assert frictions_of(scene).by_pair(pairs_of(scene, shapes_of(scene))) == pytest.approx([pair], rel=1e-15)
    held = slid(on_slope(**{"contact.friction": pair}))
    assert slid(scene) == held  # the same bits as one coefficient for all


def test_a_named_pair_comes_first() -> None:
    pair = {"between": ["floor", "box"], "friction": 0.0}
    values = {"bodies.box.friction": 0.9, "walls.floor.friction": 0.9, "contact.friction_pairs": [pair]}
    assert slid(on_slope(**values)) == pytest.approx(FREE_SLIDE, rel=0.01)
    assert slid(on_slope(**values | {"contact.friction_pairs": []})) < 1e-3


@pytest.mark.parametrize("law", [ImpulseAugmented(friction_in_impacts=True), Penalty()])
def test_friction_of_a_body_acts_in_impacts_and_by_the_papers_law(law: Any) -> None:
    thrown = {"bodies.box.position": [0, 0.08, 0], "bodies.box.velocity": [1.0, -1.0, 0], "contact.friction_law":
              "regularised", "contact.friction_velocity": 0.1}
    own = slid(on_slope(**thrown, **{"bodies.box.friction": 0.3}), law=law)
    assert own == slid(on_slope(**thrown, **{"contact.friction": 0.3}), law=law)
    assert own < 0.99 * slid(on_slope(**thrown), law=law)


# The hand's force over time

TABLE = [[0.1, 0.0, 0.0, 0.0], [0.2, 1.0, -2.0, 0.1], [0.4, 3.0, 0.0, 0.0]]


def pushed(**values: Any) -> Scene:
    return PEG.with_values({"rate": 1000.0, "duration": 1.2, "hand.force": [0, 0, 0]} | values)


def test_a_table_is_linear_between_its_rows_and_constant_outside() -> None:
    forces = np.array(pushed(**{"hand.force_table": TABLE}).hand.forces([0.0, 0.1, 0.15, 0.2, 0.3, 0.4, 9.0]))
    expected = [[0, 0, 0], [0, 0, 0], [0.5, -1, 0.05], [1, -2, 0.1], [2, -1, 0.05], [3, 0, 0], [3, 0, 0]]
    assert np.allclose(forces, expected, rtol=1e-14, atol=1e-15)


def test_the_record_has_the_force_of_each_steps_start_and_steps_alone_give_the_same_bits() -> None:
    scene = pushed(**{"hand.force_table": TABLE, "hand.force_function": ["0.1*sin(2*pi*t)", 0, "step(t - 0.5)/100"]})
    run, alone = simulate(scene, ImpulseAugmented()), Simulation(scene)
    expected = np.array(scene.hand.forces(run.time[:-1]))
    assert np.array_equal(run.hand_force, expected)  # the peg's coordinates are the hand's axes; three chunks
    states = np.array([alone.step().q for _ in range(700)])
    assert np.array_equal(states, run.q[1:701])
    alone.step(hand_force=[0.0, 0.0, 0.0])
    assert not alone.port.hand_force.any()  # what the caller says stays
    alone.step()
    assert not alone.port.hand_force.any()


def test_functions_are_arithmetic_alone() -> None:
    f = function_of("2*sin(3*t) + cos(t)**2 - exp(-t)/max(t, 1) + abs(-pi) + sqrt(4) + step(t - 0.7)")
    expected = 2 * math.sin(2.1) + math.cos(0.7) ** 2 - math.exp(-0.7) + math.pi + 3.0
    assert f(0.7) == pytest.approx(expected, rel=1e-15)
    assert (function_of("sin(t)")(1e6), function_of("cos(t)")(1e6)) == sine_cosine(1e6)  # the same bits everywhere
    with pytest.raises(IapbError, match=r"no value at t = 0\.5"):
        function_of("1/(t - 0.5)")(0.5)


def test_a_force_that_stops_being_a_number_ends_the_run_with_its_reason() -> None:
    run = simulate(pushed(**{"hand.force_function": ["sqrt(0.9 - t)", "0", "0"]}))
    assert not run.complete and "sqrt(0.9 - t) has no value at t = 0.901" in run.stopped


# Joints


def swinging(**values: Any) -> Scene:
    """A rod on a hinge, without gravity: 0.1 kg m2 about it, turning at 2 rad/s."""
    rod = {"name": "rod", "joint": "revolute", "mass": 1.0, "inertia": 0.1, "velocity": [2.0]}
    scene = Scene.model_validate({"name": "rod", "rate": 1000.0, "duration": 0.5, "bodies": [rod],
                                  "contact": {"forces": "paper", "stiffness": 1e4, "damping": 0.0}})
    return scene.with_values(values)


@pytest.mark.parametrize("damping", [0.0, 0.3, 1e3, 1e9])
@pytest.mark.parametrize("integrator", sorted(INTEGRATORS))
def test_damping_is_backward_euler_for_any_damping(damping: float, integrator: str) -> None:
    run = simulate(swinging(**{"bodies.rod.joint_damping": damping}), ImpulseAugmented(integrator=integrator))
    expected = 2.0 * (1.0 + 1e-3 * damping / 0.1) ** -np.arange(501.0)
    assert run.v[:, 0] == pytest.approx(expected, rel=1e-9, abs=1e-300)
    assert (np.diff(run.energy["kinetic"]) <= 0.0).all() and run.energy["friction_work"][-1] <= 0.0
    assert not run.distrust


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_a_joint_bounces_off_its_limit_with_the_restitution(restitution: float) -> None:
    run = simulate(swinging(**{"bodies.rod.joint_limits": [-0.1, 0.2503], "contact.restitution": restitution}))
    met = int(np.argmax(run.v[:, 0] < 1.99))
    assert run.time[met] == pytest.approx(0.2503 / 2.0, abs=2e-3)
    assert run.v[met, 0] == pytest.approx(-2.0 * restitution, abs=0.2 * 1e-3 * 2e3 * 1e-3)
    assert run.q.max() <= 0.2503 + 2.0 * 1e-3
    assert run.contacts.gap.min() == pytest.approx(math.sqrt(0.1) * (0.2503 - run.q[:-1].max()), rel=1e-12)


def test_a_joint_rests_at_its_limit_under_load_and_the_springs_hold_it() -> None:
    scene = swinging(**{"gravity": [0.0, -9.81], "bodies.rod.center_of_mass": [0.3, 0.0], "bodies.rod.velocity": [0.0],
                        "bodies.rod.joint_limits": [-0.2, 1.0], "contact.damping": 100.0, "duration": 2.0})
    run = simulate(scene)
    arm = math.sqrt(0.1 + 0.09)  # radius of gyration of 1 kg
    sag = 9.81 * 0.3 * math.cos(0.2) / arm / 1e4 / arm
    assert run.q[-1, 0] == pytest.approx(-0.2 - sag, abs=0.02 * sag) and abs(run.v[-1, 0]) < 1e-6
    assert not run.distrust and not check_scene(scene)
    assert any("limit of rod" in str(caution) for caution in check_scene(scene.with_values({"contact.stiffness": 1e9})))


def loaded(joint: str, **values: Any) -> Scene:
    """A motor of little inertia that carries a heavy arm, under gravity."""
    limits = ", joint_limits: [-0.1, 0.1]" if joint == "revolute" else ""
    return scene_from_text(f"""
name: arm
rate: 1000
gravity: [0, -9.81]
duration: 2
bodies:
  - {{name: motor, joint: revolute, mass: 1, inertia: 4.5e-4, center_of_mass: [0, 0], joint_limits: [-0.2, 0.2]}}
  - {{name: arm, parent: motor, joint: {joint}, mass: 2, inertia: 0.05, center_of_mass: [0.5, 0]{limits}}}
contact: {{stiffness: 1e4, damping: 100}}
""").with_values(values)


@pytest.mark.parametrize("law", [ImpulseAugmented(), Penalty()])
def test_a_limit_holds_all_that_its_joint_carries(law: Any) -> None:
    """The stop turns by the torque over K r², r the radius of gyration of motor and arm."""
    run = simulate(loaded("fixed"), law)
    assert not check_scene(loaded("fixed"), law) and not run.distrust
    sag = 2.0 * 9.81 * 0.5 * math.cos(0.2) / (1e4 * (4.5e-4 + 0.05 + 2.0 * 0.5**2) / 3.0)
    assert run.q[-1, 0] == pytest.approx(-0.2 - sag, abs=0.02 * sag)


def test_a_limit_that_gives_way_is_said_before_and_after_the_run() -> None:
    scene = loaded("revolute", contact={"forces": "paper", "auto": True})  # a stiffness that the motor alone allows
    (caution,) = check_scene(scene)
    assert caution.kind == "sag" and "limit of arm holds its joint beyond it" in caution.text
    assert any("motor.angle is -0.4" in why and "times their range" in why for why in simulate(scene).distrust)


def test_limits_that_are_not_reached_change_no_bit() -> None:
    scene = load_scene(find_scene("arm_obstacles"))
    names = [body.name for body in scene.bodies if body.joint == "revolute"]
    limited = scene.with_values({f"bodies.{name}.joint_limits": [-50.0, 50.0] for name in names})
    one, other = simulate(scene, steps=300), simulate(limited, steps=300)
    assert np.array_equal(one.q, other.q) and np.array_equal(one.v, other.v)
    assert any(effect.name == "joint_limits" and effect.active for effect in other.effects)


def in_space(**values: Any) -> Scene:
    """A tilted, moving base carries a turning link and a sliding one."""
    scene = scene_from_text("""
name: crane
dimensions: 3
rate: 2000
duration: 1.5
gravity: [0, 0, -9.81]
bodies:
  - {name: mast, joint: revolute, axis: [0.2, 0.1, 1], mass: 2, inertia: [0.1, 0.1, 0.1], velocity: [1.5],
     center_of_mass: [0.1, 0, 0], joint_damping: 0.2, joint_limits: [-1, 0.9]}
  - {name: boom, parent: mast, joint: revolute, axis: [0, 1, 0.3], origin: [0.3, 0, 0.5], rpy: [0.1, 0.2, 0.3], mass: 1,
     inertia: [0.02, 0.02, 0.01], center_of_mass: [0.3, 0, 0], joint_limits: [-0.7, 0.6]}
  - {name: slider, parent: boom, joint: prismatic, axis: [1, 0, 0.1], origin: [0.2, 0, 0], mass: 0.5, velocity: [0.3],
     inertia: [0.001, 0.001, 0.001], joint_damping: 1, joint_limits: [-0.05, 0.2]}
contact: {stiffness: 2e4, damping: 50, friction: 0.4}
""")
    return scene.with_values(values)


def beyond(run: Run, scene: Scene) -> float:
    """Farthest that any coordinate goes past its limits [rad, m]."""
    low, high = np.array([body.joint_limits for body in scene.bodies]).T
    return float(np.maximum(low - run.q, run.q - high).max())


@pytest.mark.parametrize("law", [ImpulseAugmented(), ImpulseAugmented(pushing=True),
                                 ImpulseAugmented(friction_in_impacts=True), Penalty()])
def test_limits_hold_in_space_for_turning_and_sliding_joints(law: Any) -> None:
    scene = in_space()
    run = simulate(scene, law)
    assert 0.0 < beyond(run, scene) < (0.02 if law.impulses else 0.05)  # springs alone stop late
    assert not run.distrust and not run.contacts.friction_force.any()  # a stop has none, whatever contact.friction says
    assert (np.diff(run.energy["impact_loss"]) >= 0.0).all()
    alone = simulate(in_space(**{"contact.self_collision_rows": "per_body"}), law)
    assert np.array_equal(run.q, alone.q)  # rows of one body alone are not used at stops
    free = simulate(scene.with_values({f"bodies.{name}.joint_limits": None for name in ("mast", "boom", "slider")}))
    assert beyond(free, scene) > 0.5
