"""`iapb report ACTION`: compare the numbers of two reports."""

from __future__ import annotations

import math
from collections import Counter
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from iapb.errors import ArgumentError
from reports.commands.as_json import Json, print_json
from reports.difference import DIFFERS, Difference, compare_reports
from reports.difference_text import PARTS, SHOWN, lines, parts, sentences, unlike
from reports.numbers_file import read_numbers


class Action(StrEnum):
    """What to do."""
    diff = "diff"


def report(
    action: Annotated[Action, typer.Argument(help="diff: compare the numbers of two reports.")],
    old: Annotated[Path, typer.Argument(help="A report, its folder, or its numbers.json.")],
    new: Annotated[Path, typer.Argument(help="The other one.")],
    tolerance: Annotated[float, typer.Option(min=0.0, help="Relative difference up to which numbers agree.")] = 1e-9,
    json_: Json = False,
) -> None:
    """Compare the numbers of two reports: equal, within a tolerance, or different; end with 1 if some differ."""
    if not math.isfinite(tolerance):
        raise ArgumentError("--tolerance", tolerance, "a finite number, 0 or more")
    first, second = read_numbers(old), read_numbers(new)
    found = compare_reports(first, second, tolerance)
    reasons = unlike(first.provenance, second.provenance)
    if json_:
        print_json({"differs_in": reasons, "depths": [first.depth, second.depth], "tolerance": tolerance,
                    "cells": Counter(cell.state for cell in found.cells), "differing": found.of(DIFFERS),
                    "tables_of_old_alone": found.tables_old, "tables_of_new_alone": found.tables_new,
                    "runs_same": found.runs_same, "runs_other": found.runs_other, "runs_single": found.runs_single})
        raise typer.Exit(1 if found.count(DIFFERS) else 0)
    print(f"The new report was made with another {', '.join(reasons)}." if reasons
          else "Same code, packages, processor and BLAS kernel.")  # fmt: skip
    if first.depth != second.depth:
        print(f"The old report is {first.depth}, the new one {second.depth}: many numbers are of one only.")
    print_difference(found, tolerance)
    if found.count(DIFFERS):
        raise typer.Exit(1)


def print_difference(found: Difference, tolerance: float) -> None:
    """Print a table by part of the report, the largest differences, and a summary in sentences."""
    by_part = Table("part", *(name for name, _ in PARTS), title="Table and words by part of the report")
    by_part.columns[0].no_wrap, by_part.columns[0].min_width = True, 15
    for row in parts(found):
        by_part.add_row(*row)
    Console().print(by_part)
    count = found.count(DIFFERS)
    if count:
        print(f"The largest {min(count, SHOWN)} of {count} differences:")
    for text in (*(f"  {line}" for line in lines(found)), *sentences(found, tolerance)):
        print(text)
