"""Counterexamples to the laws, stored so that they can be checked again.

A trajectory or an impact is stored as a run, an impact also in the FCLIB format. The other cases (a wall felt by the
hand, limits of a device, two rooms) are stored as a table with the seeds that draw them again.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from iapb.errors import IapbError, RunFileError
from iapb.scene import scene_from_text
from reference.complementarity.problem import ImpactProblem
from reference.datasets import write_fclib
from reference.one_thread import one_thread
from reference.worlds import run_world
from reports.by_name import function_named
from reports.store import read_run, write_run
from reports.store.impact import BrokenImpact, read_broken_impact, write_broken_impact
from reports.store.io import opened
from reports.store.keys import code_version, hash_of, sources_hash
from reports.store.tables import TABLE_FORMAT, read_record, write_record
from verification.laws import bounds
from verification.laws.bounds import LawResidual
from verification.laws.campaign import IMPACTS, PARTS, UNEQUAL, Found, Subject, drawn, residuals
from verification.laws.counterexample import as_test
from verification.laws.engine import ENGINE_LAWS
from verification.laws.equality import LAWS, UNEQUAL_LAWS
from verification.laws.trajectories import judge_run

ENGINE = "iapb:resolve_impact"
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
    origin = {"part": found.part, "index": found.index, "request": asdict(request)}  # to draw the case again
    if found.struck is None:
        record = {**origin, "law": found.law, "value": found.residual.value, "tolerance": found.residual.tolerance,
                  "case": found.case}  # fmt: skip
        return write_record(path, record, found.law, command=recheck_command(Path(path.name), request.resolver))
    case, subject, law = found.struck.case, request.subject(), (LAWS | UNEQUAL_LAWS | ENGINE_LAWS)[found.law]
    e, fclib = case.given_restitution(), path.with_suffix(".hdf5")
    if case.contacts and np.min(e) >= 0.0:
        try:
            write_fclib(fclib, ImpactProblem.from_impact(case.mass_matrix, case.contact_jacobian, case.velocity, e,
                                                         name=path.stem))
        except IapbError:  # FCLIB cannot express this extreme input; the run has it
            fclib.unlink(missing_ok=True)
    return write_broken_impact(path, BrokenImpact(
        found.struck, ENGINE if found.law in ENGINE_LAWS else request.resolver, found.law, law.statement,
        found.residual.value, found.residual.tolerance, origin,
        as_test(case, found.law, subject.bounds, subject.resolver)))  # fmt: skip


def recheck_command(path: Path, resolver: str) -> str:
    """Return the command that checks a counterexample of this resolver again."""
    return f"iapb verify --recheck {path}" + ("" if resolver == ENGINE else " --allow-code")


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
    with opened(path, expected_format=None) as file:
        is_record = file.attrs.get("format") == TABLE_FORMAT
    if is_record:
        record = read_record(path)
        yield _judged(path, str(record["law"]), record, None, allow_code)
    elif broken := read_broken_impact(path):
        yield _judged(path, broken.law, broken.found, broken.struck.case, allow_code)
    else:  # the laws on the stored arrays, then on the same scene simulated again
        run = read_run(path)
        world, _, rendering = run.world.partition(" ")
        again = run_world(scene_from_text(run.scene_source), world, rendering or "full", partial=True)
        for how, judged in (("as recorded", run), ("simulated again", again)):
            yield from ((f"{how}: {law}", residual) for law, residual in judge_run(judged))


def _judged(path: Path, law: str, origin: dict[str, Any], case: Any, allow_code: bool) -> tuple[str, LawResidual]:
    """Check a stored impact; if `case` is None, first draw the case again from its part, seed and index."""
    try:
        request = CampaignRequest(**origin["request"])
        part, index, own = origin["part"], origin["index"], request.resolver == ENGINE or allow_code
        if part not in PARTS or request.bounds not in BOUNDS:
            raise ValueError(f"part {part!r}, bounds {request.bounds!r}")
    except (TypeError, KeyError, ValueError) as error:
        raise RunFileError(f"{path}: is no counterexample: {error}") from error
    subject = (request if own else replace(request, resolver=ENGINE)).subject()
    with one_thread():  # as it was found
        found = residuals(part, drawn(part, index, subject) if case is None else case, subject)[0]
    if law not in found:
        raise RunFileError(f"{path}: is no counterexample: no law {law!r} of {part}")
    if own or part not in (IMPACTS, UNEQUAL):
        return law, found[law]
    return (f"{law} (by {ENGINE}; {request.resolver}, which the file names, is code that --allow-code runs)",
            found[law])  # fmt: skip
