"""The device of a scene as one that moves by itself: the counterpart of the compiled one."""

from __future__ import annotations

from typing import Any

from iapb.errors import ArgumentError
from iapb.haptics.device import SimulatedDevice
from iapb.scene import Scene
from iapb.system import System


def simulated_device(scene: Scene) -> SimulatedDevice:
    """Return the device of a scene as one that moves by itself: its inertia, damping, delay, sensors and limits.

    Raises
    ------
    ArgumentError
        A scene without a hand, or a tool whose mass matrix is not constant: only the compiled device has such.
    """
    system = System(scene)
    if system.tool_tree < 0:
        raise ArgumentError("scene", scene.name, "a scene with a hand")
    tool, state = system.device_mechanism(), system.make_state()
    q, v = state.q[slice(*system.tool_coordinates)], state.v[slice(*system.tool_dofs)]
    if not tool.has_constant_mass_matrix or len(q) != len(v):
        raise ArgumentError("scene", scene.name, "a tool of constant inertia, with as many velocities as coordinates")
    given = scene.device
    settings: dict[str, Any] = {} if given is None else {
        "damping": given.damping, "force_limit": given.force_limit, "delay": given.delay,
        "resolution": given.position_resolution,
    }  # fmt: skip
    return SimulatedDevice(tool.mass_matrix(q), q, v, dt=system.dt, **settings)
