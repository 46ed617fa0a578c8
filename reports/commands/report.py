"""`iapb report ACTION`: compare the numbers of two reports."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from reports.difference import Difference


class Action(StrEnum):
    """What to do."""

    diff = "diff"


def report(
    action: Annotated[Action, typer.Argument(help="diff: compare the numbers of two reports.")],
    old: Annotated[Path, typer.Argument(help="A report, its folder, or its numbers.json.")],
    new: Annotated[Path, typer.Argument(help="The other one.")],
    tolerance: Annotated[float, typer.Option(min=0.0, help="Relative difference up to which numbers agree.")] = 1e-9,
) -> None:
    """Say which numbers of two reports agree exactly, within a tolerance, or not; end with 1 where some differ."""
    import math

    from iapb.errors import ArgumentError
    from reports.difference import DIFFERS, compare_reports
    from reports.difference_text import unlike
    from reports.numbers_file import read_numbers

    if not math.isfinite(tolerance):
        raise ArgumentError("--tolerance", tolerance, "a finite number, 0 or more")
    first, second = read_numbers(old), read_numbers(new)
    found = compare_reports(first, second, tolerance)
    reasons = unlike(first.provenance, second.provenance)
    print(f"The reports differ in {', '.join(reasons)}." if reasons else "Same code, packages and processor.")
    if first.depth != second.depth:
        print(f"The old report is {first.depth}, the new one {second.depth}: many numbers are of one only.")
    print_difference(found, tolerance)
    if found.count(DIFFERS):
        raise typer.Exit(1)


def print_difference(found: Difference, tolerance: float) -> None:
    """Print the sentences, a table by part of the report, and what differs most."""
    from reports.difference import DIFFERS
    from reports.difference_text import PARTS, SHOWN, parts, sentences, table

    _print_table("Numbers and words by part of the report", ("part", *(name for name, _ in PARTS)), parts(found))
    count = found.count(DIFFERS)
    if count:
        _print_table(f"The largest {min(count, SHOWN)} of {count} differences",
                     ("table", "row", "column", "old", "new", "relative"), table(found))  # fmt: skip
    for sentence in sentences(found, tolerance):
        print(sentence)


def _print_table(title: str, headings: Iterable[str], rows: Iterable[tuple[str, ...]]) -> None:
    from rich.console import Console
    from rich.table import Table

    shown = Table(title=title)
    for heading in headings:
        shown.add_column(heading)
    for row in rows:
        shown.add_row(*row)
    Console().print(shown)
