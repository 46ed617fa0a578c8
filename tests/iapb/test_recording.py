"""What the loop writes is what the step did, chunk by chunk, contact by contact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from iapb import recording
from iapb.numerics.schema import quantities
from iapb.recording import Recorder
from iapb.run import UNSOLVED, Run
from iapb.scene import find_scene, load_scene
from iapb.simulation import INTERRUPTED, Simulation, simulate
from iapb.system import coupling_of
from iapb.thinning import Thinned
from reports.store.keys import results_of

STEPS = 300


def assert_same(first: Run, second: Run) -> None:
    ours, theirs = (dict(results_of(run)) for run in (first, second))
    assert ours.keys() == theirs.keys()
    for name, values in ours.items():
        assert np.array_equal(values, theirs[name]), name


@pytest.mark.parametrize("bytes_of_record", [1.0, 1e5, 1e9])
def test_a_run_has_the_same_bits_whatever_its_chunks_and_records(monkeypatch, bytes_of_record):
    scene = load_scene(find_scene("arm_pushing"))
    coupling = coupling_of(scene, "four-channel")
    whole = simulate(scene, coupling=coupling, steps=STEPS)
    monkeypatch.setattr(recording, "_STEPS_PER_CHUNK", 23)
    monkeypatch.setattr(recording, "_ROOM", bytes_of_record)
    chunked = simulate(scene, coupling=coupling, steps=STEPS)
    assert len(chunked.chunk_steps) == -(-STEPS // 23) and chunked.chunk_steps.sum() == STEPS
    assert_same(whole, chunked)


@pytest.mark.parametrize(
    ("name", "coupling"),
    [("peg_corner", "four-channel"), ("peg_corner", "unilateral"), ("two_discs", "none")],
)
def test_a_thinned_run_keeps_every_nth_step_and_those_with_an_impact(name, coupling, monkeypatch):
    scene = load_scene(find_scene(name))
    coupled = coupling_of(scene, coupling)
    whole = simulate(scene, coupling=coupled, steps=1400)
    monkeypatch.setattr(recording, "_STEPS_PER_CHUNK", 90)
    monkeypatch.setattr(recording, "_PIECE", 1)  # each chunk is a piece
    thin = simulate(scene, coupling=coupled, steps=1400, every=7)
    kept = np.array([k for k in range(1400) if k % 7 == 0 or k in whole.impacts.step])
    instants = np.append(kept, 1400)
    assert (thin.steps, thin.steps_done, thin.every) == (len(kept), 1400, 7)
    expected = {each.name: getattr(whole, each.name)[kept] for each in quantities(Run, "step")}
    expected |= {each.name: getattr(whole, each.name)[instants] for each in quantities(Run, "time")}
    for each, values in expected.items():
        assert np.array_equal(getattr(thin, each), values), each
    assert (
        np.array_equal(thin.time, whole.time[instants])
        and thin.energy.keys() == whole.energy.keys()
    )
    for each, full in whole.energy.items():  # sums reach up to the next instant
        assert np.array_equal(
            thin.energy[each], full[instants] if len(full) > 1400 else full[instants[1:] - 1]
        ), each
    for i, k in enumerate(kept):
        ours, theirs = (
            slice(*run.contacts.offsets[at : at + 2]) for run, at in ((thin, i), (whole, k))
        )
        assert np.array_equal(thin.contacts.gap[ours], whole.contacts.gap[theirs])
    assert np.array_equal(kept[thin.impacts.step], whole.impacts.step)
    for each in quantities(type(whole.impacts)):
        if each.name != "step":
            assert np.array_equal(
                getattr(thin.impacts, each.name), getattr(whole.impacts, each.name)
            ), each.name
    assert (
        thin.chunk_steps.sum() == 1400
        and thin.distrust == whole.distrust
        and thin.remarks == whole.remarks
    )


def test_a_thinned_run_that_is_interrupted_keeps_the_last_state(monkeypatch):
    def interrupt(done, total):
        if done > 1000:
            raise KeyboardInterrupt

    monkeypatch.setattr(recording, "_PIECE", 1)
    whole = simulate("peg_corner", steps=1024)
    thin = simulate("peg_corner", steps=1400, every=10, progress=interrupt)
    assert (
        thin.stopped == INTERRUPTED
        and thin.steps_done == 1024
        and np.array_equal(thin.q[-1], whole.q[-1])
    )


def test_what_an_earlier_piece_distrusts_is_kept():
    first = simulate("peg_corner", steps=20)
    thinned = Thinned(10)
    thinned.add(replace(first, distrust=("it sank",)), 0, {}, last=False)
    thinned.add(first, 20, {}, last=True)
    assert thinned.run(first).distrust == ("it sank",)


def test_a_resting_contact_that_was_left_unsolved_is_remarked():
    recorder = Recorder(simulation := Simulation(load_scene(find_scene("peg_corner"))))
    recorder.chunk(5)
    simulation.state.rest_work.shortened[0] = 1
    assert UNSOLVED in recorder.run("", "").remarks
