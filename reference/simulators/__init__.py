"""Adapters to other engines, and the fixed set of scenes for their comparison. Each engine is optional."""

from __future__ import annotations

from importlib import import_module

from iapb.errors import ArgumentError
from iapb.names import one_of
from reference.simulators.scene import FIXED_SCENES, FixedScene, fixed_scene
from reference.simulators.simulator import Settings, Simulator
from reference.simulators.trajectory import Trajectory

__all__ = [
    "FIXED_SCENES", "SIMULATORS", "FixedScene", "Settings", "Simulator", "Trajectory", "find_simulator", "fixed_scene",
]  # fmt: skip

_HERE = "reference.simulators"

# name -> module:class; to add an engine, add its module and a line here
SIMULATORS: dict[str, str] = {
    "iapb": f"{_HERE}.own_engines:ImpulseAugmentedEngine",
    "rigid": f"{_HERE}.own_engines:RigidWorld",
    "mujoco": f"{_HERE}.mujoco_adapter:MuJoCo",
}


def find_simulator(name: str) -> Simulator:
    """Return the adapter of that name, or your own as ``module:Class``; its engine is imported at its first use."""
    if name not in SIMULATORS and ":" not in name:
        raise ArgumentError("simulator", name, f"{one_of(name, SIMULATORS)}, or your own as module:Class")
    module, _, kind = SIMULATORS.get(name, name).partition(":")
    made: Simulator = getattr(import_module(module), kind)()
    return made
