"""Simulate a stored run again from its file alone, and compare the results bit for bit."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, fields
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from iapb.errors import ArgumentError
from iapb.haptics.coupling import Coupling, FourChannel, NoCoupling, UnilateralCoupler
from iapb.names import one_of
from iapb.run import Run
from iapb.scene import Scene
from iapb.scene.reading import scene_from_values
from iapb.simulation import simulate
from iapb.worlds import find_world
from reports.store.keys import canonical_json, content_hash, result_head, results_of
from reports.store.runs import read_run
from reports.view.loop import PULLED

# name of a law -> (module, class); any other law is taken from the world that has it
LAWS = {
    "impulse-augmented penalty": ("iapb.contact.laws", "ImpulseAugmented"),
    "impulse-augmented penalty with impact friction": ("iapb.contact.laws", "ImpulseAugmented"),
    "penalty": ("iapb.contact.laws", "Penalty"),
    "rigid constraints": ("reference.time_stepping", "RigidConstraints"),
}
COUPLINGS: dict[str, Any] = {
    kind.name: kind for kind in (NoCoupling, FourChannel, UnilateralCoupler)
}


@dataclass(frozen=True)
class Change:
    """One result that differs between the stored and the repeated run, and how.

    largest : largest absolute difference of the numbers; infinite if they cannot be subtracted
        (different shapes, or a NaN in one of the two).
    """

    name: str
    how: str
    largest: float = np.inf

    def __str__(self) -> str:
        return f"{self.name} ({self.how})"


@dataclass(frozen=True)
class Repetition:
    """The comparison of a stored run with its repetition: both content hashes, and the results that
    differ."""

    stored: str
    again: str
    differs: tuple[Change, ...]

    @property
    def same(self) -> bool:
        """Whether all results are equal, bit for bit."""
        return self.stored == self.again


def repeat_run(path: Path | str) -> Repetition:
    """Simulate the run in a file again.

    Raises
    ------
    RunFileError
        The file is not a run, or it is damaged.
    ArgumentError
        The law or coupling is not one of the project's, or the mouse pulled the tool, so the file
        alone does not suffice to repeat the run.
    """
    stored = read_run(path)
    if PULLED in stored.remarks:
        raise ArgumentError(
            "path", str(path), "a run without the mouse, which its scene gives again"
        )
    again = simulate(
        scene_of(stored),
        law_of(stored),
        coupling_of(stored),
        world=stored.world,
        steps=stored.steps_done,
        every=stored.every,
    )
    return Repetition(content_hash(stored), content_hash(again), differences(stored, again))


def scene_of(run: Run) -> Scene:
    """Return the scene of a run, from its resolved values."""
    scene = scene_from_values(run.scene_resolved)
    scene._source_text = run.scene_source
    return scene


def law_of(run: Run) -> Any:
    """Return the contact law of a run with its settings: one of LAWS, or the law of the run's
    world."""
    if run.law in LAWS:
        module, name = LAWS[run.law]
        return _made(getattr(import_module(module), name), run.law_settings)
    law: Any = None
    with suppress(ArgumentError):  # a world of one's own
        law = find_world(run.world).law
    law = law.within(scene_of(run)) if hasattr(law, "within") else law
    if law is None or (law.name, dict(law.settings)) != (run.law, dict(run.law_settings)):
        raise ArgumentError(
            "law",
            run.law,
            one_of(run.law, LAWS)
            + ", or the law of a world; other laws are not stored in the file",
        )
    return law


def coupling_of(run: Run) -> Coupling:
    """Return the coupling of a run with its gains."""
    if run.coupling not in COUPLINGS:
        raise ArgumentError("coupling", run.coupling, one_of(run.coupling, COUPLINGS))
    made: Coupling = _made(COUPLINGS[run.coupling], run.coupling_settings)
    return made


def _made(kind: Any, settings: Any) -> Any:
    """Return a law or coupling with those settings that it takes; the other ones only describe
    it."""
    names = {field.name for field in fields(kind) if field.init}
    try:
        return kind(
            **{
                name: tuple(value) if isinstance(value, list) else value
                for name, value in settings.items()
                if name in names
            }
        )
    except (TypeError, AttributeError) as error:  # settings of a file
        raise ArgumentError("settings", settings, f"those of {kind.name}") from error


def differences(stored: Run, again: Run) -> tuple[Change, ...]:
    """Return every result that is not equal bit for bit; there is none if the content hashes are
    equal."""
    heads = (result_head(stored), result_head(again))
    arrays = (dict(results_of(stored)), dict(results_of(again)))
    found = [
        Change(name, f"is {heads[1][name]}, was {old}")
        for name, old in heads[0].items()
        if canonical_json(old) != canonical_json(heads[1][name])
    ]
    for name in dict.fromkeys([*arrays[0], *arrays[1]]):
        if any(name not in side for side in arrays):
            found.append(
                Change(name, "only stored" if name in arrays[0] else "only simulated again")
            )
        else:
            found.extend(_changes(name, *(np.asarray(side[name]) for side in arrays)))
    return tuple(found)


def _changes(name: str, stored: np.ndarray, again: np.ndarray) -> Iterator[Change]:
    if (stored.shape, stored.dtype) != (again.shape, again.dtype):
        yield Change(name, f"is {again.dtype} {again.shape}, was {stored.dtype} {stored.shape}")
    elif stored.tobytes() != again.tobytes():
        other = stored != again  # true for NaN on both sides
        a = stored[other].astype(float)
        b = again[other].astype(float)
        bits = np.isnan(a) & np.isnan(b)
        if np.all(bits):
            yield Change(
                name, "in bits that no comparison of numbers shows (the sign of a zero, a NaN)", 0.0
            )
            return
        largest = float(np.max(np.nan_to_num(np.abs(a[~bits] - b[~bits]), nan=np.inf)))
        yield Change(
            name, f"by at most {largest:.2g} in {np.sum(~bits)} of {stored.size} values", largest
        )
