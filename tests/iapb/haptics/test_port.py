"""Forces of the hand, of the coupling and of the actuators on a tool that may stand behind other
bodies."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.contact.laws import ImpulseAugmented
from iapb.haptics.coupling import FourChannel, UnilateralCoupler
from iapb.haptics.rendering import couple
from iapb.scene import Scene, find_scene, load_scene
from iapb.system import System

ARM, PEG = (load_scene(find_scene(name)) for name in ("arm_pushing", "peg_hole_space"))
_BODIES = ARM.resolved()["bodies"]
# the arm in the hand is the second tree
BEHIND = ARM.with_values({"bodies": [_BODIES[2], *_BODIES[:2]]})


def started(scene: Scene, kind: Any = FourChannel) -> Any:
    """System, world, state and port; tool, device and wrench at random."""
    system = System(scene)
    rng = np.random.default_rng(4)
    size = system.tool_dofs[1] - system.tool_dofs[0]
    port = system.make_port(kind(rng.uniform(50.0, 100.0, size), rng.uniform(50.0, 70.0, size)))
    world = system.world_under(ImpulseAugmented())
    state = system.make_state()
    device = system.device_mechanism()
    state.q[:] = system.mechanism.integrate(state.q, rng.normal(size=system.mechanism.nv))
    port.device_q[:] = device.integrate(port.device_q, rng.normal(size=size))
    state.v[:] = rng.normal(size=system.mechanism.nv)
    port.device_v[:] = rng.normal(size=size)
    port.wrench[:] = rng.normal(size=6)
    port.hand_point[:] = rng.normal(size=3)
    return system, world, state, port


@pytest.mark.parametrize("scene", [BEHIND, PEG], ids=["plane", "space"])
def test_the_hand_does_the_work_of_its_wrench_at_the_held_point_of_tool_and_device(
    scene: Scene,
) -> None:
    """J_hᵀF_h · v = F · v_point + torque · ω for every velocity, each at its own pose; channels
    push by K Δq + B Δv."""
    system, world, state, port = started(scene)
    couple(world, state, port)
    tool = slice(*system.tool_dofs)
    device = system.device_mechanism()
    for mechanism, q, body, force in (
        (system.mechanism, state.q, port.hand_body, port.hand_force),
        (device, port.device_q, port.device_body, port.device_hand_force),
    ):
        rotations, positions = mechanism.placements(q)
        point = positions[body] + rotations[body] @ port.hand_point
        expected = mechanism.point_jacobian(q, body, point).T @ port.wrench[:3]
        assert force == pytest.approx(
            expected + mechanism.frame_jacobian(q, body)[3:].T @ port.wrench[3:], abs=1e-13
        )
    apart = device.difference(state.q[slice(*system.tool_coordinates)], port.device_q)
    spring = port.stiffness * apart + port.damping * (port.device_v - state.v[tool])
    assert port.coupling_force[tool] == pytest.approx(spring, abs=1e-12)
    assert np.array_equal(port.applied, port.hand_force + port.coupling_force)
    port.wrench[:] = 0.0
    couple(world, state, port)
    assert not port.hand_force.any() and not port.device_hand_force.any()


@pytest.mark.parametrize("engaged", [False, True])
def test_through_a_unilateral_coupler_the_hand_reaches_the_tool_only_as_long_as_it_is_off(
    engaged: bool,
) -> None:
    _, world, state, port = started(BEHIND, UnilateralCoupler)
    port.engaged[0] = engaged
    couple(world, state, port)
    assert port.hand_force.any() and port.coupling_force.any() == engaged
    assert np.array_equal(port.applied, port.coupling_force if engaged else port.hand_force)
