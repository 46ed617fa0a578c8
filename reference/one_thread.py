"""BLAS on one thread, for whatever solves many small systems: laws at every step, timings, sweeps.

OpenBLAS hands even 12 unknowns to a pool of threads; where other processes hold the cores, each product waits for
them: the rigid world then took four times as long with four busy neighbours on two cores, and more with more.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache
from typing import Any


@cache
def _controller() -> Any:
    """Made once: asking which BLAS libraries are loaded takes a millisecond, setting their limit 30 µs."""
    import numpy.linalg  # noqa: F401 - numpy and scipy bring a BLAS each, known only once it is loaded
    import scipy.linalg  # noqa: F401
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def one_thread() -> AbstractContextManager[object]:
    """Limit the BLAS of numpy and of scipy to one thread."""
    limited: AbstractContextManager[object] = _controller().limit(limits=1, user_api="blas")
    return limited
