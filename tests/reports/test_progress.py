"""Progress of long work: bars on a terminal; in a log a line per stage, and reminders while it goes on."""

from __future__ import annotations

import time

import pytest

from reports.commands import progress
from reports.commands.progress import StageLog, stage_progress, step_progress


def test_a_log_tells_of_a_stage_that_begins_and_is_reminded_of_one_that_goes_on(monkeypatch):
    lines, now = [], [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    log = StageLog(lines.append)
    log.remind()  # nothing has begun
    log("impacts", 0, 1000)
    log("impacts", 10, 1000)
    log.remind()  # it has just begun
    log("impacts", 300, 1000)
    now[0] = 30.0
    log.remind()
    log("impacts", 1000, 1000)
    log.remind()  # it is done
    log("trajectories", 0, 0)
    assert lines == ["impacts ...", "impacts: 300 of 1,000 after 0.5 min", "trajectories ..."]


def test_a_step_that_takes_long_is_reminded_of_while_it_lasts(monkeypatch, capsys):
    monkeypatch.setattr(progress, "SILENCE", 0.01)
    said = ""
    with step_progress("peg") as steps:
        steps(2, 9)
        for _ in range(1000):
            time.sleep(0.01)
            said += capsys.readouterr().err
            if said:
                break
    assert said.startswith("peg: steps: 2 of 9 after 0.0 min\n")


def test_where_stderr_is_no_terminal_lines_are_plain(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    with stage_progress() as tell:
        tell("a stage [with brackets] whose name is longer than forty columns", 0, 3)
    with step_progress("peg") as steps:
        steps(3, 3)
    out, err = capsys.readouterr()
    assert out == "" and err == "a stage [with brackets] whose name is longer than forty columns ...\n"


@pytest.mark.parametrize("term", ["xterm", "dumb"])
def test_on_a_terminal_there_are_bars_unless_it_is_a_dumb_one(monkeypatch, capsys, term):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", term)
    with stage_progress() as tell:
        tell("a stage [of work]", 1, 3)
        print("a result")
    out, err = capsys.readouterr()
    assert out == "a result\n" and "a stage [of work]" in err
    assert ("\x1b[" in err) == (term == "xterm") and ("a stage [of work] ..." in err) == (term == "dumb")
