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
from reports.commands.answer import Answer, Json
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
) -> Answer:
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
        return _gc(where, delete)
    return {Action.check: _check, Action.repair: _repair, Action.again: _again}[action](where)


def _check(where: Path) -> Answer:
    with stage_progress() as progress:
        states = check_store(where, partial(progress, "files read whole"))
    damaged = any(state.state == DAMAGED for state in states)
    lines = _states(states)
    if damaged:
        lines.append(f"Set the damaged files aside, to be computed again, with: iapb store repair {where}")
    foreign = where.is_file() and states[0].state == FOREIGN
    return Answer(_facts(states), lines, 1 if damaged or foreign else 0)


def _repair(where: Path) -> Answer:
    with stage_progress() as progress:
        states = repair_store(where, partial(progress, "files read whole"))
    recovered = [line for log in logs_of_killed(where) for line in _recovered(log)]
    aside = sum(not state.path.exists() for state in states)
    last = f"{aside} damaged set aside, to be computed again when next asked for."
    return Answer(_facts(states) | {"logs": recovered, "aside": aside}, [*_states(states), *recovered, last])


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


def _facts(states: Sequence[FileState]) -> dict[str, Any]:
    return {"files": states, "count": Counter(state.state for state in states)}


def _states(states: Sequence[FileState]) -> list[str]:
    count = Counter(state.state for state in states)
    parts = ", ".join(f"{number} {state}" for state, number in count.most_common())
    return [*(f"{state.path}: {state.state}: {state.why}" for state in states if state.state != WHOLE),
            f"{len(states)} files: {parts or 'none'}"]


def _gc(where: Path, delete: bool) -> Answer:
    found = garbage(where)
    size = sum(state.size for state in found) / 1e6
    if delete:
        collect_garbage(found)
    return Answer({"files": found, "megabytes": size, "removed": delete}, [
        *(f"{state.path}: {state.state}: {state.why}" for state in found),
        f"{len(found)} files, {size:.1f} MB, {'removed' if delete else 'would be removed by --delete'}; results of the "
        "present code, of your own code and all foreign files are kept."])


def _again(where: Path) -> Answer:
    files = [path for path in sorted(where.rglob("*.h5")) if is_run(path)] if where.is_dir() else [where]
    found: dict[Path, Repetition | str] = {}
    with stage_progress() as progress:
        for done, path in enumerate(files):
            progress("runs simulated again", done, len(files))
            try:
                found[path] = repeat_run(path)
            except IapbError as error:
                found[path] = f"not simulated again: {str(error).removeprefix(f'{path}: ')}"
    same = sum(not isinstance(one, str) and one.same for one in found.values())
    facts = {"same": same, "files": {path: {"failed": one} if isinstance(one, str) else
                                     {"same": one.same, "differs": one.differs} for path, one in found.items()}}
    lines = [line for path, one in found.items() for line in _repeated(path, one)]
    return Answer(facts, [*lines, f"{same} of {len(files)} runs came out the same."], 1 if same < len(files) else 0)


def _repeated(path: Path, found: Repetition | str) -> Iterator[str]:
    """Yield what differs in a run that was simulated again, and by how much."""
    if isinstance(found, str):
        yield f"{path}: {found}"
        return
    yield f"{path}: " + ("the same to the last bit" if found.same else "differs in")
    for one in found.differs:
        yield f"  {one.name}: {one.how}"
    made, here = read_provenance(path).get("blas", "unknown"), linear_algebra()
    if not found.same and made != here:
        yield f"  it was stored under {made}; this is {here}"
