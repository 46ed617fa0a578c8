"""Run BLAS on one thread for code that solves many small systems: laws at every step, timings,
sweeps.

OpenBLAS uses a pool of threads even for 12 unknowns. If other processes occupy the cores, each
product waits for the pool: with four busy processes on two cores, the rigid world took four times
as long, and longer with more processes.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from typing import Any

from iapb.lazy import needed

_limited: ContextVar[bool] = ContextVar("_limited", default=False)


@cache
def _controller() -> Any:
    """Return the controller, made once: finding the loaded BLAS libraries takes 1 ms, setting their
    limit 30 µs."""
    import numpy.linalg  # noqa: F401 - numpy and scipy bring a BLAS each, which is found only after it is loaded

    needed("scipy.linalg", "A reference")
    return needed("threadpoolctl", "A reference").ThreadpoolController()


@contextmanager
def one_thread() -> Iterator[None]:
    """Limit the BLAS of numpy and of scipy to one thread; a nested block does nothing."""
    if _limited.get():
        yield
        return
    with _controller().limit(limits=1, user_api="blas"):
        token = _limited.set(True)
        try:
            yield
        finally:
            _limited.reset(token)
