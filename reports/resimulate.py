"""Simulate a stored run again, from its own file alone, and compare the results bit for bit."""

from __future__ import annotations

from dataclasses import dataclass, fields
from importlib import import_module
from pathlib import Path
from typing import Any

from iapb.errors import ArgumentError
from iapb.haptics.coupling import Coupling, FourChannel, NoCoupling, UnilateralCoupler
from iapb.names import one_of
from iapb.run import Run
from iapb.scene import Scene

# name of a law -> (module, class); any other law is made again where a world has it
LAWS = {
    "impulse-augmented penalty": ("iapb.contact.laws", "ImpulseAugmented"),
    "impulse-augmented penalty with impact friction": ("iapb.contact.laws", "ImpulseAugmented"),
    "penalty": ("iapb.contact.laws", "Penalty"),
    "rigid constraints": ("reference.time_stepping", "RigidConstraints"),
}
COUPLINGS: dict[str, Any] = {kind.name: kind for kind in (NoCoupling, FourChannel, UnilateralCoupler)}


@dataclass(frozen=True)
class Repetition:
    """A run simulated again: the two content hashes, and what differs where they do."""

    file: str
    stored: str
    again: str
    differs: tuple[str, ...]

    @property
    def same(self) -> bool:
        """Whether every result is the same, bit for bit."""
        return self.stored == self.again


def repeat_run(path: Path | str) -> Repetition:
    """Simulate the run in a file again.

    Raises
    ------
    RunFileError
        The file is no run, or damaged.
    ArgumentError
        Its law or coupling is not one of ours: it cannot be made again from the file alone.
    """
    from iapb.simulation import simulate
    from reports.store.keys import content_hash
    from reports.store.runs import read_run

    stored = read_run(path)
    again = simulate(scene_of(stored), law_of(stored), coupling_of(stored), world=stored.world, steps=stored.steps)
    return Repetition(str(path), content_hash(stored), content_hash(again), differences(stored, again))


def scene_of(run: Run) -> Scene:
    """The scene of a run, from its resolved values."""
    from iapb.scene.space import scene_kind

    scene: Scene = scene_kind(run.scene_resolved).model_validate(run.scene_resolved)
    scene._source_text = run.scene_source
    return scene


def law_of(run: Run) -> Any:
    """The contact law of a run with its settings: one of LAWS, or that of the world that the run names."""
    if run.law in LAWS:
        module, name = LAWS[run.law]
        kind = getattr(import_module(module), name)
        return kind(**_known(kind, run.law_settings))
    law = _law_of_world(run.world)
    if law is None or (law.name, dict(law.settings)) != (run.law, dict(run.law_settings)):
        raise ArgumentError("law", run.law, one_of(run.law, LAWS) + ", or a world's (any other law is not in the file)")
    return law


def _law_of_world(name: str) -> Any:
    """The law of a world of reference/worlds.py, None where there is no such world."""
    from reference.worlds import WORLDS, find_world

    return find_world(name).law if name in WORLDS else None


def coupling_of(run: Run) -> Coupling:
    """The coupling of a run with its gains."""
    if run.coupling not in COUPLINGS:
        raise ArgumentError("coupling", run.coupling, one_of(run.coupling, COUPLINGS))
    kind = COUPLINGS[run.coupling]
    settings = _known(kind, run.coupling_settings)
    made: Coupling = kind(**{name: tuple(v) if isinstance(v, list) else v for name, v in settings.items()})
    return made


def _known(kind: Any, settings: Any) -> dict[str, Any]:
    """The settings that are parameters; others only say what the law does."""
    names = {field.name for field in fields(kind) if field.init}
    return {name: value for name, value in settings.items() if name in names}


def differences(stored: Run, again: Run) -> tuple[str, ...]:
    """Names of the results that are not the same bit for bit."""
    import numpy as np

    from reports.store.schema import GROUPS, RESULT_GROUPS

    found = []
    for group in RESULT_GROUPS:
        quantities, record_of, _ = GROUPS[group]
        for quantity in quantities:
            a, b = (np.asarray(getattr(record_of(run), quantity.name)) for run in (stored, again))
            if a.shape != b.shape or a.tobytes() != b.tobytes():
                found.append(f"{group}/{quantity.name}")
    return tuple(found)
