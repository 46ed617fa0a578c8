"""Whole motions: error against event-driven truth, and the time they take, over methods and steps.

Our compiled worlds are timed in their loop, the record included. The others are called from Python with set-up and
record: their time is that of the run less that of a run of one step. All by the thread's own clock, the least of
REPEATS short runs. What raises, or ends in numbers that are none, is a failure; what would take longer than LONGEST
by the time of the coarser steps is a time-out. Both stay among the records.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import cos, sin, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.contact import laws
from iapb.errors import IapbError, MissingDependencyError
from iapb.recorder import Recorder
from iapb.simulation import Simulation
from reference.one_thread import one_thread
from reference.scene_events import scene_truth
from reference.simulators import FixedScene, Settings, Trajectory, find_simulator, fixed_scene
from reference.simulators.own_engines import own_scene, world_state
from reference.simulators.scene import FLOOR, RADIUS, WEIGHT, Cuboid, Obstacle, RigidBody, Sphere, rotation
from reference.simulators.trajectory import steps_between_samples
from verification.finding import Failure, attempt

_BOUNCE, _FALL, _SPEED = 0.7, 0.1037, 1.0  # e, height [m] above the floor and speed [m/s] downwards at the start
_PEG = (0.021, 0.0105, 0.0105)  # [m] the paper's peg, a third side added
_TILT, _PUSH = 0.05, (-0.8, 0.0, -1.0)  # [rad] about y, [m/s2] towards wall and floor


def cradle() -> FixedScene:
    """The fixed set's, until all four collisions are over."""
    return replace(fixed_scene("elastic_cradle"), title="cradle, e = 1")


def bouncing_ball() -> FixedScene:
    """A ball falls, and is caught in flight after its fifth bounce."""
    ball = RigidBody("ball", 1.0, (0.4 * RADIUS**2,) * 3, (Sphere(RADIUS),), (0.0, 0.0, RADIUS + _FALL),
                     velocity=(0.0, 0.0, -_SPEED))  # fmt: skip
    duration, gravity = 0.75, -WEIGHT[2]
    landing = sqrt(_SPEED**2 + 2.0 * gravity * _FALL)
    time, speed = (landing - _SPEED) / gravity, _BOUNCE * landing
    while time + 2.0 * speed / gravity < duration:
        time, speed = time + 2.0 * speed / gravity, _BOUNCE * speed
    end = ((0.0, 0.0, speed - gravity * (duration - time)),)
    return FixedScene("bouncing_ball", "bouncing ball, e = 0.7", "parabolas", (ball,), (FLOOR,), _BOUNCE, duration,
                      2.0 * RADIUS, WEIGHT, end)  # fmt: skip


def peg_landing() -> FixedScene:
    """A tilted peg is driven into a corner without bounce: edge after edge comes to lie on the floor and the wall."""
    wall = Obstacle("wall", (0.5, 2.0, 2.0), (-0.25, 0.0, 0.75))
    half = 0.5 * _PEG[0]
    peg = RigidBody("peg", 2.0, (0.005,) * 3, (Cuboid(_PEG),), (half + 0.0131, 0.0, 0.5 * _PEG[2] + 0.0087),
                    (0.0, sin(0.5 * _TILT), 0.0, cos(0.5 * _TILT)))  # fmt: skip
    return FixedScene("peg_landing", "peg into a corner, e = 0", "every impact plastic", (peg,), (FLOOR, wall), 0.0,
                      0.185, _PEG[0], _PUSH)  # fmt: skip


TRAJECTORY_SCENES: dict[str, Callable[[], FixedScene]] = {
    made.__name__: made for made in (cradle, bouncing_ball, peg_landing)
}


Floats = NDArray[np.float64]

