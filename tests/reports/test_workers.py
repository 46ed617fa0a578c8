"""Worker processes: deaf to Ctrl-C from their first moment, ended with the work, and a killed one
is said."""

import os
import signal
import subprocess
import sys
import time
from multiprocessing import active_children
from pathlib import Path

import pytest

from iapb.errors import IapbError
from reports.cli import _end_politely
from reports.workers import executor

ORPHANING = """
import os, signal
from reports.workers import executor
if __name__ == "__main__":
    with executor(1) as pool:
        print(pool.submit(os.getpid).result(60), flush=True)
        os.kill(os.getpid(), signal.SIGKILL)
"""


def blocked():
    """What a worker says of itself."""
    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def suicide():
    """A worker that the system kills."""
    os.kill(os.getpid(), signal.SIGKILL)


def test_workers_never_hear_ctrl_c_and_what_stops_the_work_ends_them_in_the_middle_of_theirs():
    others = set(active_children())
    with pytest.raises(KeyboardInterrupt), executor(1) as pool:
        assert pool.submit(blocked).result(60) and not blocked()
        pool.submit(time.sleep, 20.0)
        [worker] = set(active_children()) - others
        raise KeyboardInterrupt
    assert worker.exitcode == -signal.SIGTERM


def test_a_worker_whose_parent_was_killed_ends(tmp_path):
    script = tmp_path / "orphaning.py"
    script.write_text(ORPHANING)
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    # A pipe would stay open as long as the worker lives. Python's tracker of semaphores warns on
    # stderr, sometimes before the file is read.
    quiet = subprocess.DEVNULL
    with (tmp_path / "said").open("w") as said:
        done = subprocess.run([sys.executable, script], stdout=said, stderr=quiet, env=environment)
    worker = Path("/proc") / (tmp_path / "said").read_text().strip()
    for _ in range(600):
        if not worker.exists():
            break
        time.sleep(0.1)
    assert done.returncode == -signal.SIGKILL and worker.name.isdecimal() and not worker.exists()


def test_a_killed_worker_is_one_of_our_errors():
    with pytest.raises(IapbError, match="worker process was killed"), executor(1) as pool:
        pool.submit(suicide).result(60)


def test_a_polite_signal_ends_a_command_like_ctrl_c():
    before = signal.signal(signal.SIGTERM, _end_politely)
    try:
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
    finally:
        signal.signal(signal.SIGTERM, before)
