"""`iapb store ACTION`: check stored results, remove files that are not needed, and simulate runs again."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from iapb.errors import ArgumentError
from reports.provenance import linear_algebra
from reports.resimulate import recover, repeat_run
from reports.show import Answer, Json, one_line, said, stage_progress
from reports.store import care
from reports.store.runs import read_provenance


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
    return _again(where) if action is Action.again else _checked(where, action is Action.repair)


def _listed(states: Sequence[care.FileState]) -> list[str]:
    return [f"{one_line(state.path)}: {state.state}: {state.why}" for state in states if state.state != care.WHOLE]


def _checked(where: Path, repair: bool) -> Answer:
    with stage_progress() as progress:
        states = (care.repair_store if repair else care.check_store)(where, partial(progress, "files read whole"))
    count = Counter(state.state for state in states)
    facts = {"files": states, "count": count}
    parts = ", ".join(f"{number} {state}" for state, number in count.most_common())
    lines = [*_listed(states), f"{len(states)} files: {parts or 'none'}"]
    if repair:
        logs = [line for parts in care.parts_of_killed(where) for line in _recovered(parts)]
        aside = sum(state.state == care.DAMAGED and not state.path.exists() for state in states)
        lines += [*logs, f"{aside} damaged set aside, to be computed again when next asked for."]
        return Answer(facts | {"logs": logs, "aside": aside}, lines)
    if count[care.DAMAGED]:
        lines.append(f"iapb store repair {where} sets aside damaged files whose seal holds; remove the others.")
    failed = count[care.DAMAGED] or where.is_file() and count[care.FOREIGN] + count[care.OTHER]
    return Answer(facts, lines, int(bool(failed)))


def _recovered(parts: Path) -> Iterator[str]:
    """Store the complete steps in parts as a readable run, and yield a sentence about it."""
    try:
        yield f"{recover(parts)}: what a killed run did; iapb run --resume goes on"
    except Exception as error:  # parts made by other software: any error is possible
        yield f"{one_line(parts)}: left as they are: {said(error, parts)}"


def _gc(where: Path, delete: bool) -> Answer:
    found = care.garbage(where)
    size = sum(state.size for state in found) / 1e6
    if delete:
        care.collect_garbage(found)
    return Answer({"files": found, "megabytes": size, "removed": delete}, [
        *_listed(found),
        f"{len(found)} files, {size:.1f} MB, {'removed' if delete else 'would be removed by --delete'}; results of the "
        "present code, of your own code and all foreign files are kept."])


def _again(where: Path) -> Answer:
    """Simulate the runs again; list what differs, and by how much."""
    files = [path for path in sorted(where.rglob("*.h5")) if care.is_run(path)] if where.is_dir() else [where]
    facts, lines = dict[Path, dict[str, object]](), list[str]()
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
            lines.append(f"{one_line(path)}: {'the same to the last bit' if found.same else 'differs in'}")
            lines += [f"  {one.name}: {one.how}" for one in found.differs]
            made, here = read_provenance(path).get("blas", "unknown"), linear_algebra()
            if not found.same and made != here:
                lines.append(f"  it was stored under {made}; this is {here}")
    same = sum(bool(one.get("same")) for one in facts.values())
    return Answer({"same": same, "files": facts}, [*lines, f"{same} of {len(files)} runs came out the same."],
                  int(same < len(files)))
