"""`iapb bench`: what accuracy costs in time, and every ratio that was asked for, all within one run."""

from __future__ import annotations

import statistics
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table as Printed

from reports.commands.progress import stage_progress
from reports.figures.numbers import format_cell
from verification.cost.impacts import work_precision
from verification.cost.study import haptic_study
from verification.finding import MIXED, NOT_COMPUTED, REPRODUCED, Table

LONG = ("motions", "solvers", "budgets", "scaling", "robots")  # tables that take --tables to be printed


def bench(
    full: Annotated[bool, typer.Option("--full", help="More repeats and steps, and compiling: minutes.")] = False,
    tables: Annotated[bool, typer.Option("--tables", help="Print the long tables as well.")] = False,
) -> None:
    """Time a step, an impact, a whole motion: beside MuJoCo, Pinocchio, solvers and the printed formula."""
    with stage_progress() as progress:
        topic = haptic_study("full" if full else "quick", progress)
        methods = work_precision(progress=lambda done, total: progress("methods on problems", done, total))
    console = Console(width=max(140, Console().width))
    for name, numbers in topic.tables.items():
        if tables or name not in LONG:
            _print(console, name.capitalize(), numbers)
    if tables:
        _print(console, "What a microsecond buys", methods)
    words = {REPRODUCED: "as asked for", MIXED: "not as asked for", NOT_COMPUTED: "not measured"}
    for part in topic.parts:
        console.print(f"• {words[part.verdict]}: {part.sentence}", highlight=False, markup=False)
    console.print(_methods(methods), highlight=False, markup=False)
    if not tables:
        console.print(f"Further tables with --tables: {', '.join((*LONG, 'methods on problems'))}.", highlight=False)
    if topic.failures:
        for one in topic.failures:
            print(f"Not computed: {one.case}: {one.error}: {one.reason}")
        raise typer.Exit(1)


def _print(console: Console, title: str, numbers: Table) -> None:
    table = Printed(title=title, caption=numbers.note)
    for heading in numbers.titles:
        table.add_column(heading, overflow="fold")
    for row in numbers.cells:
        table.add_row(*(format_cell(value, numbers.digits) for value in row))
    console.print(table)


def _methods(numbers: Table) -> str:
    """One line per method: worst error, worst residual and median time over the problems, failures counted."""
    rows = numbers.records()
    lines = ["Impact methods over all problems: worst relative error, median time, failures"]
    for method in dict.fromkeys(row["method"] for row in rows):
        here = [row for row in rows if row["method"] == method]
        done = [row for row in here if row["outcome"] == "ok"]
        worst = max(row["relative error"] for row in done)
        median = statistics.median(row["time"] for row in done)
        lines.append(f"  {method:<18} {worst:8.1e}  {median:9.1f} µs  {len(here) - len(done)} of {len(here)} failed")
    return "\n".join(lines)
