"""Progress of long work in a log: a line per stage, then one after every stretch of silence."""

from __future__ import annotations

import pytest

from reports.commands import progress
from reports.commands.progress import SILENCE, log_of_stages, stage_progress, step_progress


@pytest.fixture
def clock(monkeypatch):
    """A clock that tests set."""
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    return now


def test_a_log_tells_how_far_the_work_is_after_every_silence(clock):
    lines = []
    log = log_of_stages(lines.append)
    for done in range(1001):
        clock[0] = 0.1 * done  # 100 s in all
        log("impacts", done, 1000)
    log("trajectories", 0, 0)
    assert lines == ["impacts ...", "impacts: 300 of 1,000 after 0.5 min", "impacts: 600 of 1,000 after 1.0 min",
                     "impacts: 900 of 1,000 after 1.5 min", "trajectories ..."]  # fmt: skip


def test_a_stage_that_has_begun_before_is_silent_until_it_takes_long(clock):
    lines = []
    log = log_of_stages(lines.append, "steps")
    log("steps", 1, 9)
    clock[0] += 1.01 * SILENCE
    log("steps", 2, 9)
    clock[0] += 1.01 * SILENCE
    log("steps", 9, 9)
    assert lines == ["steps: 2 of 9 after 0.5 min"]


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
