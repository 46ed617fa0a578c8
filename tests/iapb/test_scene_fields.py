"""Friction by body and pair, a hand's force over time, damping and limits of joints: each against a
law of its own."""

from __future__ import annotations

import gc
import math
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from iapb.advice.checks import check_scene
from iapb.contact.laws import INTEGRATORS, ImpulseAugmented, Penalty
from iapb.errors import IapbError
from iapb.numerics.elementary import sine_cosine
from iapb.scene import Scene, find_scene, load_scene, scene_from_text
from iapb.scene.expressions import function_of, syntax_tree
from iapb.simulation import Simulation, simulate
from iapb.system import System
from tests.iapb.contact.paper import scene_of

PEG = load_scene(find_scene("peg_corner"))

# Friction


@pytest.mark.parametrize(
    ("peg", "floor", "general", "expected"),
    [
        (0.2, 0.8, 0.3, 0.4),
        (0.25, None, 0.7, 0.25),
        (0.0, 0.9, 0.5, 0.0),
    ],
)
def test_of_two_values_the_geometric_mean_counts(
    peg: float | None, floor: float | None, general: float, expected: float
) -> None:
    system = System(
        PEG.with_values(
            {"bodies.peg.friction": peg, "walls.floor.friction": floor, "contact.friction": general}
        )
    )
    _, found = system.surfaces.by_pair(system.pairs)  # right wall, floor
    assert found == pytest.approx([general if peg is None else peg, expected], rel=1e-15)


# The hand's force over time

TABLE = [[0.1, 0.0, 0.0, 0.0], [0.2, 1.0, -2.0, 0.1], [0.4, 3.0, 0.0, 0.0]]


def pushed(**values: Any) -> Scene:
    return PEG.with_values({"rate": 1000.0, "duration": 1.2, "hand.force": [0, 0, 0]} | values)


def test_a_table_is_linear_between_its_rows_and_constant_outside() -> None:
    forces = np.array(
        [
            *map(
                pushed(**{"hand.force_table": TABLE}).hand.force_at,
                [0.0, 0.1, 0.15, 0.2, 0.3, 0.4, 9.0],
            )
        ]
    )
    expected = [
        [0, 0, 0],
        [0, 0, 0],
        [0.5, -1, 0.05],
        [1, -2, 0.1],
        [2, -1, 0.05],
        [3, 0, 0],
        [3, 0, 0],
    ]
    assert np.allclose(forces, expected, rtol=1e-14, atol=1e-15)


def test_the_record_has_the_force_of_each_steps_middle_and_steps_alone_give_the_same_bits() -> None:
    scene = pushed(
        **{
            "hand.force_table": TABLE,
            "hand.force_function": ["0.1*sin(2*pi*t)", 0, "step(t - 0.5)/100"],
        }
    )
    run = simulate(scene, ImpulseAugmented())
    alone = Simulation(scene)
    expected = np.array(
        [*map(scene.hand.force_at, ((np.arange(run.steps) + 0.5) * run.dt).tolist())]
    )
    assert np.array_equal(
        run.hand_force, expected
    )  # the peg's coordinates are the hand's axes; three chunks
    states = np.array([alone.step().q for _ in range(700)])
    assert np.array_equal(states, run.q[1:701])
    alone.step(hand_force=[0.0, 0.0, 0.0])
    assert not alone.port.hand_force.any()  # what the caller says stays
    alone.step()
    assert not alone.port.hand_force.any()


def test_functions_are_arithmetic_alone() -> None:
    f = function_of(
        "2*sin(3*t) + cos(t)**2 - exp(-t)/max(t, 1) + abs(-pi) + sqrt(4) + step(t - 0.7)"
    )
    expected = 2 * math.sin(2.1) + math.cos(0.7) ** 2 - math.exp(-0.7) + math.pi + 3.0
    assert f(0.7) == pytest.approx(expected, rel=1e-15)
    assert (function_of("sin(t)")(1e6), function_of("cos(t)")(1e6)) == sine_cosine(
        1e6
    )  # the same bits everywhere
    with pytest.raises(IapbError, match=r"no value at t = 0\.5"):
        function_of("1/(t - 0.5)")(0.5)


