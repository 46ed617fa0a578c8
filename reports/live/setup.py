"""A scene made ready for a live run: its rate, its world, its device."""

from __future__ import annotations

from iapb.errors import ArgumentError, IapbError
from iapb.haptics.device import Device
from iapb.scene import Scene
from iapb.simulation import Simulation
from reference.worlds import World
from reports.by_name import function_named

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
    made = made_device(device, scene)
    try:
        return Simulation(scene, world.law, world.coupling_in(scene), made)
    except IapbError:
        raise
    except Exception as error:
        if made is None:
            raise
        raise IapbError(f"the device failed at its first reading: {type(error).__name__}: {error}") from error


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
    make = function_named("--device", name, "module:factory, such as my_lab.omega:connect, or simulated")
    try:
        device: Device = make(scene)
    except IapbError:
        raise
    except Exception as error:  # a device of somebody's own
        why = f"{type(error).__name__}: {error}"
        raise ArgumentError("--device", name, f"a factory that makes a device of a scene ({why})") from error
    return device
