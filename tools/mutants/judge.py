"""Is a mutant noticed? One changed file in a clone, the tests that call it, and the verdicts kept for the next time."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from tools.mutants.clones import FAILED, NO_TESTS, PASSED, TIMED_OUT, Clone, git, in_clones
from tools.mutants.selection import MeasuredTest, Selection
from tools.mutants.sites import Mutant

NOTICED, TOO_LONG, SURVIVED, UNREACHED = "noticed", "too long", "survived", "unreached"
_PLUGIN = ("-x", "-p", "tools.mutants.quick_failure")
_START = 20  # [s] of CPU to start pytest and import everything, generously
_SLOWER = 4  # a mutant that takes this many times as long as the engine hangs


@dataclass(frozen=True)
class Judgement:
    """What became of one mutant."""

    file: str
    function: str
    number: int
    line: str
    becomes: str
    operator: str
    verdict: str  # NOTICED; TOO_LONG: a test did not end; SURVIVED; UNREACHED: no interpreted test calls the function
    by: str = ""  # the test that noticed it
    tests: int = 0  # that it survived
    key: str = ""  # of the mutated file
    code: str = ""  # of engine and tests at that time

    @property
    def killed(self) -> bool:
        """Did some test fail, or never end?"""
        return self.verdict in (NOTICED, TOO_LONG)


class Kept:
    """Verdicts in a file, one line each, so that a sample can be stopped and gone on with.

    A mutant that was noticed stays so while its mutated file is the same; one that survived is judged again when
    the engine or the tests have changed.
    """

    def __init__(self, path: Path, code: str) -> None:
        self._path, self.code = path, code
        path.parent.mkdir(parents=True, exist_ok=True)
        lines = path.read_text().splitlines() if path.exists() else []
        judged = [Judgement(**json.loads(line)) for line in lines]
        self._known = {old.key: old for old in judged if old.killed or old.code == code}

    def find(self, key: str) -> Judgement | None:
        """The verdict on a mutated file, if it stands."""
        return self._known.get(key)

    def add(self, judgement: Judgement) -> None:
        """Keep a verdict."""
        with self._path.open("a") as file:
            file.write(json.dumps(asdict(judgement)) + "\n")


def code_version(clone: Clone) -> str:
    """Stamp of engine and tests in a clone."""
    trees = git("rev-parse", "HEAD:iapb", "HEAD:tests", folder=clone.root)
    return hashlib.sha256(trees.encode()).hexdigest()[:16]


def judge_all(
    mutants: Sequence[Mutant], selection: Selection, clones: Sequence[Clone], kept: Kept,
    told: Callable[[int, Judgement], None],
) -> list[Judgement]:  # fmt: skip
    """Judge every mutant, one at a time in each clone; `told` hears of each as it is done."""
    judged: list[Judgement] = []
    for judgement in in_clones(lambda clone, mutant: _judge(mutant, selection, clone, kept), mutants, clones):
        judged.append(judgement)
        told(len(judged), judgement)
    return judged


def _judge(mutant: Mutant, selection: Selection, clone: Clone, kept: Kept) -> Judgement:
    """Look up or find out one verdict; the clone is left as it was."""
    path = clone.root / mutant.file
    text = path.read_text()
    mutated = mutant.source(text)
    key = hashlib.sha256((mutant.file + mutated).encode()).hexdigest()[:20]
    known = kept.find(key)
    if known is not None:
        return known
    path.write_text(mutated)
    try:
        verdict, by, tests = _run(mutant, selection, clone)
    finally:
        path.write_text(text)
    if verdict == NOTICED and "::" not in by:
        _only_the_change_breaks(by, clone)
    judgement = Judgement(
        mutant.file, mutant.function, mutant.number, mutant.line, mutant.becomes(text), mutant.operator, verdict,
        by, tests, key, kept.code,
    )  # fmt: skip
    kept.add(judgement)
    return judgement


def _run(mutant: Mutant, selection: Selection, clone: Clone) -> tuple[str, str, int]:
    """(verdict, the test that noticed, number of tests that passed)."""
    passed = 0
    for tests in (selection.first_look(mutant), selection.second_look(mutant)):
        if not tests:
            continue
        outcome = clone.pytest([*_PLUGIN, *(test.name for test in tests)], _patience(tests))
        if outcome.verdict == FAILED:
            return NOTICED, outcome.first_failure, passed
        if outcome.verdict == TIMED_OUT:
            return TOO_LONG, "", passed
        passed += len(tests) if outcome.verdict == PASSED else 0
        if outcome.verdict == NO_TESTS:
            raise RuntimeError(f"pytest finds none of the tests chosen for {mutant.file}: {tests[0].name}, …")
    return (SURVIVED if passed else UNREACHED), "", passed


def _only_the_change_breaks(file: str, clone: Clone) -> None:
    """A test file that cannot even be read says nothing of the mutant if it cannot be read without it either."""
    if Path(clone.root / file).is_file() and clone.pytest(["--collect-only", file], _START).verdict == FAILED:
        raise RuntimeError(f"{file} cannot be collected, with or without a mutant")


def _patience(tests: Sequence[MeasuredTest]) -> int:
    return _START + round(_SLOWER * sum(test.seconds for test in tests))
