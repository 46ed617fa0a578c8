"""`iapb solvers`: complementarity solvers on problem files, or beside IAPB on impacts."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from iapb.errors import ArgumentError
from reference.datasets import problem_files
from reference.worlds import run_world
from reports.show import Answer, Json, sentence, stage_progress
from reports.store.io import write_whole
from verification.check import Topic
from verification.complementarity.solvers import collections
from verification.complementarity.topic import complementarity
from verification.finding import Finding
from verification.table import Table, titled

FOLDER = Path("out/compare")


def solvers(
    problems: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[FOLDER...]",
            help="Folders of problem files (LCP, FCLIB); without one: IAPB and complementarity, on random impacts "
            "and the project's scenes.",
        ),
    ] = None,
    full: Annotated[
        bool, typer.Option("--full", help="Without a folder: ten times the impacts, more repeats.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option(help="File of the results, .json; default: in out/compare.")
    ] = None,
    json_: Json = False,
) -> Answer:
    """Put problem files to every complementarity solver; or compare IAPB with complementarity."""
    place = as_json_file(out)
    folders = {str(folder): folder for folder in problems or ()}
    for name, folder in folders.items():
        if not problem_files(folder):
            kinds = ".lcp, .lcp.gz, .dat, .hdf5, .h5"
            raise ArgumentError("FOLDER", name, f"a folder with problem files ({kinds})")
    topic = complementarity({})
    if folders:
        topic = Topic(
            key="problems",
            title="Solvers on problem files",
            question="",
            checks=collections({**folders}),
        )
    with stage_progress() as progress:
        depth = "full" if full or folders else "quick"
        found = topic(run_world, depth, partial(progress, topic.title))
    place = place or FOLDER / f"{topic.key}.json"
    lines = [*_problem_lines(found), *judgements(found), f"Stored in {place}"]
    answer = Answer(facts_of(found), lines, 1 if found.failures else 0)
    write_whole(place, answer.text(json_=True))
    return answer


def as_json_file(out: Path | None) -> Path | None:
    """Return the place of the results, which must be a JSON file."""
    if out is not None and out.suffix != ".json":
        raise ArgumentError("--out", str(out), "a file that ends in .json")
    return out


def judgements(found: Finding) -> Iterator[str]:
    """Yield the sentences of the parts that the answer does not have, and what was not computed."""
    for part in found.parts:
        if part.sentence not in found.answer:
            yield sentence(part.sentence, "• ")
    for one in found.failures:
        yield f"Not computed: {one.case}: {one.error}: {one.reason}"


def facts_of(found: Finding) -> dict[str, Any]:
    """Return a finding as JSON values: texts, numbers and tables as columns and rows."""
    parts = [
        {"name": part.name, "verdict": part.verdict, "sentence": part.sentence}
        for part in found.parts
    ]
    tables = {
        name: {"columns": table.titles, "rows": table.cells} for name, table in found.tables.items()
    }
    return {
        "question": found.question,
        "answer": found.answer,
        "verdict": found.verdict,
        "parts": parts,
        "details": dict(found.details),
        "tables": tables,
    }


def _problem_lines(found: Finding) -> list[str | Table]:
    """Return the problems, each with the names of the solvers that did not solve it."""
    lines: list[str | Table] = []
    for folder in (name for name, table in found.tables.items() if "why not read" in table.keys):
        rows = []
        for row in found.tables[folder].records():
            unread = row["why not read"] and f"not read: {row['why not read']}"
            others = ", ".join(
                f"{name} {said}" for name, said in row.items() if said in ("refused", "failed")
            )
            solved = None if unread else sum(said == "solved" for said in row.values())
            rows.append(
                (
                    row["problem"],
                    row.get("unknowns"),
                    row.get("rank"),
                    solved,
                    unread or others or None,
                )
            )
        lines += [
            f"{folder}: every solver on every problem",
            titled(("problem", "unknowns", "rank", "solved by", "not solved by"), rows),
            "",
        ]
    return lines
