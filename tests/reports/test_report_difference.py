"""Two reports compared: a planted change is found, whatever its kind; measured times are left alone."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest

from iapb.errors import RunFileError
from reports import cli
from reports.difference import (
    CLOSE,
    DIFFERS,
    EXACT,
    ONLY_NEW,
    ONLY_OLD,
    PROSE,
    SHOWN,
    TIMING,
    compare_reports,
    compare_values,
    lines,
    parts,
    sentences,
    unlike,
)
from reports.numbers_file import NUMBERS_NAME, ReportNumbers, read_numbers, write_numbers
from verification.table import titled

TABLE = titled(("method", "gain", "median [µs]", "stable", "note"),
                (("factored", 1.5, 12.0, True, "rank 3 of 4"), ("svd", math.nan, 40.0, True, ""),
                 ("pinv", math.inf, 41.0, False, "gains 2.50000e-3"), ("qr", None, 7.0, True, "x")),
                timed=("median [µs]",))  # fmt: skip
SENTENCES = titled(("claim", "outcome", "sentence"), (("C07", "reproduced", "Gains 2.5e-3 at most."),),
                    prose=("sentence",))  # fmt: skip
REPORT = ReportNumbers({"claims/C07": TABLE, "claims": titled(("claim", "outcome"), (("C07", "reproduced"),))},
                       {"iapb run peg_corner": "c" * 64}, {"cpu": "one", "commit": "abc"}, "quick")  # fmt: skip


def changed(row: int, column: str, value: object) -> ReportNumbers:
    """The report with another value in one cell."""
    rows = [list(cells) for cells in TABLE.rows]
    rows[row][TABLE.titles.index(column)] = value
    return replace(REPORT, tables={**REPORT.tables, "claims/C07": replace(TABLE, rows=tuple(map(tuple, rows)))})


def test_a_report_agrees_with_itself_through_its_file(tmp_path):
    again = read_numbers(write_numbers(tmp_path / NUMBERS_NAME, REPORT))
    found = compare_reports(REPORT, again)
    assert {cell.state for cell in found.cells if cell.column != "median [µs]"} == {EXACT} and len(found.cells) == 22
    assert found.count(TIMING) == 4
    assert (found.runs_same, found.runs_other, found.tables_old, found.tables_new) == (1, (), (), ())
    assert (again.runs, again.provenance, again.depth) == (REPORT.runs, REPORT.provenance, "quick")


@pytest.mark.parametrize(
    ("row", "column", "value", "state"),
    [
        (0, "gain", 1.5 * (1 + 1e-12), CLOSE), (0, "gain", 1.5 * (1 + 1e-8), DIFFERS), (0, "gain", -1.5, DIFFERS),
        (0, "gain", math.nan, DIFFERS), (1, "gain", 1.0, DIFFERS), (2, "gain", -math.inf, DIFFERS),
        (0, "gain", None, ONLY_OLD), (3, "gain", 1.0, ONLY_NEW), (0, "median [µs]", 99.0, TIMING),
        (0, "stable", False, DIFFERS), (0, "stable", 1, DIFFERS), (0, "note", "rank 2 of 4", DIFFERS),
        (2, "note", "gains 2.50001e-3", DIFFERS),
    ],
)  # fmt: skip
def test_a_planted_change_is_found_and_named(row, column, value, state):
    found = compare_reports(REPORT, changed(row, column, value))
    [cell] = [cell for cell in found.cells if repr(cell.old) != repr(cell.new)]
    assert (cell.state, cell.table, cell.column) == (state, "claims/C07", column)
    assert cell.row.startswith(f"{row + 1}: ")


def test_another_sentence_is_told_and_not_judged_and_its_verdict_is(tmp_path):
    given = ReportNumbers({"claims": SENTENCES}, {}, {}, "quick")
    for column, value, state in ((2, "Gains 2.6e-3 at most.", PROSE), (1, "refuted", DIFFERS), (2, None, ONLY_OLD)):
        row = [*SENTENCES.rows[0][:column], value, *SENTENCES.rows[0][column + 1 :]]
        other = replace(given, tables={"claims": replace(SENTENCES, rows=(tuple(row),))})
        again = read_numbers(write_numbers(tmp_path / NUMBERS_NAME, other))
        found = compare_reports(given, again)
        assert [cell.state for cell in found.cells if cell.old != cell.new] == [state]
        assert ("1 sentences differ" in " ".join(sentences(found, 1e-9))) == (state == PROSE)


def test_a_file_that_does_not_say_which_columns_are_sentences_is_read(tmp_path):
    path = write_numbers(tmp_path / NUMBERS_NAME, ReportNumbers({"claims": SENTENCES}, {}, {}, "quick"))
    path.write_text(path.read_text().replace('"prose":["sentence"],', ""))
    assert read_numbers(path).tables["claims"] == titled(SENTENCES.titles, SENTENCES.rows)


def test_rows_that_times_decide_are_no_loss_and_others_are():
    fewer = replace(TABLE, rows=TABLE.rows[:2])
    sized = replace(TABLE, timed_rows=True), replace(fewer, timed_rows=True)
    for (old, new), state in (((TABLE, fewer), ONLY_OLD), (sized, TIMING)):
        pair = [replace(REPORT, tables={"claims/C07": table}) for table in (old, new)]
        found = compare_reports(*pair)
        assert {cell.state for cell in found.cells if cell.new is None and cell.column == "stable"} == {state}


def test_a_column_of_times_that_is_no_column_is_refused():
    with pytest.raises(ValueError, match="timed columns"):
        titled(("a",), ((1.0,),), timed=("b",))


def test_the_parts_of_a_report_are_counted_apart():
    tables = {"claims, from times": TABLE, "claims/C07": TABLE, "proofs": titled(("a",), ((1.0,),))}
    report = replace(REPORT, tables=tables)
    assert list(parts(compare_reports(report, report))) == [
        ("claims", "32", "", "", "", "8", ""), ("proofs", "1", "", "", "", "", "")]  # fmt: skip


def test_what_is_rounding_itself_need_not_repeat():
    assert compare_values(2.2e-16, 4.4e-16, 1e-9)[0] == CLOSE
    assert compare_values(2.2e-16, 1e-11, 1e-9)[0] == DIFFERS
    assert compare_values(2.0862968e-11, 2.0865977e-11, 1e-9)[0] == CLOSE
    assert compare_values(1.0, 1.0 + 1e-8, 1e-9)[0] == DIFFERS


def test_what_was_left_out_for_its_time_in_one_of_them_is_not_judged():
    outcomes = ("solved", "left out"), ("solved", "refused")
    for (old, new), state in zip(outcomes, (TIMING, DIFFERS), strict=True):
        pair = [replace(REPORT, tables={"t": titled(("solver",), ((said,),))}) for said in (old, new)]
        assert [cell.state for cell in compare_reports(*pair).cells] == [state]


def test_where_times_decide_the_rows_they_are_known_by_what_was_asked():
    def table(*sizes):
        rows = tuple(("pinv", size, 2.0 * size, True) for size in sizes)
        return titled(("method", "contacts", "time [µs]", "stable"), rows, timed=("time [µs]",), timed_rows=True)

    pair = [replace(REPORT, tables={"t": one}) for one in (table(1, 60, 300), table(1, 300, 600))]
    found = compare_reports(*pair)
    assert found.count(DIFFERS) == 0 and found.count(EXACT) == 6  # three judged cells of each of the two in common
    assert found.count(TIMING) == 10  # the times of those two, and two rows of four cells of one alone


def test_a_row_more_does_not_shift_the_others():
    more = replace(TABLE, rows=(("new", 1.0, 1.0, True, ""), *TABLE.rows))
    found = compare_reports(REPORT, replace(REPORT, tables={**REPORT.tables, "claims/C07": more}))
    assert (found.count(ONLY_NEW), found.count(DIFFERS), found.count(EXACT)) == (5, 0, 18)
    fewer = replace(TABLE, columns=TABLE.columns[:-1], rows=tuple(row[:-1] for row in TABLE.rows))
    found = compare_reports(REPORT, replace(REPORT, tables={**REPORT.tables, "claims/C07": fewer}))
    assert (found.count(ONLY_OLD), found.count(DIFFERS)) == (4, 0)


def test_columns_of_one_name_are_kept_apart():
    twice = ReportNumbers({"t": titled(("a", "a"), ((1.0, 2.0),))}, {}, {}, "quick")
    other = ReportNumbers({"t": titled(("a", "a"), ((3.0, 2.0),))}, {}, {}, "quick")
    assert [cell.state for cell in compare_reports(twice, other).cells] == [DIFFERS, EXACT]


def test_sentences_count_everything():
    other = replace(changed(0, "gain", 2.0), runs={"iapb run peg_corner": "d" * 64, "iapb run new": "e"})
    other = replace(other, tables={"extra": TABLE, **{k: v for k, v in other.tables.items() if k != "claims"}})
    found = compare_reports(REPORT, other)
    text = " ".join(sentences(found, 1e-9))
    assert "16 numbers and words" in text and "15 are exactly" in text and "1 differ" in text
    assert "Only in the old report: claims." in text and "Only in the new report: extra." in text
    assert "Of 1 runs behind both, 0 are the same to the last bit; 1 are behind one only." in text
    assert list(lines(found)) == ["claims/C07, row 1: factored, gain: 1.5 -> 2.0 (2.5e-01 of it)"]
    many = titled(("x",), tuple((float(i),) for i in range(1, 100)))
    twice = replace(many, rows=tuple((2 * x,) for (x,) in many.rows))
    pair = [ReportNumbers({"t": one}, {}, {}, "quick") for one in (many, twice)]
    assert len(list(lines(compare_reports(*pair)))) == SHOWN


def test_what_keeps_runs_from_repeating_is_named():
    assert unlike(REPORT.provenance, REPORT.provenance) == ()
    assert unlike({"cpu": "a", "sources": "x", "commit": "1"}, {"cpu": "b", "sources": "y", "mujoco": "1"}) == (
        "cpu", "sources", "mujoco")  # fmt: skip
    other = {"cpu": "a", "blas": "openblas 0.3 Haswell x2", "simd": "AVX2"}
    assert unlike({"cpu": "a", "blas": "openblas 0.3 Haswell x1", "simd": "AVX2"}, other) == ()  # threads alone
    assert unlike({"cpu": "a", "blas": "openblas 0.3 SkylakeX x2", "simd": "AVX2 X86_V4"}, other) == (
        "BLAS kernel", "CPU features of numpy")


def test_the_command_ends_with_1_only_where_results_differ(tmp_path, capsys):
    for name, report in (("a", REPORT), ("b", changed(0, "median [µs]", 99.0)), ("c", changed(0, "gain", 2.0))):
        (tmp_path / name).mkdir()
        write_numbers(tmp_path / name / NUMBERS_NAME, report)
    a, b, c = (str(tmp_path / name) for name in "abc")
    assert cli.main(["report", "diff", a, f"{b}/report.html"]) == 0
    assert "4 measured times, and what is made from them, are not judged" in capsys.readouterr().out
    assert cli.main(["report", "diff", a, f"{c}/{NUMBERS_NAME}"]) == 1
    assert "The largest 1 of 1 differences" in capsys.readouterr().out
    assert cli.main(["report", "diff", a, c, "--tolerance", "0.5"]) == 0


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", "null", '{"format": "other"}', "\x00", "[" * 100_000, "not JSON",
             '{"format": "iapb numbers", "format_version": 1, "depth": "q", "runs": {}, "provenance": {}, '
             '"tables": {"t": {"columns": ["a"], "rows": [[1, 2]]}}}'],
)  # fmt: skip
def test_a_foreign_file_is_refused_in_one_sentence(text, tmp_path, capsys):
    path = tmp_path / NUMBERS_NAME
    path.write_text(text)
    with pytest.raises(RunFileError, match="numbers of a report"):
        read_numbers(path)
    assert cli.main(["report", "diff", str(path), str(path)]) == 1
    assert capsys.readouterr().err.startswith("iapb: ")


def test_numbers_keep_their_last_bit_and_the_file_is_strict_json(tmp_path):
    value = 0.1 + 0.2
    report = replace(REPORT, tables={"t": titled(("x",), ((value,), (-math.inf,)))})
    path = write_numbers(tmp_path / NUMBERS_NAME, report)
    json.loads(path.read_text(), parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))
    assert read_numbers(path).tables["t"].rows == ((value,), (-math.inf,))


@pytest.fixture
def remade(monkeypatch):
    """Stand in for the hours of computing: `reproduce --check` makes the report that is put here."""
    made, folders = [REPORT], []

    def make_report(out, depth, facts):
        facts["page"] = out / "report.html"
        folders.append(out)
        out.mkdir(exist_ok=True)
        write_numbers(out / NUMBERS_NAME, replace(made[-1], depth=depth))

    monkeypatch.setattr("reports.commands.reproduce.make_report", make_report)
    return made, folders


@pytest.mark.parametrize(
    ("other", "status", "said"),
    [
        (REPORT, 0, "every number was made again"),
        (changed(0, "median [µs]", 99.0), 0, "every number was made again"),
        (changed(0, "gain", 1.5 + 1e-12), 0, "1 agree within 1e-09"),
        (changed(0, "gain", 1.6), 1, "not every number"),
        (changed(0, "gain", None), 1, "not every number"),
        (replace(REPORT, tables={}), 1, "not every number"),
        (replace(REPORT, runs={"iapb run peg_corner": "d" * 64}), 1, "runs must agree to the last bit"),
        (replace(REPORT, runs={"iapb run peg_corner": "d" * 64}, provenance={"cpu": "two", "commit": "abc"}), 0,
         "made with another cpu: numbers must agree within 1e-09"),
    ],
)  # fmt: skip
def test_a_report_is_checked_by_making_it_again(other, status, said, remade, tmp_path, capsys):
    write_numbers(tmp_path / NUMBERS_NAME, REPORT)
    remade[0].append(other)
    assert cli.main(["reproduce", "--check", str(tmp_path / "report.html")]) == status
    assert said in capsys.readouterr().out
    assert not remade[1][0].exists()  # the temporary folder is gone


def test_a_check_says_as_json_what_was_not_made_again(remade, tmp_path, capsys):
    write_numbers(tmp_path / NUMBERS_NAME, REPORT)
    remade[0].append(changed(0, "gain", 1.6))
    assert cli.main(["reproduce", "--check", str(tmp_path), "--json"]) == 1
    said = capsys.readouterr()
    found = json.loads(said.out)
    assert not found["made_again"] and len(found["differing"]) == 1 and found["page"].endswith("report.html")
    assert "not every number" in said.err


def test_a_check_never_reads_what_is_there(remade, tmp_path, capsys):
    write_numbers(tmp_path / NUMBERS_NAME, replace(REPORT, depth="full"))
    assert cli.main(["reproduce", "--check", str(tmp_path), "--out", str(tmp_path)]) == 1
    assert "an empty folder" in capsys.readouterr().err and not remade[1]
    assert cli.main(["reproduce", "--check", str(tmp_path), "--out", str(tmp_path / "new")]) == 0
    assert read_numbers(tmp_path / "new").depth == "full"
