"""Two reports compared: a planted change is found, whatever its kind; measured times are left
alone."""

import math
from dataclasses import replace

import pytest

from iapb.errors import RunFileError
from reports import cli
from reports.pages import difference
from reports.pages.difference import (
    CLOSE,
    DIFFERS,
    EXACT,
    ONLY_NEW,
    ONLY_OLD,
    TIMING,
    compare_reports,
    unlike,
)
from reports.pages.numbers_file import NUMBERS_NAME, ReportNumbers, read_numbers, write_numbers
from verification.table import Columns, titled

TABLE = titled(
    ("method", "gain", "median [µs]", "stable", "note"),
    (
        ("factored", 1.5, 12.0, True, "rank 3 of 4"),
        ("svd", math.nan, 40.0, True, "left out"),
        ("pinv", math.inf, 41.0, False, "gains 2.50000e-3"),
        ("qr", None, 7.0, True, "x"),
        ("qr", 2.2e-16, 7.0, True, "x"),
    ),
    kinds=Columns(timed=("median [µs]",)),
)
SENTENCES = titled(
    ("claim", "outcome", "sentence"),
    (("C07", "reproduced", "Gains 2.5e-3 at most."),),
    kinds=Columns(prose=("sentence",)),
)
REPORT = ReportNumbers(
    {"claims/C07": TABLE, "claims": SENTENCES},
    {"iapb run peg_corner": "c" * 64},
    {"cpu": "one", "commit": "abc"},
    "quick",
)


def changed(row, column, value, table="claims/C07"):
    """The report with another value in one cell."""
    given = REPORT.tables[table]
    rows = [list(cells) for cells in given.rows]
    rows[row][given.titles.index(column)] = value
    return replace(
        REPORT, tables={**REPORT.tables, table: replace(given, rows=tuple(map(tuple, rows)))}
    )


def only(**tables):
    return replace(REPORT, tables=tables)


@pytest.mark.parametrize(
    "change",
    [
        (0, "gain", 1.5 * (1 + 1e-12), CLOSE),
        (0, "gain", 1.5 * (1 + 1e-8), DIFFERS),
        (0, "gain", None, ONLY_OLD),
        (3, "gain", 1.0, ONLY_NEW),
        (0, "median [µs]", 99.0, TIMING),
        (0, "stable", False, DIFFERS),
        (0, "stable", 1, DIFFERS),
        (0, "note", "rank 2 of 4", DIFFERS),
        (1, "note", "solved", TIMING),
        (4, "gain", 4.4e-16, CLOSE),
        (4, "gain", 1e-11, DIFFERS),
        (0, "sentence", "Gains 2.6e-3 at most.", difference.PROSE, "claims"),
        (0, "outcome", "refuted", DIFFERS, "claims"),
    ],
)
def test_a_planted_change_is_found_and_named_through_the_files(change, tmp_path):
    row, column, value, state, table = (*change, "claims/C07")[:5]
    for name, report in (
        ("old", REPORT),
        ("same", REPORT),
        ("new", changed(row, column, value, table)),
    ):
        write_numbers(tmp_path / f"{name}.json", report)
    old, same, new = (read_numbers(tmp_path / f"{name}.json") for name in ("old", "same", "new"))
    found = compare_reports(old, same)
    assert {cell.state for cell in found.cells} == {EXACT, TIMING} and len(found.cells) == 28
    assert (found.runs_same, found.runs_other, found.tables_old, found.tables_new) == (
        1,
        (),
        (),
        (),
    )
    assert (same.runs, same.provenance, same.depth) == (REPORT.runs, REPORT.provenance, "quick")
    [cell] = [cell for cell in compare_reports(old, new).cells if repr(cell.old) != repr(cell.new)]
    assert (cell.state, cell.table, cell.column) == (state, table, column)
    assert cell.row.startswith(f"{row + 1}: ")


def test_rows_and_columns_that_one_report_lacks_shift_no_others():
    more = replace(TABLE, rows=(("new", 1.0, 1.0, True, ""), *TABLE.rows))
    found = compare_reports(only(t=TABLE), only(t=more))
    assert (found.count(ONLY_NEW), found.count(DIFFERS), found.count(EXACT)) == (5, 0, 19)
    fewer = replace(TABLE, columns=TABLE.columns[:-1], rows=tuple(row[:-1] for row in TABLE.rows))
    found = compare_reports(only(t=TABLE), only(t=fewer))
    assert (found.count(ONLY_OLD), found.count(DIFFERS)) == (5, 0)
    twice, other = (titled(("a", "a"), ((first, 2.0),)) for first in (1.0, 3.0))
    assert [cell.state for cell in compare_reports(only(t=twice), only(t=other)).cells] == [
        DIFFERS,
        EXACT,
    ]


