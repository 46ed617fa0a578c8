"""`iapb store ACTION`: check stored results, remove files that are not needed, and simulate runs again."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from iapb.errors import ArgumentError, IapbError
from reports.commands.as_json import Json, print_json
from reports.commands.progress import stage_progress
from reports.live.replay import finish_live, is_live
from reports.provenance import linear_algebra
from reports.resimulate import Repetition, repeat_run
from reports.store.care import (
    DAMAGED,
    FOREIGN,
    WHOLE,
    FileState,
    check_store,
    collect_garbage,
    garbage,
    is_run,
    repair_store,
)
from reports.store.logs import is_damaged
from reports.store.runs import read_provenance
from reports.streaming import logs_of_killed, recover


class Action(StrEnum):
    """The action on a folder of results."""
    check = "check"
    repair = "repair"
    gc = "gc"
    again = "again"


_ACTION = ("check: read every file whole. repair: check, set damaged files aside. gc: list what nothing needs; "
           "remove it with --delete. again: simulate runs again and compare bit for bit.")


def store(
    action: Annotated[Action, typer.Argument(help=_ACTION)],
    where: Annotated[Path, typer.Argument(help="A folder of results, or one run file (check, again).")] = Path("out"),
    delete: Annotated[bool, typer.Option("--delete", help="gc: remove what it lists.")] = False,
    json_: Json = False,
) -> None:
    """Check, repair and clean up the run and table files below a folder.

    repair and gc act in marked stores only, and only on files of iapb.
    """
    if not (where.is_file() or where.is_dir()):
        raise ArgumentError("where", str(where), "a folder of results, or a run file")
    if where.resolve() == Path(where.resolve().anchor):
        raise ArgumentError("where", str(where), "a folder of results, not a whole file system")
    if where.is_file() and action in (Action.repair, Action.gc):
        raise ArgumentError("where", str(where), f"a folder of results: {action} is not for one file")
    if delete and action is not Action.gc:
        raise typer.BadParameter("only with the action gc", param_hint="--delete")
    if action is Action.gc:
        _gc(where, delete, json_)
    else:
        {Action.check: _check, Action.repair: _repair, Action.again: _again}[action](where, json_)


def _check(where: Path, json_: bool) -> None:
    with stage_progress() as progress:
        states = check_store(where, partial(progress, "files read whole"))
    _tell(states, json_)
    if where.is_file() and states[0].state == FOREIGN:
        raise typer.Exit(1)
    if any(state.state == DAMAGED for state in states):
        if not json_:
            print(f"Set the damaged files aside, to be computed again, with: iapb store repair {where}")
        raise typer.Exit(1)


def _repair(where: Path, json_: bool) -> None:
    with stage_progress() as progress:
        states = repair_store(where, partial(progress, "files read whole"))
    recovered = [line for log in logs_of_killed(where) for line in _recovered(log)]
    aside = sum(not state.path.exists() for state in states)
    if json_:
        _tell(states, json_, logs=recovered, aside=aside)
        return
    _tell(states)
    for line in recovered:
        print(line)
    print(f"{aside} damaged set aside, to be computed again when next asked for.")


def _recovered(log: Path) -> Iterator[str]:
    """Store the complete steps of a log as a readable run, and yield a sentence about it."""
    try:
        if not is_live(log):
            yield f"{recover(log)}: what a killed run did; iapb run --resume goes on"
            return
        yield f"{finish_live(log, 'killed')[0]}: what a killed live run did, with its timetable"
        if is_damaged(log):
            yield f"{log}: damaged; what is before the damage is in the run, the log is kept"
        else:
            log.unlink()
    except IapbError as error:
        yield f"{log}: left as it is: {str(error).removeprefix(f'{log}: ')}"


def _tell(states: Sequence[FileState], json_: bool = False, **more: Any) -> None:
    if json_:
        print_json({"files": states, "count": Counter(state.state for state in states)} | more)
        return
    for state in states:
        if state.state != WHOLE:
            print(f"{state.path}: {state.state}: {state.why}")
    count = Counter(state.state for state in states)
    parts = ", ".join(f"{number} {state}" for state, number in count.most_common())
    print(f"{len(states)} files: {parts or 'none'}")


def _gc(where: Path, delete: bool, json_: bool) -> None:
    found = garbage(where)
    size = sum(state.size for state in found) / 1e6
    if delete:
        collect_garbage(found)
    if json_:
        print_json({"files": found, "megabytes": size, "removed": delete})
        return
    for state in found:
        print(f"{state.path}: {state.state}: {state.why}")
    print(f"{len(found)} files, {size:.1f} MB, {'removed' if delete else 'would be removed by --delete'}; results of "
          "the present code, of your own code and all foreign files are kept.")


def _again(where: Path, json_: bool) -> None:
    files = [path for path in sorted(where.rglob("*.h5")) if is_run(path)] if where.is_dir() else [where]
    found: dict[Path, Repetition | str] = {}
    with stage_progress() as progress:
        for done, path in enumerate(files):
            progress("runs simulated again", done, len(files))
            try:
                found[path] = repeat_run(path)
            except IapbError as error:
                found[path] = f"not simulated again: {str(error).removeprefix(f'{path}: ')}"
            if not json_:
                _tell_again(path, found[path])
    same = sum(not isinstance(one, str) and one.same for one in found.values())
    if json_:
        print_json({"same": same, "files": {path: {"failed": one} if isinstance(one, str) else
                                            {"same": one.same, "differs": one.differs} for path, one in found.items()}})
    else:
        print(f"{same} of {len(files)} runs came out the same.")
    if same < len(files):
        raise typer.Exit(1)


def _tell_again(path: Path, found: Repetition | str) -> None:
    """Print what differs in a run that was simulated again, and by how much."""
    if isinstance(found, str):
        print(f"{path}: {found}")
        return
    print(f"{path}: " + ("the same to the last bit" if found.same else "differs in"))
    for one in found.differs:
        print(f"  {one.name}: {one.how}")
    made, here = read_provenance(path).get("blas", "unknown"), linear_algebra()
    if not found.same and made != here:
        print(f"  it was stored under {made}; this is {here}")
