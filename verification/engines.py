"""Engines on the fixed scenes: energy, momentum and overlap, with each engine's own settings and with one step for all.

All engines are measured in the same way, from the positions and velocities of their trajectories alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby, product
from typing import Any

import numpy as np

from iapb.errors import IapbError, MissingDependencyError
from reference.simulators import FIXED_SCENES, SIMULATORS, FixedScene, Trajectory, find_simulator, fixed_scene
from reference.simulators.trajectory import deepest_overlap
from verification.check import Check, Study, Topic
from verification.finding import MIXED, NOT_TESTABLE, REPRODUCED, Failure, Part, counted, of_each
from verification.table import Row, Table

OWN, MATCHED = SETTINGS = ("own", "matched")
MATCHED_STEP = 1e-3  # [s] the haptic rate
# Duration of a resting scene at depth "quick" [s]; a full minute at 1 ms takes some engines a minute.
QUICK_REST, QUICK_STACK = 1.0, 0.25
OUR_OWN = ("iapb", "rigid")  # simulators of this project: their exceptions are faults of this project

# An engine with springs as contacts cannot be exact. A hundredth of the initial energy, momentum and speed is an error
# that a user would not notice, and far above rounding.
CLOSE = 1e-2
STAYS = 1e-3  # [m] a hundredth of the bodies' size
FLIES, THROWN = 1.0, "thrown out"  # [m] a body that moves farther has left the scene; how far depends on the duration
_ERRORS = ("energy", "momentum", "velocity")
MEASURES = ("energy error", "largest rise of energy", "momentum error", "velocity error", "overlap / size",
            "drift [m]", "creep [m]")  # of a motion, see `measured`
MET, MISSED, FAILED, MISSING = "met", "missed", "failed", "not installed"


@dataclass(frozen=True)
class EngineRecord:
    """Results of one engine on one scene.

    engine, title, version : name of the adapter, name of the engine, and its version ("" if it is not installed)
    scene : name of the scene; choice : "own" or "matched"; settings : step and options in words; duration : simulated
    time [s]; note : features that the engine lacks
    measures : see `measured`; failure : reason why there are none; missing : how to install the engine
    """

    engine: str
    title: str
    version: str
    scene: str
    choice: str
    settings: str = ""
    note: str = ""
    duration: float = 0.0
    measures: Row = field(default_factory=dict)
    failure: str = ""
    missing: str = ""


def compare_engines(
    engines: Sequence[str] | None = None, scenes: Sequence[str] | None = None,
    progress: Callable[[int, int], None] | None = None, failures: list[Failure] | None = None,
) -> list[EngineRecord]:
    """Run every engine on every scene at both choices of settings.

    Parameters
    ----------
    engines, scenes : names; by default all. An engine that is not installed gets records that say so.
    failures : receives exceptions outside of the other engines; an exception of another engine in a run is a result

    If an engine's own settings equal the matched ones, one run gives both records.
    """
    pairs = list(product(engines or SIMULATORS, scenes or FIXED_SCENES))
    return list(of_each(counted(pairs, progress) if progress else pairs, lambda pair: _both(*pair, "full"), failures,
                        lambda pair: f"{pair[0]} on {pair[1]}"))  # fmt: skip


def _both(name: str, scene_name: str, depth: str) -> list[EngineRecord]:
    simulator, scene = find_simulator(name), fixed_scene(scene_name)
    blank = EngineRecord(name, simulator.title, "", scene_name, OWN)
    try:
        blank = replace(blank, version=simulator.version())
    except MissingDependencyError as error:
        return [replace(blank, choice=choice, missing=str(error)) for choice in SETTINGS]
    duration = scene.duration
    if depth == "quick" and scene.rests:
        duration = min(duration, QUICK_STACK if len(scene.bodies) > 1 else QUICK_REST)
    own, matched = simulator.settings(scene), simulator.settings(scene, MATCHED_STEP)
    records: list[EngineRecord] = []
    for choice, settings in zip(SETTINGS, (own, matched), strict=True):
        if records and settings == own:
            records.append(replace(records[0], choice=choice))
            continue
        found, failure = dict[str, Any](), ""
        try:
            motion = simulator.run(scene, settings, settings.step, duration)
            if motion.finite:
                found = measured(scene, motion)
            else:
                first = int(np.argmin(np.isfinite(motion.velocity).all(axis=(1, 2))))
                failure = f"not a number from {motion.time[first]:.4g} s on"
        except Exception as error:  # engines raise exceptions of any type; those of our own count as failed cases
            if name in OUR_OWN:
                raise
            kind = "" if isinstance(error, IapbError) else f"{type(error).__name__}: "
            failure = (kind + " ".join(str(error).split()))[:160]
        records.append(replace(blank, choice=choice, settings=str(settings), note=settings.note, duration=duration,
                               measures=found, failure=failure))
    return records


def measured(scene: FixedScene, motion: Trajectory) -> dict[str, Any]:
    """Return the measures of a motion; those that do not apply to the scene are None.

    - energy error: (kinetic energy at the end − true) / kinetic energy at the start; impact scenes
    - largest rise of energy: of kinetic plus potential energy above its start value, relative to the kinetic energy at
      the start, or in resting scenes to the work of gravity along the scene's length
    - momentum error: (momentum at the end − true), by size, / sum of m v at the start; impact scenes
    - velocity error: largest error of a body's final velocity / largest speed at the start; impact scenes
    - overlap / size: deepest overlap / the scene's length
    - drift: largest distance of a body from its start; creep: drift in the second half; resting scenes
    """
    kinetic, masses = motion.kinetic_energy(scene), scene.masses
    energy = kinetic + motion.potential_energy(scene)
    scale = float(masses.sum() * np.linalg.norm(scene.gravity) * scene.length) if scene.rests else kinetic[0]
    found: dict[str, Any] = dict.fromkeys(MEASURES) | {
        "largest rise of energy": float((energy.max() - energy[0]) / scale),
        "overlap / size": max(0.0, deepest_overlap(scene, motion)) / scene.length}
    if scene.rests:
        places, half = motion.position, motion.position[len(motion.position) // 2]
        return found | {"drift [m]": float(np.linalg.norm(places - places[0], axis=-1).max()),
                        "creep [m]": float(np.linalg.norm(places[-1] - half, axis=-1).max())}
    truth = np.array(scene.final_velocities)
    true_energy = 0.5 * float(masses @ (truth**2).sum(axis=1))
    speeds, off = np.linalg.norm(motion.velocity[0], axis=1), motion.velocity[-1] - truth
    return found | {"energy error": float((kinetic[-1] - true_energy) / kinetic[0]),
                    "momentum error": float(np.linalg.norm(masses @ off) / (masses @ speeds)),
                    "velocity error": float(np.linalg.norm(off, axis=1).max() / scene.fastest)}


def verdict(record: EngineRecord) -> str:
    """Return one of MET, MISSED, FAILED and MISSING."""
    if record.missing or record.failure:
        return MISSING if record.missing else FAILED
    if (drift := record.measures["drift [m]"]) is not None:
        return MET if drift <= STAYS else MISSED
    return MET if all(abs(record.measures[f"{name} error"]) <= CLOSE for name in _ERRORS) else MISSED


def row_of(record: EngineRecord) -> Row:
    """Return the row of a record; a body that is thrown out has no drift."""
    thrown = (record.measures.get("drift [m]") or 0.0) > FLIES
    found = {**record.measures, **(dict.fromkeys(("drift [m]", "creep [m]")) if thrown else {})}
    return {"engine": record.title, "version": record.version, "scene": record.scene.replace("_", " "),
            "settings": record.choice, "law": verdict(record), **dict.fromkeys(MEASURES), **found,
            "simulated [s]": record.duration or None, "failure": THROWN if thrown else record.failure}  # fmt: skip


def told(rows: Sequence[Row]) -> tuple[str, str]:
    """Return what is asked of one engine at one choice of settings, and the result, from its rows."""
    first, missed = rows[0], ", ".join(f"{row['scene']} ({_worst(row)})" for row in rows if row["law"] != MET)
    at = "settings that suit it" if first["settings"] == OWN else f"a step of {1e3 * MATCHED_STEP:g} ms"
    rise = max(row["largest rise of energy"] or 0.0 for row in rows)
    return (f"{first['engine']} {first['version']} with {at}: scenes with the right outcome",
            f"{_met(rows)} of {len(rows)}{missed and f'; wrong: {missed}'}. Largest relative rise of energy: "
            f"{rise:.2g}")


def _worst(row: Row) -> str:
    """The measure with the largest error in words, or the failure."""
    if row["failure"]:
        return THROWN if row["failure"] == THROWN else "failed: " + row["failure"].rstrip(".")
    if row["drift"] is not None:
        return f"moves by {row['drift']:.3g} m"
    size, name = max(((abs(row[f"{name} error"]), name) for name in _ERRORS), key=lambda one: one[0])
    return f"{name} off by {size:.2g}"


def _rows(study: Study, case: tuple[str, str]) -> Iterator[Row]:
    yield from map(row_of, study.once(case, lambda: _both(*case, study.depth)))


def _settings(study: Study, name: str) -> Iterator[Row]:
    """Yield a row per settings of an engine, with the scenes in which they were used."""
    uses: dict[tuple[str, str, str, str], list[str]] = {}
    for scene in FIXED_SCENES:
        for one in study.results.get((name, scene), ()):
            key = (one.title, one.version or MISSING, one.settings, one.note)
            uses.setdefault(key, []).append(f"{one.scene.replace('_', ' ')} ({one.choice})")
    for (title, version, settings, note), used in uses.items():
        yield {"engine": title, "version": version, "settings": settings,
               "used in": "" if version == MISSING else ", ".join(used), "what it cannot do": note}


def _says(table: Table) -> Iterator[Part]:
    """Yield one part per engine and choice of settings, and one on the engines that are not installed."""
    present = _present(table)
    for engine, choice in dict.fromkeys((row["engine"], row["settings"]) for row in present):
        group = [row for row in present if (row["engine"], row["settings"]) == (engine, choice)]
        missed = _misses(group)
        yield Part.of(*told(group), "all", MIXED if missed else REPRODUCED, miss=missed if _is_ours(group[0]) else "")
    absent = sorted(set(table.where(law=MISSING).column("engine")))
    if absent:
        yield Part(f"Not installed, hence not compared: {', '.join(absent)}.", NOT_TESTABLE, optional=True)


def _present(table: Table) -> list[Row]:
    return [row for row in table.records() if row["law"] != MISSING]


def _is_ours(row: Row) -> bool:
    return bool(row["engine"].endswith("(ours)"))


def _misses(rows: Iterable[Row]) -> str:
    """The misses in words, each with its settings."""
    found: dict[str, list[str]] = {}
    for row in (row for row in rows if row["law"] != MET):
        found.setdefault(f"{row['scene']} ({_worst(row)})", []).append(
            "with settings that suit it" if row["settings"] == OWN else f"at a step of {1e3 * MATCHED_STEP:g} ms")
    return ", ".join(f"{what} {' and '.join(how)}" for what, how in found.items())


def _met(rows: Sequence[Row]) -> int:
    return sum(row["law"] == MET for row in rows)


def _answer(tables: Mapping[str, Table], parts: Sequence[Part]) -> str:
    present = sorted(_present(tables["errors"]), key=lambda row: (not _is_ours(row), row["engine"]))
    own, matched = ([row for row in present if row["settings"] == choice] for choice in SETTINGS)
    others = ", ".join(dict.fromkeys(row["engine"] for row in present if not _is_ours(row))) or "no other engine"
    own_count = len({row["engine"] for row in present if _is_ours(row)})
    said = "; ".join(f"{engine}, {missed}" for engine, rows in groupby(present, key=lambda row: row["engine"])
                        if (missed := _misses(rows)))  # fmt: skip
    return (
        f"{others} and {own_count} methods of ours simulate {len({row['scene'] for row in present})} scenes with a "
        f"known outcome. The outcome is right in {_met(own)} of {len(own)} runs with settings that suit the engine and "
        f"in {_met(matched)} of {len(matched)} with a step of 1 ms." + (f" Wrong: {said}." if said else "")
    )


ERRORS = Check(
    key="errors", question="Does the engine give the known outcome?",
    cases=lambda study: product(SIMULATORS, FIXED_SCENES), row=_rows, says=_says, digits=2,
    note="Errors are relative to initial values: those of energy to the kinetic energy, those of momentum to the sum "
    "of m |v|, those of velocity to the largest speed. In resting scenes the rise of energy is relative to m g times "
    f"the bodies' size. The resting box is simulated for {QUICK_REST:g} s, the stack for {QUICK_STACK:g} s; with "
    "--full, for 60 s and 1 s. The outcome is right (“met”) if all errors are at most 1 % or, in a resting scene, if "
    "no body moves by more than 1 mm.",
)
engines = Topic(
    key="engines", title="Other engines",
    question="Every installed engine simulates eight frictionless scenes (listed below) with a known outcome. In six "
    "scenes it follows from symmetry and the conservation of energy and momentum; in two nothing must move. Each scene "
    "is simulated twice. “Own”: settings and a step that suit the engine, chosen by one rule for all impacts. "
    "“Matched”: a step of 1 ms, with the settings of least error on a grid. For MuJoCo and Drake they are chosen for "
    "each scene (docs/engines.md), so “matched” can be more exact than “own”. Our engine and our ideal world run with "
    "their defaults, a step of 1 ms. Pinocchio computes only the impacts; our code does the steps. So these three have "
    "the same result twice. MuJoCo and Drake have no coefficient of restitution; damped springs replace it. "
    "The overlap of bodies is shown, but does not decide the outcome.",
    checks=(ERRORS, Check(key="settings", question="With which settings did the engines run?",
                          cases=lambda study: SIMULATORS, row=_settings),
            Check(key="scenes", question="What must come out?", cases=lambda study: FIXED_SCENES,
                  row=lambda study, name: {"scene": name.replace("_", " "), "outcome": fixed_scene(name).law})),
    says=_answer,
)
