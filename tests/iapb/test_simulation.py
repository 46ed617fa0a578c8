"""The loop: compiled or stepped from Python it is one algorithm, and what stops it early leaves a readable run."""

from __future__ import annotations

from dataclasses import fields, is_dataclass

import numpy as np
import pytest

from iapb import recording
from iapb.contact.laws import RENDERINGS, ImpulseAugmented, Penalty, StepResult
from iapb.errors import ArgumentError, IapbError
from iapb.haptics.coupling import FourChannel, NoCoupling
from iapb.mechanics.integrators import INTEGRATORS
from iapb.run import FREE, Run
from iapb.scene import load_scene
from iapb.scene_files import find_scene
from iapb.simulation import INTERRUPTED, Simulation, simulate
from iapb.system import coupling_of

# A tilted, rough peg and a weak device: contacts one by one, friction, and impulses that exceed the limits.
PEG = load_scene(find_scene("peg_corner")).with_values({
    "bodies.peg.position": [0.0209, -0.0141, 0.08], "contact.friction": 0.1, "device.force_limit": [3, 3, 0.05],
    "device.delay": 2, "device.position_resolution": [1e-5, 1e-5, 0], "device.damping": [0.5, 0.5, 0],
})  # fmt: skip
ARM = load_scene(find_scene("arm_pushing"))  # inertia that varies, velocity terms, a group of two trees
STEPS = 350  # past the fourth collision of the peg
COUPLINGS = ("none", "four-channel", "unilateral")
LAWS = [Penalty(), *(ImpulseAugmented(rendering=rendering) for rendering in RENDERINGS)]
LAWS += [ImpulseAugmented(integrator=name) for name in INTEGRATORS if name != "semi_implicit_euler"]
STEP_VECTORS = ("q", "v", "penalty_force", "friction_force", "impulse")


def name_of(law):
    return "-".join([law.name.split(" ")[0], *law.settings.values()])


def results_of(record, place="run"):
    """Every array of results, by place; timings left out."""
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


@pytest.mark.parametrize("scene", [PEG, ARM], ids=lambda scene: scene.name)
@pytest.mark.parametrize("coupling", COUPLINGS)
@pytest.mark.parametrize("law", LAWS, ids=name_of)
def test_the_compiled_loop_is_the_loop_stepped_from_python_bit_for_bit(scene, law, coupling):
    chosen = coupling_of(scene, coupling)
    run = simulate(scene, law, chosen, steps=STEPS)
    stepped = Simulation(scene, law, chosen)
    for k in range(STEPS):
        result = stepped.step()
        for name in STEP_VECTORS:
            assert np.array_equal(getattr(result, name), getattr(run, name)[k + (name in "qv")]), (k, name)
        assert np.array_equal(stepped.port.device_q, run.device_q[k + 1])
        assert np.array_equal(stepped.port.device_v, run.device_v[k + 1])
        assert np.array_equal(stepped.port.device_force, run.device_force[k])
        assert result.state == run.state[k]
    assert stepped.time == run.time[-1]
    assert np.any(run.state != FREE)


