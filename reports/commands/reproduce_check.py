"""`iapb reproduce --check REPORT`: compute a report again on this machine, and say which of its numbers agree."""

from __future__ import annotations

import tempfile
from contextlib import nullcontext
from pathlib import Path

import typer


def check_report(report: Path, out: Path | None) -> None:
    """Compute everything again, at the report's depth, into `out` or a temporary folder, and compare.

    Runs must be the same to the last bit where code, packages and processor are; elsewhere numbers must agree within
    the tolerance. Ends with 1 where they do not, or where the report has numbers that were not made again.
    """
    from iapb.errors import ArgumentError
    from reports.commands.report import print_difference
    from reports.commands.reproduce import make_report
    from reports.difference import DIFFERS, ONLY_OLD, TOLERANCE, compare_reports
    from reports.difference_text import unlike
    from reports.numbers_file import read_numbers

    given = read_numbers(report)
    if out is not None and out.exists() and any(out.iterdir()):
        raise ArgumentError("--out", str(out), "an empty folder: what is there would be read, not computed again")
    with tempfile.TemporaryDirectory() if out is None else nullcontext(str(out)) as folder:
        make_report(Path(folder), given.depth)
        made = read_numbers(folder)
    found = compare_reports(given, made)
    reasons = unlike(given.provenance, made.provenance)
    print()
    print(f"The report was made with another {', '.join(reasons)}: numbers must agree within {TOLERANCE:.0e}."
          if reasons else "Same code, packages and processor: runs must agree to the last bit.")  # fmt: skip
    print_difference(found, TOLERANCE)
    lost = found.count(ONLY_OLD) + len(found.tables_old)
    failed = found.count(DIFFERS) + lost + (0 if reasons else len(found.runs_other))
    print(f"{report}: " + ("every number was made again." if not failed else "not every number was made again."))
    if failed:
        raise typer.Exit(1)
