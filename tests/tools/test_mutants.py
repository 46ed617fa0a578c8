"""The tool that mutates the physics: its places, its sample, its choice of tests, its verdicts."""

from __future__ import annotations

import ast
import json
import tomllib
from contextlib import nullcontext
from dataclasses import asdict
from pathlib import Path

import pytest

from tools import mutants
from tools.mutants import (
    FAILED,
    NOTICED,
    PASSED,
    PHYSICS,
    SURVIVED,
    TABLE,
    Clone,
    Judgement,
    MeasuredTest,
    Mutant,
    all_places,
    judge,
    kept_verdicts,
    looks,
    places,
    sample,
    score,
    sentences,
)

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


@pytest.mark.parametrize(("text", "becomes"), [
    ("a += b", {"a -= b", "pass"}), ("min(a, b)", {"max(a, b)", "pass"}), ("f(x)", {"pass"}),
    ("x = (a) + (b)", {"x = (a) - (b)"}), ("x = -(a * b)", {"x = (a * b)", "x = -(a / b)"}),
    ("x = a <= b < c", {"x = a < b < c", "x = a > b < c", "x = a <= b <= c", "x = a <= b >= c"}),
    ("x = not a and b", {"x = a and b", "x = not a or b"}), ("x = True", {"x = False"}),
    ("x = 'é' + 'ü'", {"x = 'é' - 'ü'"}),
    ("best = 1e300", set()), ("n = 1e3", {"n = 1001.0", "n = 999.0"}), ("n = q.shape[0]", {"n = q.shape[1]"}),
    ("clock[0] = row[0]", {"clock[1] = row[0]", "clock[0] = row[1]", "clock[0] = row[-1]"}),
])  # fmt: skip
def test_faults_are_these(text: str, becomes: set[str]) -> None:
    assert {mutant.becomes for mutant in places("a.py", text + "\n", frozenset({"clock"}))} == becomes


def test_every_place_changes_code_and_still_parses() -> None:
    for mutant in places("fall.py", TEXT):
        assert ast.dump(ast.parse(mutant.source(TEXT))) != ast.dump(ast.parse(TEXT)), mutant
        assert mutant.becomes != mutant.line


def test_places_know_their_function_and_skip_messages() -> None:
    found = list(places("fall.py", TEXT))
    assert {mutant.function for mutant in found} == {"", "fall"}
    assert not [mutant for mutant in found if "raise" in mutant.line or "Not code" in mutant.line]
    assert {"total += LIMIT * min(speeds[k], 1.0)", "store(total)"} <= {
        mutant.line for mutant in found if mutant.fault == "dropped"
    }


def test_every_file_of_the_physics_is_there() -> None:
    assert not [pattern for pattern in PHYSICS if not list(ROOT.glob(pattern))]


def test_sample_depends_on_the_seed_alone() -> None:
    found = all_places(ROOT, only="projector")
    first, again, other = (sample(found, 20, seed) for seed in (0, 0, 1))
    assert first == again
    assert set(first) != set(other)
    assert sample(found, 10, 0) == first[:10]


def _mutant(function: str) -> Mutant:
    return Mutant("iapb/a.py", function, 3, "x = 1", "x = 2", "number", 4, 5, "2")


def test_tests_that_call_the_function_judge_first_and_their_files_second() -> None:
    mirrored = MeasuredTest("tests/test_a.py::test_slow", 2.0, frozenset({"iapb/a.py::f"}))
    elsewhere = MeasuredTest("tests/test_b.py::test_quick", 0.1, frozenset({"iapb/a.py::f"}))
    beside = MeasuredTest("tests/test_b.py::test_shared", 0.1, frozenset())
    unrelated = MeasuredTest("tests/test_c.py::test_c", 0.1, frozenset({"iapb/a.py::g"}))
    tests = [unrelated, beside, elsewhere, mirrored]
    assert looks(_mutant("f"), tests) == ([mirrored, elsewhere], [beside])
    for name in ("", "newer_than_the_measurement"):
        assert unrelated in looks(_mutant(name), tests)[0]


def test_a_pytest_that_does_not_run_notices_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor does a test file that cannot be read with or without the mutant."""
    clone = Clone.__new__(Clone)
    clone.root = tmp_path
    with pytest.raises(RuntimeError, match="pytest did not run"):
        clone.pytest(["--no-such-option"], 20)
    (tmp_path / "iapb").mkdir()
    (tmp_path / "iapb/a.py").write_text("x = 1\n")
    (tmp_path / "test_broken.py").write_text("import nothing_of_this_name\n")
    monkeypatch.setattr(mutants, "_tried", lambda *_: (NOTICED, "test_broken.py", 0))
    for verdict, raises in ((FAILED, pytest.raises(RuntimeError, match="with or without")), (PASSED, nullcontext())):
        monkeypatch.setattr(Clone, "pytest", lambda *_, said=verdict: (said, ""))
        with raises:
            judge(_mutant(""), [], clone, {}, "now")
        assert (tmp_path / "iapb/a.py").read_text() == "x = 1\n"


def _judgement(verdict: str, key: str, code: str = "now") -> Judgement:
    return Judgement("iapb/a.py", "f", 3, "x = 1", "x = 2", verdict, key=key, code=code)


def test_a_survivor_is_judged_again_when_the_tests_have_changed(tmp_path: Path) -> None:
    path = tmp_path / "verdicts.jsonl"
    judged = [_judgement(verdict, verdict, code="before") for verdict in (NOTICED, SURVIVED)]
    path.write_text("".join(json.dumps(asdict(one)) + "\n" for one in judged))
    assert set(kept_verdicts(path, "now")) == {NOTICED}
    assert set(kept_verdicts(path, "before")) == {NOTICED, SURVIVED}


def test_only_the_explained_change_of_the_explained_line_is_excused() -> None:
    survivor = _judgement(SURVIVED, "1")
    judged = [survivor, *(_judgement(NOTICED, str(k)) for k in range(2, 5))]
    reason = {"file": "iapb/a.py", "line": "x = 1", "becomes": "x = 2", "kind": "equivalent", "reason": "because"}
    assert score(judged, [reason]) == (0.75, 1.0, [])
    assert score(judged, [{**reason, "kind": "harmless"}]) == (0.75, 0.75, [])
    for other in ({"becomes": "x = 0"}, {"line": "y = 1"}):
        assert score(judged, [{**reason, **other}]) == (0.75, 0.75, [survivor])
    assert any(sentence.startswith("Not enough: 90%") for sentence in sentences(judged, [], 10))
    assert any(sentence.startswith("Enough") for sentence in sentences(judged, [reason], 10))


def test_every_explained_line_is_still_in_its_file_and_becomes_that() -> None:
    found = {(mutant.file, mutant.line): mutant for mutant in all_places(ROOT)}
    changes = {(mutant.file, mutant.line, mutant.becomes) for mutant in all_places(ROOT)}
    for entry in tomllib.loads(TABLE.read_text())["survivor"]:
        place = entry["file"], entry["line"]
        assert entry["kind"] in ("equivalent", "harmless") and entry["reason"]
        assert (*place, entry["becomes"]) in changes if "becomes" in entry else place in found, entry
