"""`iapb store ACTION`: check stored results, and simulate runs again."""

from __future__ import annotations

from collections import Counter
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from iapb.errors import ArgumentError
from reports.provenance import linear_algebra
from reports.resimulate import repeat_run
from reports.show import Answer, Json, one_line, said, stage_progress
from reports.store.check import (
    CHANGED,
    DAMAGED,
    FOREIGN,
    OPEN,
    OTHER,
    WHOLE,
    check_store,
    is_run,
    seal_again,
)
from reports.store.runs import read_provenance


class Action(StrEnum):
    """The action on a folder of results."""

    check = "check"
    again = "again"
    seal = "seal"


_ACTION = (
    "check: read every file whole. again: simulate runs again and compare bit for bit. seal: check, "
    "and seal again what was changed while its data stayed whole."
)


def store(
    action: Annotated[Action, typer.Argument(help=_ACTION)],
    where: Annotated[Path, typer.Argument(help="A folder of results, or one run file.")] = Path(
        "out"
    ),
    json_: Json = False,
) -> Answer:
    """Check the run and table files below a folder, or simulate its runs again."""
    if not (where.is_file() or where.is_dir()):
        raise ArgumentError("where", str(where), "a folder of results, or a run file")
    if where.resolve() == Path(where.resolve().anchor):
        raise ArgumentError("where", str(where), "a folder of results, not a whole file system")
    return _again(where) if action is Action.again else _checked(where, action is Action.seal)


def _checked(where: Path, seal: bool) -> Answer:
    """Read every file; list those that are not whole, and count the states; seal changed ones
    again."""
    with stage_progress() as progress:
        states = check_store(where, partial(progress, "files read whole"))
    count = Counter(state.state for state in states)
    lines = [
        f"{one_line(state.path)}: {state.state}: {state.why}"
        for state in states
        if state.state != WHOLE
    ]
    parts = ", ".join(f"{number} {state}" for state, number in count.most_common())
    lines.append(f"{len(states)} files: {parts or 'none'}")
    if count[DAMAGED]:
        lines.append("Remove a damaged run to have it computed again.")
    for state in states if seal else ():
        if state.state == CHANGED:
            seal_again(state)
            lines.append(f"{one_line(state.path)}: sealed again")
    failed = count[DAMAGED] or where.is_file() and count[FOREIGN] + count[OTHER] + count[OPEN]
    return Answer({"files": states, "count": count}, lines, int(bool(failed)))


def _again(where: Path) -> Answer:
    """Simulate the runs again; list what differs, and by how much."""
    files = (
        [path for path in sorted(where.rglob("*.h5")) if is_run(path)]
        if where.is_dir()
        else [where]
    )
    facts = dict[Path, dict[str, object]]()
    lines = list[str]()
    with stage_progress() as progress:
        for done, path in enumerate(files):
            progress("runs simulated again", done, len(files))
            try:
                found = repeat_run(path)
            except Exception as error:  # a run made by other software: any error is possible
                facts[path] = {"failed": f"not simulated again: {said(error, path)}"}
                lines.append(f"{one_line(path)}: {facts[path]['failed']}")
                continue
            facts[path] = {"same": found.same, "differs": found.differs}
            lines.append(
                f"{one_line(path)}: {'the same to the last bit' if found.same else 'differs in'}"
            )
            lines += [f"  {one.name}: {one.how}" for one in found.differs]
            made = read_provenance(path).get("blas", "unknown")
            here = linear_algebra()
            if not found.same and made != here:
                lines.append(f"  it was stored under {made}; this is {here}")
    same = sum(bool(one.get("same")) for one in facts.values())
    return Answer(
        {"same": same, "files": facts},
        [*lines, f"{same} of {len(files)} runs came out the same."],
        int(same < len(files)),
    )
