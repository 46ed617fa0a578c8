"""BLAS on one thread, for whatever solves many small systems: laws at every step, timings, sweeps.

OpenBLAS hands even 12 unknowns to a pool of threads; where other processes hold the cores, each product waits for
them: the rigid world then took four times as long with four busy neighbours on two cores, and more with more.
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
    """Made once: asking which BLAS libraries are loaded takes a millisecond, setting their limit 30 µs."""
    import numpy.linalg  # noqa: F401 - numpy and scipy bring a BLAS each, known only once it is loaded

    needed("scipy.linalg", "A reference")
    return needed("threadpoolctl", "A reference").ThreadpoolController()


@contextmanager
def one_thread() -> Iterator[None]:
    """Limit the BLAS of numpy and of scipy to one thread; inside another such block this costs nothing."""
    if _limited.get():
        yield
        return
    with _controller().limit(limits=1, user_api="blas"):
        token = _limited.set(True)
        try:
            yield
        finally:
            _limited.reset(token)
