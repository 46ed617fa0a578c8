"""Runs through the store: computed once, kept, and never half a run taken for a whole one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest

import reference.worlds
from iapb.scene import find_scene, load_scene
from iapb.simulation import INTERRUPTED
from reports.evidence import exact_energy
from reports.runner import Runner
from reports.store import read_run
from verification.claims.conditions import Condition
from verification.claims.peg import trace

PEG = load_scene(find_scene("peg_corner")).with_values({"duration": 1.2})


@pytest.fixture
def computed(monkeypatch):
    """Names of the worlds that were simulated."""
    names = []
    simulate = reference.worlds.run_world

    def counting(scene, name, *arguments, **options):
        names.append(name)
        return simulate(scene, name, *arguments, **options)

    monkeypatch.setattr(reference.worlds, "run_world", counting)
    return names


def test_a_run_is_computed_once_by_all_runners_of_a_folder(tmp_path, computed):
    first = Runner(tmp_path)(PEG, "IAPB")
    runner = Runner(tmp_path)
    second = runner(PEG, "IAPB")
    assert computed == ["IAPB"]
    assert np.array_equal(first.q, second.q) and runner(PEG, "IAPB") is second
    [used] = runner.used.values()
    assert np.array_equal(read_run(tmp_path / used.file).q, first.q)
    assert (used.status, used.size) == ("complete", (tmp_path / used.file).stat().st_size)


def test_whatever_changes_a_run_changes_its_key(tmp_path):
    store = Runner(tmp_path).store
    cases = [(PEG, "IAPB", "full"), (PEG, "IAPB", "scale"), (PEG, "PB", "full"), (PEG, "ideal", "full"),
             (PEG, "CBuc", "full"), (PEG.with_values({"contact.friction": 0.123}), "IAPB", "full"),
             (PEG.with_values({"couplings.four_channel.damping": [1, 1, 1]}), "IAPB", "full")]  # fmt: skip
    assert len({store.place_of(Runner.inputs(*case)).key for case in cases}) == len(cases)
    assert len({Runner.label(*case) for case in cases}) == 5


def test_runs_that_are_not_kept_are_stored_all_the_same(tmp_path, computed):
    runner = Runner(tmp_path)
    run = runner(PEG, "PB", keep=False)
    assert runner(PEG, "PB", keep=False) is not run and computed == ["PB"]
    assert len(list(tmp_path.glob("*.h5"))) == 1


def interrupt(done, total):
    raise KeyboardInterrupt


@pytest.mark.parametrize("keep", [True, False])
def test_ctrl_c_in_a_run_stops_who_asked_for_it_and_keeps_what_was_done(keep, tmp_path, computed):
    runner = Runner(tmp_path, interrupt)
    with pytest.raises(KeyboardInterrupt):
        runner(PEG, "IAPB", keep=keep)
    [partial] = tmp_path.glob("*.partial")
    kept = read_run(partial)
    assert not kept.complete and kept.stopped == INTERRUPTED and 0 < kept.steps < PEG.steps
    assert not runner.used
    runner.progress = None
    assert runner(PEG, "IAPB", keep=keep).complete and computed == ["IAPB", "IAPB"]
    assert not list(tmp_path.glob("*.partial"))


def test_claims_are_not_computed_from_interrupted_runs(tmp_path, monkeypatch):
    """Ctrl-C during the claims must not leave a verdict from half a run in the table of claims."""
    from reports.evidence import claims
    from verification import claims as verified

    of_runs = partial(verified.check_claims, ids=["C10"])
    monkeypatch.setattr(verified, "check_claims", of_runs)
    runner = Runner(tmp_path, interrupt)
    with pytest.raises(KeyboardInterrupt):
        claims.compute(runner, "quick", lambda done, total: None, [])
    assert len(list(tmp_path.glob("*.partial"))) == 1


def test_progress_counts_to_the_end(tmp_path):
    seen = []
    Runner(tmp_path, lambda done, total: seen.append((done, total)))(PEG, "PB")
    assert seen[-1] == (PEG.steps, PEG.steps) and [done for done, _ in seen] == sorted(done for done, _ in seen)


def test_runs_are_listed_under_everything_that_used_them(tmp_path):
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
    assert runner.user == "" and len(inside) == 2


def test_a_run_that_gave_up_is_listed_as_partial(tmp_path):
    runner = Runner(tmp_path, interrupt)
    runner(PEG, "IAPB", partial=True)
    [used] = runner.used.values()
    assert used.status == "partial" and (tmp_path / used.file).is_file()


@dataclass(frozen=True)
class _UsesOne:
    """A claim that looks at one run, and its own result."""

    worlds: tuple[str, ...]
    failures: tuple = ()

    def finding(self, study):
        for world in self.worlds:
            trace(study, Condition(), world)
        return self


def test_a_run_is_listed_under_every_claim_that_uses_it_though_it_is_made_once(tmp_path, computed, monkeypatch):
    import verification.claims as verified
    from reports.evidence import claims

    monkeypatch.setattr(verified, "CLAIMS", {"A": _UsesOne(("IAPB", "PB")), "B": _UsesOne(("PB", "IAPB", "PB"))})
    runner = Runner(tmp_path)
    with runner.recording("claims") as used:
        claims.compute(runner, "quick", lambda done, total: None, [])
    assert computed == ["IAPB", "PB"]
    assert [run.used_by for run in used.values()] == [("A", "B"), ("A", "B")]


def test_every_engine_run_used_before_is_certified(tmp_path, monkeypatch):
    monkeypatch.setattr(exact_energy, "_DRAWN", {"quick": 20})
    runner = Runner(tmp_path)
    run = runner(PEG, "IAPB")
    runner(PEG, "PB")
    with runner.recording("a topic") as inside:
        found = exact_energy.TOPIC(runner, "quick", lambda done, total: None)
    table = found.tables["certified runs"]
    assert table.column("impacts") == [len(run.impacts.step)] and len(run.impacts.step) > 0
    assert not inside and len(runner.used_so_far()) == 2