STEPS = {
    "quick": (8e-3, 2e-3, 5e-4, 1e-4, 2e-5),
    "full": (8e-3, 4e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5),
}  # [s]
ENGINES = ("mujoco", "bullet", "drake")  # those of the adapters that take any step
REPEATS = 2  # below ONCE seconds
ONCE = 0.05
LONGEST = {"quick": 0.4, "full": 20.0}  # [s] for one run
OK, FAILED, TIMED_OUT = "ok", "failed", "timed out"

Motion = Callable[[FixedScene, float, float], tuple[Trajectory, float]]  # scene, step, duration -> motion, seconds


@dataclass(frozen=True)
class TrajectoryRun:
    """One method on one scene with one step [s]; the errors of a failure are NaN.

    position : largest distance of a body's centre, or of a point half a length beside it, from the truth, in lengths
    velocity : mean over the samples, a millisecond apart, of the largest error of a body's velocity, in largest true
        speeds (L¹: at an impact any two motions that are not simultaneous differ by the whole jump)
    energy : error of the energy at the end, in largest true kinetic energies; positive is a gain
    seconds : CPU time of the run [s]; until it failed, or expected where it was not tried
    """

    scene: str
    method: str
    step: float
    status: str
    note: str
    position: float
    velocity: float
    energy: float
    seconds: float


def trajectory_precision(
    scenes: Sequence[str] | None = None, depth: str = "quick", steps: Sequence[float] | None = None,
    progress: Callable[[int, int], None] | None = None, failures: list[Failure] | None = None,
) -> tuple[TrajectoryRun, ...]:
    """Run every method that is installed on every scene with every step, coarse to fine."""
    names, ways = tuple(scenes or TRAJECTORY_SCENES), methods()
    runs: list[TrajectoryRun] = []
    with one_thread():
        for done, name in enumerate(names):
            scene = TRAJECTORY_SCENES[name]()
            judge = attempt(f"truth of {scene.title}", partial(_Judge, scene), failures)
            if judge is None:
                continue
            for turn, (method, way) in enumerate(ways.items(), start=1):
                over = partial(_over_steps, scene, method, way, judge, steps or STEPS[depth], LONGEST[depth])
                runs += attempt(f"{method} on {scene.title}", over, failures) or []
                if progress is not None:
                    progress(done * len(ways) + turn, len(names) * len(ways))
    return tuple(runs)


def methods() -> dict[str, Motion]:
    """Name -> way to run a scene: our worlds with each integrator, the rigid world's schemes, installed engines."""
    ways: dict[str, Motion] = {
        "IAPB, semi-implicit Euler": _compiled("ImpulseAugmented", "semi_implicit_euler"),
        "IAPB, midpoint": _compiled("ImpulseAugmented", "midpoint"),
        "IAPB, Runge-Kutta 4": _compiled("ImpulseAugmented", "runge_kutta_4"),
        "PB, semi-implicit Euler": _compiled("Penalty", "semi_implicit_euler"),
        "PB, Runge-Kutta 4": _compiled("Penalty", "runge_kutta_4"),
        "rigid (QP per step)": _adapter("rigid"),
    }
    for name in ENGINES:
        try:
            find_simulator(name).version()
        except MissingDependencyError:
            continue
        ways[find_simulator(name).title] = _adapter(name)
    return ways


def _over_steps(scene: FixedScene, method: str, way: Motion, judge: _Judge, steps: Sequence[float],
                longest: float) -> list[TrajectoryRun]:  # fmt: skip
    runs: list[TrajectoryRun] = []
    nothing, per_step = (np.nan,) * 3, 0.0
    for step in sorted(steps, reverse=True):
        expected = per_step * scene.duration / step
        if expected > longest:
            note = f"would take {expected:.2g} s"
            runs.append(TrajectoryRun(scene.title, method, step, TIMED_OUT, note, *nothing, expected))
            continue
        started = time.thread_time()
        try:
            found = [way(scene, step, scene.duration)]
            while len(found) < REPEATS and found[0][1] < ONCE:
                found.append(way(scene, step, scene.duration))
        except Exception as error:  # an engine's own errors are of every kind, and each is a result
            note = " ".join(f"{type(error).__name__}: {error}".split())[:160]
            spent = time.thread_time() - started
            runs.append(TrajectoryRun(scene.title, method, step, FAILED, note, *nothing, spent))
            continue
        seconds = min(spent for _, spent in found)
        per_step = seconds / (scene.duration / step)
        motion = found[-1][0]
        if not motion.finite:
            runs.append(TrajectoryRun(scene.title, method, step, FAILED, "not a number", *nothing, seconds))
            continue
        runs.append(TrajectoryRun(scene.title, method, step, OK, "", *judge.errors(motion), seconds))
    return runs


