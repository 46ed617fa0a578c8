"""Topic "engines": other engines on the fixed scenes, at their own settings and at one step for all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from reports.runner import Runner
from verification.finding import (
    LIMITED,
    NOT_TESTABLE,
    REPRODUCED,
    Failure,
    Finding,
    Part,
    Table,
    finding_of,
    titled,
)

if TYPE_CHECKING:
    from verification.engines import EngineRecord

ID, TITLE = "engines", "Other engines"
LEAD = (
    "Eight scenes whose outcome is known, by energy, momentum and symmetry or because nothing may move, were given to "
    "every engine that is installed: without friction, each at the settings that suit it best and then at a step "
    "of 1 ms. Energy, momentum and overlap are computed from positions and velocities by one measure for all. MuJoCo "
    "and Drake have no coefficient of restitution; springs with the right damping stand in for it."
)
COLUMNS = (
    "engine", "version", "scene", "settings", "law", "energy error", "largest rise of energy", "momentum error",
    "velocity error", "overlap / size", "drift [m]", "creep [m]", "simulated [s]", "failure",
)  # fmt: skip
SETTINGS_COLUMNS = ("engine", "version", "settings", "used in", "what it cannot do")


def compute(runner: Runner, depth: str, progress: Callable[[int, int], None]) -> Finding:
    """Compare all engines that are here, and name those that are not."""
    from verification.engines import compare_engines

    failures: list[Failure] = []
    records = compare_engines(depth=depth, progress=progress, failures=failures)
    tables = {"errors": errors_table(records), "settings": settings_table(records)}
    return finding_of(ID, TITLE, LEAD, verdict_of(records), findings(records), tables, failures)


def findings(records: Sequence[EngineRecord]) -> tuple[Part, ...]:
    """One sentence per engine and choice of settings, and one on those that are not installed."""
    from verification.engines import sentence

    found = [Part(sentence(group), _outcome(group)) for group in _groups(records)]
    absent = sorted({record.title for record in records if record.missing})
    if absent:
        found.append(Part(f"Not installed here, and so not compared: {', '.join(absent)}.", NOT_TESTABLE))
    return tuple(found)


def verdict_of(records: Sequence[EngineRecord]) -> str:
    """The sentence of the first page."""
    from verification.engines import verdict

    present = [record for record in records if not record.missing]
    engines = list(dict.fromkeys(record.title for record in present))
    own = [record for record in present if record.choice == "own"]
    matched = [record for record in present if record.choice == "matched"]
    met = [sum(verdict(record) == "met" for record in group) for group in (own, matched)]
    scenes = len({record.scene for record in present})
    return (f"{len(engines)} engines on {scenes} scenes of known outcome: the law is met in {met[0]} of {len(own)} "
            f"runs at their own settings and in {met[1]} of {len(matched)} at 1 ms.")  # fmt: skip


def errors_table(records: Sequence[EngineRecord]) -> Table:
    """A row per engine, scene and choice of settings; an engine that is not installed keeps its rows."""
    from reference.simulators import fixed_scene
    from verification.engines import verdict

    rows = []
    for record in records:
        depth = None if record.penetration is None else record.penetration / fixed_scene(record.scene).length
        rows.append((
            record.title, record.version, record.scene.replace("_", " "), record.choice, verdict(record),
            record.energy_error, record.energy_gain, record.momentum_error, record.velocity_error, depth, record.drift,
            record.creep, record.duration or None, record.failure,
        ))  # fmt: skip
    note = ("Errors are shares of the start's kinetic energy, of the sum of m |v| and of the largest speed; at rest "
            "the rise is a share of m g times the bodies' size. A law is met within 1 %, at rest within 1 mm.")
    return titled(COLUMNS, tuple(rows), 2, note)


def settings_table(records: Sequence[EngineRecord]) -> Table:
    """What every engine was run with, and where."""
    uses: dict[tuple[str, str, str, str], list[str]] = {}
    for record in records:
        key = (record.title, record.version or "not installed", record.settings, record.note)
        uses.setdefault(key, []).append(f"{record.scene.replace('_', ' ')} ({record.choice})")
    rows = [(title, version, settings, "" if version == "not installed" else ", ".join(used), note)
            for (title, version, settings, note), used in uses.items()]  # fmt: skip
    return titled(SETTINGS_COLUMNS, tuple(rows))


def _groups(records: Sequence[EngineRecord]) -> list[list[EngineRecord]]:
    present = [record for record in records if not record.missing]
    keys = dict.fromkeys((record.engine, record.choice) for record in present)
    return [[record for record in present if (record.engine, record.choice) == key] for key in keys]


def _outcome(records: Sequence[EngineRecord]) -> str:
    from verification.engines import verdict

    return REPRODUCED if all(verdict(record) == "met" for record in records) else LIMITED
