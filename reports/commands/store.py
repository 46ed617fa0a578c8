"""`iapb store ACTION`: are the results whole, what can go, and do they come out the same again?"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from iapb.errors import ArgumentError, IapbError
from reports.commands.progress import stage_progress
from reports.provenance import linear_algebra
from reports.resimulate import repeat_run
from reports.store.care import (
    DAMAGED,
    WHOLE,
    FileState,
    check_store,
    collect_garbage,
    garbage,
    is_run,
    repair_store,
)
from reports.store.runs import read_provenance


class Action(StrEnum):
    """What to do with a folder of results."""
    check = "check"
    repair = "repair"
    gc = "gc"
    again = "again"


_ACTION = ("check: read every file whole. repair: check, set damaged files aside, write the index anew. gc: remove "
           "what nothing needs. again: simulate runs again and compare bit for bit.")


def store(
    action: Annotated[Action, typer.Argument(help=_ACTION)],
    where: Annotated[Path, typer.Argument(help="A folder of results, or one run file (check, again).")] = Path("out"),
    dry_run: Annotated[bool, typer.Option("--dry-run", help="gc: only say what would be removed.")] = False,
) -> None:
    """Look after the run and table files below a folder."""
    if not where.exists():
        raise ArgumentError("where", str(where), "a folder of results, or a run file")
    if where.is_file() and action in (Action.repair, Action.gc):
        raise ArgumentError("where", str(where), f"a folder of results: {action} is not for one file")
    {Action.check: _check, Action.repair: _repair, Action.gc: _gc, Action.again: _again}[action](where, dry_run)


def _check(where: Path, _: bool) -> None:
    with stage_progress() as progress:
        states = check_store(where, lambda done, total: progress("files read whole", done, total))
    _tell(states)
    if any(state.state == DAMAGED for state in states):
        print(f"Set the damaged files aside, to be computed again, with: iapb store repair {where}")
        raise typer.Exit(1)


def _repair(where: Path, _: bool) -> None:
    with stage_progress() as progress:
        states = repair_store(where, lambda done, total: progress("files read whole", done, total))
    _tell(states)
    aside = sum(state.state == DAMAGED for state in states)
    print(f"The index is written anew; {aside} damaged set aside, to be computed again when next asked for.")


def _tell(states: Sequence[FileState]) -> None:
    for state in states:
        if state.state != WHOLE:
            print(f"{state.path}: {state.state}: {state.why}")
    count = Counter(state.state for state in states)
    parts = ", ".join(f"{number} {state}" for state, number in count.most_common())
    print(f"{len(states)} files: {parts or 'none'}")


def _gc(where: Path, dry_run: bool) -> None:
    found = garbage(where)
    size = sum(state.size for state in found) / 1e6
    for state in found:
        print(f"{state.path}: {state.state}: {state.why}")
    if not dry_run:
        collect_garbage(where)
    print(f"{len(found)} files, {size:.1f} MB, {'would be removed' if dry_run else 'removed'}; results of the present "
          "code are kept.")


def _again(where: Path, _: bool) -> None:
    files = [path for path in sorted(where.rglob("*.h5")) if is_run(path)] if where.is_dir() else [where]
    same = 0
    with stage_progress() as progress:
        for done, path in enumerate(files):
            progress("runs simulated again", done, len(files))
            same += _tell_again(path)
    print(f"{same} of {len(files)} runs came out the same.")
    if same < len(files):
        raise typer.Exit(1)


def _tell_again(path: Path) -> bool:
    """Simulate one run again, and say what differs and by how much; whether nothing does."""
    try:
        found = repeat_run(path)
    except IapbError as error:
        print(f"{path}: not simulated again: {str(error).removeprefix(f'{path}: ')}")
        return False
    print(f"{path}: " + ("the same to the last bit" if found.same else "differs in"))
    for one in found.differs:
        print(f"  {one.name}: {one.how}")
    made, here = read_provenance(path).get("blas", "unknown"), linear_algebra()
    if not found.same and made != here:
        print(f"  it was stored under {made}; this is {here}")
    return found.same
