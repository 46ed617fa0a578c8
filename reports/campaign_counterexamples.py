"""What broke a law, kept so that it can be judged again: an impact as a table and as FCLIB, a trajectory as its run."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from iapb.errors import IapbError, RunFileError
from reports.store_keys import plain
from reports.store_tables import Column, Table, read_table, write_table

if TYPE_CHECKING:
    from reports.campaign import CampaignRequest
    from verification.properties.campaign import Found
    from verification.properties.case import ImpactCase, LawResidual

_TABLE = "counterexample"


def keep_counterexample(folder: Path, found: Found, request: CampaignRequest) -> Path:
    """Write one; return its file. The same one again is the same file."""
    from reports.store import write_run

    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{found.part.replace(' ', '_')}-{found.index:09d}-{found.law}.h5"
    if found.run is not None:
        return write_run(path, found.run, replace=True)
    record = {"law": found.law, "part": found.part, "index": found.index, "request": asdict(request),
              "value": found.residual.value, "tolerance": found.residual.tolerance,
              "case": plain(asdict(found.case))}  # fmt: skip
    columns = (Column("json", (json.dumps(record),), "1", "law, tolerances and input as JSON"),)
    write_table(path, Table(_TABLE, columns, found.law, command=f"iapb verify --recheck {path.name}"))
    _write_fclib(path.with_suffix(".hdf5"), found.case)
    return path


def _write_fclib(path: Path, case: Any) -> None:
    """The impact as FCLIB too, where it is a problem of that kind: contacts, and a restitution in [0, 1]."""
    from reference.complementarity.problem import ImpactProblem
    from reference.fclib import write_fclib
    from verification.properties.case import ImpactCase

    if not isinstance(case, ImpactCase) or case.contacts == 0:
        return
    e = case.given_restitution()
    if np.min(e) < 0.0:
        return
    try:
        problem = ImpactProblem.from_impact(case.mass_matrix, case.contact_jacobian, case.velocity, e, name=path.stem)
        write_fclib(path, problem)
    except IapbError:  # an extreme input that is no such problem: the table has it
        path.unlink(missing_ok=True)


def recheck(path: Path) -> Iterator[tuple[str, LawResidual]]:
    """Judge a counterexample again: an impact by its resolver, a run as recorded and as it comes out now."""
    from reports.store_read import opened
    from reports.store_tables import TABLE_FORMAT

    if not path.is_file():
        raise RunFileError(f"{path}: no such file")
    try:
        with opened(path, TABLE_FORMAT):
            pass
    except RunFileError:
        yield from _recheck_run(path)
        return
    yield from _recheck_impact(json.loads(read_table(path, _TABLE)["json"][0]))


def _recheck_impact(record: dict[str, Any]) -> Iterator[tuple[str, LawResidual]]:
    """The stored impact itself; what is no impact is drawn again from its seed."""
    from reports.campaign import CampaignRequest
    from verification.properties.campaign import drawn, residuals

    subject, values = CampaignRequest(**record["request"]).subject(), record["case"]
    stored = "contact_jacobian" in values
    case = _impact_case(values) if stored else drawn(record["part"], record["index"], subject)
    yield record["law"], residuals(record["part"], case, subject)[0][record["law"]]


def _impact_case(values: dict[str, Any]) -> ImpactCase:
    from verification.properties.case import ImpactCase

    arrays: dict[str, Any] = dict(values)
    for name in ("mass_matrix", "contact_jacobian", "velocity", "translations", "unequal"):
        arrays[name] = None if values[name] is None else np.array(values[name], dtype=float)
    d = len(arrays["velocity"])
    arrays["contact_jacobian"] = arrays["contact_jacobian"].reshape(-1, d)
    return ImpactCase(**arrays)


def _recheck_run(path: Path) -> Iterator[tuple[str, LawResidual]]:
    """Laws on the stored arrays, then on the same scene simulated again."""
    from iapb.scene import scene_from_text
    from reference.worlds import run_world
    from reports.store import read_run
    from verification.properties.trajectory_laws import judge_run

    run = read_run(path)
    yield from ((f"as recorded: {law}", residual) for law, residual in judge_run(run))
    world, _, rendering = run.world.partition(" ")
    again = run_world(scene_from_text(run.scene_source), world, rendering or "full", partial=True)
    yield from ((f"simulated again: {law}", residual) for law, residual in judge_run(again))
