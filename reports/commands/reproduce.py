"""`iapb reproduce`: every figure, table and claim into one report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def reproduce(
    out: Annotated[Path, typer.Option(help="Folder of the report, the runs and the tables.")] = Path("out"),
    full: Annotated[bool, typer.Option("--full", help="The deep version: finer conditions, ten times the impacts.")]
    = False,
    figure: Annotated[str | None, typer.Option(help="Write one figure's drawings only (such as fig07) as SVG.")] = None,
) -> None:
    """Regenerate the report; what was computed before is read from its files."""
    import time

    from reports.commands.progress import stage_progress
    from reports.evidence.gather import gather
    from reports.report import build_report, write_report

    started = time.perf_counter()
    with stage_progress() as progress:
        evidence = gather(out, "full" if full else "quick", progress)
    if figure is not None:
        _write_figure(figure, evidence.inputs, out)
        return
    path = write_report(out / "report.html", build_report(evidence))
    for verdict in evidence.verdicts:
        print(f"{verdict.topic}: {verdict.sentence}")
    size, files = path.stat().st_size / 1e6, len(evidence.manifest)
    print(f"\n{path} ({size:.1f} MB, from {files} run and table files) in {time.perf_counter() - started:.0f} s.")


def _write_figure(key: str, inputs: object, out: Path) -> None:
    from iapb.errors import ArgumentError
    from reports.figures import RECIPES
    from reports.figures.figure import Figure, draw

    recipes = {recipe.key: recipe for recipe in RECIPES}
    if key not in recipes:
        raise ArgumentError("--figure", key, "one of " + ", ".join(recipes))
    drawn = draw(recipes[key], inputs)  # type: ignore[arg-type]
    if not isinstance(drawn, Figure):
        raise ArgumentError("--figure", key, f"a figure whose inputs exist; missing: {', '.join(drawn.missing)}")
    for number, panel in enumerate(drawn.panels):
        path = out / f"{key}-{number}.svg"
        path.write_text(panel.svg, encoding="utf-8")
        print(f"{path}: {panel.label or drawn.title}")
