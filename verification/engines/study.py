"""The study: engines × fixed scenes × settings (each engine's own, and one step for all)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from iapb.errors import ArgumentError, IapbError, MissingDependencyError
from reference.simulators import FIXED_SCENES, SIMULATORS, Simulator, find_simulator, fixed_scene
from verification.engines.measures import measured
from verification.engines.record import EngineRecord
from verification.finding import Failure, attempt

OWN, MATCHED = "own", "matched"
SETTINGS = (OWN, MATCHED)
MATCHED_STEP = 1e-3  # [s] the haptic rate
# At depth "quick" a resting scene lasts so long [s]: a minute at 1 ms takes some engines a minute.
QUICK_REST, QUICK_STACK = 1.0, 0.25

Progress = Callable[[int, int], None]


OUR_OWN = ("iapb", "rigid")  # simulators made of this project: what they raise is a fault of ours


def installed() -> dict[str, str]:
    """Name of every engine that is here, with its version."""
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
    engines, scenes : names; default: all. An engine that is not installed gets records that say so.
    depth : "quick" shortens the resting scenes
    failures : receives what raises outside of the engines themselves; what an engine raises in a run is a result

    Where an engine's own settings are the matched ones, one run makes both records.
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
    """Measures, or what stopped the run: another engine's errors are of every kind, and each is a result.

    An error of our own engines is no result: it is raised, and the case counts as failed.
    """
    if name in OUR_OWN:
        return measured(scene, simulator.run(scene, settings, settings.step, duration))
    try:
        return measured(scene, simulator.run(scene, settings, settings.step, duration))
    except IapbError as error:
        return {"failure": str(error)[:160]}
    except Exception as error:
        return {"failure": f"{type(error).__name__}: {' '.join(str(error).split())}"[:160]}
