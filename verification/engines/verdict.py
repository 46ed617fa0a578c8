"""The verdicts on the engines' runs: whether a run met its scene's law, one sentence per engine, and the finding."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from typing import Any

from iapb.run import Run
from reference.simulators import fixed_scene
from verification.engines.record import EngineRecord
from verification.engines.study import OWN, compare_engines
from verification.finding import (
    MIXED,
    NOT_TESTABLE,
    REPRODUCED,
    Failure,
    Finding,
    Part,
    Table,
    finding_of,
    table_of,
    titled,
)

TITLE = "Other engines"
QUESTION = (
    "Every installed engine simulates eight frictionless scenes of known outcome: conservation of energy and momentum "
    "with symmetry determine the outcome, or nothing may move. Each scene runs twice: with the settings that suit the "
    "engine best, and with a time step of 1 ms. One program computes energy, momentum and overlap from the positions "
    "and velocities of all engines. MuJoCo and Drake have no coefficient of restitution; springs with suitable damping "
    "replace it."
)
COLUMNS = titled((
    "engine", "version", "scene", "settings", "law", "energy error", "largest rise of energy", "momentum error",
    "velocity error", "overlap / size", "drift [m]", "creep [m]", "simulated [s]", "failure",
)).columns  # fmt: skip

# An engine with springs as contacts cannot be exact. A hundredth of the initial energy, momentum and speed is an error
# that a user would not notice, and far above rounding.
CLOSE = 1e-2
STAYS = 1e-3  # [m] a hundredth of the bodies' size
NEVER_RISES = 1e-6  # relative rise of energy: above the rounding of 60 000 steps

MET, MISSED, FAILED, MISSING = "met", "missed", "failed", "not installed"


def verdict(record: EngineRecord) -> str:
    """Return one of MET, MISSED, FAILED and MISSING."""
    if record.missing:
        return MISSING
    if record.failure:
        return FAILED
    if record.rests:
        return MET if (record.drift or 0.0) <= STAYS else MISSED
    errors = (record.energy_error, record.momentum_error, record.velocity_error)
    return MET if all(abs(error or 0.0) <= CLOSE for error in errors) else MISSED


def sentence(records: Sequence[EngineRecord]) -> str:
    """Return the results of one engine at one choice of settings in one sentence."""
    first = records[0]
    if first.missing:
        return f"{first.title} is not installed here: {first.missing}"
    met = [record for record in records if verdict(record) == MET]
    at = "with its own settings" if first.choice == OWN else f"with a step of {1e3 * (first.step or 0.0):g} ms"
    parts = [f"{first.title} {first.version}, {at}, gives the known outcome in {len(met)} of {len(records)} scenes"]
    missed = [f"{record.scene.replace('_', ' ')} ({_worst(record)})" for record in records if record not in met]
    if missed:
        parts.append("it misses it in " + ", ".join(missed))
    gains = [record for record in records if (record.energy_gain or 0.0) > NEVER_RISES]
    if gains:
        most = max(gains, key=lambda record: record.energy_gain or 0.0)
        parts.append(f"energy rises in {len(gains)} scene{'s' * (len(gains) > 1)}, with a relative rise of at most "
                     f"{most.energy_gain:.2g} ({most.scene.replace('_', ' ')})")  # fmt: skip
    else:
        parts.append("energy rises in no scene")
    return "; ".join(parts) + "."


def _worst(record: EngineRecord) -> str:
    """Return the measure with the largest error in words, or the failure."""
    if record.failure:
        return "failed: " + record.failure.rstrip(".")
    if record.rests:
        return f"moves by {record.drift:.3g} m"
    errors = {"energy": record.energy_error, "momentum": record.momentum_error, "velocity": record.velocity_error}
    name, value = max(errors.items(), key=lambda item: abs(item[1] or 0.0))
    return f"{name} off by {abs(value or 0.0):.2g}"


def engines(run: Callable[..., Run], depth: str, progress: Callable[[int, int], None]) -> Finding:
    """Compare all installed engines and name those that are not installed; `run` is not used."""
    failures: list[Failure] = []
    return finding(compare_engines(depth=depth, progress=progress, failures=failures), failures)


def finding(records: Sequence[EngineRecord], failures: Sequence[Failure] = ()) -> Finding:
    """Return one part per engine and choice of settings, and one on the engines that are not installed."""
    present = [record for record in records if not record.missing]
    groups: dict[tuple[str, str], list[EngineRecord]] = {}
    for record in present:
        groups.setdefault((record.engine, record.choice), []).append(record)
    parts = [Part(sentence(group), REPRODUCED if _met(group) == len(group) else MIXED) for group in groups.values()]
    ours = [k for k, group in enumerate(groups.values()) if _our_misses(group)]
    if ours:  # one clause for both choices of settings
        parts[ours[0]] = replace(parts[ours[0]], miss=_our_misses(present))
    absent = sorted({record.title for record in records if record.missing})
    if absent:
        said = f"Not installed, hence not compared: {', '.join(absent)}."
        parts.append(Part(said, NOT_TESTABLE, optional=True))
    own = [record for record in present if record.choice == OWN]
    matched = [record for record in present if record.choice != OWN]
    answer = (
        f"{len({record.engine for record in present})} engines on {len({record.scene for record in present})} scenes "
        f"of known outcome: the outcome is right in {_met(own)} of {len(own)} runs with the engine's own settings and "
        f"in {_met(matched)} of {len(matched)} with a step of 1 ms. {_misses(present)}"
    ).rstrip()
    tables = {"errors": errors_table(records), "settings": settings_table(records)}
    return finding_of("engines", TITLE, QUESTION, answer, parts, tables, failures)


def _misses(records: Sequence[EngineRecord]) -> str:
    """Return all misses by engine, ours first; "" if there is none."""
    missed: dict[str, list[str]] = {}
    for record in sorted(records, key=lambda record: (not record.title.endswith("(ours)"), record.title)):
        if verdict(record) != MET:
            missed.setdefault(record.title, []).append(
                f"{record.scene.replace('_', ' ')} {_at(record)} ({_worst(record)})")
    said = "; by ".join(f"{title}: {', '.join(each)}" for title, each in missed.items())
    return f"Missed by {said}." if missed else ""


def _our_misses(records: Sequence[EngineRecord]) -> str:
    """Return the misses of our engines, one clause per scene; "" if there is none."""
    missed: dict[str, list[str]] = {}
    for record in records:
        if record.title.endswith("(ours)") and verdict(record) != MET:
            missed.setdefault(record.scene.replace("_", " "), []).append(f"{_worst(record)} {_at(record)}")
    return "; ".join(f"{scene} {', '.join(each)}" for scene, each in missed.items())


def _at(record: EngineRecord) -> str:
    return "at own settings" if record.choice == OWN else "at 1 ms"


def _met(records: Sequence[EngineRecord]) -> int:
    return sum(verdict(record) == MET for record in records)


def errors_table(records: Sequence[EngineRecord]) -> Table:
    """Return the errors, one row per engine, scene and choice of settings, also for engines that are not installed."""
    note = ("Errors are relative to the kinetic energy at the start, to the sum of m |v| and to the largest speed; in "
            "resting scenes the rise of energy is relative to m g times the bodies' size. Law met: all errors are at "
            "most 1 %, or, in resting scenes, nothing moves by more than 1 mm.")
    return table_of(COLUMNS, map(_row, records), digits=2, note=note)


def _row(record: EngineRecord) -> dict[str, Any]:
    depth = None if record.penetration is None else record.penetration / fixed_scene(record.scene).length
    same = {name.replace("_", " "): value for name, value in asdict(record).items()}
    return same | {
        "engine": record.title, "scene": record.scene.replace("_", " "), "settings": record.choice,
        "law": verdict(record), "largest rise of energy": record.energy_gain, "overlap / size": depth,
        "simulated": record.duration or None,
    }  # fmt: skip


def settings_table(records: Sequence[EngineRecord]) -> Table:
    """Return the settings of every engine and the scenes in which they were used."""
    uses: dict[tuple[str, str, str, str], list[str]] = {}
    for record in records:
        key = (record.title, record.version or MISSING, record.settings, record.note)
        uses.setdefault(key, []).append(f"{record.scene.replace('_', ' ')} ({record.choice})")
    rows = [(title, version, settings, "" if version == MISSING else ", ".join(used), note)
            for (title, version, settings, note), used in uses.items()]  # fmt: skip
    return titled(("engine", "version", "settings", "used in", "what it cannot do"), rows)
