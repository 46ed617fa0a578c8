"""Throw-away clones of the last commit, and pytest in them with interpreted kernels under a limit of CPU time."""

from __future__ import annotations

import os
import queue
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

Thing = TypeVar("Thing")
Result = TypeVar("Result")

REPOSITORY = Path(__file__).resolve().parents[2]
PASSED, FAILED, TIMED_OUT, NO_TESTS = "passed", "failed", "timed out", "no tests"
_FIRST_FAILURE = re.compile(r"^(?:FAILED|ERROR) (\S+)", re.MULTILINE)
_NO_TESTS_COLLECTED = 5  # exit code of pytest


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
        command = [sys.executable, "-m", "pytest", "-q", "--tb=no", "-p", "no:cacheprovider", *arguments]
        done = subprocess.run(
            command, cwd=self.root, capture_output=True, text=True, check=False,
            env={**_environment(), **environment}, preexec_fn=lambda: _limit(seconds),
        )  # fmt: skip
        if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
            return Outcome(TIMED_OUT)
        if done.returncode == 0:
            return Outcome(PASSED)
        if done.returncode == _NO_TESTS_COLLECTED:
            return Outcome(NO_TESTS)
        first = _FIRST_FAILURE.search(done.stdout)
        return Outcome(FAILED, first[1] if first else (done.stderr.strip().splitlines() or ["?"])[-1])


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


def _limit(seconds: int) -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5))


def _environment() -> dict[str, str]:
    """Interpreted kernels; one thread, so that CPU time is the time of the work; no stale byte code."""
    return {
        **os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": str(REPOSITORY),
        "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "IAPB_HYPOTHESIS_PROFILE": "quick",
    }  # fmt: skip
