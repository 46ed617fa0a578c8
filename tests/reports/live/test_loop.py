"""The paced loop under a clock of the tests' own: order of ticks, misses, budgets, and the run done again."""

from __future__ import annotations

import os
import signal

import numpy as np
import pytest

from reference.worlds import run_world
from reports.cli import main
from reports.live.budget import RowBudget, calibrated
from reports.live.deadline import PERCENTILES
from reports.live.loop import Loop
from reports.live.replay import finish_live, is_live, open_parts, read_live, replay
from reports.store.care import parts_of_killed
from reports.store.keys import content_hash
from reports.store.parts import are_damaged

PERIOD = 1e-3
TICKS = 700  # more than one chunk of the record


def test_a_miss_delays_what_comes_after_and_changes_nothing_in_the_run(peg, fake_clock, lived, monkeypatch):
    monkeypatch.setattr("reports.streaming.HELD", 1)  # a piece for each part
    jumps = {7: 0.4e-3, 50: 2.5e-3, 90: 3.3e-3}  # the first is late, but done in time
    live, pace = lived(peg(), TICKS, fake_clock(jumps))
    due, start, end = live.timetable.rows[:, :3].T
    assert live.timetable.period == PERIOD
    assert np.all(start >= due) and np.all(end > start) and np.all(start[1:] >= end[:-1])
    assert np.all(due[1:] >= due[:-1] + PERIOD - 1e-12)  # a miss delays, and nothing is hurried
    assert np.flatnonzero(live.timetable.missed).tolist() == [50, 90] and pace.missed == 2
    assert (start - due)[[7, 50, 90]] == pytest.approx([0.4e-3, 2.5e-3, 3.3e-3], abs=1e-4)
    assert pace.behind == pytest.approx(1.5e-3 + 2.3e-3, abs=1e-4)
    assert due[-1] == pytest.approx((TICKS - 1) * PERIOD + pace.behind, abs=1e-9)
    unpaced = run_world(peg().scene.with_values({"duration": TICKS * PERIOD}), "IAPB")
    assert live.run.complete and len(live.run.impacts.step) and content_hash(live.run) == content_hash(unpaced)


def scarce(simulation):
    """A row is said to take longer than there is time: one row for every impact."""
    return RowBudget(0.0, 1.0, PERIOD, simulation.system.mechanism.nv, 1)


@pytest.mark.parametrize("device", ["", "simulated"])
def test_a_run_short_of_time_keeps_to_its_budgets_is_passive_and_repeats_exactly(peg, fake_clock, lived, device):
    simulation = peg(device)
    live, pace = lived(simulation, TICKS, fake_clock({40: 5e-3}), scarce(simulation))
    impacts = live.run.impacts
    assert np.all(live.timetable.budget == 1) and len(impacts.step)
    assert np.all(impacts.rank <= live.timetable.budget[impacts.step])
    assert impacts.rows.max() > 1 and pace.rows_left_out > 0
    assert impacts.energy_lost.min() >= 0.0
    assert content_hash(replay(live)) == content_hash(live.run)
    live.timetable.rows[:, 3] = 3  # other budgets, another run
    assert content_hash(replay(live)) != content_hash(live.run)


def test_the_budget_grows_with_the_time_left_between_one_row_and_all():
    budget = RowBudget(2e-4, 1e-5, PERIOD, 30, 2)
    rows = [budget.rows(left) for left in np.linspace(-1e-3, 1e-3, 300)]
    assert rows == sorted(rows) and rows[0] == 1 and rows[-1] == 30 and len(set(rows)) > 5
    before = budget.rows(4e-4)
    budget.learn(3e-4, 1)  # a step took longer than expected
    assert budget.rows(4e-4) < before
    for _ in range(1000):
        budget.learn(1e-4, 0)  # of late they were quick
    assert budget.fixed == pytest.approx(1e-4, rel=1e-3)


def test_with_time_enough_every_impact_gets_all_its_rows_and_the_summary_counts(peg, fake_clock, lived):
    simulation = peg()
    dofs = simulation.system.mechanism.nv
    assert calibrated(simulation, PERIOD).per_row > 0.0
    live, pace = lived(simulation, TICKS, fake_clock({50: 2.5e-3}), RowBudget(0.0, 1e-6, PERIOD, dofs, 1))
    assert np.all(np.delete(live.timetable.budget, 50) == dofs)
    assert (pace.ticks, pace.missed, pace.rows_left_out) == (TICKS, 1, 0)
    work = live.timetable.rows[:, 2] - live.timetable.rows[:, 1]
    assert pace.work[-1] == work.max() and list(pace.lateness) == sorted(pace.lateness)
    assert pace.work == pytest.approx(np.percentile(work, PERCENTILES), rel=2e-3)


def test_control_c_ends_the_loop_with_what_was_done(peg, fake_clock, lived):
    before = signal.getsignal(signal.SIGINT)
    live, _ = lived(peg(), TICKS, fake_clock(at={123: lambda: os.kill(os.getpid(), signal.SIGINT)}))
    assert live.run.steps == 124 == len(live.timetable.due)  # the tick at hand is done to its end
    assert live.run.stopped == "interrupted" and not live.run.complete
    assert content_hash(replay(live)) == content_hash(live.run)
    assert signal.getsignal(signal.SIGINT) is before


def test_a_live_run_that_is_killed_is_there_up_to_its_last_chunk(peg, fake_clock, tmp_path):
    process = os.fork()
    if process == 0:
        simulation = peg()
        parts = open_parts(tmp_path, "live", simulation, "IAPB", 2000)
        Loop(simulation, 2000, parts, fake_clock(at={1700: lambda: os._exit(9)})).run()
    os.waitpid(process, 0)
    [parts] = parts_of_killed(tmp_path)
    assert is_live(parts)
    stored = read_live(finish_live(parts, "killed")[0])
    assert stored.run.steps == 3 * 512 == len(stored.timetable.due) and stored.run.stopped == "killed"
    assert content_hash(replay(stored)) == content_hash(stored.run)
    last = sorted(parts.glob("*.part"))[-1]
    content = last.read_bytes()
    last.write_bytes(content[: len(content) // 2])
    assert are_damaged(parts) and main(["store", "repair", str(tmp_path)]) == 0 and last.is_file()
    last.write_bytes(content)
    assert main(["store", "repair", str(tmp_path)]) == 0 and not parts.exists()


class Fails:
    """A device that works for a while."""

    def __init__(self, device, readings):
        self.device, self.readings, self.told = device, readings, []

    def read(self):
        self.readings -= 1
        if self.readings < 0:
            raise ConnectionError("unplugged")
        return self.device.read()

    def apply(self, force):
        self.told.append(np.array(force))
        self.device.apply(force)


def test_a_device_that_fails_or_a_motion_without_bounds_ends_the_loop_with_what_was_done(peg, fake_clock, lived):
    simulation = peg("simulated")
    device = simulation.link.device = Fails(simulation.link.device, 60)
    live, _ = lived(simulation, TICKS, fake_clock())
    assert live.run.steps == 60 and "unplugged" in live.run.stopped
    assert np.array_equal(device.told[-1], np.zeros(3)) and np.any(device.told[-2])  # it is told to let go
    live, _ = lived(peg(**{"couplings.four_channel.stiffness": [1e9] * 3}), TICKS, fake_clock())
    assert "too long" in live.run.stopped and 0 < live.run.steps < TICKS
