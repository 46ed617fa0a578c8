"""Which tests judge a mutant: those that call the changed function, as measured, the quick ones first."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tools.mutants import calls
from tools.mutants.clones import Clone, in_clones
from tools.mutants.sites import MODULE_LEVEL, Mutant

TEST_FOLDERS = ("tests/iapb", *(f"tests/verification/{part}" for part in ("mechanics", "properties")))
BATCH = 3  # test files measured by one process
LONGEST_BATCH = 300  # [s] of CPU, far more than the limits of its tests allow
FIRST_LOOK, SECOND_LOOK = 10.0, 40.0  # [s] of CPU for the tests of a mutant, as measured without one


@dataclass(frozen=True)
class MeasuredTest:
    """One test as measured."""

    name: str
    seconds: float
    calls: frozenset[str]

    @property
    def file(self) -> str:
        """The file that it stands in."""
        return self.name.split("::")[0]


class Selection:
    """All measured tests that pass with interpreted kernels."""

    def __init__(self, tests: list[MeasuredTest]) -> None:
        self._tests = sorted(tests, key=lambda test: (test.seconds, test.name))

    def first_look(self, mutant: Mutant) -> list[MeasuredTest]:
        """The quickest tests that call the mutant's function, the mirrored test files before all others."""
        stem = Path(mutant.file).stem
        return _within(sorted(self._touching(mutant), key=lambda test: stem not in test.file), FIRST_LOOK)

    def second_look(self, mutant: Mutant) -> list[MeasuredTest]:
        """All tests of all files in which some test calls the function, without those of the first look."""
        files = {test.file for test in self._touching(mutant)}
        seen = set(self.first_look(mutant))
        return _within([test for test in self._tests if test.file in files and test not in seen], SECOND_LOOK)

    def _touching(self, mutant: Mutant) -> list[MeasuredTest]:
        """Tests that call the function; for a constant, or a function newer than the measurement, its module."""
        calling = [test for test in self._tests if f"{mutant.file}::{mutant.function}" in test.calls]
        if calling and mutant.function != MODULE_LEVEL:
            return calling
        return [test for test in self._tests if any(name.startswith(f"{mutant.file}::") for name in test.calls)]


def _within(tests: list[MeasuredTest], seconds: float) -> list[MeasuredTest]:
    chosen, total = [], 0.0
    for test in tests:
        if total + test.seconds <= seconds:
            chosen.append(test)
            total += test.seconds
    return chosen


def measured(clones: Sequence[Clone], folder: Path, progress: Callable[[int, int], None]) -> Selection:
    """Measure every test file, or take what was measured: a file of results for each version of a test file."""
    folder.mkdir(parents=True, exist_ok=True)
    root = clones[0].root
    files = [str(path.relative_to(root)) for part in TEST_FOLDERS for path in sorted((root / part).rglob("test_*.py"))]
    results = {file: folder.resolve() / f"{_stamp(file + (root / file).read_text())}.json" for file in files}
    pending = [file for file in files if not results[file].exists()]
    batches = [pending[start : start + BATCH] for start in range(0, len(pending), BATCH)]
    for done, _ in enumerate(in_clones(lambda clone, batch: _measure(clone, batch, results), batches, clones), start=1):
        progress(min(done * BATCH, len(pending)), len(pending))
    entries = [entry for file in files for entry in json.loads(results[file].read_text()).items()]
    return Selection([
        MeasuredTest(name, entry["seconds"], frozenset(entry["calls"])) for name, entry in entries if entry["passed"]
    ])


def _measure(clone: Clone, batch: Sequence[str], results: Mapping[str, Path]) -> None:
    """Run some test files under the tracer; write a file of results for each."""
    seen = results[batch[0]].with_suffix(".seen")
    outcome = clone.pytest(["-p", "tools.mutants.calls", *batch], LONGEST_BATCH, **{calls.RESULT: str(seen)})
    if not seen.exists():
        raise RuntimeError(f"measuring {' '.join(batch)}: {outcome.verdict} {outcome.first_failure}")
    tests = json.loads(seen.read_text())
    seen.unlink()
    for file in batch:
        of_file = {name: entry for name, entry in tests.items() if name.split("::")[0] == file}
        results[file].write_text(json.dumps(of_file))


def _stamp(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:20]
