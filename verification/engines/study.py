"""Run all engines on all fixed scenes, with each engine's own settings and with the same step for all.

All engines are measured in the same way, from the positions and velocities of their trajectories alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from iapb.errors import ArgumentError, IapbError, MissingDependencyError
from reference.simulators import (
    FIXED_SCENES,
    SIMULATORS,
    FixedScene,
    Simulator,
    Trajectory,
    find_simulator,
    fixed_scene,
)
from reference.simulators.trajectory import deepest_overlap
from verification.engines.record import EngineRecord
from verification.finding import Failure, attempt

OWN, MATCHED = "own", "matched"
SETTINGS = (OWN, MATCHED)
MATCHED_STEP = 1e-3  # [s] the haptic rate
# Duration of a resting scene at depth "quick" [s]; a full minute at 1 ms takes some engines a minute.
QUICK_REST, QUICK_STACK = 1.0, 0.25

Progress = Callable[[int, int], None]


OUR_OWN = ("iapb", "rigid")  # simulators of this project: their exceptions are faults of this project


def installed() -> dict[str, str]:
    """Return name and version of every installed engine."""
    found = {}
    for name in SIMULATORS:
        try:
            found[name] = find_simulator(name).version()
        except MissingDependencyError:
            continue
    return found


def compare_engines(
    engines: Sequence[str] | None = None,
    scenes: Sequence[str] | None = None,
    depth: str = "full",
    progress: Progress | None = None,
    failures: list[Failure] | None = None,
) -> list[EngineRecord]:
    """Run every engine on every scene at both choices of settings.

    Parameters
    ----------
    engines, scenes : names; by default all. An engine that is not installed gets records that say so.
    depth : "full", or "quick" with shorter resting scenes
    failures : receives exceptions outside of the other engines; an exception of another engine in a run is a result

    If an engine's own settings equal the matched ones, one run gives both records.
    """
    if depth not in ("quick", "full"):
        raise ArgumentError("depth", depth, "quick or full")
    names, chosen = list(engines or SIMULATORS), list(scenes or FIXED_SCENES)
    made = {name: attempt(name, partial(find_simulator, name), failures) for name in names}
    records: list[EngineRecord] = []
    pairs = [(name, simulator, scene) for name, simulator in made.items() if simulator is not None for scene in chosen]
    for done, (name, simulator, scene) in enumerate(pairs, 1):
        records += attempt(f"{name} on {scene}", partial(_both, name, simulator, scene, depth), failures) or []
        if progress is not None:
            progress(done, len(pairs))
    return records


def _both(name: str, simulator: Simulator, scene_name: str, depth: str) -> list[EngineRecord]:
    scene = fixed_scene(scene_name)
    blank = EngineRecord(name, simulator.title, "", scene_name, scene.rests, OWN)
    try:
        blank = replace(blank, version=simulator.version())
    except MissingDependencyError as error:
        return [replace(blank, choice=choice, missing=str(error)) for choice in SETTINGS]
    own, matched = simulator.settings(scene), simulator.settings(scene, MATCHED_STEP)
    duration = scene.duration
    if depth == "quick" and scene.rests:
        duration = min(duration, QUICK_STACK if len(scene.bodies) > 1 else QUICK_REST)
    records: list[EngineRecord] = []
    for choice, settings in ((OWN, own), (MATCHED, matched)):
        if records and settings == own:
            records.append(replace(records[0], choice=choice))
            continue
        head = replace(blank, choice=choice, settings=str(settings), note=settings.note, step=settings.step,
                       duration=duration)  # fmt: skip
        records.append(replace(head, **_outcome(name, simulator, scene, settings, duration)))
    return records


def _outcome(name: str, simulator: Simulator, scene: Any, settings: Any, duration: float) -> dict[str, Any]:
    """Return the measures of a run, or the failure that stopped it; engines raise exceptions of any type.

    An exception of our own engines propagates, and the case counts as failed.
    """
    if name in OUR_OWN:
        return measured(scene, simulator.run(scene, settings, settings.step, duration))
    try:
        return measured(scene, simulator.run(scene, settings, settings.step, duration))
    except IapbError as error:
        return {"failure": str(error)[:160]}
    except Exception as error:
        return {"failure": f"{type(error).__name__}: {' '.join(str(error).split())}"[:160]}


def measured(scene: FixedScene, motion: Trajectory) -> dict[str, Any]:
    """Return the measures of an `EngineRecord`; if a number is not finite, return only a failure."""
    if not motion.finite:
        first = int(np.argmin(np.isfinite(motion.velocity).all(axis=(1, 2))))
        return {"failure": f"not a number from {motion.time[first]:.4g} s on"}
    common = {"penetration": max(0.0, deepest_overlap(scene, motion)), "most_contacts": _most_contacts(motion),
              "energy_gain": _energy_gain(scene, motion)}  # fmt: skip
    return {**common, **(_rest(motion) if scene.rests else _impacts(scene, motion))}


def _most_contacts(motion: Trajectory) -> int | None:
    most = int(motion.contacts.max())
    return most if most >= 0 else None


def _energy_gain(scene: FixedScene, motion: Trajectory) -> float:
    kinetic = motion.kinetic_energy(scene)
    energy = kinetic + motion.potential_energy(scene)
    scale = kinetic[0]
    if scene.rests:
        scale = float(scene.masses.sum() * np.linalg.norm(scene.gravity) * scene.length)
    return float((energy.max() - energy[0]) / scale)


def _impacts(scene: FixedScene, motion: Trajectory) -> dict[str, float]:
    truth, masses = np.array(scene.final_velocities), scene.masses
    kinetic = motion.kinetic_energy(scene)
    true_energy = 0.5 * float(masses @ (truth**2).sum(axis=1))
    speeds = np.linalg.norm(motion.velocity[0], axis=1)
    off = motion.velocity[-1] - truth
    return {
        "energy_error": float((kinetic[-1] - true_energy) / kinetic[0]),
        "momentum_error": float(np.linalg.norm(masses @ off) / (masses @ speeds)),
        "velocity_error": float(np.linalg.norm(off, axis=1).max() / scene.fastest),
    }


def _rest(motion: Trajectory) -> dict[str, float]:
    halfway = motion.position[len(motion.position) // 2]
    return {"drift": _farthest(motion.position - motion.position[0]), "creep": _farthest(motion.position[-1] - halfway)}


def _farthest(moved: Any) -> float:
    return float(np.linalg.norm(moved, axis=-1).max())
