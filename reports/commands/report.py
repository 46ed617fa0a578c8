"""`iapb report ACTION`: compare the numbers of two reports."""

from __future__ import annotations

import math
from collections import Counter
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from iapb.errors import ArgumentError
from reports.pages.difference import (
    DIFFERS,
    PARTS,
    SHOWN,
    compare_reports,
    parts,
    sentences,
    unlike,
)
from reports.pages.difference import lines as largest
from reports.pages.numbers_file import read_numbers
from reports.show import Answer, Json
from verification.table import Table, titled

_COLUMNS = ("part", *(name for name, _ in PARTS))


class Action(StrEnum):
    """What to do."""

    diff = "diff"


def report(
    action: Annotated[Action, typer.Argument(help="diff: compare the numbers of two reports.")],
    old: Annotated[Path, typer.Argument(help="A report, its folder, or its numbers.json.")],
    new: Annotated[Path, typer.Argument(help="The other one.")],
    tolerance: Annotated[
        float, typer.Option(min=0.0, help="Relative difference up to which numbers agree.")
    ] = 1e-9,
    json_: Json = False,
) -> Answer:
    """Compare the numbers of two reports: equal, within a tolerance, or different; end with 1 if
    some differ or are in one report only."""
    if not math.isfinite(tolerance):
        raise ArgumentError("--tolerance", tolerance, "a finite number, 0 or more")
    first = read_numbers(old)
    second = read_numbers(new)
    found = compare_reports(first, second, tolerance)
    reasons = unlike(first.provenance, second.provenance)
    facts = {
        "differs_in": reasons,
        "depths": [first.depth, second.depth],
        "tolerance": tolerance,
        "cells": Counter(cell.state for cell in found.cells),
        "differing": found.of(DIFFERS),
        "tables_of_old_alone": found.tables_old,
        "tables_of_new_alone": found.tables_new,
        "runs_same": found.runs_same,
        "runs_other": found.runs_other,
        "runs_single": found.runs_single,
    }
    lines: list[str | Table] = [
        f"The new report was made with another {', '.join(reasons)}."
        if reasons
        else "Same code, packages, processor and BLAS kernel."
    ]
    if first.depth != second.depth:
        lines.append(
            f"The old report is {first.depth}, the new one {second.depth}: many numbers are of one only."
        )
    count = found.count(DIFFERS)
    lines += ["Table and words by part of the report", titled(_COLUMNS, parts(found))]
    if count:
        lines.append(f"The largest {min(count, SHOWN)} of {count} differences:")
        lines += [f"  {line}" for line in largest(found)]
    return Answer(facts, [*lines, *sentences(found, tolerance)], 0 if found.agree else 1)
