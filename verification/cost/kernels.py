"""Time of the compiled factored impact beside the printed formula (21) in numpy, no public call around them.

By the thread's own clock: what else the machine does in between is nobody's cost.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.contact.kernels.impact import make_impact_work, rank_tolerance
from iapb.mechanics.kernels.cholesky import cholesky
from reference.one_thread import one_thread
from verification.cost.loops import repeat_factored
from verification.cost.measure import Quartiles
from verification.finding import Failure, attempt

Floats = NDArray[Any]

SIZES = ((3, 4), (12, 60), (12, 300))  # (d, c): the peg on four corners, an arm on boxes, the same on meshes
_CALLS = 50  # calls per sample of the compiled kernel, so that the clock and the Python call do not count


@dataclass(frozen=True)
class KernelTime:
    """Time of one impact of d coordinates and c contacts of rank two thirds of d."""

    coordinates: int
    contacts: int
    factored: Quartiles
    printed: Quartiles

    @property
    def ratio(self) -> float:
        """How many times longer the printed formula takes (medians)."""
        return self.printed.median / self.factored.median


def kernel_times(
    sizes: tuple[tuple[int, int], ...] = SIZES, rounds: int = 40, seed: int = 0, failures: list[Failure] | None = None
) -> tuple[KernelTime, ...]:
    """Return the times at each (d, c), sampled in turn."""
    with one_thread():
        found = [attempt(f"impact of {c} contacts in {d} coordinates",
                         partial(_time_size, d, c, rounds, np.random.default_rng([seed, d, c])), failures)
                 for d, c in sizes]  # fmt: skip
    return tuple(timed for timed in found if timed is not None)


def _time_size(d: int, c: int, rounds: int, rng: np.random.Generator) -> KernelTime:
    mass, rows, v = random_impact(d, c, rng)
    factored = factored_loop(mass, rows, v, _CALLS)
    factored()
    printed_impact(mass, rows, v)
    compiled, printed = [], []
    for _ in range(rounds):
        started = time.thread_time()
        factored()
        compiled.append((time.thread_time() - started) / _CALLS)
        started = time.thread_time()
        printed_impact(mass, rows, v)
        printed.append(time.thread_time() - started)
    return KernelTime(d, c, quartiles(compiled), quartiles(printed))


def random_impact(d: int, c: int, rng: np.random.Generator) -> tuple[Floats, Floats, Floats]:
    """(M, J, v) with c rows that span two thirds of the d coordinates."""
    rank = max(1, (2 * d) // 3)
    root, rows = rng.normal(size=(d, d)), rng.normal(size=(c, rank)) @ rng.normal(size=(rank, d))
    return root @ root.T + np.eye(d), rows, rng.normal(size=d)


def printed_impact(mass: Floats, rows: Floats, v: Floats) -> Floats:
    """(21) to the letter with e = 0.5."""
    solved = np.linalg.solve(mass, rows.T)
    return v - 1.5 * (solved @ (np.linalg.pinv(rows @ solved) @ (rows @ v)))


def factored_loop(mass: Floats, rows: Floats, v: Floats, calls: int) -> Callable[[], None]:
    """A function that resolves the impact `calls` times in compiled code."""
    (c, d), lower = rows.shape, np.zeros_like(mass)
    cholesky(mass, lower)
    work, v_plus, momentum = make_impact_work(d, c), np.zeros(d), np.zeros(d)
    columns, tolerance = np.ascontiguousarray(rows.T), float(rank_tolerance(lower))

    def loop() -> None:
        repeat_factored(mass, lower, v, 0.5, columns, tolerance, work, v_plus, momentum, calls)

    return loop


def quartiles(samples: list[float]) -> Quartiles:
    """Median and quartiles of some times."""
    lower, median, upper = np.percentile(samples, [25, 50, 75])
    return Quartiles(float(lower), float(median), float(upper), len(samples))
