"""Waiting time before the first step: `iapb --help`, and the compilation without cached kernels."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from verification.finding import Column, Failure, Table, attempt

HELP_LIMIT, COMPILE_LIMIT = 0.5, 30.0  # [s]
_HELPS = 5
_PROJECT = Path(__file__).parents[2]
# one step in the plane and one in space; the second uses kernels that the first compiled
_FIRST_STEPS = (
    "from iapb import find_scene, load_scene, simulate\n"
    "for name in ('peg_corner', 'arm_obstacles'):\n"
    "    simulate(load_scene(find_scene(name)), steps=1)\n"
)


COLUMNS = (
    Column("what", condition=True),
    Column("on the wall", "s", timed=True),
    Column("computing", "s", timed=True),
    Column("processes"),
    Column("target", "s"),
)


def start_up(depth: str = "quick", failures: list[Failure] | None = None) -> Table:
    """Time `iapb --help`; at depth "full" also the first steps without and with a cache of compiled kernels."""
    rows = attempt("iapb --help", _help, failures) or ()
    if depth == "full":
        rows += attempt("first steps", _first_steps, failures) or ()
    return Table(COLUMNS, rows, digits=3)


def _help() -> tuple[tuple[Any, ...], ...]:
    helps = [_timed(["-m", "reports.cli", "--help"], {}) for _ in range(_HELPS)]
    return (("iapb --help", *(float(x) for x in np.median(helps, axis=0)), _HELPS, HELP_LIMIT),)


def _first_steps() -> tuple[tuple[Any, ...], ...]:
    with tempfile.TemporaryDirectory() as cache:
        first, second = (_timed(["-c", _FIRST_STEPS], {"NUMBA_CACHE_DIR": cache}) for _ in range(2))
    saved = (first[0] - second[0], first[1] - second[1])
    return (("first steps, all kernels compiled", *saved, 1, COMPILE_LIMIT),
            ("first steps, kernels from the cache", *second, 1, COMPILE_LIMIT))  # fmt: skip


def _timed(arguments: list[str], environment: dict[str, str]) -> tuple[float, float]:
    """Return wall and CPU time [s] of a Python process in the project's folder."""
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run([sys.executable, *arguments], cwd=_PROJECT, env={**os.environ, **environment}, check=True,
                   stdout=subprocess.DEVNULL)  # fmt: skip
    wall, after = time.perf_counter() - started, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
