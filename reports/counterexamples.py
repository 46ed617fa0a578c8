"""Counterexamples to the laws, stored so that they can be checked again.

A trajectory is stored as its run, all other cases as a record with the seeds that draw them again: an impact also with
its numbers and the answers of the resolver.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from iapb.by_name import function_named
from iapb.errors import RunFileError
from iapb.scene import scene_from_text
from reference.one_thread import one_thread
from reference.worlds import run_world
from reports.store import read_run, write_run
from reports.store.io import opened
from reports.store.keys import code_version, hash_of, sources_hash
from reports.store.schema import FORMAT
from reports.store.tables import read_record, write_record
from verification.impacts import ImpactCase
from verification.laws import bounds
from verification.laws.bounds import LawResidual
from verification.laws.campaign import IMPACTS, PARTS, UNEQUAL, Found, Subject, drawn, residuals
from verification.laws.counterexample import as_test
from verification.laws.engine import ENGINE_LAWS
from verification.laws.equality import LAWS, UNEQUAL_LAWS
from verification.laws.trajectories import judge_run

ENGINE = "iapb:resolve_impact"
WRONG = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)  # what a forged record raises
BOUNDS = ("FACTORED", "KIT")  # tolerances, by their names in verification.laws.bounds


@dataclass(frozen=True)
class CampaignRequest:
    """What a campaign verifies: the resolver and the tolerances, both given by name, and the number of cases.

    workers : number of worker processes; 1 = this process alone.
    """

    resolver: str
    bounds: str
    largest_condition: float
    impacts: int
    trajectories: int
    seed: int
    workers: int

    def subject(self) -> Subject:
        """Import the resolver, and return it with its tolerances as the subject of the laws."""
        tested = function_named("--resolver", self.resolver)
        return Subject(tested, getattr(bounds, self.bounds), self.largest_condition, self.seed)

    def key(self) -> str:
        """Return a hash of everything that a batch depends on; the number of batches does not enter it."""
        asked = {"resolver": self.resolver, "bounds": self.bounds, "condition": self.largest_condition,
                 "seed": self.seed, "code": code_version(), "laws": sources_hash("verification")}  # fmt: skip
        return hash_of(asked)[:16]


def keep_counterexample(folder: Path, found: Found, request: CampaignRequest) -> Path:
    """Write a counterexample and return its file; the same counterexample always has the same file name."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{found.part.replace(' ', '_')}-{found.index:09d}-{found.law}.h5"
    if found.run is not None:
        return write_run(path, found.run, replace=True)
    record = {"law": found.law, "resolver": request.resolver, "value": found.residual.value,
              "tolerance": found.residual.tolerance, "part": found.part, "index": found.index, "request": request,
              "case": found.case, "test": ""}  # fmt: skip
    if found.struck is not None:
        case, subject, law = found.case, request.subject(), (LAWS | UNEQUAL_LAWS | ENGINE_LAWS)[found.law]
        record |= {"resolver": ENGINE if found.law in ENGINE_LAWS else request.resolver, "statement": law.statement,
                   **found.struck, "test": as_test(case, found.law, subject.bounds, subject.resolver)}  # fmt: skip
    return write_record(path, record, found.law, command=recheck_command(Path(path.name), request.resolver))


def read_counterexample(path: Path) -> dict[str, Any] | None:
    """Return the record of a counterexample, or None for a run.

    Raises
    ------
    RunFileError
        The file is absent, damaged, or neither a run nor a counterexample.
    """
    with opened(path, expected_format=None) as file:
        if file.attrs.get("format") == FORMAT:
            return None
    record = read_record(path)
    try:
        request = CampaignRequest(**record["request"])
        if record["part"] not in PARTS or request.bounds not in BOUNDS:
            raise ValueError(f"part {record['part']!r}, bounds {request.bounds!r}")
        case = _impact_of(record["case"]) if record["test"] else record["case"]
        texts = {name: str(record.get(name, "")) for name in ("law", "resolver", "statement", "complaint", "test")}
        numbers = {name: float(record[name]) for name in ("value", "tolerance")}
        after = np.asarray(record.get("velocity_after", []), np.float64)
        return record | texts | numbers | {"request": request, "index": int(record["index"]), "case": case,
                                           "velocity_after": after}  # fmt: skip
    except WRONG as error:
        raise RunFileError(f"{path}: is no counterexample: {error}") from error


def _impact_of(told: dict[str, Any]) -> ImpactCase:
    d = len(told["velocity"])
    shapes = {"mass_matrix": (d, d), "contact_jacobian": (-1, d), "velocity": (d,), "unequal": (-1,),
              "translations": (-1, d), "touching": (-1, d), "friction": (-1,)}
    return ImpactCase(**told | {name: np.array(value, np.float64).reshape(shapes.get(name, np.shape(value)))
                                for name, value in told.items() if name in shapes or isinstance(value, list)
                                if value is not None} | {"restitution": float(told["restitution"])})  # fmt: skip


def recheck_command(path: Path, resolver: str) -> str:
    """Return the command that checks a counterexample of this resolver again."""
    return f"iapb verify --recheck {shlex.quote(str(path))}" + ("" if resolver == ENGINE else " --allow-code")


def recheck(path: Path, allow_code: bool = False) -> Iterator[tuple[str, LawResidual]]:
    """Check a counterexample again: an impact with a resolver, a run as recorded and as simulated now.

    Parameters
    ----------
    path : file of the counterexample
    allow_code : whether the resolver that the file names is imported and called. A file may name any module, so by
        default the engine's own resolver is used, and the name of the law says so.

    Raises
    ------
    RunFileError
        The file is absent, damaged, or not a counterexample.
    """
    if record := read_counterexample(path):
        yield _judged(path, record, allow_code)
    else:  # the laws on the stored arrays, then on the same scene simulated again
        run = read_run(path)
        world, _, rendering = run.world.partition(" ")
        again = run_world(scene_from_text(run.scene_source), world, rendering or "full", partial=True)
        for how, judged in (("as recorded", run), ("simulated again", again)):
            yield from ((f"{how}: {law}", residual) for law, residual in judge_run(judged))


def _judged(path: Path, record: dict[str, Any], allow_code: bool) -> tuple[str, LawResidual]:
    """Check a stored impact; draw any other case again from its part, seed and index."""
    request, part, law = record["request"], record["part"], record["law"]
    own = request.resolver == ENGINE or allow_code
    subject = (request if own else replace(request, resolver=ENGINE)).subject()
    try:
        with one_thread():  # as it was found
            case = record["case"] if record["test"] else drawn(part, record["index"], subject)
            found = residuals(part, case, subject)[0]
    except WRONG as error:
        raise RunFileError(f"{path}: is no counterexample: {error}") from error
    if law not in found:
        raise RunFileError(f"{path}: is no counterexample: no law {law!r} of {part}")
    if own or part not in (IMPACTS, UNEQUAL):
        return law, found[law]
    return (f"{law} (by {ENGINE}; {request.resolver}, which the file names, is code that --allow-code runs)",
            found[law])  # fmt: skip