def test_where_times_decide_the_rows_they_are_known_by_what_was_asked():
    def table(*sizes):
        rows = tuple(("pinv", size, 2.0 * size, True) for size in sizes)
        return titled(
            ("method", "contacts", "time [µs]", "stable"),
            rows,
            kinds=Columns(timed=("time [µs]",), timed_rows=True),
        )

    found = compare_reports(only(t=table(1, 60, 300)), only(t=table(1, 300, 600)))
    assert (
        found.count(DIFFERS) == 0 and found.count(EXACT) == 6
    )  # three judged cells of each of the two in common
    assert (
        found.count(TIMING) == 10
    )  # the times of those two, and two rows of four cells of one alone


def test_what_keeps_runs_from_repeating_is_named():
    old = {"cpu": "a", "blas": "openblas 0.3 Haswell x2", "commit": "1"}
    threads = old | {"blas": "openblas 0.3 Haswell x1", "commit": "2"}
    kernel = old | {"blas": "openblas 0.3 SkylakeX x2", "cpu": "b", "mujoco": "1"}
    assert unlike(old, threads) == () and unlike(old, kernel) == ("cpu", "BLAS kernel", "mujoco")


def test_the_command_counts_everything_and_ends_with_1_only_where_results_differ(tmp_path, capsys):
    more = replace(changed(0, "gain", 2.0), runs={"iapb run peg_corner": "d" * 64, "new": "e"})
    more = replace(more, tables={"claims/C07": more.tables["claims/C07"], "extra": TABLE})
    for name, report in (
        ("a", REPORT),
        ("b", changed(0, "median [µs]", 99.0)),
        ("c", more),
        ("d", changed(0, "gain", 2.0)),
        ("e", replace(REPORT, tables=REPORT.tables | {"extra": TABLE})),
    ):
        (tmp_path / name).mkdir()
        write_numbers(tmp_path / name / NUMBERS_NAME, report)
    a, b, c, d, e = (str(tmp_path / name) for name in "abcde")
    assert cli.main(["report", "diff", a, f"{b}/report.html"]) == 0
    capsys.readouterr()
    assert cli.main(["report", "diff", a, f"{c}/{NUMBERS_NAME}"]) == 1
    said = " ".join(capsys.readouterr().out.split())
    for words in (
        "claims/C07, row 1: factored, gain: 1.5 -> 2.0 (2.5e-01 of it)",
        "Of 19 numbers and words in both reports, 18 are exactly the same",
        "Only in the old report: claims. Only in the new report: extra.",
        "Of 1 runs behind both, 0 are the same to the last bit; 1 are behind one only.",
    ):
        assert words in said, words
    assert cli.main(["report", "diff", a, d, "--tolerance", "0.5"]) == 0
    assert cli.main(["report", "diff", a, e]) == cli.main(["report", "diff", e, a]) == 1


def test_a_long_text_is_shown_from_where_it_differs():
    long = "the same forty letters before both ends: "
    table = titled(("row", "note"), (("one", f"{long}left"),))
    other = titled(("row", "note"), (("one", f"{long}right"),))
    [line] = difference.lines(compare_reports(only(t=table), only(t=other)))
    assert "h ends: left -> " in line and "h ends: right" in line


@pytest.mark.parametrize(
    "text",
    [
        "",
        '{"format": "other"}',
        "[" * 100_000,
        '{"format": "iapb numbers", "format_version": 1, "depth": "q", "runs": {}, "provenance": {}, '
        '"tables": {"t": {"columns": ["a"], "rows": [[1, 2]]}}}',
    ],
)
def test_a_foreign_file_is_refused_in_one_sentence(text, tmp_path, capsys):
    path = tmp_path / NUMBERS_NAME
    path.write_text(text)
    with pytest.raises(RunFileError, match="numbers of a report"):
        read_numbers(path)
    assert cli.main(["report", "diff", str(path), str(path)]) == 1
    assert capsys.readouterr().err.startswith("iapb: ")
