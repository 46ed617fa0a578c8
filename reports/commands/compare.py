"""`iapb compare`: a scene in several worlds, or IAPB against complementarity on impacts, scenes and
problem files."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from iapb.errors import ArgumentError, MissingDependencyError
from iapb.lazy import needed
from reference.datasets import problem_files
from reference.worlds import run_world
from reports.commands.run import Values, scene_given
from reports.figures.figure import draw, standalone
from reports.figures.worlds import worlds as worlds_figure
from reports.show import Answer, Json, sentence, stage_progress
from reports.store.io import write_whole
from verification.check import Topic
from verification.complementarity.solvers import collections
from verification.complementarity.topic import complementarity
from verification.finding import Finding
from verification.table import Table, titled
from verification.worlds import compare_worlds

FOLDER = Path("out/compare")


def compare(
    scene: Annotated[
        str | None,
        typer.Argument(
            help="A scene file, or the name of a scene that comes with the project; without one: IAPB and "
            "complementarity, on random impacts and the project's scenes."
        ),
    ] = None,
    worlds: Annotated[
        str | None,
        typer.Option(
            help="Worlds to run; default: IAPB,PB,ideal, and those with friction if SCENE has some."
        ),
    ] = None,
    against: Annotated[
        str | None,
        typer.Option(
            help="The world that the others are compared with; default: ideal, or ideal-friction if SCENE has friction."
        ),
    ] = None,
    set_: Values = None,
    impacts: Annotated[
        int, typer.Option(min=0, help="Largest number of impacts of SCENE given to every solver.")
    ] = 12,
    problems: Annotated[
        list[Path] | None,
        typer.Option(help="A folder of problem files (LCP, FCLIB) for every solver. Repeatable."),
    ] = None,
    only_problems: Annotated[
        bool,
        typer.Option(
            "--only-problems", help="Only the problem files, not the comparison on impacts."
        ),
    ] = False,
    full: Annotated[
        bool, typer.Option("--full", help="Ten times the impacts, more repeats.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="File of the results, .json; default: in out/compare. The figure stands beside it."
        ),
    ] = None,
    json_: Json = False,
) -> Answer:
    """Compare worlds on SCENE; without SCENE, IAPB with complementarity, and solvers on problem
    files."""
    if only_problems and not problems:
        raise typer.BadParameter("give a folder with --problems", param_hint="--only-problems")
    if out is not None and out.suffix != ".json":
        raise ArgumentError("--out", str(out), "a file that ends in .json")
    for given, option in ((worlds, "--worlds"), (against, "--against"), (set_, "--set")):
        if given and scene is None:
            raise typer.BadParameter("give a SCENE", param_hint=option)
    for folder in problems or ():
        if not problem_files(folder):
            kinds = ".lcp, .lcp.gz, .dat, .hdf5, .h5"
            raise ArgumentError("--problems", str(folder), f"a folder with problem files ({kinds})")
    folders = {str(folder): folder for folder in problems or ()}
    with stage_progress() as progress:
        if scene is not None:
            found = compare_worlds(
                scene_given(scene, set_),
                worlds.split(",") if worlds else None,
                against,
                impacts=impacts,
                progress=progress,
            )
            name = found.details["scene"]
            lines = _scene_lines(found)
        else:
            alone = Topic(
                key="problems",
                title="Solvers on problem files",
                question="",
                checks=collections({**folders}),
                says=lambda tables, parts: "",
            )
            topic = alone if only_problems else complementarity(folders)
            found = topic(
                run_world,
                "full" if full or only_problems else "quick",
                partial(progress, topic.title),
            )
            name = topic.key
            lines = _problem_lines(found)
    place = out or FOLDER / f"{name}.json"
    new = [part for part in found.parts if part.sentence not in found.answer]
    lines += [sentence(part.sentence, "• ") for part in new]
    lines += [f"Not computed: {one.case}: {one.error}: {one.reason}" for one in found.failures]
    drawn = None
    if scene is not None:
        try:
            needed("matplotlib", "The figure")
            drawn = draw(worlds_figure, found.tables)
        except MissingDependencyError as missing:  # the numbers are worth printing without it
            lines.append(str(missing))
    if drawn is not None and drawn.panels:
        write_whole(place.with_suffix(".svg"), standalone(drawn))
        lines.append(f"Figure: {place.with_suffix('.svg')}")
    answer = Answer(_facts(found), [*lines, f"Stored in {place}"], 1 if found.failures else 0)
    write_whole(place, answer.text(json_=True))
    return answer


def _facts(found: Finding) -> dict[str, Any]:
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


def _scene_lines(found: Finding) -> list[str | Table]:
    """Return one page of text: distances, energy and time by world, then the results of the solvers
    on the impacts."""
    table = found.tables["worlds"]
    against = found.details["against"]
    far = titled(
        (
            "world",
            "apart, rms [mm]",
            "most [mm]",
            "end [mm]",
            "velocity, rms [mm/s]",
            "impulse, rms [N s]",
            "end [N s]",
        ),
        [
            (
                "own error" if row["world"] == against else row["world"],
                *(1e3 * row[f"configuration, {size}"] for size in ("rms", "most", "end")),
                1e3 * row["velocity, rms"],
                row["impulse, rms"],
                row["impulse, end"],
            )
            for row in sorted(table.records(), key=lambda row: bool(row["world"] == against))
            if row["configuration, rms"] is not None
        ],
        3,
    )
    rest = (
        "world",
        "energy lost",
        "most above start and work",
        "deepest overlap",
        "impacts",
        "time per step",
        "times the fastest",
    )
    ignoring = (
        sentence(f"{row['world']} ignores {row['ignores']}.")
        for row in table.records()
        if row["ignores"]
    )
    lines: list[str | Table] = [
        found.title,
        sentence(found.answer),
        *ignoring,
        "",
        f"Distance from {against} (impulse: {found.details['impulse']})",
        far,
        "",
        "Energy, penetration, time",
        table.select(rest),
    ]
    if "solvers" in found.tables:
        every = found.tables["solvers"]
        there = every.only(row["missing"] < row["problems"] for row in every.records())
        lines += [
            "",
            "Its impacts as problems, by every solver",
            there.without("left out", "missing", "spread of velocities"),
            *(sentence(text, "  ") for text in _unsolved(found.tables["problems"])),
        ]
        if absent := [
            name for name in every.column("solver") if name not in there.column("solver")
        ]:
            lines.append(sentence(f"Not installed: {', '.join(absent)}.", "  "))
    return [*lines, ""]


def _unsolved(problems: Table) -> Iterator[str]:
    """Yield one line for each solver and failing outcome: how many problems it did not solve, one
    of them, and why."""
    failed = problems.only(
        outcome not in ("solved", "missing") for outcome in problems.column("outcome")
    )
    for solver, outcome in dict.fromkeys(
        zip(failed.column("solver"), failed.column("outcome"), strict=True)
    ):
        first, *others = failed.where(solver=solver, outcome=outcome).records()
        residual = first["worst residual"]
        why = ": ".join(
            filter(None, [f"residual {residual:.1e}" if residual else "", first["note"]])
        )
        yield f"{solver} {outcome} {1 + len(others)}, such as {first['problem']}: {why.removeprefix('refused: ')}"


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
