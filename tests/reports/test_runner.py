"""Runs through the store: computed once, kept, and never half a run taken for a whole one."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.scene import find_scene, load_scene
from iapb.simulation import INTERRUPTED, simulate
from reports.evidence import exact_energy
from reports.runner import Runner
from reports.store import read_run
from verification.check import Study

PEG = load_scene(find_scene("peg_corner")).with_values({"duration": 1.2})


@pytest.fixture
def computed(monkeypatch):
    """Names of the worlds that were simulated."""
    names = []

    def counting(*arguments, **options):
        names.append(options["world"])
        return simulate(*arguments, **options)

    monkeypatch.setattr("reports.runner.simulate", counting)
    return names


def test_a_run_is_computed_once_by_all_runners_of_a_folder(tmp_path, computed):
    seen = []
    first = Runner(tmp_path, lambda done, total: seen.append((done, total)))(PEG, "IAPB")
    assert seen == sorted(seen) and seen[-1] == (PEG.steps, PEG.steps)
    runner = Runner(tmp_path)
    second = runner(PEG, "IAPB")
    assert np.array_equal(first.q, second.q) and runner(PEG, "IAPB") is second
    [used] = runner.used.values()
    assert np.array_equal(read_run(tmp_path / used.file).q, first.q)
    assert (used.status, used.size) == ("complete", (tmp_path / used.file).stat().st_size)
    run = runner(PEG, "PB", keep=False)
    assert runner(PEG, "PB", keep=False) is not run and computed == ["IAPB", "PB"]


def test_whatever_changes_a_run_changes_its_key(tmp_path):
    runner = Runner(tmp_path)
    cases = [(PEG, "IAPB", "full"), (PEG, "IAPB", "scale"), (PEG, "PB", "full"), (PEG, "ideal", "full"),
             (PEG, "CBuc", "full"), (PEG.with_values({"contact.friction": 0.123}), "IAPB", "full"),
             (PEG.with_values({"couplings.four_channel.damping": [1, 1, 1]}), "IAPB", "full")]  # fmt: skip
    assert len({runner.file_of(*case).rpartition("-")[2] for case in cases}) == len(cases)


def test_ctrl_c_in_a_run_stops_who_asked_for_it_and_keeps_what_was_done(tmp_path, computed):
    def interrupt(done, total):
        raise KeyboardInterrupt

    runner = Runner(tmp_path, interrupt)
    with pytest.raises(KeyboardInterrupt):
        runner(PEG, "IAPB")
    [partial] = tmp_path.glob("*.partial")
    kept = read_run(partial)
    assert not kept.complete and kept.stopped == INTERRUPTED and 0 < kept.steps < PEG.steps and not runner.used
    runner(PEG, "IAPB", partial=True)
    assert [used.status for used in runner.used.values()] == ["partial"]
    runner.progress = None
    assert runner(PEG, "IAPB").complete and computed == ["IAPB"] * 3 and not list(tmp_path.glob("*.partial"))


def test_runs_are_listed_under_everything_that_used_them(tmp_path, computed):
    runner = Runner(tmp_path)
    with runner.recording("trajectories") as inside:
        runner(PEG, "IAPB")
        runner.user = "forces"
        runner.use_again(PEG, "IAPB")
        runner(PEG, "PB", keep=False)
    assert [run.used_by for run in inside.values()] == [("trajectories", "forces"), ("forces",)]
    with runner.recording("energy"):
        runner(PEG, "IAPB")
    assert [run.used_by for run in runner.used.values()] == [("trajectories", "forces", "energy"), ("forces",)]
    assert runner.user == "" and len(inside) == 2 and computed == ["IAPB", "PB"]


def test_every_engine_run_used_before_is_certified(tmp_path):
    runner = Runner(tmp_path)
    run = runner(PEG, "IAPB")
    runner(PEG, "PB")
    discs = load_scene(find_scene("two_discs")).with_values({"duration": 0.1})
    assert len(runner(discs, "ideal").impacts.step)  # left out: a rigid step solves impulses and forces together
    with runner.recording("a topic") as inside:
        table = exact_energy.TOPIC.checks[0].table(Study(runner))
    assert table.column("impacts") == [len(run.impacts.step)] and len(run.impacts.step) > 0
    assert not inside and len(runner.files) == 3
