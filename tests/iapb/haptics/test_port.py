"""Hand, sensors, pulses and actuators of a tool that is the second of two bodies, against plain numpy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.contact.laws import ImpulseAugmented
from iapb.haptics.coupling import FourChannel, UnilateralCoupler
from iapb.haptics.kernels import command, couple, observe_work, shape_impulse
from iapb.scene import find_scene, load_scene, scene_from_text
from iapb.system import System

GAINS = (100.0, 80.0, 0.5), (70.0, 60.0, 0.375)
LIMIT = np.array([3.0, 2.0, 0.1])


def planar_scene(device: str = "", rate: int = 1000) -> Any:
    """A free disc, then a tool that a hand holds off its origin."""
    return scene_from_text(f"""
name: two
rate: {rate}
duration: 1.0
bodies:
  - {{name: disc, joint: planar, mass: 1, inertia: 1, shapes: [{{kind: circle, radius: 0.1}}], position: [5, 0, 0]}}
  - {{name: tool, joint: planar, mass: 2.0, inertia: 0.02, shapes: [{{kind: circle, radius: 0.1}}]}}
contact: {{stiffness: 500, restitution: 0.5}}
hand: {{body: tool, point: [0.03, -0.02], force: [0.3, -0.4, 0.05]}}
device: {{force_limit: [3.0, 2.0, 0.1]{device}}}
""")


def started(device: str = "", coupling: Any = None, rendering: str = "full", rate: int = 1000) -> Any:
    """World, state and port; state and device somewhere at random."""
    system = System(planar_scene(device, rate))
    law, coupling = ImpulseAugmented(rendering=rendering), coupling or FourChannel(*GAINS)
    port = system.make_port(coupling, system.decide(law, coupling))
    world, state, rng = system.world_under(ImpulseAugmented()), system.make_state(), np.random.default_rng(0)
    state.q[3:], port.device_q[:] = rng.uniform(-0.5, 0.5, 3), rng.uniform(-0.5, 0.5, 3)
    state.v[:], port.device_v[:] = rng.uniform(-0.5, 0.5, 6), rng.uniform(-0.5, 0.5, 3)
    return world, state, port, rng


def pushed_at(q: np.ndarray) -> np.ndarray:
    """J_hᵀF_h of the planar tool at (x, y, θ): the force, and its moment about the tool's origin."""
    arm = np.array([[np.cos(q[2]), -np.sin(q[2])], [np.sin(q[2]), np.cos(q[2])]]) @ [0.03, -0.02]
    return np.array([0.3, -0.4, 0.05 + arm[0] * -0.4 - arm[1] * 0.3])


def test_the_hand_pushes_tool_and_device_where_each_of_them_is() -> None:
    world, state, port, _ = started()
    couple(world, state, port)
    assert port.hand_force == pytest.approx([0.0, 0.0, 0.0, *pushed_at(state.q[3:])], abs=1e-15)
    assert port.device_hand_force == pytest.approx(pushed_at(port.device_q), abs=1e-15)
    spring = np.multiply(GAINS[0], port.device_q - state.q[3:]) + np.multiply(GAINS[1], port.device_v - state.v[3:])
    assert port.coupling_force == pytest.approx([0.0, 0.0, 0.0, *spring], abs=1e-13)
    assert port.applied == pytest.approx(port.hand_force + port.coupling_force, abs=0.0)
    port.wrench[:] = 0.0
    couple(world, state, port)
    assert not port.hand_force.any() and not port.device_hand_force.any()


@pytest.mark.parametrize("engaged", [False, True])
def test_through_a_unilateral_coupler_the_hand_reaches_the_tool_only_as_long_as_it_is_off(engaged: bool) -> None:
    world, state, port, _ = started(coupling=UnilateralCoupler(*GAINS))
    port.engaged[0] = engaged
    couple(world, state, port)
    spring = np.multiply(GAINS[0], port.device_q - state.q[3:]) + np.multiply(GAINS[1], port.device_v - state.v[3:])
    assert port.hand_force[3:] == pytest.approx(pushed_at(state.q[3:]), abs=1e-15)
    expected = spring if engaged else pushed_at(state.q[3:])
    assert port.applied == pytest.approx([0.0, 0.0, 0.0, *expected], abs=1e-13)


