"""What the loop writes is what the step did, chunk by chunk, contact by contact."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.contact.laws import ImpulseAugmented
from iapb.recording import Recorder, Room, _filled, chunk_steps
from iapb.run import quantities
from iapb.scene import find_scene, load_scene
from iapb.simulation import Simulation, simulate
from iapb.system import coupling_of

STEPS = 300
CONTACT_FIELDS = ("body_a", "body_b", "point", "normal", "gap", "normal_velocity", "normal_force", "friction_force",
                  "is_new")


@given(st.integers(0, 10_000_000), st.integers(1, 100_000))
def test_chunks_go_forward_and_bound_time_and_memory(contacts, remaining):
    steps = chunk_steps(contacts, remaining)
    assert 1 <= steps <= min(remaining, 512)
    assert steps == 1 or steps * contacts <= 200_000


@pytest.mark.parametrize(
    ("name", "coupling"), [("peg_corner", "four-channel"), ("arm_pushing", "unilateral"), ("newton_cradle", "none")]
)
def test_the_record_holds_what_each_step_did(name, coupling):
    scene = load_scene(find_scene(name))
    chosen = coupling_of(scene, coupling)
    run = simulate(scene, ImpulseAugmented(), chosen, steps=STEPS)
    simulation = Simulation(scene, ImpulseAugmented(), chosen)
    impact = 0
    for k in range(STEPS):
        simulation.step()
        state, port = simulation.state, simulation.port
        rows = slice(run.contacts.offsets[k], run.contacts.offsets[k + 1])
        count = state.contact_count[0]
        assert rows.stop - rows.start == count
        for field in CONTACT_FIELDS:
            assert np.array_equal(getattr(run.contacts, field)[rows], getattr(state.contacts, field)[:count]), field
        assert np.array_equal(run.contacts.impulse[rows], state.contact_impulse[:count])
        for field in ("hand_force", "coupling_force", "environment_force"):
            assert np.array_equal(getattr(run, field)[k], getattr(port, field)), field
        for i in range(state.impacts.logged[0]):
            assert run.impacts.step[impact] == k
            for field in ("group", "rows", "rank", "scale", "clamp", "energy_lost", "v_minus", "v_plus", "impulse",
                          "friction_share", "approaching", "solved"):
                assert np.array_equal(getattr(run.impacts, field)[impact], getattr(state.impacts, field)[i]), field
            impact += 1
    assert impact == len(run.impacts.step)
    assert len(run.contacts.gap) == run.contacts.offsets[-1] > 0


def test_a_run_that_fits_into_a_room_is_neither_joined_nor_holds_what_is_empty():
    simulation = Simulation(load_scene(find_scene("peg_corner")))
    recorder = Recorder(simulation)
    for _ in range(2):
        assert recorder.chunk(STEPS + 512) is None
    room = recorder._room
    for name, columns in (("steps", ("impulse", "state")), ("contacts", ("gap",)), ("impacts", ("v_plus",))):
        joined = recorder.joined(name)
        for column in columns:
            shared = np.shares_memory(joined[column], getattr(room.lines[name], column))
            assert shared == (2 * len(joined[column]) >= len(getattr(room.lines[name], column))), column
            parts = [getattr(getattr(record, name), column) for record in recorder.records]
            sizes = [size if name == "steps" else record.used[int(name == "impacts")]
                     for record, size, _ in recorder.held()]
            whole = np.concatenate([part[:size] for part, size in zip(parts, sizes, strict=True)])
            assert joined[column].tobytes() == whole.tobytes() and len(whole)
    assert np.shares_memory(recorder.joined("steps")["impulse"], room.lines["steps"].impulse)
    recorder.keep(recorder.blank(2000)[0], 0, 0.0)  # a chunk from elsewhere: all are joined again
    assert recorder._room is None and len(recorder.joined("steps")["impulse"]) == recorder.steps == STEPS + 512


@pytest.mark.parametrize("used", [0, 4, 5, 6, 10])
def test_what_is_filled_is_all_of_it_and_keeps_no_large_array_alive(used):
    array = np.arange(10)
    found = _filled(array, used)
    assert found.tolist() == list(range(used)) and np.shares_memory(found, array) == (used >= 5)


def test_a_room_takes_a_chunk_after_the_last_one_and_as_long_as_it_fits():
    room = Room(10, (3, 3, 0, 0), 2, 1)
    assert room.fits(10) and not room.fits(11)
    record = room.record(4)
    assert not room.fits(1)  # a chunk is open
    assert room.keep(record, 4) and room.fits(6) and not room.fits(7)
    assert not room.keep(record, 4) and room.used == [4, 0, 0]


def values_of(run):
    """The bytes of everything that the loop recorded, but for the time it took."""
    return {each.name: getattr(record, each.name).tobytes() for record in (run, run.contacts, run.impacts)
            for each in quantities(type(record)) if each.name != "chunk_seconds"}


def test_changing_the_run_of_a_checkpoint_changes_no_other_run():
    class Careless:
        due, runs = True, 0

        def __call__(self, run):
            self.runs += 1
            for record in (run, run.contacts, run.impacts):
                for each in quantities(type(record)):
                    getattr(record, each.name)[...] = 1

    scene, careless = load_scene(find_scene("peg_corner")), Careless()
    changed = simulate(scene, steps=STEPS + 512, checkpoint=careless)
    assert careless.runs and values_of(changed) == values_of(simulate(scene, steps=STEPS + 512))


def test_rendered_force_is_contact_forces_and_impulse_over_the_step():
    """(26)"""
    run = simulate(load_scene(find_scene("peg_corner")), steps=STEPS)
    rendered = run.penalty_force + run.friction_force + run.impulse / run.dt
    assert run.environment_force == pytest.approx(rendered, rel=1e-14, abs=1e-14)


def test_time_and_names_fit_the_arrays():
    scene = load_scene(find_scene("arm_pushing"))
    run = simulate(scene, coupling=coupling_of(scene, "four-channel"), steps=5)
    assert run.time == pytest.approx(np.arange(6) / scene.rate, rel=1e-15)
    assert len(run.coordinate_names) == len(run.coordinate_units) == run.q.shape[1]
    assert run.device_q.shape == (6, 2) and run.device_force.shape == (5, 2)
    assert run.scene_source == scene.source_text and run.scene_resolved == scene.resolved()
    assert run.world == f"{run.law} + {run.coupling}" and run.coupling == "four-channel"
