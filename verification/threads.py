"""BLAS on one thread, for whatever resolves many small impacts."""

from __future__ import annotations

from contextlib import AbstractContextManager


def one_thread() -> AbstractContextManager[object]:
    """Limit BLAS to one thread: on matrices this small more cost time, up to a thousandfold on a busy machine."""
    from threadpoolctl import threadpool_limits

    return threadpool_limits(limits=1)
