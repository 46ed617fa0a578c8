"""`iapb bench`: accuracy against computing time, and speed ratios, all measured in one run."""

from __future__ import annotations

import math
import re
from datetime import date
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table as Printed

from iapb.errors import ArgumentError
from reports.commands.as_json import Json, facts_of
from reports.commands.progress import stage_progress
from reports.figures.numbers import format_cell
from reports.provenance import processor
from verification.cost.impacts import choices, short_time, which_method, work_precision
from verification.cost.study import haptic_study
from verification.finding import MIXED, NOT_COMPUTED, REPRODUCED, Table

LONG = ("motions", "solvers", "budgets", "scaling", "robots")  # tables that take --tables to be printed


def bench(
    full: Annotated[bool, typer.Option("--full", help="More repeats and steps, and compile times.")] = False,
    tables: Annotated[bool, typer.Option("--tables", help="Print the long tables as well.")] = False,
    budget: Annotated[str, typer.Option("--budget", help="Name the method for an impact in this time, such as 50us.")]
    = "",
    contacts: Annotated[int, typer.Option("--contacts", help="Contacts of that impact.")] = 20,
    coordinates: Annotated[int, typer.Option("--coordinates", help="Coordinates of that impact.")] = 6,
    json_: Json = False,
) -> None:
    """Time a step, an impact and a motion; compare with MuJoCo, Pinocchio, solvers and the printed formula."""
    with facts_of(json_) as facts:
        if budget:
            _answer(seconds_of(budget), contacts, coordinates, facts)
        else:
            _measure(full, tables, facts)


def _measure(full: bool, tables: bool, facts: dict[str, Any]) -> None:
    with stage_progress() as progress:
        topic = haptic_study("full" if full else "quick", progress)
        methods = work_precision(progress=lambda done, total: progress("methods on problems", done, total))
    facts.update(processor=processor(), verdict=topic.verdict, parts=topic.parts, failures=topic.failures,
                 tables={name: table.records() for name, table in topic.tables.items()} | {
                     "methods on problems": methods.records()})
    console = Console(width=max(140, Console().width))
    for name, numbers in topic.tables.items():
        if tables or name not in LONG:
            _print(console, name.capitalize(), numbers)
    _print(console, "Which method for a budget", choices(methods))
    if tables:
        _print(console, "What a microsecond buys", methods)
    words = {REPRODUCED: "as asked for", MIXED: "not as asked for", NOT_COMPUTED: "not measured"}
    for part in topic.parts:
        console.print(f"• {words[part.verdict]}: {part.sentence}", highlight=False, markup=False)
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


UNITS = {"ns": 1e-9, "us": 1e-6, "µs": 1e-6, "ms": 1e-3, "s": 1.0}


def seconds_of(text: str) -> float:
    """Return a time given with its unit, such as 50us or 0.5ms, in seconds."""
    found = re.fullmatch(r"\s*([0-9.eE+-]+)\s*(ns|us|µs|ms|s)\s*", text)
    try:
        seconds = float(found[1]) * UNITS[found[2]]  # type: ignore[index]
    except (TypeError, ValueError):
        seconds = math.inf
    if not math.isfinite(seconds):
        raise ArgumentError("budget", text, "a time with its unit, e.g. 50us")
    return seconds


def _answer(budget: float, contacts: int, coordinates: int, facts: dict[str, Any]) -> None:
    """Print the recommended method in one sentence for each way of calling, and the machine of the measurement."""
    found = which_method(budget, contacts, coordinates)
    facts.update(processor=processor(), choices=found)
    for choice in found:
        print(choice)
    if not found:
        print(f"In {short_time(budget)} no method solves {contacts} contacts on {coordinates} coordinates without a "
              "gain of energy.")
    print(f"Measured on {processor()}, {date.today()}, on nine hard impacts of this size.")