class _Judge:
    """The truth of a scene, and how far a motion is from it."""

    def __init__(self, scene: FixedScene) -> None:
        self.scene = scene
        self.truth = scene_truth(own_scene(scene, 1e-3, scene.duration), scene.duration, coupled=False)
        grid = self._at(np.linspace(0.0, scene.duration, 1001))
        self.speed = float(np.linalg.norm(grid.velocity, axis=-1).max())
        self.kinetic = float(grid.kinetic_energy(scene).max())

    def errors(self, motion: Trajectory) -> tuple[float, float, float]:
        """Errors of position, velocity and energy, as `TrajectoryRun` has them."""
        truth = self._at(np.minimum(motion.time, self.truth.end))
        off = np.linalg.norm(motion.velocity - truth.velocity, axis=-1).max(axis=1)
        energy = [one.kinetic_energy(self.scene)[-1] + one.potential_energy(self.scene)[-1] for one in (motion, truth)]
        return (
            max(float(np.linalg.norm(a - b, axis=-1).max()) for a, b in
                zip(self._points(motion), self._points(truth), strict=True)) / self.scene.length,
            float(np.trapezoid(off, motion.time) / (motion.time[-1] * self.speed)),
            float(energy[0] - energy[1]) / self.kinetic,
        )  # fmt: skip

    def _points(self, motion: Trajectory) -> tuple[Floats, Floats]:
        beside = rotation(motion.orientation) @ np.array([0.5 * self.scene.length, 0.0, 0.0])
        return motion.position, motion.position + beside

    def _at(self, times: Floats) -> Trajectory:
        q, v = self.truth.state(times)
        return Trajectory(times, *world_state(q, v), np.full(len(times), -1))


def _compiled(law_name: str, integrator: str) -> Motion:
    """One of the engine's laws, in the compiled loop."""

    def run(scene: FixedScene, step: float, duration: float) -> tuple[Trajectory, float]:
        contact: dict[str, Any] = dict(find_simulator("iapb").settings(scene, step).options)
        law = getattr(laws, law_name)(integrator=integrator)
        recording = Recorder(Simulation(own_scene(scene, step, duration, **contact), law))
        total, seconds = round(duration / step), 0.0
        while recording.steps < total:
            started = time.thread_time()
            stop = recording.chunk(total)
            seconds += time.thread_time() - started
            if stop is not None:
                raise stop
        run = recording.run("", "")
        keep = slice(None, None, steps_between_samples(step))
        q, v = run.q[keep], run.v[keep]
        return Trajectory(run.time[keep], *world_state(q, v), np.full(len(q), -1)), seconds

    return run


def _adapter(name: str) -> Motion:
    """An engine behind the adapters' protocol, less its set-up."""

    def run(scene: FixedScene, step: float, duration: float) -> tuple[Trajectory, float]:
        engine = find_simulator(name)
        settings: Settings = engine.settings(scene, step)
        engine.run(scene, settings, step, 2.0 * step)  # warm
        marks = [time.thread_time()]
        engine.run(scene, settings, step, step)
        marks.append(time.thread_time())
        motion = engine.run(scene, settings, step, duration)
        marks.append(time.thread_time())
        if len(motion.time) < 2:
            raise IapbError("fewer than two instants were recorded")
        return motion, max((marks[2] - marks[1]) - (marks[1] - marks[0]), 0.0)

    return run
