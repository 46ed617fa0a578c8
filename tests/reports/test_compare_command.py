"""`iapb compare SCENE`: one page within 80 columns, stored results, a figure; tables as lines."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from reports import cli
from reports.commands.lines import WIDTH, sentence, table_lines
from verification.table import titled

SLOPE = Path(__file__).parents[1] / "verification" / "worlds" / "slope.yaml"
SHORT = ("--set", "duration=0.05", "--worlds", "IAPB,ideal,ideal-friction")


@pytest.fixture
def iapb(capsys):
    def call(*arguments):
        return cli.main([str(argument) for argument in arguments]), *capsys.readouterr()

    return call


def test_a_scene_is_compared_on_one_page_and_stored_with_its_figure(iapb, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    place = Path("mine/slope.json")
    status, out, err = iapb("compare", SLOPE, *SHORT, "--out", place)
    assert status == 0, err
    lines = out.splitlines()
    assert max(map(len, lines)) <= WIDTH and len(lines) < 60
    for said in ("Closest to ideal-friction is ", "ideal ignores friction, stiffness, damping.", f"Stored in {place}"):
        assert said in out
    found = json.loads(place.read_text(encoding="utf-8"))
    assert set(found["tables"]) == {"worlds", "over time"} and len(found["tables"]["over time"]["rows"]) == 3 * 51
    assert found["details"]["worlds"] == "IAPB, ideal, ideal-friction"
    picture = place.with_suffix(".svg").read_text(encoding="utf-8")
    assert "ideal-friction (reference)" in picture and "penetration [mm]" in picture


def test_what_a_solver_did_not_solve_is_said_with_its_reason(iapb, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, out, err = iapb("compare", SLOPE.with_name("door.yaml"), "--set", "duration=0.15", "--worlds", "IAPB",
                            "--against", "IAPB", "--impacts", "1")  # fmt: skip
    assert status == 0, err
    assert max(map(len, out.splitlines())) <= WIDTH
    rows = [line.split() for line in out.splitlines() if " none " in line or " friction " in line]
    by_solver = {row[0]: row[2:6] for row in rows}
    assert by_solver["lemke"] == by_solver["nsgs"] == ["1", "1", "0", "0"]
    if "pinocchio_pgs" in by_solver:
        assert by_solver["pinocchio_pgs"] == ["1", "0", "1", "0"]
        said = " ".join(out.split())
        assert "pinocchio_pgs refused 1, such as impact 1 at 0.115 s, μ = 0.2: takes contacts of three" in said
    assert Path("out/compare/door.json").is_file() and Path("out/compare/door.svg").is_file()


def test_json_goes_to_stdout_or_to_the_file(iapb, tmp_path):
    place = tmp_path / "slope.json"
    status, out, _ = iapb("compare", SLOPE, *SHORT, "--out", place, "--json")
    printed, stored = json.loads(out), json.loads(place.read_text(encoding="utf-8"))
    assert status == 0 and printed == stored
    worlds = printed["tables"]["worlds"]
    assert [row[0] for row in worlds["rows"]] == ["IAPB", "ideal", "ideal-friction"]
    assert worlds["columns"][:3] == ["world", "law", "ignores"] and printed["parts"][0]["name"] == "runs"


def test_problem_files_are_listed_with_who_did_not_solve_them_and_stored(iapb, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("given").mkdir()
    Path("given/two.lcp").write_text("2\n2 1\n1 2\n-5 -6\n")
    Path("given/bad.lcp").write_text("2\nno number\n")
    Path("given/none.lcp").write_text("1\n-1\n-1\n")  # 0 <= z, −z − 1 >= 0: no z
    status, out, _ = iapb("compare", "--only-problems", "--problems", "given")
    rows = {line.split()[0]: line.split()[1:] for line in out.splitlines() if line[:4] in ("two.", "none", "bad.")}
    assert status == 0 and max(map(len, out.splitlines())) <= WIDTH
    assert int(rows["two.lcp"][2]) > 3 and rows["none.lcp"][2] == "0" and rows["bad.lcp"][3:5] == ["not", "read:"]
    assert "Stored in out/compare/problems.json" in out
    tables = json.loads(Path("out/compare/problems.json").read_text(encoding="utf-8"))["tables"]
    assert set(tables) == {"given", "profile"} and tables["given"]["rows"][0][0] == "none.lcp"


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        ((SLOPE, "--worlds", "ideel"), 1, "did you mean ideal?"),
        ((SLOPE, "--against", "best"), 1, "against = 'best'"),
        ((SLOPE, "--out", "x.csv"), 1, "ends in .json"),
        (("peg_cornr",), 1, "did you mean peg_corner?"),
        (("--worlds", "PB"), 2, "give a SCENE"),
        (("--against", "PB"), 2, "give a SCENE"),
    ],
)
def test_wrong_use_is_refused_before_anything_is_computed(arguments, status, said, iapb, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ended, out, err = iapb("compare", *arguments)
    assert (ended, list(tmp_path.iterdir())) == (status, []) and said in " ".join((out + err).split())


def test_a_wide_table_goes_on_below_with_its_first_column_again():
    table = titled(("name", *(f"quantity {k} [N s]" for k in range(12))), [("a", *map(float, range(12)))], 3)
    lines = table_lines(table)
    assert max(map(len, lines)) <= WIDTH and lines.count("") == 1
    assert [line for line in lines if line.startswith("a ")][1].split()[-1] == "11"
    assert lines[1].split()[:4] == ["name", "0", "[N", "s]"]


def test_long_texts_are_folded_and_empty_columns_left_out():
    table = titled(("name", "empty", "why"), [("a", None, "words " * 12), ("b", None, None)])
    lines = table_lines(table)
    assert max(map(len, lines)) <= WIDTH and "empty" not in lines[0] and sum("words" in line for line in lines) == 3
    wrapped = sentence("word " * 40, "• ").splitlines()
    assert max(map(len, wrapped)) <= WIDTH and wrapped[0].startswith("• ") and wrapped[1].startswith("  word")
