"""What a person waits for before the first step: `iapb --help`, and compiling where nothing is cached yet."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from verification.finding import Failure, attempt

HELP_LIMIT, COMPILE_LIMIT = 0.5, 30.0  # [s]
_HELPS = 5
_PROJECT = Path(__file__).parents[2]
# a step in the plane and one in space: the second finds the first one's kernels
_FIRST_STEPS = (
    "from iapb import find_scene, load_scene, simulate\n"
    "for name in ('peg_corner', 'arm_obstacles'):\n"
    "    simulate(load_scene(find_scene(name)), steps=1)\n"
)


@dataclass(frozen=True)
class StartUp:
    """Seconds: of the clock on the wall, and of the process itself; medians over `runs` processes."""

    what: str
    wall: float
    cpu: float
    runs: int
    limit: float


def start_up(depth: str = "quick", failures: list[Failure] | None = None) -> tuple[StartUp, ...]:
    """Time `iapb --help`; at depth "full" also the first steps without and with a cache of compiled kernels."""
    found = attempt("iapb --help", _help, failures) or []
    if depth == "full":
        found += attempt("first steps", _first_steps, failures) or []
    return tuple(found)


def _help() -> list[StartUp]:
    helps = [_timed(["-m", "reports.cli", "--help"], {}) for _ in range(_HELPS)]
    return [StartUp("iapb --help", *_medians(helps), _HELPS, HELP_LIMIT)]


def _first_steps() -> list[StartUp]:
    with tempfile.TemporaryDirectory() as cache:
        first, second = (_timed(["-c", _FIRST_STEPS], {"NUMBA_CACHE_DIR": cache}) for _ in range(2))
    saved = (first[0] - second[0], first[1] - second[1])
    return [StartUp("first steps, all kernels compiled", *saved, 1, COMPILE_LIMIT),
            StartUp("first steps, kernels from the cache", *second, 1, COMPILE_LIMIT)]  # fmt: skip


def _medians(times: list[tuple[float, float]]) -> tuple[float, float]:
    wall, cpu = np.median(times, axis=0)
    return float(wall), float(cpu)


def _timed(arguments: list[str], environment: dict[str, str]) -> tuple[float, float]:
    """Wall and CPU seconds of a Python process in the project's folder."""
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run([sys.executable, *arguments], cwd=_PROJECT, env={**os.environ, **environment}, check=True,
                   stdout=subprocess.DEVNULL)  # fmt: skip
    wall, after = time.perf_counter() - started, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
