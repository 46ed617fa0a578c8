"""The tool that mutates the physics: its places, its sample, its choice of tests, its verdicts."""

from __future__ import annotations

import ast
import dataclasses
from contextlib import nullcontext
from pathlib import Path

import pytest

pytest.importorskip("cosmic_ray")

from cosmic_ray.mutating import mutate_code

from tools.mutants.clones import FAILED, PASSED, Clone, Outcome
from tools.mutants.explained import Explanation, explanations
from tools.mutants.judge import NOTICED, SURVIVED, Judgement, Kept, _only_the_change_breaks
from tools.mutants.operators import OPERATORS
from tools.mutants.report import enough, likely_range, score, score_of_changes, sentences, unexplained
from tools.mutants.selection import MeasuredTest, Selection
from tools.mutants.sites import Mutant, places, sample

ROOT = Path(__file__).resolve().parents[2]
TEXT = """\
LIMIT = 2.0


def fall(speeds, n):
    \"\"\"Not code: 1 + 1.\"\"\"
    total = 0.0
    for k in range(n):
        total += LIMIT * min(speeds[k], 1.0)
    store(total)
    if n < 0:
        raise ValueError(f"n < 0: {n + 1}")
    return total
"""


@pytest.mark.parametrize("name", ["AugmentedSign", "OtherExtreme", "DropStatement"])
def test_own_operators_do_what_their_examples_say(name: str) -> None:
    for example in OPERATORS[name].examples():
        before, after = example.pre_mutation_code + "\n", example.post_mutation_code + "\n"
        assert mutate_code(before, OPERATORS[name], 0) == after


def test_every_place_changes_code_and_still_parses() -> None:
    for mutant in places("fall.py", TEXT):
        changed = ast.dump(ast.parse(mutant.source(TEXT)))
        assert changed != ast.dump(ast.parse(TEXT)), mutant
        assert mutant.becomes(TEXT) != mutant.line


def test_places_know_their_function_and_skip_messages() -> None:
    found = list(places("fall.py", TEXT))
    assert {mutant.function for mutant in found} == {"", "fall"}
    assert not [mutant for mutant in found if "raise" in mutant.line or "Not code" in mutant.line]
    assert {"total += LIMIT * min(speeds[k], 1.0)", "store(total)"} <= {
        mutant.line for mutant in found if mutant.operator == "DropStatement"
    }


def test_sample_depends_on_the_seed_alone() -> None:
    first, again, other = (sample(ROOT, 20, seed, only="projector") for seed in (0, 0, 1))
    assert first == again
    assert set(first) != set(other)
    assert sample(ROOT, 10, 0, only="projector") == first[:10]


def _mutant(function: str) -> Mutant:
    return Mutant("iapb/a.py", "Constant", 0, 3, "x = 1", function)


def test_tests_that_call_the_function_judge_first_and_their_files_second() -> None:
    mirrored = MeasuredTest("tests/test_a.py::test_slow", 2.0, frozenset({"iapb/a.py::f"}))
    elsewhere = MeasuredTest("tests/test_b.py::test_quick", 0.1, frozenset({"iapb/a.py::f"}))
    beside = MeasuredTest("tests/test_b.py::test_shared", 0.1, frozenset())
    unrelated = MeasuredTest("tests/test_c.py::test_c", 0.1, frozenset({"iapb/a.py::g"}))
    selection = Selection([unrelated, beside, elsewhere, mirrored])
    assert selection.first_look(_mutant("f")) == [mirrored, elsewhere]
    assert selection.second_look(_mutant("f")) == [beside]
    for name in ("", "newer_than_the_measurement"):
        assert unrelated in selection.first_look(_mutant(name))


