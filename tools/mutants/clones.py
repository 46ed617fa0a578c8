"""Throw-away clones of the last commit, and pytest in them with interpreted kernels under a limit of CPU time.

Every run of pytest is a process of its own, forked from a server that has loaded the big libraries once.
"""

from __future__ import annotations

import multiprocessing
import os
import queue
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

Thing = TypeVar("Thing")
Result = TypeVar("Result")

REPOSITORY = Path(__file__).resolve().parents[2]
PASSED, FAILED, TIMED_OUT, NO_TESTS = "passed", "failed", "timed out", "no tests"
_FIRST_FAILURE = re.compile(r"^(?:FAILED|ERROR) (\S+)", re.MULTILINE)
_COUNTED = re.compile(r"\b[1-9]\d* (failed|error)")
_NO_TESTS_COLLECTED = 5  # exit code of pytest
_PROCESSES = multiprocessing.get_context("forkserver")
_LOADED_ONCE = [
    "tools.mutants.__main__", "pytest", "hypothesis.strategies", "hypothesis.extra.numpy", "numba.extending",
    "scipy.linalg", "scipy.spatial.transform", "pydantic", "ruamel.yaml",
]  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """What pytest said."""

    verdict: str
    first_failure: str = ""


def git(*arguments: str, folder: Path = REPOSITORY) -> str:
    """Output of a git command."""
    done = subprocess.run(["git", *arguments], cwd=folder, capture_output=True, text=True, check=True)
    return done.stdout.strip()


class Clone:
    """A clone of the last commit in a temporary folder; remove it after use."""

    def __init__(self) -> None:
        self.root = Path(tempfile.mkdtemp(prefix="mutants-"))
        git("clone", "-q", str(REPOSITORY), str(self.root))

    def remove(self) -> None:
        """Delete the folder."""
        shutil.rmtree(self.root, ignore_errors=True)

    def pytest(self, arguments: Sequence[str], seconds: int, **environment: str) -> Outcome:
        """Run pytest on some tests, at most so many seconds of CPU."""
        said = self.root / "said.txt"
        options = ["-q", "--tb=no", "-p", "no:cacheprovider", *arguments]
        process = _PROCESSES.Process(target=_run_pytest, args=(self.root, options, seconds, environment, said))
        process.start()
        process.join()
        if process.exitcode in (-signal.SIGXCPU, -signal.SIGKILL):
            return Outcome(TIMED_OUT)
        if process.exitcode == 0:
            return Outcome(PASSED)
        if process.exitcode == _NO_TESTS_COLLECTED:
            return Outcome(NO_TESTS)
        text = said.read_text(errors="replace")
        if first := _FIRST_FAILURE.search(text):
            return Outcome(FAILED, first[1])
        last = (text.strip().splitlines() or ["?"])[-1]
        if (process.exitcode or 0) < 0:
            return Outcome(FAILED, f"the interpreter ended by signal {-(process.exitcode or 0)}")
        if _COUNTED.search(last):
            return Outcome(FAILED, last)
        raise RuntimeError(f"pytest did not run: {last}")


def _run_pytest(
    root: Path, options: Sequence[str], seconds: int, environment: Mapping[str, str], said: Path
) -> None:  # fmt: skip
    """In a process of its own, where all big libraries are loaded but the engine is not: pytest in a clone."""
    import pytest

    os.environ.update(environment)
    os.chdir(root)
    sys.path.insert(0, str(root))
    output = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(output, 1)
    os.dup2(output, 2)
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5))
    code = int(pytest.main(list(options)))
    sys.stdout.flush()
    os._exit(code)


def prepare() -> None:
    """Settings of all test processes: interpreted kernels; one thread, so that CPU time is the time of the work.

    Before the first test, in the main module. No byte code is written: of a file that changes twice within a second
    it would be stale.
    """
    os.environ.update(
        NUMBA_DISABLE_JIT="1", PYTHONDONTWRITEBYTECODE="1", OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1",
        IAPB_HYPOTHESIS_PROFILE="quick",
    )  # fmt: skip
    _PROCESSES.set_forkserver_preload(_LOADED_ONCE)


def in_clones(
    work: Callable[[Clone, Thing], Result], things: Iterable[Thing], clones: Sequence[Clone]
) -> Iterator[Result]:
    """Results of `work(clone, thing)` as they are done, one at a time in each clone."""
    free: queue.SimpleQueue[Clone] = queue.SimpleQueue()
    for clone in clones:
        free.put(clone)

    def one(thing: Thing) -> Result:
        clone = free.get()
        try:
            return work(clone, thing)
        finally:
            free.put(clone)

    with ThreadPoolExecutor(len(clones)) as pool:
        tasks = [pool.submit(one, thing) for thing in things]
        try:
            for task in as_completed(tasks):
                yield task.result()
        finally:
            for task in tasks:
                task.cancel()
