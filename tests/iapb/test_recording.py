"""What the loop writes is what the step did, chunk by chunk, contact by contact."""

from __future__ import annotations

from dataclasses import fields, is_dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb import recording
from iapb.recording import Recorder, chunk_steps
from iapb.run import UNSOLVED, Run
from iapb.scene import find_scene, load_scene
from iapb.simulation import Simulation, simulate
from iapb.system import coupling_of

STEPS = 300


def results_of(record, place="run"):
    """Every array of a run, its tables and its ledger, by place; timings left out."""
    found = {}
    for field in fields(record):
        value = getattr(record, field.name)
        if is_dataclass(value):
            found |= results_of(value, field.name)
        elif isinstance(value, dict):
            found |= {f"{field.name}/{key}": each for key, each in value.items() if isinstance(each, np.ndarray)}
        elif isinstance(value, np.ndarray) and not field.name.startswith("chunk"):
            found[f"{place}/{field.name}"] = value
    return found


def assert_same(first: Run, second: Run) -> None:
    ours, theirs = results_of(first), results_of(second)
    assert ours.keys() == theirs.keys()
    for name, values in ours.items():
        assert np.array_equal(values, theirs[name]), name


@given(st.integers(0, 10_000_000), st.integers(1, 100_000))
def test_chunks_go_forward_and_bound_time_and_memory(contacts, remaining):
    steps = chunk_steps(contacts, remaining)
    assert 1 <= steps <= min(remaining, 512)
    assert steps == 1 or steps * contacts <= 200_000


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


def test_parts_of_a_run_continue_each_other():
    scene = load_scene(find_scene("peg_corner"))
    coupling = coupling_of(scene, "four-channel")
    whole, recorder = simulate(scene, coupling=coupling, steps=1400), Recorder(Simulation(scene, coupling=coupling))
    parts = []
    while recorder.steps < 1400:
        assert recorder.chunk(1400) is None
        assert 0 < recorder.held_bytes
        parts.append(recorder.take(""))
    assert len(parts) == 3 and recorder.held_bytes == 0
    for name in ("q", "impulse", "state"):
        first, *others = (getattr(part, name) for part in parts)
        joined = np.concatenate([first, *(other[name == "q":] for other in others)])
        assert np.array_equal(joined, getattr(whole, name)), name
    for name, values in whole.energy.items():
        states = len(values) > whole.steps
        assert np.array_equal(np.concatenate([parts[0].energy[name], *(
            part.energy[name][states:] for part in parts[1:])]), values), name
    assert np.array_equal(np.concatenate([part.impacts.mass_digest for part in parts]), whole.impacts.mass_digest)


def test_a_resting_contact_that_was_left_unsolved_is_remarked():
    recorder = Recorder(simulation := Simulation(load_scene(find_scene("peg_corner"))))
    recorder.chunk(5)
    simulation.state.rest_work.shortened[0] = 1
    assert UNSOLVED in recorder.run("", "").remarks


def test_time_names_and_the_rendered_force_fit_the_arrays():
    scene = load_scene(find_scene("arm_pushing"))
    run = simulate(scene, coupling=coupling_of(scene, "four-channel"), steps=STEPS)
    assert run.time == pytest.approx(np.arange(STEPS + 1) / scene.rate, rel=1e-15)
    assert len(run.coordinate_names) == len(run.coordinate_units) == run.q.shape[1]
    assert run.device_q.shape == (STEPS + 1, 2) and run.device_force.shape == (STEPS, 2)
    assert run.scene_source == scene.source_text and run.scene_resolved == scene.resolved()
    assert run.world == f"{run.law} + {run.coupling}" and run.coupling == "four-channel"
    rendered = run.penalty_force + run.friction_force + run.impulse / run.dt  # (26)
    assert run.environment_force == pytest.approx(rendered, rel=1e-14, abs=1e-14)