def test_a_pytest_that_does_not_run_notices_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor does a test file that cannot be read with or without it."""
    clone = Clone.__new__(Clone)
    clone.root = tmp_path
    with pytest.raises(RuntimeError, match="pytest did not run"):
        clone.pytest(["--no-such-option"], 20)
    (tmp_path / "test_broken.py").write_text("import nothing_of_this_name\n")
    for verdict, raises in ((FAILED, pytest.raises(RuntimeError, match="with or without")), (PASSED, nullcontext())):
        monkeypatch.setattr(Clone, "pytest", lambda *_, said=verdict: Outcome(said))
        with raises:
            _only_the_change_breaks("test_broken.py", clone)


def test_a_number_that_one_more_does_not_change_is_no_place() -> None:
    found = [mutant.becomes("best = 1e300\nn = 1e3\n") for mutant in places("a.py", "best = 1e300\nn = 1e3\n")]
    assert found == ["n = 1001.0", "n = 999.0"]


def test_the_last_entry_of_one_is_no_other() -> None:
    text = "port.clock[0] = log.logged[0]\nrow[0] = 2\n"
    found = {mutant.becomes(text) for mutant in places("a.py", text) if mutant.operator == "Constant"}
    assert found == {"port.clock[1] = log.logged[0]", "port.clock[0] = log.logged[1]", "row[1] = 2", "row[-1] = 2",
                     "row[0] = 3", "row[0] = 1"}  # fmt: skip


def _judgement(verdict: str, key: str, code: str = "now") -> Judgement:
    return Judgement("iapb/a.py", "f", 3, "x = 1", "x = 2", "Constant", verdict, key=key, code=code)


def test_a_survivor_is_judged_again_when_the_tests_have_changed(tmp_path: Path) -> None:
    kept = Kept(tmp_path / "verdicts.jsonl", "before")
    for verdict in (NOTICED, SURVIVED):
        kept.add(_judgement(verdict, verdict, code="before"))
    later, same = Kept(tmp_path / "verdicts.jsonl", "now"), Kept(tmp_path / "verdicts.jsonl", "before")
    assert later.find(NOTICED) is not None
    assert later.find(SURVIVED) is None
    assert same.find(SURVIVED) is not None


def test_only_the_explained_change_of_the_explained_line_is_excused() -> None:
    survivor = _judgement(SURVIVED, "1")
    judged = [survivor, _judgement(NOTICED, "2")]
    explanation = Explanation("iapb/a.py", "x = 1", "harmless", "because", becomes="x = 2")
    assert unexplained(judged, [explanation]) == []
    assert unexplained(judged, [dataclasses.replace(explanation, becomes="x = 0")]) == [survivor]
    assert unexplained(judged, [dataclasses.replace(explanation, line="y = 1")]) == [survivor]
    assert score(judged) == 0.5


def test_what_changes_nothing_is_left_out_of_the_customary_score_but_what_is_harmless_is_not() -> None:
    judged = [_judgement(SURVIVED, "1"), *(_judgement(NOTICED, str(k)) for k in range(2, 5))]
    table = [Explanation("iapb/a.py", "x = 1", "equivalent", "because")]
    assert (score(judged), score_of_changes(judged, table)) == (0.75, 1.0)
    assert enough(judged, table) and not enough(judged, [])
    harmless = [dataclasses.replace(table[0], kind="harmless")]
    assert score_of_changes(judged, harmless) == 0.75 and not enough(judged, harmless)
    assert any(sentence.startswith("Not enough: 90%") for sentence in sentences(judged, harmless, 10))


def test_likely_range_narrows_with_the_sample_and_stays_within_one() -> None:
    few, many = likely_range(0.9, 50), likely_range(0.9, 5000)
    assert few[0] < many[0] < 0.9 < many[1] < few[1] < 1.0
    assert likely_range(1.0, 10)[0] < 1.0


def test_every_explained_line_is_still_in_its_file() -> None:
    for entry in explanations():
        lines = {line.strip() for line in (ROOT / entry.file).read_text().splitlines()}
        assert entry.line in lines, f"explained.toml: {entry.file} no longer holds {entry.line!r}"
