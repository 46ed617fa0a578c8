"""Worker processes: deaf to Ctrl-C from their first moment, ended with the work, and a killed one is said."""

from __future__ import annotations

import os
import signal
import time
from multiprocessing import active_children

import pytest

from iapb.errors import IapbError
from reports.workers import worker_pool


def blocked() -> bool:
    """What a worker says of itself."""
    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def suicide() -> None:
    """A worker that the system kills."""
    os.kill(os.getpid(), signal.SIGKILL)


def test_workers_never_hear_ctrl_c_and_the_parent_does():
    with worker_pool(1) as pool:
        assert pool.submit(blocked).result(60)
    assert not blocked()


def test_what_stops_the_work_ends_the_workers_in_the_middle_of_theirs():
    others = set(active_children())
    with pytest.raises(KeyboardInterrupt), worker_pool(1) as pool:
        pool.submit(time.sleep, 20.0)
        [worker] = set(active_children()) - others
        raise KeyboardInterrupt
    assert worker.exitcode == -signal.SIGTERM


def test_a_killed_worker_is_one_of_our_errors():
    with pytest.raises(IapbError, match="worker process was killed"), worker_pool(1) as pool:
        pool.submit(suicide).result(60)