@pytest.mark.parametrize("coupling", COUPLINGS)
def test_a_run_repeats_bit_for_bit_whatever_the_chunks(coupling, monkeypatch):
    law, chosen = ImpulseAugmented(rendering="spread"), coupling_of(PEG, coupling)
    run = simulate(PEG, law, chosen, steps=STEPS)
    assert_same(run, simulate(PEG, law, chosen, steps=STEPS))
    monkeypatch.setattr(recording, "_STEPS_PER_CHUNK", 23)
    chunked = simulate(PEG, law, chosen, steps=STEPS)
    assert len(chunked.chunk_steps) == -(-STEPS // 23) and chunked.chunk_steps.sum() == STEPS
    assert_same(run, chunked)


class Wrapped:
    """The engine's law as a law of the caller's own, known by its protocol alone."""

    name, rendering = "wrapped", "full"

    def __init__(self, change=lambda result: result, after=0):
        self.law, self.change, self.after, self.calls = ImpulseAugmented(), change, after, 0

    @property
    def settings(self):
        return {}

    def advance(self, system, state, applied_force, dt):
        self.calls += 1
        result = self.law.advance(system, state, applied_force, dt)
        return self.change(result) if self.calls > self.after else result


@pytest.mark.parametrize("coupling", COUPLINGS)
def test_a_law_written_in_python_is_run_and_recorded_as_the_compiled_one(coupling):
    chosen = coupling_of(PEG, coupling)
    ours, theirs = simulate(PEG, Wrapped(), chosen, steps=STEPS), simulate(PEG, steps=STEPS, coupling=chosen)
    assert (ours.kernel, theirs.kernel) == ("python", "compiled")
    assert_same(ours, theirs)


def test_a_subclass_with_a_step_of_its_own_is_not_run_as_the_engines_law():
    class Stays(Penalty):
        def advance(self, system, state, applied_force, dt):
            return StepResult(state.q, 0.0 * state.v, *(np.zeros(3) for _ in range(3)), FREE)

    run = simulate(PEG, Stays(), steps=3)
    assert run.kernel == "python" and np.array_equal(run.q, np.tile(run.q[0], (4, 1)))


def test_results_of_steps_stay_as_they_were():
    simulation = Simulation(PEG)
    first = simulation.step()
    before = [values.copy() for values in first[:5]]
    for _ in range(200):
        simulation.step()
    assert all(np.array_equal(kept, values) for kept, values in zip(before, first[:5], strict=True))


def test_the_hand_force_stays_until_the_next_one():
    simulation = Simulation(PEG.with_values({"hand.force": [0, 0, 0], "bodies.peg.position": [1, -1, 0.0]}))
    rest = simulation.step().v
    pushed = simulation.step([2.0, -4.0, 0.01]).v
    again = simulation.step().v
    spatial = simulation.step([0, 0, 0, 0, 0, -0.01]).v
    dt, mass = simulation.system.dt, np.array([2.0, 2.0, 0.005])
    assert np.array_equal(rest, np.zeros(3))
    assert pushed == pytest.approx(dt * np.array([2.0, -4.0, 0.01]) / mass, rel=1e-12)
    assert again == pytest.approx(2.0 * pushed, rel=1e-12)
    assert spatial == pytest.approx(again - dt * np.array([0, 0, 0.01]) / mass, rel=1e-12)


@pytest.mark.parametrize("force", [[1.0], [1.0, 2.0, float("nan")], np.zeros((3, 1)), [np.inf] * 6])
def test_a_wrong_hand_force_is_named(force):
    with pytest.raises(ArgumentError, match="hand_force = .*expected 3 .plane. or 6 .space. finite numbers"):
        Simulation(PEG).step(force)


@pytest.mark.parametrize(
    ("argument", "arguments"),
    [
        ("steps", {"steps": 0}),
        ("steps", {"steps": -3}),
        ("steps", {"steps": 2.5}),
        ("steps", {"steps": True}),
        ("law", {"law": "IAPB"}),
        ("law", {"law": Penalty}),
        ("coupling", {"coupling": "four-channel"}),
        ("coupling stiffness", {"coupling": FourChannel((1.0,), (1.0,))}),
        ("coupling", {"scene": find_scene("two_discs"), "coupling": FourChannel((1.0,), (1.0,))}),
    ],
)
def test_wrong_arguments_are_named_with_value_and_expectation(argument, arguments):
    with pytest.raises(ArgumentError) as caught:
        simulate(**{"scene": PEG, **arguments})
    assert caught.value.argument == argument and caught.value.expected
    assert str(caught.value).startswith(f"{argument} = ")


def test_a_hand_force_without_a_hand_is_refused():
    with pytest.raises(ArgumentError, match="hand_force"):
        Simulation(find_scene("two_discs")).step([0, 0, 0])


# --- what stops a run early -------------------------------------------------------------------------------------------


def assert_readable(run: Run, steps: int) -> None:
    """A partial run: every array ends at the last step done, and all of it is numbers."""
    assert not run.complete and run.stopped and run.steps == steps
    assert len(run.penalty_force) == len(run.state) == steps and run.contacts.offsets[-1] == len(run.contacts.gap)
    assert np.all(run.impacts.step < steps)
    for name, values in results_of(run).items():
        assert np.all(np.isfinite(values)), name


def test_a_complete_run_says_so():
    run = simulate(PEG, steps=5)
    assert run.complete and run.stopped == ""


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
    whole = simulate(PEG, steps=STEPS)
    assert np.array_equal(run.q, whole.q[:271]) and np.array_equal(run.impulse, whole.impulse[:270])
    assert np.array_equal(run.contacts.gap, whole.contacts.gap[: whole.contacts.offsets[270]])


def test_ctrl_c_inside_a_law_written_in_python_keeps_the_steps_done():
    def interrupt(result):
        raise KeyboardInterrupt

    assert_readable(simulate(PEG, Wrapped(interrupt, after=200), steps=STEPS), 200)


def test_ctrl_c_before_the_first_step_is_ctrl_c():
    def interrupt(result):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(PEG, Wrapped(interrupt), steps=STEPS)


def test_ctrl_c_after_the_last_step_leaves_a_complete_run():
    assert simulate(PEG, steps=20, progress=stop_after(1)).complete


# Between two walls each stroke multiplies the speed by K dt² / m = 2000: the doubles end after a hundred strokes.
ABSURD = PEG.with_values({"contact.stiffness": 1e9, "contact.damping": 0, "contact.friction": 0, "walls": [
    {"name": f"wall_{side}", "kind": "half_plane", "point": [0.05 * side, 0], "normal": [-side, 0]} for side in (1, -1)
]})  # fmt: skip


def test_motion_that_leaves_the_range_of_numbers_stops_the_run_and_says_why():
    run = simulate(ABSURD, Penalty(), steps=1500)
    assert "step is too long" in run.stopped
    assert_readable(run, run.steps)
    assert np.any(run.state != FREE) and run.steps < 1500


def test_an_unstable_device_stops_the_run_before_its_numbers_run_out():
    """Its own damping b makes it diverge, by b dt / m = 1e6 a step, while nothing couples it to the tool."""
    loose, scene = FourChannel((0.0,) * 3, (0.0,) * 3), PEG.with_values({"device.damping": [1e9, 0, 0]})
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
    with pytest.raises(ArgumentError, match=f"the law 'wrapped' returned {what} = .*: expected "):
        simulate(PEG, Wrapped(WRONG_RESULTS[what]), steps=STEPS)
    run = simulate(PEG, Wrapped(WRONG_RESULTS[what], after=50), steps=STEPS)
    assert_readable(run, 50)
    assert "wrapped" in run.stopped and "expected" in run.stopped


def test_checkpoints_are_partial_runs_written_when_due(monkeypatch):
    monkeypatch.setattr(recording, "_STEPS_PER_CHUNK", 100)
    kept = []

    class Checkpoint:
        due = True

        def __call__(self, run):
            kept.append(run)

    simulate(PEG, steps=STEPS, checkpoint=Checkpoint())
    assert [run.steps for run in kept] == [100, 200, 300]
    for run in kept:
        assert_readable(run, run.steps)
    Checkpoint.due = False
    simulate(PEG, steps=STEPS, checkpoint=Checkpoint())
    assert len(kept) == 3


def test_without_a_coupling_no_device_moves():
    run = simulate(PEG, coupling=NoCoupling(), steps=20)
    assert run.coupling == "none" and np.array_equal(run.device_q, np.tile(run.device_q[0], (21, 1)))
