"""Which tests judge a mutant: those that call the changed function, as measured, the quick ones first."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tools.mutants import calls
from tools.mutants.clones import Clone, in_clones
from tools.mutants.sites import MODULE_LEVEL, Mutant, functions, physics_files

TEST_FOLDERS = ("tests/iapb", *(f"tests/verification/{part}" for part in ("mechanics", "properties", "hard_cases")))
LONGEST_FILE = 30  # [s] of CPU to measure one test file; the tests that were reached by then count
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
        chosen = [test for test in self._tests if _touches(test, mutant)]
        return _within(sorted(chosen, key=lambda test: stem not in Path(test.file).stem), FIRST_LOOK)

    def second_look(self, mutant: Mutant) -> list[MeasuredTest]:
        """All tests of all files in which some test calls the function, without those of the first look."""
        files = {test.file for test in self._tests if _touches(test, mutant)}
        seen = set(self.first_look(mutant))
        return _within([test for test in self._tests if test.file in files and test not in seen], SECOND_LOOK)


def _touches(test: MeasuredTest, mutant: Mutant) -> bool:
    if mutant.function == MODULE_LEVEL:
        return any(name.startswith(f"{mutant.file}::") for name in test.calls)
    return f"{mutant.file}::{mutant.function}" in test.calls


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
    folder, root = folder.resolve(), clones[0].root  # pytest runs in another folder
    found, names = [], _function_names(root)
    files = [str(path.relative_to(root)) for part in TEST_FOLDERS for path in sorted((root / part).rglob("test_*.py"))]

    def one(clone: Clone, file: str) -> dict[str, Any]:
        stamp = hashlib.sha256((file + names + (root / file).read_text()).encode()).hexdigest()[:20]
        return _measurement(clone, file, folder / f"{stamp}.json")

    for done, entries in enumerate(in_clones(one, files, clones), start=1):
        progress(done, len(files))
        found += [
            MeasuredTest(name, entry["seconds"], frozenset(entry["calls"]))
            for name, entry in entries.items()
            if entry["passed"] and "seconds" in entry
        ]
    return Selection(found)


def _measurement(clone: Clone, file: str, result: Path) -> dict[str, Any]:
    """Run one test file under the tracer, unless that was done; a file without a test that ends has none."""
    if not result.exists():
        partial = result.with_suffix(".partial")
        clone.pytest(["-p", "tools.mutants.calls", file], LONGEST_FILE, **{calls.RESULT: str(partial)})
        if not partial.exists():
            partial.write_text("{}")
        partial.rename(result)
    return dict(json.loads(result.read_text()))


def _function_names(root: Path) -> str:
    """All functions of the physics: where one is renamed or new, what the tests call is measured again."""
    return "".join(f"{file}:{sorted(functions((root / file).read_text()))}" for file in physics_files(root))
