"""iapb: rigid contact with impulses at new contacts and penalty forces at lasting ones.

The names below are loaded when they are first used, so ``import iapb`` is fast.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from iapb.lazy import lazy_names

if TYPE_CHECKING:
    from iapb.advice.checks import check_scene as check_scene
    from iapb.contact.impact import Impact as Impact
    from iapb.contact.impact import resolve_frictional_impact as resolve_frictional_impact
    from iapb.contact.impact import resolve_impact as resolve_impact
    from iapb.contact.impact import resolve_impacts as resolve_impacts
    from iapb.effects import Effect as Effect
    from iapb.errors import ArgumentError as ArgumentError
    from iapb.errors import IapbError as IapbError
    from iapb.errors import MissingDependencyError as MissingDependencyError
    from iapb.errors import RangeError as RangeError
    from iapb.errors import RunFileError as RunFileError
    from iapb.errors import SceneError as SceneError
    from iapb.errors import SolverError as SolverError
    from iapb.mechanics.mechanism import Body as Body
    from iapb.mechanics.mechanism import Joint as Joint
    from iapb.mechanics.mechanism import Mechanism as Mechanism
    from iapb.run import Run as Run
    from iapb.scene import Scene as Scene
    from iapb.scene import find_scene as find_scene
    from iapb.scene import load_scene as load_scene
    from iapb.scene import scene_folder as scene_folder
    from iapb.simulation import Simulation as Simulation
    from iapb.simulation import simulate as simulate
    from iapb.system import decide_effects as decide_effects
    from verification import check_passivity as check_passivity
    from verification.certificate import Certificate as Certificate
    from verification.certificate import certify as certify
    from verification.certificate import certify_impacts as certify_impacts
    from verification.port import BareDevice as BareDevice
    from verification.port import check_force as check_force

    __version__: str

_HOME = {
    "iapb.advice.checks": ("check_scene",),
    "iapb.contact.impact": (
        "Impact",
        "resolve_frictional_impact",
        "resolve_impact",
        "resolve_impacts",
    ),
    "iapb.effects": ("Effect",),
    "iapb.errors": (
        "ArgumentError",
        "IapbError",
        "MissingDependencyError",
        "RangeError",
        "RunFileError",
        "SceneError",
        "SolverError",
    ),
    "iapb.mechanics.mechanism": ("Body", "Joint", "Mechanism"),
    "iapb.run": ("Run",),
    "iapb.scene": ("Scene", "find_scene", "load_scene", "scene_folder"),
    "iapb.simulation": ("Simulation", "simulate"),
    "iapb.system": ("decide_effects",),
    # upper packages bring these as entry points: the engine never imports one
    "": (
        "BareDevice",
        "Certificate",
        "certify",
        "certify_impacts",
        "check_force",
        "check_passivity",
    ),
}

_MODULE_OF = {name: module for module, names in _HOME.items() for name in names}
_load, __dir__, _names = lazy_names(__name__, _MODULE_OF)
__all__ = sorted([*_names, "__version__"])


def __getattr__(name: str) -> Any:
    if name != "__version__":
        return _load(name)
    from importlib.metadata import version

    return version("iapb")