def test_in_space_the_hand_does_the_work_of_its_wrench_at_the_held_point() -> None:
    """J_hᵀF_h · v = F · v_point + torque · ω for every velocity."""
    scene, rng = load_scene(find_scene("peg_hole_space")), np.random.default_rng(4)
    system = System(scene)
    world, state = system.world_under(ImpulseAugmented()), system.make_state()
    port = system.make_port(FourChannel([10.0] * 6, [1.0] * 6))
    port.wrench[:], port.hand_point[:] = rng.normal(size=6), rng.normal(size=3)
    start, stop = system.tool_dofs
    for _ in range(5):
        state.q[:] = system.mechanism.integrate(state.q, rng.normal(size=system.mechanism.nv), 1.0)
        couple(world, state, port)
        rotations, positions = system.mechanism.placements(state.q)
        point = positions[port.hand_body] + rotations[port.hand_body] @ port.hand_point
        moving = system.mechanism.point_jacobian(state.q, int(port.hand_body), point)
        turning = system.mechanism.frame_jacobian(state.q, int(port.hand_body))[3:]
        expected = moving.T @ port.wrench[:3] + turning.T @ port.wrench[3:]
        assert port.hand_force == pytest.approx(expected, abs=1e-13)
        assert np.any(port.hand_force[start:stop] != 0.0)


def test_unilateral_actuators_give_the_coupler_alone_and_without_limits_all_of_it() -> None:
    for coupling, share in ((FourChannel(*GAINS), 1.0), (UnilateralCoupler(*GAINS), 0.0)):
        _, _, port, rng = started(coupling=coupling)
        port.environment_force[:], port.coupling_force[:] = rng.normal(size=6) * 100.0, rng.normal(size=6) * 100.0
        command(port)
        expected = share * port.environment_force[3:] - port.coupling_force[3:]
        assert port.device_force == pytest.approx(expected, abs=0.0)


def test_an_impulse_comes_in_the_shares_of_its_waveform_or_waits_while_it_would_give_energy() -> None:
    """What falls due in step n is the sum of weight_j × the force of step n − j; held, it falls due one step later."""
    world, state, port, rng = started(", waveform: brake")
    weights, steps, held = port.pulse_weights.copy(), 3 * len(port.pulse_weights), 0
    due, balance = np.zeros((steps + len(weights) + 1, 3)), 0.0
    state.island_of_tree[:] = (0, 1)
    for step in range(steps):
        port.clock[0] = step
        state.impulse[:] = rng.normal(size=6) * (rng.random() < 0.4)
        port.device_v[:] = rng.normal(size=3)
        port.environment_force[:] = rng.normal(size=6)
        state.impacts.logged[0] = 2
        state.impacts.group[:2], state.impacts.energy_lost[:2] = rng.permutation(2), rng.exponential(0.05, 2)
        balance += state.impacts.energy_lost[:2][state.impacts.group[:2] == 1].sum()
        before = port.environment_force.copy()
        due[step : step + len(weights)] += np.outer(weights, state.impulse[3:] / world.dt)
        power = due[step] @ port.device_v
        given = due[step]
        if power > 0.0 and balance < world.dt * power:
            due[step + 1] += given
            given, held = np.zeros(3), held + 1
        shape_impulse(world, state, port)
        assert port.pulse_force == pytest.approx(given, abs=1e-9)
        assert port.pulse_held[0] == held
        change = port.environment_force - before
        assert change == pytest.approx([0.0, 0.0, 0.0, *(given - state.impulse[3:] / world.dt)], abs=1e-9)
        port.acceleration[:] = rng.normal(size=3)
        observe_work(world, port)
        balance -= world.dt * given @ (port.device_v - 0.5 * world.dt * port.acceleration)
        assert port.pulse_balance[0] == pytest.approx(balance, abs=1e-9)
    assert 0 < held < steps