def test_threads_that_take_turns_while_they_read_expressions_do_not_disturb_each_other() -> None:
    """What the collector calls lets them take turns: dask has such a callback."""

    def take_turns(phase: str, info: Any) -> None:
        time.sleep(0.0)

    sources = [f"[{'(t + 1) * sin(t), ' * 20}{number}]" for number in range(50)]
    threshold = gc.get_threshold()
    gc.callbacks.append(take_turns)
    gc.set_threshold(20)
    try:
        with ThreadPoolExecutor(2) as threads:
            trees = list(threads.map(syntax_tree, sources + sources))
    finally:
        gc.set_threshold(*threshold)
        gc.callbacks.remove(take_turns)
    assert [len(tree.body[0].value.elts) for tree in trees] == [21] * 100


def test_a_force_that_stops_being_a_number_ends_the_run_with_its_reason() -> None:
    run = simulate(pushed(**{"hand.force_function": ["sqrt(0.9 - t)", "0", "0"]}))
    assert not run.complete and "sqrt(0.9 - t) has no value at t = 0.9005" in run.stopped


# Joints


@pytest.mark.parametrize("damping", [0.0, 0.3, 1e3, 1e9])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_damping_is_backward_euler_for_any_damping(damping: float, integrator: str) -> None:
    """A rod on a hinge, without gravity: 0.1 kg m2 about it, turning at 2 rad/s."""
    rod = {
        "name": "rod",
        "joint": "revolute",
        "mass": 1.0,
        "inertia": 0.1,
        "velocity": [2.0],
        "joint_damping": damping,
    }
    run = simulate(scene_of([rod], [], duration=0.5), ImpulseAugmented(integrator=integrator))
    expected = 2.0 * (1.0 + 1e-3 * damping / 0.1) ** -np.arange(501.0)
    assert run.v[:, 0] == pytest.approx(expected, rel=1e-9, abs=1e-300)
    assert (np.diff(run.energy["kinetic"]) <= 0.0).all() and run.energy["friction_work"][-1] <= 0.0
    assert not run.distrust


# A motor of little inertia that carries a heavy arm, under gravity.
LOADED = scene_from_text("""
name: arm
rate: 1000
gravity: [0, -9.81]
duration: 2
bodies:
  - {name: motor, joint: revolute, mass: 1, inertia: 4.5e-4, center_of_mass: [0, 0], joint_limits: [-0.2, 0.2]}
  - {name: arm, parent: motor, joint: fixed, mass: 2, inertia: 0.05, center_of_mass: [0.5, 0]}
contact: {stiffness: 1e4, damping: 100}
""")


@pytest.mark.parametrize("law", [ImpulseAugmented(), Penalty()])
def test_a_limit_holds_all_that_its_joint_carries(law: Any) -> None:
    """The stop turns by the torque over K r², r the radius of gyration of motor and arm."""
    run = simulate(LOADED, law)
    assert not check_scene(LOADED, law) and not run.distrust
    sag = 2.0 * 9.81 * 0.5 * math.cos(0.2) / (1e4 * (4.5e-4 + 0.05 + 2.0 * 0.5**2) / 3.0)
    assert run.q[-1, 0] == pytest.approx(-0.2 - sag, abs=0.02 * sag)


# A tilted, moving base carries a turning link and a sliding one.
CRANE = scene_from_text("""
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


@pytest.mark.parametrize(("law", "late"), [(ImpulseAugmented(), 0.02), (Penalty(), 0.05)])
def test_limits_hold_in_space_for_turning_and_sliding_joints(law: Any, late: float) -> None:
    """Springs alone stop late."""
    run = simulate(CRANE, law)
    low, high = np.array([body.joint_limits for body in CRANE.bodies]).T
    beyond = np.maximum(low - run.q, run.q - high)
    assert 0.0 < beyond.max() < late and (beyond > -0.05).any(axis=0).all()
    # a stop has no friction, whatever contact.friction says
    assert not run.distrust and not run.contacts.friction_force.any()
    alone = simulate(CRANE.with_values({"contact.self_collision_rows": "per_body"}), law)
    assert np.array_equal(run.q, alone.q)  # rows of one body alone are not used at stops
