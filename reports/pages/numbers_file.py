"""The file numbers.json beside a report holds every number of the report, so that two reports can
be compared."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from iapb.errors import ArgumentError, RunFileError
from reports.figures.figure import Figure, numbers_of, statements
from reports.pages.records import Evidence
from reports.store.io import write_whole
from reports.store.keys import plain
from verification.numbers import value_tables
from verification.table import Columns, Table, titled

NUMBERS_NAME = "numbers.json"
FORMAT = "iapb numbers"
FORMAT_VERSION = 2
LARGEST_FILE = 200_000_000  # bytes; a report's is a few million
_TEXTS = ("runs", "provenance")
_NOT_FINITE = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}


@dataclass(frozen=True)
class ReportNumbers:
    """The numbers of a report.

    tables : tables by their place in the report, such as "claims/C07" or "mechanics/trees"
    runs : content hash of each run, by the command that reproduces it
    provenance : code, machine and packages that made the report
    depth : "quick" or "full"
    """

    tables: Mapping[str, Table]
    runs: Mapping[str, str]
    provenance: Mapping[str, str]
    depth: str


def collect_numbers(evidence: Evidence, figures: Iterable[Figure], depth: str) -> ReportNumbers:
    """Return every table and judged sentence of a report, each once, and the content hashes of its
    runs."""
    tables = dict(_of_evidence(evidence))
    figures = tuple(figures)
    for figure in figures:
        if figure.numbers is not None and all(
            figure.numbers is not table for table in tables.values()
        ):
            tables[f"figures/{figure.key}"] = figure.numbers
    tables["figures/statements"] = statements(figures)
    tables |= {
        f"figures/{name}": table for name, table in value_tables(numbers_of(figures)).items()
    }
    runs = {run.command: run.content_hash for run in evidence.runs}
    return ReportNumbers(tables, runs, dict(evidence.provenance), depth)


def _of_evidence(evidence: Evidence) -> Iterator[tuple[str, Table]]:
    said = ("what", "outcome", "sentence")
    yield from _by_time(
        "verdicts",
        said,
        ((one.timed, one.title, one.verdict, one.answer) for one in evidence.topics),
    )
    yield from _by_time(
        "claims", said, ((one.timed, one.key, one.outcome, one.answer) for one in evidence.claims)
    )
    yield from _by_time(
        "claims/parts",
        ("part", "outcome", "holds in", "of", "cannot tell"),
        (
            (
                part.timed,
                f"{claim.key}: {part.name}",
                part.outcome,
                part.held,
                part.decided,
                part.unknown,
            )
            for claim in evidence.claims
            for part in claim.parts
        ),
    )
    for claim in evidence.claims:
        for name, table in claim.tables.items():
            yield f"claims/{claim.key}" + (f", {name}" if name != claim.key else ""), table
    yield from (
        (f"inputs/{name}", value)
        for name, value in evidence.inputs.items()
        if isinstance(value, Table)
    )
    yield from ((f"effects/{scene}", table) for scene, table in evidence.effects.items())
    for page, tables in evidence.numbers.items():
        yield from ((f"{page}/{name}", table) for name, table in tables.items())
    for topic in evidence.topics:
        found = enumerate(topic.parts, 1)
        yield from _by_time(
            topic.key,
            said,
            ((one.timed, number, one.verdict, one.sentence) for number, one in found),
        )
        yield from ((f"{topic.key}/{name}", table) for name, table in topic.tables.items())


def _by_time(
    name: str, titles: tuple[str, ...], found: Iterable[tuple[Any, ...]]
) -> Iterator[tuple[str, Table]]:
    """Yield a table of the rows that do not depend on measured times, and another of those that do,
    by a first cell."""
    rows: dict[bool, list[Any]] = {False: [], True: []}
    for timed, *row in found:
        rows[timed].append(row)
    yield (
        name,
        titled(titles, rows[False], kinds=Columns(prose=("sentence",))),
    )
    if rows[True]:
        kinds = Columns(timed=titles[1:], timed_rows=True)
        yield f"{name}, from times", titled(titles, rows[True], kinds=kinds)


def write_numbers(path: Path, numbers: ReportNumbers) -> Path:
    """Write the numbers as JSON, to the last bit; NaN becomes {"number": "nan"}, an infinity
    {"number": "inf"}."""
    tables = {
        name: {
            "columns": list(table.titles),
            "timed": list(table.timed),
            "timed_rows": table.kinds.timed_rows,
            "prose": list(table.prose),
            "rows": [[_cell(value) for value in row] for row in table.cells],
        }
        for name, table in numbers.tables.items()
    }
    content = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "depth": numbers.depth,
        "provenance": dict(numbers.provenance),
        "runs": dict(numbers.runs),
        "tables": tables,
    }
    write_whole(
        path, json.dumps(content, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    )
    return path


def _cell(value: Any) -> Any:
    value = plain(value)
    if isinstance(value, float) and not math.isfinite(value):
        return {"number": str(value)}
    return value if value is None or isinstance(value, bool | int | float | str) else str(value)


def read_numbers(where: Path | str) -> ReportNumbers:
    """Return the numbers of a report, given its folder, one of its pages, or its numbers.json.

    Raises
    ------
    ArgumentError
        There is no such file.
    RunFileError
        The file was not written by `write_numbers`, or it is damaged.
    """
    path = Path(where)
    path = (
        path / NUMBERS_NAME
        if path.is_dir()
        else path.with_name(NUMBERS_NAME)
        if path.suffix == ".html"
        else path
    )
    if not path.is_file():
        raise ArgumentError(
            "report", str(where), f"a report with {NUMBERS_NAME} beside it, or its folder"
        )
    if path.stat().st_size > LARGEST_FILE:
        raise RunFileError(
            f"{path}: larger than {LARGEST_FILE} bytes: expected the numbers of a report"
        )
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if (found := (content["format"], content["format_version"])) != (FORMAT, FORMAT_VERSION):
            raise ValueError(
                f"format {found[0]!r} {found[1]!r}: expected {FORMAT} {FORMAT_VERSION}"
            )
        tables = {str(name): _table(table) for name, table in content["tables"].items()}
        runs, facts = (
            {str(key): str(value) for key, value in content[name].items()} for name in _TEXTS
        )
        return ReportNumbers(tables, runs, facts, str(content["depth"]))
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise RunFileError(f"{path}: cannot be read as the numbers of a report: {error}") from error


def _table(table: Any) -> Table:
    columns, timed, prose = (
        tuple(str(name) for name in table.get(part, ())) for part in ("columns", "timed", "prose")
    )
    rows = tuple(
        tuple(_NOT_FINITE[v["number"]] if isinstance(v, dict) else v for v in row)
        for row in table["rows"]
    )
    if any(len(row) != len(columns) for row in rows):
        raise ValueError("a row without a cell for each column")
    kinds = Columns(timed=timed, prose=prose, timed_rows=bool(table["timed_rows"]))
    return titled(columns, rows, kinds=kinds)
