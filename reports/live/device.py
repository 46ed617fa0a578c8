"""Prepare a scene for a live run: its rate, its world, and its device."""

from __future__ import annotations

from typing import Any

from iapb.errors import ArgumentError, IapbError
from iapb.haptics.device import SimulatedDevice
from iapb.scene import Scene
from iapb.simulation import Simulation
from iapb.system import System
from iapb.worlds import World
from reports.by_name import function_named


def live_simulation(scene: Scene, world: World, rate: float, device: str = "") -> Simulation:
    """Return a simulation whose step is the period of the rate, so that simulated time is real time.

    Parameters
    ----------
    scene : Scene; its own rate is replaced.
    world : law and coupling, see `iapb.worlds`.
    rate : float [1/s]
    device : ``module:factory`` of a user's device, ``simulated``, or empty for the compiled device.

    Raises
    ------
    ArgumentError
        There is no such factory, it does not return a device, or the device fails at its first reading.
    """
    scene = scene.with_values({"rate": rate})
    form = "module:factory, such as my_lab.omega:connect, or simulated"
    make = simulated_device if device == "simulated" else device and function_named("--device", device, form)
    try:
        return Simulation(scene, world.law, world.coupling_in(scene), make(scene) if make else None)
    except IapbError:
        raise
    except Exception as error:  # a device of somebody's own
        if not make:
            raise
        why = f"{type(error).__name__}: {error}"
        raise ArgumentError("--device", device, f"a factory of a device that can be read ({why})") from error


def simulated_device(scene: Scene) -> SimulatedDevice:
    """Return the Python version of a scene's compiled device: its inertia, damping, delay, sensors and limits.

    Raises
    ------
    ArgumentError
        The scene has no hand, or the tool's mass matrix is not constant, which only the compiled device supports.
    """
    system = System(scene)
    if system.tool_tree < 0:
        raise ArgumentError("scene", scene.name, "a scene with a hand")
    tool, state = system.device_mechanism(), system.make_state()
    q, v = state.q[slice(*system.tool_coordinates)], state.v[slice(*system.tool_dofs)]
    if not tool.has_constant_mass_matrix or len(q) != len(v):
        raise ArgumentError("scene", scene.name, "a tool of constant inertia, with as many velocities as coordinates")
    fields = {"damping": "damping", "force_limit": "force_limit", "delay": "delay", "position_resolution": "resolution"}
    given = {name: getattr(scene.device, field, None) for field, name in fields.items()}
    settings: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    return SimulatedDevice(tool.mass_matrix(q), q, v, dt=system.dt, **settings)
