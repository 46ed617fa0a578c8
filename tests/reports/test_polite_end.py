"""SIGTERM ends a command as Ctrl-C does: what was done is kept."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from functools import partial

import pytest


@pytest.mark.parametrize("of_ctrl_c", [signal.SIG_DFL, signal.SIG_IGN], ids=["in front", "in the background"])
def test_the_signal_that_ends_a_process_politely_keeps_what_was_done(of_ctrl_c, tmp_path):
    command = [sys.executable, "-m", "reports.cli", "live", "peg_corner", "--seconds", "600", "--out", str(tmp_path)]
    start = partial(signal.signal, signal.SIGINT, of_ctrl_c)
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, preexec_fn=start) as process:
        assert "Under way" in process.stdout.readline()
        time.sleep(1.0)
        process.terminate()
        out, _ = process.communicate(timeout=60)
    assert process.returncode == 130 and "Stopped: interrupted" in out and len(list(tmp_path.glob("*.h5"))) == 2
