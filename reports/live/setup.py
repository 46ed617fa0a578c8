"""A scene made ready for a live run: its rate, its world, its device."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from iapb.errors import ArgumentError
from iapb.haptics.device import Device
from iapb.scene import Scene
from iapb.simulation import Simulation
from reference.worlds import World

_SIMULATED = "simulated"  # the word for the device of `iapb.scene_device.simulated_device`


def live_simulation(scene: Scene, world: World, rate: float, device: str = "") -> Simulation:
    """Return a simulation whose step is the period of the rate, so that simulated time is real time.

    Parameters
    ----------
    scene : its own rate is replaced.
    world : law and coupling, see `reference.worlds`.
    rate : float [1/s]
    device : ``module:factory`` of a device of one's own, ``simulated``, or empty for the compiled one.
    """
    scene = scene.with_values({"rate": rate})
    return Simulation(scene, world.law, world.coupling_in(scene), made_device(device, scene))


def made_device(name: str, scene: Scene) -> Device | None:
    """Return the device that ``module:factory`` makes of a scene; None for an empty name.

    Raises
    ------
    ArgumentError
        There is no such factory, or what it makes is no device.
    """
    if not name:
        return None
    if name == _SIMULATED:
        name = "iapb.scene_device:simulated_device"
    module, colon, factory = name.partition(":")
    if not colon or not module or not factory:
        raise ArgumentError("device", name, "module:factory, such as my_lab.omega:connect, or simulated")
    try:
        make: Any = getattr(import_module(module), factory)
    except (ImportError, AttributeError) as error:
        raise ArgumentError("device", name, f"an importable module with that factory ({error})") from error
    device: Device = make(scene)
    return device
