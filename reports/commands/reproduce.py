"""`iapb reproduce`: compute every figure, table and claim, and write them to one report."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Annotated, Any

import typer

from iapb.errors import ArgumentError
from iapb.names import one_of
from reports.commands.answer import Json, facts_of, print_lines
from reports.commands.progress import stage_progress
from reports.commands.report import difference_lines
from reports.difference import DIFFERS, ONLY_OLD, TOLERANCE, compare_reports, unlike
from reports.evidence.gather import failed_cases, gather
from reports.evidence.runs import FIGURE_RUNS, shipped_scene
from reports.figures import RECIPES
from reports.figures.figure import Figure, draw
from reports.figures.standalone import standalone
from reports.numbers_file import read_numbers
from reports.pages.builder import build_report, figure_inputs
from reports.pages.quantities import contradictions, unsaid
from reports.pages.records import Evidence, FailedCases
from reports.report import remembering, write_companions, write_report
from reports.runner import Runner
from verification.finding import Failure

SHOWN_FAILURES = 20  # of a stage, in the last lines


def reproduce(
    out: Annotated[Path | None, typer.Option(
        help="Folder of the report, the runs and the tables; default out, with --check a temporary one.")] = None,
    full: Annotated[bool, typer.Option("--full", help="The deep version: finer conditions, ten times the impacts.")]
    = False,
    figure: Annotated[str | None, typer.Option(help="Write one figure's drawings only (such as fig07) as SVG.")] = None,
    check: Annotated[Path | None, typer.Option(
        help="Recompute everything and compare all numbers with this report.")] = None,
    json_: Json = False,
) -> None:
    """Regenerate the report; cached results are reused."""
    depth, folder = "full" if full else "quick", out or Path("out")
    with facts_of(json_) as facts:
        if check is not None:
            check_report(check, out, facts)
        elif figure is not None:
            _write_figure(figure, folder, depth, facts)
        else:
            make_report(folder, depth, facts)


def make_report(out: Path, depth: str, facts: dict[str, Any]) -> None:
    """Compute all evidence or read stored results, write the report and its companion files, print the verdicts."""
    started = time.perf_counter()
    took: dict[str, float] = {}
    with stage_progress() as progress:
        evidence = gather(out, depth, _timed(progress, took))
    undrawn: list[Failure] = []
    recipes, figures = remembering(RECIPES, undrawn)
    pages = build_report(evidence, recipes)
    path = write_report(out, pages)
    failed = evidence.failed + failed_cases(out / "tables", "figures", undrawn)
    beside = write_companions(out, evidence, figures, depth)
    for topic in evidence.topics:
        print(f"{topic.title}: {topic.answer}")
    size, files = path.stat().st_size / 1e6, len(evidence.manifest)
    print(f"\n{path} ({size:.1f} MB, from {files} run and table files) in {time.perf_counter() - started:.0f} s.")
    print(f"Beside it: {', '.join(file.name for file in beside)}.")
    took["figures and page"] = time.perf_counter() - started - sum(took.values())
    print(f"Seconds by part: {', '.join(f'{part} {seconds:.0f}' for part, seconds in took.items())}.")
    facts.update(page=path, beside=beside, files=files, seconds=took,
                 answers={topic.title: {"verdict": topic.verdict, "answer": topic.answer} for topic in evidence.topics})
    facts["contradictions"] = print_contradictions(evidence)
    _end_where_something_failed(failed, facts)
    facts["unsaid"] = unsaid(evidence)
    if facts["unsaid"]:
        print(f"No page of the report says: {', '.join(facts['unsaid'])}.")
    if facts["contradictions"] or facts["unsaid"]:
        raise typer.Exit(1)


def print_contradictions(evidence: Evidence) -> dict[str, tuple[str, ...]]:
    """Print and return the quantities for which the report gives more than one value or verdict."""
    found = contradictions(evidence)
    for name, texts in found.items():
        print(f"More than one value in the report. {name}: {', '.join(texts)}.")
    return found


def _end_where_something_failed(failed: Sequence[FailedCases], facts: dict[str, Any]) -> None:
    """If cases failed, print which, why, and where their tracebacks are, and end the command with status 1."""
    facts["failed"] = failed
    if not failed:
        return
    count = sum(len(one.failures) for one in failed)
    print(f"\nNot computed: {count} {'case' if count == 1 else 'cases'}. The next call tries again.")
    for one in failed:
        for failure in one.failures[:SHOWN_FAILURES]:
            print(f"  {one.stage}: {failure.case}: {failure.error}: {failure.reason}")
        if len(one.failures) > SHOWN_FAILURES:
            print(f"  {one.stage}: and {len(one.failures) - SHOWN_FAILURES} more")
        print(f"    tracebacks: {one.file}")
    raise typer.Exit(1)


def _timed(progress: Callable[[str, int, int], None], took: dict[str, float]) -> Callable[[str, int, int], None]:
    """Return a progress function that also adds up the time of each stage in `took`; stages run one after the other."""
    last = time.perf_counter()

    def timed(stage: str, done: int, total: int) -> None:
        nonlocal last
        progress(stage, done, total)
        now = time.perf_counter()
        took[stage], last = took.get(stage, 0.0) + now - last, now

    return timed


def check_report(report: Path, out: Path | None, facts: dict[str, Any]) -> None:
    """Compute everything again, at the report's depth, into `out` or a temporary folder, and compare.

    With the same code, packages, processor and BLAS kernel, runs must agree to the last bit; otherwise numbers must
    agree within the tolerance. Ends with 1 if they do not, or if numbers of the report were not computed again.
    """
    given = read_numbers(report)
    if out is not None and out.exists() and any(out.iterdir()):
        raise ArgumentError("--out", str(out), "an empty folder: results in it would be reused, not computed again")
    with tempfile.TemporaryDirectory() if out is None else nullcontext(str(out)) as folder:
        make_report(Path(folder), given.depth, facts)
        made = read_numbers(folder)
    found = compare_reports(given, made)
    reasons = unlike(given.provenance, made.provenance)
    print()
    print(f"The report was made with another {', '.join(reasons)}: numbers must agree within {TOLERANCE:.0e}."
          if reasons else "Same code, packages, processor and BLAS kernel: runs must agree to the last bit."
          )  # fmt: skip
    print_lines(difference_lines(found, TOLERANCE))
    lost = found.count(ONLY_OLD) + len(found.tables_old)
    failed = found.count(DIFFERS) + lost + (0 if reasons else len(found.runs_other))
    facts.update(differs_in=reasons, tolerance=TOLERANCE, differing=found.of(DIFFERS), not_made_again=lost,
                 runs_other=found.runs_other, made_again=not failed)
    print(f"{report}: " + ("every number was made again." if not failed else "not every number was made again."))
    if failed:
        raise typer.Exit(1)


def _write_figure(key: str, out: Path, depth: str, facts: dict[str, Any]) -> None:
    """Write each panel of a figure, and all panels with the legend in one file; compute only the needed inputs."""
    recipes = {recipe.key: recipe for recipe in RECIPES}
    if key not in recipes:
        raise ArgumentError("--figure", key, one_of(key, recipes))
    inputs, failed = _inputs(recipes[key].needs, out, depth)
    drawn = draw(recipes[key], inputs)
    if not isinstance(drawn, Figure):
        raise ArgumentError("--figure", key, f"a figure whose inputs exist; missing: {', '.join(drawn.missing)}")
    out.mkdir(parents=True, exist_ok=True)
    pictures = {f"{key}-{number}.{'html' if panel.is_table else 'svg'}": (panel.svg, panel.label)
                for number, panel in enumerate(drawn.panels)}  # fmt: skip
    whole = f"{key}.{'html' if any(panel.is_table for panel in drawn.panels) else 'svg'}"
    for name, (text, label) in {**pictures, whole: (standalone(drawn), "all of it")}.items():
        (out / name).write_text(text, encoding="utf-8")
        print(f"{out / name}: {label or drawn.title}")
    facts["drawings"] = [out / name for name in pictures]
    _end_where_something_failed(failed, facts)


def _inputs(needs: tuple[str, ...], out: Path, depth: str) -> tuple[Mapping[str, Any], tuple[FailedCases, ...]]:
    """Return the inputs of a figure and the failed cases. If runs and scenes do not suffice, compute all evidence."""
    if not all(name in FIGURE_RUNS or name.startswith("scene/") for name in needs):
        with stage_progress() as progress:
            evidence = gather(out, depth, progress)
        return figure_inputs(evidence), evidence.failed
    runner = Runner(out / "runs")
    found: dict[str, Any] = {}
    with stage_progress() as progress:
        for done, name in enumerate(needs):
            progress("runs of the figure", done, len(needs))
            if name in FIGURE_RUNS:
                scene, values, world, rendering = FIGURE_RUNS[name]
                found[name] = runner(shipped_scene(scene, values), world, rendering)
            else:
                found[name] = shipped_scene(name.removeprefix("scene/")).resolved()
        progress("runs of the figure", len(needs), len(needs))
    return found, ()
