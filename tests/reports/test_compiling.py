"""Compiling is told when it happens, and only then; a run's times are those of its steps."""

import multiprocessing

import numba
import numpy as np
import pytest

from iapb import compiling
from iapb.compiled import Entry
from iapb.compiling import BEGIN, compiling_told, tell_from_worker
from iapb.contact.laws import StepResult
from iapb.run import FREE
from iapb.scene import find_scene
from iapb.simulation import simulate
from reference.time_stepping import RigidConstraints

needs_compiler = pytest.mark.skipif(numba.config.DISABLE_JIT, reason="kernels are interpreted")


@needs_compiler
def test_compiling_is_told_once_however_many_kernels_and_by_one_worker(capsys, monkeypatch):
    from numba.core import event

    monkeypatch.setattr(compiling, "_begun", [])  # whatever this process has said before
    monkeypatch.setattr(compiling, "WORTH_SAYING", 0.0)
    inner = numba.njit(lambda x: x + 1.0)
    outer = numba.njit(lambda x: inner(x) * 2.0)
    lines = []
    with compiling_told(lines.append):
        assert outer(1.0) == 4.0 and outer(1) == 4
    assert lines[0] == BEGIN and len(lines) == 2 and lines[1].startswith("Compiling took ")
    with compiling_told(lines.append):
        outer(3.0)  # compiled already
    monkeypatch.setattr(compiling, "WORTH_SAYING", 1e3)
    with compiling_told(lines.append):
        outer(1j)  # too quick to be worth a word
    outer(np.float32(1.0))  # nobody listens any more
    assert len(lines) == 2
    told, before = multiprocessing.Value("b", False), list(event._registered["numba:compile"])
    try:
        tell_from_worker(told)
        tell_from_worker(told)
        numba.njit(lambda x: x - 1.0)(1.0)
    finally:
        event._registered["numba:compile"][:] = before
    assert capsys.readouterr().err == BEGIN + "\n"


@needs_compiler
def test_the_times_of_a_run_leave_out_compiling(monkeypatch):
    """The first call of a step compiles it: here it counts 1000 s for that."""
    clock, calls = [0.0], []

    class SlowAtFirst(Entry):
        def __call__(self, *arguments):
            clock[0] += 1000.0 if not calls else 1.0
            calls.append(arguments[-1])
            return super().__call__(*arguments)

    monkeypatch.setattr("iapb.simulation.Entry", SlowAtFirst)
    monkeypatch.setattr("iapb.recording.time.perf_counter", lambda: clock[0])
    run = simulate(find_scene("peg_corner"), steps=600)
    assert calls == [0, 512, 88] and run.chunk_seconds.tolist() == [1.0, 1.0]


def test_a_law_in_python_takes_its_first_step_in_a_twin_and_one_that_may_have_a_state_does_not():
    class Counting(RigidConstraints):
        calls = 0

        def advance(self, *arguments):
            Counting.calls += 1
            return super().advance(*arguments)

    class Stateful:
        name, settings, calls = "stateful", {}, 0

        def advance(self, system, state, force, dt):
            self.calls += 1
            still = np.zeros_like(state.v)
            return StepResult(state.q.copy(), still, still, still, still, FREE)

    run, law = simulate(find_scene("two_discs"), Counting(), steps=3), Stateful()
    simulate(find_scene("two_discs"), law, steps=3)
    assert (Counting.calls, run.steps, law.calls) == (4, 3, 3)
    assert np.array_equal(run.q, simulate(find_scene("two_discs"), RigidConstraints(), steps=3).q)
