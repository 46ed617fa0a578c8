"""`iapb reproduce`: compute every figure, table and claim, and write them to one report."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from iapb.errors import ArgumentError, counted
from iapb.lazy import needed
from iapb.names import nearest
from reports.evidence.gather import failed_cases, gather
from reports.evidence.runs import (
    CORNER_SCENE,
    FIGURE_RUNS,
    TILTED,
    corner_scene,
    figure_run,
    tilted_runs,
)
from reports.figures import RECIPES
from reports.figures.figure import TEXTS, Recipe, draw
from reports.pages.builder import build_report, draw_all, figure_inputs, figure_page
from reports.pages.first import count_claims
from reports.pages.records import FailedCases
from reports.pages.report import write_companions, write_report
from reports.runner import Runner
from reports.show import Answer, Json, stage_progress
from reports.store.io import write_whole
from reports.store.uses import parsed
from verification.finding import REPRODUCED, Failure, Finding


def reproduce(
    out: Annotated[
        Path, typer.Option(help="Folder of the report, the runs and the tables.")
    ] = Path("out"),
    full: Annotated[
        bool,
        typer.Option("--full", help="The deep version: finer conditions, ten times the impacts."),
    ] = False,
    figure: Annotated[
        str | None, typer.Option(help="Write one figure's drawings only (such as fig07) as SVG.")
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="With --figure: change a value of the figure's scenes, as in iapb run: "
            "contact.friction=0.3. Repeatable.",
        ),
    ] = None,
    json_: Json = False,
) -> Answer:
    """Regenerate the report; cached results are reused."""
    for package in (
        "matplotlib",
        "latex2mathml",
    ):  # if one is missing, say it before minutes of computing
        needed(package, "iapb reproduce")
    depth = "full" if full else "quick"
    if figure is not None:
        return _write_figure(figure, out, depth, set_ or [])
    if set_:
        raise ArgumentError("--set", " ".join(set_), "a figure whose scenes it changes: --figure")
    return make_report(out, depth)


def make_report(out: Path, depth: str) -> Answer:
    """Compute all evidence or read stored results, write the report and its companion files, return
    the verdicts."""
    started = time.perf_counter()
    with stage_progress() as progress:
        evidence = gather(out, depth, progress)
    gathered = time.perf_counter()
    undrawn: list[Failure] = []
    figures = draw_all(evidence, RECIPES, undrawn)
    path = write_report(out, build_report(evidence, figures, depth))
    failed = evidence.failed + failed_cases(out / "tables", {"figures": undrawn})
    beside = write_companions(out, evidence, figures, depth)
    ended = time.perf_counter()
    took = {**evidence.seconds, "figures and page": ended - gathered}
    counts = count_claims(evidence.claims)
    lines = [
        *(f"Claims, {kind}: {count}." for kind, count in counts.items() if count),
        *(_line_of(topic) for topic in evidence.topics),
        f"\n{path} ({path.stat().st_size / 1e6:.1f} MB, from {len(evidence.runs)} runs) in {ended - started:.0f} s.",
        f"Beside it: {', '.join(file.name for file in beside)}.",
        f"Seconds by part: {', '.join(f'{part} {seconds:.0f}' for part, seconds in took.items())}.",
        *_failure_lines(failed),
    ]
    answers = {
        topic.title: {"verdict": topic.verdict, "answer": topic.answer} for topic in evidence.topics
    }
    claims = {
        claim.key: {"outcome": claim.outcome, "answer": claim.answer} for claim in evidence.claims
    }
    facts = {
        "page": path,
        "claims": claims,
        "beside": beside,
        "runs": len(evidence.runs),
        "seconds": took,
        "answers": answers,
        "failed": failed,
    }
    return Answer(facts, lines, int(bool(failed)))


def _line_of(topic: Finding) -> str:
    """Return how many parts of a topic hold."""
    held = sum(part.verdict == REPRODUCED for part in topic.parts)
    return f"{topic.title}: {held} of {len(topic.parts)} parts hold."


def _failure_lines(failed: Sequence[FailedCases]) -> Iterator[str]:
    """Yield which cases failed, why, and where their tracebacks are."""
    if failed:
        yield f"\nNot computed: {counted(sum(len(one.failures) for one in failed), 'case')}. The next call tries again."
    for one in failed:
        for failure in one.failures:
            yield f"  {one.stage}: {failure.case}: {failure.error}: {failure.reason}"
        yield f"    tracebacks: {one.file}"


def _write_figure(key: str, out: Path, depth: str, changes: list[str]) -> Answer:
    """Write each panel of a figure as a drawing, and a page with all of it; compute only the needed
    inputs.

    `changes` are values of the figure's scenes, as KEY=VALUE; the title and the files then say so.
    """
    recipes = {recipe.key: recipe for recipe in RECIPES}
    if key not in recipes:
        listed = (f"{name} ({TEXTS[name]['title']})" for name in recipes)
        near = nearest(key, recipes)
        meant = f"; did you mean {near}?" if near else ""
        raise ArgumentError("--figure", key, f"one of {', '.join(listed)}{meant}")
    with stage_progress() as progress:
        inputs, failed = _inputs(recipes[key], out, depth, parsed(changes), progress)
    undrawn: list[Failure] = []
    drawn = draw(recipes[key], inputs, undrawn if changes else None)
    for failure in undrawn:
        expected = f"values with which {key} can be drawn: {failure.error}: {failure.reason}"
        raise ArgumentError("--set", " ".join(changes), expected)
    if changes:
        drawn = replace(drawn, title=f"{drawn.title}, with {', '.join(changes)}")
        key = f"{key}-changed"
    if not drawn.panels:
        raise ArgumentError(
            "--figure", key, f"a figure whose inputs exist; missing: {', '.join(drawn.missing)}"
        )
    lines = []
    drawings = []
    for number, panel in enumerate(drawn.panels):
        path = out / f"{key}-{number}.svg"
        write_whole(path, panel.svg)
        drawings.append(path)
        lines.append(f"{path}: {panel.label or drawn.title}")
    page = out / f"{key}.html"
    write_whole(page, figure_page(drawn))
    lines += [f"{page}: all of it", *_failure_lines(failed)]
    return Answer({"drawings": drawings, "page": page, "failed": failed}, lines, int(bool(failed)))


def _shows_scenes(recipe: Recipe) -> bool:
    """Whether the figure is drawn from runs, whose scenes may be changed."""
    return any(name in (*FIGURE_RUNS, TILTED) for name in recipe.needs)


def _inputs(
    recipe: Recipe, out: Path, depth: str, values: dict[str, Any], progress: Any
) -> tuple[Mapping[str, Any], tuple[FailedCases, ...]]:
    """Return the inputs of a figure and the failed cases. If runs and scenes do not suffice,
    compute all evidence."""
    needs = recipe.needs
    at_hand = all(name in (*FIGURE_RUNS, TILTED, CORNER_SCENE) for name in needs)
    if values and not _shows_scenes(recipe):
        able = ", ".join(each.key for each in RECIPES if _shows_scenes(each))
        raise ArgumentError("--set", recipe.key, f"a figure that shows scenes: {able}")
    if not at_hand:
        evidence = gather(out, depth, progress)
        return figure_inputs(evidence), evidence.failed
    runner = Runner(out / "runs")
    found = dict[str, Any]()
    for done, name in enumerate(needs, 1):
        if name in FIGURE_RUNS:
            found[name] = figure_run(runner, name, values)
        elif name == TILTED:
            found[name] = tilted_runs(runner, values)
        else:
            found[name] = corner_scene()
        progress("runs of the figure", done, len(needs))
    return found, ()
