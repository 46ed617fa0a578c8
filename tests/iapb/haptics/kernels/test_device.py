"""How the device moves, and when the unilateral coupler is on, against plain numpy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.contact.laws import Penalty
from iapb.haptics.coupling import FourChannel, UnilateralCoupler
from iapb.haptics.kernels import engage, inside, move_device
from iapb.run import FREE, RESTING
from iapb.scene import scene_from_text
from iapb.system import System

GAINS = (100.0, 80.0, 0.5), (70.0, 60.0, 0.375)


def system_of(center: str, damping: str = "[0, 0, 0]") -> System:
    """Two discs that overlap each other all the time, a tool that is the third body, and a wall."""
    return System(scene_from_text(f"""
name: three
rate: 100
duration: 1.0
bodies:
  - {{name: one, joint: planar, mass: 1, inertia: 1, shapes: [{{kind: circle, radius: 0.2}}], position: [5, 0, 0]}}
  - {{name: other, joint: planar, mass: 1, inertia: 1, shapes: [{{kind: circle, radius: 0.2}}], position: [5.1, 0, 0]}}
  - name: tool
    joint: planar
    mass: 2
    inertia: 0.1
    center_of_mass: {center}
    shapes: [{{kind: box, size: [0.4, 0.2]}}]
walls: [{{name: floor, kind: half_plane, point: [0, -0.5], normal: [0, 1]}}]
contact: {{stiffness: 500}}
hand: {{body: tool, force: [0, 0, 0]}}
device: {{force_limit: [3, 2, 0.1], damping: {damping}}}
"""))


@pytest.mark.parametrize("center", ["[0, 0]", "[0.3, -0.2]"])
@pytest.mark.parametrize("damping", [(0.0, 0.0, 0.0), (0.5, 2.0, 0.3)])
def test_the_device_obeys_its_equation_of_motion(center: str, damping: tuple[float, ...]) -> None:
    """M(q) a + B(q, v) = F_hand + F_actuators − b v; the new velocity moves it; the clock counts the step."""
    system, rng = system_of(center, str(list(damping))), np.random.default_rng(0)
    port = system.make_port(FourChannel(*GAINS))
    device, world, state = system.device_mechanism(), system.world_under(Penalty()), system.make_state()
    for step in range(5):
        q = device.integrate(device.neutral(), rng.normal(size=3))
        v, hand, actuators = rng.normal(size=(3, 3))
        port.device_q[:], port.device_v[:] = q, v
        port.device_hand_force[:], port.device_force[:] = hand, actuators
        assert move_device(world, state, port)
        force = hand + actuators - np.array(damping) * v - device.bias(q, v)
        moved = v + world.dt * np.linalg.solve(device.mass_matrix(q), force)
        assert port.device_v == pytest.approx(moved, abs=1e-13)
        assert port.device_q == pytest.approx(device.integrate(q, moved, world.dt), abs=1e-13)
        assert port.clock[0] == step + 1
    for k in range(3):
        port.device_q[:], port.device_v[:], port.device_force[:] = device.neutral(), 0.0, 0.0
        port.device_force[k] = 1e200
        assert not move_device(world, state, port)  # it left all bounds


def test_the_coupler_is_on_while_the_tool_touches_or_the_device_is_inside_something() -> None:
    """Else the tool is where the device is. Other bodies that overlap do not count."""
    system, rng, seen = system_of("[0.3, -0.2]"), np.random.default_rng(1), set()
    world, state = system.world_under(Penalty()), system.make_state()
    port: Any = system.make_port(UnilateralCoupler(*GAINS))
    for _ in range(60):
        state.q[6:], state.v[:] = rng.normal(size=3), rng.normal(size=9)
        start = (4.9, 0.0) if rng.random() < 0.3 else (0.0, -0.3)
        port.device_q[:], port.device_v[:] = [*(start + 0.3 * rng.normal(size=2)), rng.normal()], rng.normal(size=3)
        at_device = state.q.copy()
        at_device[6:] = port.device_q
        found = system.contacts_at(at_device)
        within = bool(np.any((found.body_a == 2) | (found.body_b == 2)))
        q, v = state.q.copy(), state.v.copy()
        assert bool(inside(world, state, port)) == within
        state.state_of_tree[:] = (RESTING, RESTING, RESTING if rng.random() < 0.3 else FREE)
        on = within or state.state_of_tree[2] != FREE
        engage(world, state, port)
        assert bool(port.engaged[0]) == on
        q[6:], v[6:] = (q[6:], v[6:]) if on else (port.device_q, port.device_v)
        np.testing.assert_array_equal(state.q, q)
        np.testing.assert_array_equal(state.v, v)
        seen.add((within, int(state.state_of_tree[2])))
    assert len(seen) == 4
