"""`iapb compare`: a scene in several worlds, or IAPB against complementarity on impacts, scenes and problem files."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Annotated, Any

import typer

from iapb.errors import ArgumentError
from reference.datasets import problem_files, write_fclib
from reference.worlds import run_world
from reports.commands.answer import Answer, Json
from reports.commands.lines import sentence, table_lines
from reports.commands.progress import stage_progress
from reports.commands.run import Values, scene_given
from reports.figures.figure import NotComputed, draw
from reports.figures.standalone import standalone
from reports.figures.worlds import worlds as worlds_figure
from reports.store.keys import plain
from verification.check import Topic
from verification.complementarity.solvers import collections, own_problems
from verification.complementarity.topic import complementarity
from verification.finding import Finding
from verification.table import Table, titled
from verification.worlds import compare_worlds

FOLDER = Path("out/compare")
# Columns of the comparison with complementarity that are printed; the file has all.
_SHOWN = {
    "map": ("impacts", "e", "redundant rows", "cases", "share that agrees", "largest distance",
            "largest extra loss of KE⁻"),
    "friction": ("e", "μ", "cases", "all contacts push", "share equal to the NCP", "unsolved", "NCP gains",
                 "largest change of KE, IAPB"),
    "convergence": ("scene", "events", "step", "error of positions", "order, positions", "order, velocities"),
}  # fmt: skip


def compare(
    scene: Annotated[str | None, typer.Argument(
        help="A scene file, or the name of a scene that comes with the project; without one: IAPB and "
             "complementarity, on random impacts and the project's scenes.")] = None,
    worlds: Annotated[str | None, typer.Option(
        help="Worlds to run; default: IAPB,PB,ideal, and those with friction if SCENE has some."
    )] = None,
    against: Annotated[str | None, typer.Option(
        help="The world that the others are compared with; default: ideal, or ideal-friction if SCENE has friction."
    )] = None,
    set_: Values = None,
    impacts: Annotated[int, typer.Option(min=0, help="Largest number of impacts of SCENE given to every solver.")] = 12,
    problems: Annotated[list[Path] | None, typer.Option(
        help="A folder of problem files (LCP, MLCP, FCLIB) for every solver. Repeatable.")] = None,
    only_problems: Annotated[bool, typer.Option(
        "--only-problems", help="Only the problem files, not the comparison on impacts.")] = False,
    full: Annotated[bool, typer.Option("--full", help="Ten times the impacts, more repeats.")] = False,
    export: Annotated[Path | None, typer.Option(
        help="Write iapb's own problems to this folder as FCLIB files, and stop.")] = None,
    out: Annotated[Path | None, typer.Option(
        help="File of the results, .json; default: in out/compare. The figure stands beside it.")] = None,
    json_: Json = False,
) -> Answer:
    """Compare worlds on SCENE; without SCENE, IAPB with complementarity, and solvers on problem files."""
    if only_problems and not problems:
        raise typer.BadParameter("give a folder with --problems", param_hint="--only-problems")
    if out is not None and out.suffix != ".json":
        raise ArgumentError("--out", str(out), "a file that ends in .json")
    for given, option in ((worlds, "--worlds"), (against, "--against"), (set_, "--set")):
        if given and scene is None:
            raise typer.BadParameter("give a SCENE", param_hint=option)
    for folder in problems or ():
        _require_problems(folder)
    if export is not None:
        export.mkdir(parents=True, exist_ok=True)
        with stage_progress() as progress:
            progress("our own problems", 0, 1)
            count = _export(export)
        return Answer({"problems": count, "folder": export}, [f"{count} problems written to {export}"])
    figure, folders = "", {str(folder): folder for folder in problems or ()}
    with stage_progress() as progress:
        if scene is not None:
            found = compare_worlds(scene_given(scene, set_), worlds.split(",") if worlds else None, against,
                                   impacts=impacts, progress=progress)  # fmt: skip
            lines, place, figure = _scene_lines(found), out or FOLDER / f"{found.details['scene']}.json", _figure(found)
        elif only_problems:
            found, place = _compared(_problems_alone({**folders}), True, progress), out or FOLDER / "problems.json"
            lines = _problem_lines(found)
        else:
            found, place = _compared(complementarity(folders), full, progress), out or FOLDER / "complementarity.json"
            lines = _study_lines(found)
    facts = plain_finding(found)
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_text(json.dumps(facts, ensure_ascii=False), encoding="utf-8")
    lines += [sentence(part.sentence, "• ") for part in found.parts]
    lines += [f"Not computed: {one.case}: {one.error}: {one.reason}" for one in found.failures]
    if figure:
        place.with_suffix(".svg").write_text(figure, encoding="utf-8")
        lines.append(f"Figure: {place.with_suffix('.svg')}")
    return Answer(facts, [*lines, f"Stored in {place}"], 1 if found.failures else 0)


def _require_problems(folder: Path) -> None:
    if not problem_files(folder):
        kinds = ".lcp, .lcp.gz, .dat, .txt, .hdf5, .h5"
        raise ArgumentError("--problems", str(folder), f"a folder with problem files ({kinds})")


def _export(folder: Path) -> int:
    """Write the built-in problems of the study, one file each."""
    problems = [stored.problem for stored in own_problems()]
    for problem in problems:
        title = problem.name.replace("μ", "mu")  # FCLIB's titles are ASCII
        name = re.sub(r"[^a-z0-9.]+", "_", title.lower())
        write_fclib(folder / f"{name}.hdf5", problem, title)
    return len(problems)


def _problems_alone(folders: dict[str, Path | None]) -> Topic:
    return Topic(key="problems", title="Solvers on problem files", question="", checks=collections(folders),
                 says=lambda tables, parts: "")  # fmt: skip


def _compared(topic: Topic, full: bool, progress: Any) -> Finding:
    return topic(run_world, "full" if full else "quick", lambda done, total: progress(topic.title, done, total))


def plain_finding(found: Finding) -> dict[str, Any]:
    """Return a finding as plain JSON values: texts, numbers and tables; null for a number that is not finite."""
    parts = [{"name": part.name, "verdict": part.verdict, "sentence": part.sentence} for part in found.parts]
    tables = {name: {"columns": list(table.titles), "rows": [[_cell(value) for value in row] for row in table.cells]}
              for name, table in found.tables.items()}  # fmt: skip
    return {"question": found.question, "answer": found.answer, "verdict": found.verdict, "parts": parts,
            "details": dict(found.details), "tables": tables}  # fmt: skip


def _cell(value: Any) -> Any:
    value = plain(value)
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _figure(found: Finding) -> str:
    drawn = draw(worlds_figure, found.tables)
    return "" if isinstance(drawn, NotComputed) else standalone(drawn)


def _scene_lines(found: Finding) -> list[str]:
    """Return one page of text: distances, energy and time by world, then the results of the solvers on the impacts."""
    table, against = found.tables["worlds"], found.details["against"]
    lines = [found.title, sentence(found.answer)]
    lines += [sentence(f"{row['world']} ignores {row['ignores']}.") for row in table.records() if row["ignores"]]
    others = table.only(name != against for name in table.column("world"))
    far = titled(
        ("world", "apart, rms [mm]", "most [mm]", "end [mm]", "velocity, rms [mm/s]", "impulse, rms [N s]",
         "end [N s]"),
        [(row["world"], *(1e3 * row[f"configuration, {size}"] for size in ("rms", "most", "end")),
          1e3 * row["velocity, rms"], row["impulse, rms"], row["impulse, end"]) for row in others.records()], 3)
    rest = ("world", "energy lost", "most above start and work", "deepest overlap", "impacts", "time per step",
            "times the fastest")  # fmt: skip
    lines += ["", f"Distance from {against} (impulse: {found.details['impulse']})", *table_lines(far)]
    lines += ["", "Energy, penetration, time", *table_lines(table.select(rest))]
    if "solvers" in found.tables:
        every = found.tables["solvers"]
        there = every.only(row["missing"] < row["problems"] for row in every.records())
        shown = there.without("left out", "missing", "spread of velocities")
        lines += ["", "Its impacts as problems, by every solver", *table_lines(shown)]
        lines += [sentence(text, "  ") for text in _unsolved(found.tables["problems"])]
        absent = [name for name in every.column("solver") if name not in there.column("solver")]
        lines += [sentence(f"Not installed: {', '.join(absent)}.", "  ")] if absent else []
    return [*lines, ""]


def _unsolved(problems: Table) -> list[str]:
    """Return one line for each solver and failing outcome: which problems it did not solve, and why."""
    found: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for row in problems.records():
        if row["outcome"] not in ("solved", "missing"):
            found.setdefault((row["solver"], row["outcome"]), []).append(row)
    said = []
    for (solver, outcome), rows in found.items():
        residual = rows[0]["worst residual"]
        why = ": ".join(filter(None, [f"residual {residual:.1e}" if residual else "", rows[0]["note"]]))
        said.append(f"{solver} {outcome} {len(rows)}, such as {rows[0]['problem']}: {why.removeprefix('refused: ')}")
    return said


def _study_lines(found: Finding) -> list[str]:
    lines: list[str] = []
    for name, keys in _SHOWN.items():
        if name in found.tables:
            lines += [sentence(found.tables[name].note) or name, *table_lines(found.tables[name].select(keys)), ""]
    if "time per impact" in found.tables:
        lines += ["Time per impact [µs], median", *table_lines(_costs(found.tables["time per impact"]), keys=2), ""]
    return lines + _problem_lines(found)


def _costs(table: Table) -> Table:
    """Return a table with a row per kind of impact and size and a column per solver; unsolved cells say so."""
    cells: dict[tuple[Any, ...], dict[str, Any]] = {}
    for row in table.records():
        time = row["median"]
        failed = "" if row["outcome"] == "solved" else row["outcome"]
        said = " ".join(filter(None, ["" if time is None else f"{time:.3g}", failed]))
        cells.setdefault((row["impacts"], row["contacts"]), {})[row["solver"]] = said
    solvers = list(dict.fromkeys(table.column("solver")))
    return titled(("impacts", "contacts", *solvers),
                  [(*key, *(cells[key].get(solver) for solver in solvers)) for key in sorted(cells)])


def _problem_lines(found: Finding) -> list[str]:
    """Return the problems, each with the names of the solvers that did not solve it, and the profiles of times."""
    lines = []
    for folder in (name for name, table in found.tables.items() if "why not read" in table.keys):
        rows: list[tuple[Any, ...]] = []
        for row in found.tables[folder].records():
            others = ", ".join(f"{name} {said}" for name, said in row.items() if said in ("refused", "failed"))
            why = f"not read: {row['why not read']}" if row["why not read"] else others or None
            solved = None if row["why not read"] else sum(said == "solved" for said in row.values())
            rows.append((row["problem"], row.get("unknowns"), row.get("rank"), solved, why))
        by_problem = titled(("problem", "unknowns", "rank", "solved by", "not solved by"), rows)
        profile, shown = found.tables["profile"].where(collection=folder), (1.0, 3.0, 10.0, 100.0, 1e5)
        shares: dict[tuple[str, str], list[float]] = {}
        for row in profile.records():
            within = shares.setdefault((row["solver"], row["kind"]), [0.0] * len(shown))
            for k, factor in enumerate(shown):
                within[k] = row["share solved"] if row["factor"] <= factor * (1 + 1e-9) else within[k]
        by_factor = titled(("solver", "kind", *(f"within {factor:g}" for factor in shown)),
                           [(*key, *(f"{100 * share:.0f} %" for share in within)) for key, within in shares.items()])
        lines += [f"{folder}: every solver on every problem", *table_lines(by_problem), "",
                  "Performance profile (Dolan and Moré): solved within a factor of the fastest",
                  *table_lines(by_factor), ""]  # fmt: skip
    return lines
