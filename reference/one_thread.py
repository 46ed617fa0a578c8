"""BLAS on one thread for laws that solve small systems at every step.

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
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def one_thread() -> AbstractContextManager[object]:
    """Limit the BLAS libraries that were loaded at the first call to one thread."""
    limited: AbstractContextManager[object] = _controller().limit(limits=1, user_api="blas")
    return limited
