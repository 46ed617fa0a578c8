"""BLAS on one thread: every BLAS that is loaded, and only while it is asked for."""

from __future__ import annotations

from threadpoolctl import threadpool_info

from reference.one_thread import one_thread


def threads() -> list[int]:
    return [pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"]


def test_every_blas_has_one_thread_inside_and_its_own_number_outside() -> None:
    with one_thread():
        pass  # now both of them are loaded
    before = threads()
    with one_thread():
        assert len(before) >= 2  # numpy's and scipy's
        assert threads() == [1] * len(before)
    assert threads() == before
