"""What stops a run early: Ctrl-C, motion without bounds, a law that returns no step. What was done
stays readable."""

from __future__ import annotations

import numpy as np
import pytest

from iapb import recording, simulation
from iapb.contact.laws import ImpulseAugmented, Penalty
from iapb.errors import ArgumentError, IapbError
from iapb.haptics.coupling import FourChannel
from iapb.run import FREE, Run
from iapb.scene import find_scene, load_scene
from iapb.simulation import INTERRUPTED, Simulation, simulate
from reports.store.keys import results_of

PEG = load_scene(find_scene("peg_corner")).with_values(
    {"bodies.peg.position": [0.0209, -0.0141, 0.08], "contact.friction": 0.1}
)
STEPS = 350


class Wrapped:
    """The engine's law as a law of the caller's own, known by its protocol alone."""

    name = "wrapped"
    rendering = "full"

    def __init__(self, change=lambda result: result, after=0):
        self.law = ImpulseAugmented()
        self.change = change
        self.after = after
        self.calls = 0

    @property
    def settings(self):
        return {}

    def advance(self, system, state, applied_force, dt):
        self.calls += 1
        result = self.law.advance(system, state, applied_force, dt)
        return self.change(result) if self.calls > self.after else result


def assert_readable(run: Run, steps: int) -> None:
    """A partial run: every array ends at the last step done, and all of it is numbers."""
    assert not run.complete and run.stopped and run.steps == steps
    assert len(run.penalty_force) == len(run.state) == steps and run.contacts.offsets[-1] == len(
        run.contacts.gap
    )
    assert np.all(run.impacts.step < steps)
    for name, values in results_of(run):
        assert np.all(np.isfinite(values)), name


def stop_after(chunks):
    calls = []

    def progress(done, total):
        calls.append((done, total))
        if len(calls) == chunks:
            raise KeyboardInterrupt

    return progress


@pytest.mark.parametrize("law", [ImpulseAugmented(), Wrapped()], ids=["compiled", "python"])
def test_ctrl_c_keeps_the_chunks_done(law, monkeypatch):
    monkeypatch.setattr(recording, "_STEPS_PER_CHUNK", 90)
    run = simulate(PEG, law, steps=STEPS, progress=stop_after(3))
    assert_readable(run, 270)
    assert run.stopped == INTERRUPTED
    whole = simulate(PEG, ImpulseAugmented(), steps=STEPS)
    assert np.array_equal(run.q, whole.q[:271]) and np.array_equal(run.impulse, whole.impulse[:270])
    assert np.array_equal(run.contacts.gap, whole.contacts.gap[: whole.contacts.offsets[270]])


def test_ctrl_c_during_the_compiled_loop_keeps_its_steps(monkeypatch):
    """Python raises it when the loop returns, before anything has counted the steps."""
    monkeypatch.setattr(recording, "_STEPS_PER_CHUNK", 90)
    loop = simulation.run_steps
    calls = []

    def interrupted(*arguments):
        calls.append(loop(*arguments))
        if len(calls) == 3:
            raise KeyboardInterrupt
        return calls[-1]

    monkeypatch.setattr(simulation, "run_steps", interrupted)
    assert_readable(simulate(PEG, steps=STEPS), 270)


def test_ctrl_c_inside_a_law_written_in_python_keeps_the_steps_done():
    def interrupt(result):
        raise KeyboardInterrupt

    assert_readable(simulate(PEG, Wrapped(interrupt, after=200), steps=STEPS), 200)
    with pytest.raises(KeyboardInterrupt):  # before the first step
        simulate(PEG, Wrapped(interrupt), steps=STEPS)


def test_ctrl_c_after_the_last_step_leaves_a_complete_run():
    run = simulate(PEG, steps=20, progress=stop_after(1))
    assert run.complete and run.stopped == ""


# Between two walls each stroke multiplies the speed by K dt² / m = 2000: the doubles end after a
# hundred strokes.
ABSURD = PEG.with_values(
    {
        "contact.stiffness": 1e9,
        "contact.damping": 0,
        "contact.friction": 0,
        "walls": [
            {
                "name": f"wall_{side}",
                "kind": "half_plane",
                "point": [0.05 * side, 0],
                "normal": [-side, 0],
            }
            for side in (1, -1)
        ],
    }
)


def test_motion_that_leaves_the_range_of_numbers_stops_the_run_and_says_why():
    run = simulate(ABSURD, Penalty(), steps=1500)
    assert "step is too long" in run.stopped
    assert_readable(run, run.steps)
    assert np.any(run.state != FREE) and run.steps < 1500


def test_an_unstable_device_stops_the_run_before_its_numbers_run_out():
    """Its own damping b makes it diverge, by b dt / m = 1e6 a step, while nothing couples it to the
    tool."""
    loose = FourChannel((0.0,) * 3, (0.0,) * 3)
    scene = PEG.with_values({"device.damping": [1e9, 0, 0]})
    run = simulate(scene, ImpulseAugmented(), loose, steps=STEPS)
    assert "the device's motion" in run.stopped
    assert_readable(run, run.steps)
    simulation = Simulation(scene, ImpulseAugmented(), loose)
    with pytest.raises(IapbError, match="the device's motion"):
        for _ in range(STEPS):
            simulation.step()
    assert simulation.steps_done == run.steps


def test_a_step_that_cannot_be_done_is_an_error():
    with pytest.raises(IapbError, match="range of numbers"):
        Simulation(PEG).step([1e308, 0, 0])


WRONG_RESULTS = {
    "v": lambda r: r._replace(v=r.v * np.nan),
    "q": lambda r: r._replace(q=np.append(r.q, 0.0)),
    "impulse": lambda r: r._replace(impulse=0.0),
    "state": lambda r: r._replace(state=7),
    "result": lambda r: None,
}


@pytest.mark.parametrize("what", WRONG_RESULTS)
def test_a_law_that_returns_no_step_is_named_and_the_steps_before_are_kept(what):
    with pytest.raises(ArgumentError, match=f"the law 'wrapped' returned {what}.* = .*: expected "):
        simulate(PEG, Wrapped(WRONG_RESULTS[what]), steps=STEPS)
    run = simulate(PEG, Wrapped(WRONG_RESULTS[what], after=50), steps=STEPS)
    assert_readable(run, 50)
    assert "wrapped" in run.stopped and "expected" in run.stopped
