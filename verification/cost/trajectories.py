"""Error and computing time of whole motions, over methods and steps; the truth is the event-driven solution.

Our compiled worlds are timed in their loop, with the record. The other methods are called from Python with set-up and
record; their time is the least time of a run minus the least time of a run of one step. Short runs are repeated
REPEATS times.

A run that raises an exception or gives values that are not finite is a failure. A run that, judged by the coarser
steps, would take longer than LONGEST is a time-out and is not made. Both have rows in the table. If an error is below
the error bound of the truth, the row has this bound instead, and its note says so. No scene has an impact at a multiple
of a step, because there a run would be exact by chance.

`curves` computes the cost of ten times the accuracy for each method and scene, and the figures show the same curves.
A cost is never extrapolated: it is fitted only to runs that themselves span ten times the accuracy. `worth` summarizes
the curves of each method.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import cos, inf, pi, sin, sqrt
from typing import Any

import numpy as np

from iapb.contact import laws
from iapb.errors import IapbError, MissingDependencyError
from iapb.simulation import Simulation
from reference import Floats
from reference.one_thread import one_thread
from reference.scene_events import scene_truth
from reference.simulators import FixedScene, Settings, Trajectory, find_simulator, fixed_scene
from reference.simulators.own_engines import own_scene, world_state
from reference.simulators.scene import FLOOR, RADIUS, WEIGHT, Cuboid, Obstacle, RigidBody, Sphere, rotation
from reference.simulators.simulator import LOWEST, damping_for
from reference.simulators.trajectory import steps_between_samples
from verification.check import Check, Study
from verification.clock import target, timed
from verification.cost.steps import IDEAL, RecordedLoop
from verification.finding import Part, attempt
from verification.table import Row, Table

_BOUNCE, _FALL, _SPEED = 0.7, 0.1037, 1.0  # e, height [m] above the floor and speed [m/s] downwards at the start
_PEG = (0.021, 0.0105, 0.0105)  # [m] the sides of the paper's peg, and a third side
_TILT, _PUSH = 0.05, (-0.8, 0.0, -1.0)  # [rad] about y, [m/s2] towards wall and floor
_LATER = 0.5e-3 * (sqrt(5.0) - 1.0)  # [s] the golden ratio of a millisecond: no step divides it


def bouncing_ball() -> FixedScene:
    """A falling ball; the motion ends in flight after the fifth bounce, with the velocity of the parabolas."""
    ball = RigidBody("ball", 1.0, (0.4 * RADIUS**2,) * 3, (Sphere(RADIUS),), (0.0, 0.0, RADIUS + _FALL),
                     velocity=(0.0, 0.0, -_SPEED))  # fmt: skip
    return FixedScene("bouncing_ball", "bouncing ball, e = 0.7", "parabolas", (ball,), (FLOOR,), _BOUNCE, 0.75,
                      2.0 * RADIUS, WEIGHT, ((0.0, 0.0, -0.1452010665010186),))  # fmt: skip


def peg_landing() -> FixedScene:
    """A tilted peg is pushed into a corner without bounce; its edges touch the floor and the wall one after another."""
    wall = Obstacle("wall", (0.5, 2.0, 2.0), (-0.25, 0.0, 0.75))
    half = 0.5 * _PEG[0]
    peg = RigidBody("peg", 2.0, (0.005,) * 3, (Cuboid(_PEG),), (half + 0.0131, 0.0, 0.5 * _PEG[2] + 0.0087),
                    (0.0, sin(0.5 * _TILT), 0.0, cos(0.5 * _TILT)))  # fmt: skip
    return FixedScene("peg_landing", "peg into a corner, e = 0", "every impact plastic", (peg,), (FLOOR, wall), 0.0,
                      0.185, _PEG[0], _PUSH)  # fmt: skip


def later(scene: FixedScene) -> FixedScene:
    """Return the scene with its first impact `_LATER` later, because its bodies start earlier in their flight.

    In the scene itself an impact is at a multiple of the step, and a run with that step is exact by chance.
    """
    gravity = np.array(scene.gravity)

    def earlier(body: RigidBody) -> RigidBody:
        position, velocity = np.array(body.position), np.array(body.velocity)
        x, y, z = (position - _LATER * velocity + 0.5 * _LATER**2 * gravity).tolist()
        vx, vy, vz = (velocity - _LATER * gravity).tolist()
        return replace(body, position=(x, y, z), velocity=(vx, vy, vz))

    return replace(scene, bodies=tuple(map(earlier, scene.bodies)))


TRAJECTORY_SCENES: dict[str, Callable[[], FixedScene]] = {
    "cradle": lambda: later(replace(fixed_scene("elastic_cradle"), title="cradle, e = 1")),  # till all four are over
    "bouncing_ball": bouncing_ball, "peg_landing": peg_landing,
    "bernoulli": lambda: later(fixed_scene("bernoulli")),
    "box_on_four_corners": lambda: later(fixed_scene("box_on_four_corners")),
    "box_on_sixteen_corners": lambda: later(fixed_scene("box_on_sixteen_corners")),
}  # fmt: skip

STEPS = {
    "quick": (8e-3, 2e-3, 5e-4, 1e-4, 2e-5),
    "full": (8e-3, 4e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5),
}  # [s]
ENGINES = ("mujoco", "bullet", "drake")  # adapters of engines that accept any step
REPEATS = 5  # number of repetitions of runs below ONCE seconds
_SET_UPS = 3  # number of timed set-ups of each repetition
ONCE = 0.05
LONGEST = {"quick": 2.0, "full": 20.0}  # [s] largest time of one run
OK, FAILED, TIMED_OUT = "ok", "failed", "timed out"

# scene, step, duration -> motion, seconds of the run with its set-up, seconds of the set-up
Motion = Callable[[FixedScene, float, float], tuple[Trajectory, float, float]]


BELOW = "below the truth's error bound"
Record = dict[str, Any]
ERRORS = ("position", "energy", "signed energy", "energy made")


def motions_of(study: Study, name: str) -> Iterator[Row]:
    """Yield the runs of every installed method on a scene with every step, coarse to fine.

    position : largest distance of a body's centre, or of a point half a length beside it, from the truth
    signed energy : error of the energy at the end; positive is a gain
    energy made : largest rise of kinetic plus potential energy above its start value, without elastic energy
    time : computing time per simulated second; of a failed run until it failed, of a time-out the expected time
    """
    scene = TRAJECTORY_SCENES[name]()
    with one_thread():
        judge = Judge(scene)
        for method, way in methods().items():
            over = partial(over_steps, scene, way, judge, STEPS[study.depth], LONGEST[study.depth])
            for run in attempt(f"{method} on {scene.title}", over, study.failures) or ():
                yield {"scene": scene.title, "method": method, **run}


GAINED = 1.5  # a run belongs to a fit if its error is at least this many times smaller than that of the run before it
USEFUL = 0.1  # [lengths] a run with a larger error is on no front: the coarsest step of any method is the fastest run
FIT_RUNS, FIT_FALL = 3, 10.0  # a power is fitted to no fewer runs and no smaller fall of the error: no extrapolation
_LEAST_FALL = 3.0  # with a smaller fall of the error it is said to stay


@dataclass(frozen=True)
class Curve:
    """One method on one scene; runs are in the order of their steps, from the coarsest to the finest.

    Attributes
    ----------
    runs : all runs.
    used : those along which the error falls, for `words`; () if it falls less than threefold.
    cost : factor in computing time for a tenth of the error, fitted to `used`; None if these are too few (FIT_RUNS) or
        span too little (FIT_FALL).
    front : runs with a useful error such that no other run of the scene is better in both time and error.
    least : the smallest error of position, without runs that are exact by chance.
    too_few : whether there are no runs to use because finer steps would take too long.
    cut_short : whether the error still falls at the finest step that was run, and finer steps would take too long.
    """

    scene: str
    method: str
    runs: tuple[Record, ...]
    used: tuple[Record, ...]
    cost: float | None
    front: tuple[Record, ...]
    least: float
    too_few: bool
    cut_short: bool

    @property
    def left_out(self) -> list[Record]:
        """The other runs: before the error falls, after it stops falling, or exact by chance (`by_chance`)."""
        return [run for run in self.runs if run not in self.used]

    @property
    def words(self) -> str:
        """The cost of ten times the accuracy, or what was measured without a fit, as a label of the curve."""
        if not self.used:
            return "too few runs" if self.too_few else f"stays at {self.least:.2g}"
        first, last = self.used[0], self.used[-1]
        level = any(run["step"] < last["step"] and not by_chance(run) for run in self.left_out)
        told = f"{times(first['position'] / last['position'])} costs {times(last['time'] / first['time'])}"
        told = f"{told} ({len(self.used)} runs)" if self.cost is None else f"10× costs {times(self.cost)}"
        return told + ", then level" * level


def times(factor: float) -> str:
    """Return a factor as short text, for example 3.4× or 49×."""
    return f"{factor:.2g}×" if factor < 10.0 else f"{factor:.0f}×"


def by_chance(run: Row) -> bool:
    """Whether the error of position is below the truth's own bound, because the step meets the instants of impact."""
    return "position" in run["note"] and str(run["note"]).endswith(BELOW)


def curves(motions: Table, methods: Sequence[str]) -> list[Curve]:
    """Return a curve for each scene and each of these methods that has a run; fronts compare only these methods."""
    found: list[Curve] = []
    for scene in dict.fromkeys(motions.column("scene")):
        here = sorted((run for run in motions.where(scene=scene, outcome=OK).records()
                       if run["method"] in methods and run["time"] > 0.0), key=lambda run: -float(run["step"]))
        honest = [run for run in here if not by_chance(run)]
        for method in methods:
            runs = [run for run in honest if run["method"] == method]
            if not runs:
                continue
            kept = falling(runs)
            used = kept if kept[0]["position"] >= _LEAST_FALL * kept[-1]["position"] else []
            late = bool(motions.where(scene=scene, method=method, outcome=TIMED_OUT).rows)
            found.append(Curve(
                scene, method, tuple(run for run in here if run["method"] == method), tuple(used), tenfold_cost(used),
                tuple(run for run in runs if run["position"] <= USEFUL and not any(
                    one["time"] < run["time"] and one["position"] < run["position"] for one in honest)),
                float(min(run["position"] for run in runs)),
                not used and late and len(kept) == len(runs), late and kept[-1] is runs[-1]))
    return found


def falling(runs: Sequence[Record]) -> list[Record]:
    """Return the runs, coarse to fine, along which the error falls by a factor of at least GAINED each.

    The first of them is the last run before the error falls.
    """
    kept = [runs[0]]
    for run in runs[1:]:
        if run["position"] * GAINED <= kept[-1]["position"]:
            kept.append(run)
        elif len(kept) == 1 and run["position"] >= kept[0]["position"]:
            kept = [run]
    return kept


def tenfold_cost(runs: Sequence[Record]) -> float | None:
    """Return the factor in time for a tenth of the error; None with fewer than FIT_RUNS runs or a fall below FIT_FALL.

    The factor is 10^(−1/slope), with the slope of log(error) over log(time) by least squares.
    """
    if len(runs) < FIT_RUNS or runs[0]["position"] < FIT_FALL * runs[-1]["position"]:
        return None
    time, error = (np.log10([run[key] for run in runs]) for key in ("time", "position"))
    return float(10.0 ** (-1.0 / np.polyfit(time, error, 1)[0]))


def worth(motions: Table, methods: Sequence[str]) -> Table:
    """Return for each method its errors over all scenes, its cost of ten times the accuracy, and its best scenes.

    The cost is the median over the scenes on which it can be fitted (see `Curve.cost`). "Error stays" is the number of
    scenes on which the error does not fall. "Best for its time" is the number of scenes in which the method is on the
    front with an error of at most USEFUL. "Cut short" is the number of scenes in which the method might still reach
    the front with steps that would take too long.
    """
    rows, by_method = list[Row](), dict[str, list[Curve]]()
    for curve in sorted(curves(motions, methods), key=lambda curve: methods.index(curve.method)):
        by_method.setdefault(curve.method, []).append(curve)
    for method, mine in by_method.items():
        costs = [curve.cost for curve in mine if curve.cost is not None]
        front = [run["position"] for curve in mine for run in curve.front]
        rows.append({
            "method": method, "called": "compiled" if method in INTEGRATORS else "from Python",
            "tenfold accuracy costs": float(np.median(costs)) if costs else None,
            "least cost": min(costs, default=None), "largest cost": max(costs, default=None),
            "scenes fitted": len(costs), "error stays": sum(not curve.used and not curve.too_few for curve in mine),
            "least error": float(np.median([curve.least for curve in mine])),
            "best for its time [scenes]": sum(bool(curve.front) for curve in mine), "scenes": len(mine),
            "most exact there": min(front, default=None), "least exact there": max(front, default=None),
            "energy made": max(run["energy made"] for curve in mine for run in curve.runs),
            "cut short [scenes]": sum(curve.cut_short for curve in mine),
            "failed [runs]": sum(run["outcome"] != OK for run in motions.where(method=method).records())})
    return WORTH.table_of(rows)


IMPULSES, PENALTIES = "IAPB, semi-implicit Euler", "PB, semi-implicit Euler"
STIFFENED = "PB with stiffened walls, Runge-Kutta 4"  # see `_stiffened`
# Two comparisons of at most six curves each: worlds and engines, and integrators. Each has its own front.
WORLDS = (IMPULSES, STIFFENED, IDEAL, "MuJoCo", "Drake", "Bullet")
INTEGRATORS = (IMPULSES, "IAPB, midpoint", "IAPB, Runge-Kutta 4", PENALTIES, "PB, Runge-Kutta 4", STIFFENED)
SHORT = dict(zip(INTEGRATORS, ("IAPB, Euler", "IAPB, midpoint", "IAPB, RK4", "PB, Euler", "PB, RK4", "PB, stiffened"),
                 strict=True))  # names in print


def methods() -> dict[str, Motion]:
    """Return the motion functions by name: our worlds with several integrators, the ideal world, installed engines."""
    ways: dict[str, Motion] = {
        IMPULSES: _compiled("ImpulseAugmented", "semi_implicit_euler"),
        "IAPB, midpoint": _compiled("ImpulseAugmented", "midpoint"),
        "IAPB, Runge-Kutta 4": _compiled("ImpulseAugmented", "runge_kutta_4"),
        PENALTIES: _compiled("Penalty", "semi_implicit_euler"),
        "PB, Runge-Kutta 4": _compiled("Penalty", "runge_kutta_4"),
        STIFFENED: _compiled("Penalty", "runge_kutta_4", _stiffened),
        IDEAL: _adapter("rigid"),
    }
    for name in ENGINES:
        try:
            find_simulator(name).version()
        except MissingDependencyError:
            continue
        ways[find_simulator(name).title] = _adapter(name)
    return ways


def over_steps(scene: FixedScene, way: Motion, judge: Judge, steps: Sequence[float], longest: float) -> list[Record]:
    """Run one method with every step; failures and runs that would take longer than `longest` [s] also give rows."""
    runs: list[Record] = []
    per_step = 0.0
    for step in sorted(steps, reverse=True):
        seconds = per_step * scene.duration / step
        run: Record = {"step [ms]": 1e3 * step, "time [ms/s]": None, **dict.fromkeys(ERRORS), "outcome": TIMED_OUT,
                       "note": f"would take {seconds:.3g} s; limit: {longest:g} s"}  # fmt: skip
        if seconds <= longest:
            found, seconds = timed(partial(_tried, way, scene, step))
            if isinstance(found, Exception):
                run |= {"outcome": FAILED, "note": " ".join(f"{type(found).__name__}: {found}".split())[:160]}
            else:
                motion, seconds = found
                per_step = seconds / (scene.duration / step)
                errors, note = judge.errors(motion) if motion.finite else ({}, "not a number")
                run |= {**errors, "outcome": OK if motion.finite else FAILED, "note": note}
        runs.append(run | {"time [ms/s]": 1e3 * seconds / scene.duration})
    return runs


def _tried(way: Motion, scene: FixedScene, step: float) -> tuple[Trajectory, float] | Exception:
    """Return the motion and its least time without the set-up, or the exception of a run.

    The least set-up is subtracted from the least run. The least of the differences would be too short, because it
    takes the run before which the set-up was disturbed most.
    """
    try:
        found = [way(scene, step, scene.duration)]
        while len(found) < REPEATS and found[0][1] < ONCE:
            found.append(way(scene, step, scene.duration))
    except Exception as error:  # engines raise exceptions of any type, and each is a result
        return error
    return found[-1][0], max(min(spent for _, spent, _ in found) - min(set_up for *_, set_up in found), 0.0)


class Judge:
    """The truth of a scene, the errors of a motion, and bounds of the truth's own errors."""

    def __init__(self, scene: FixedScene) -> None:
        self.scene = scene
        self.truth = scene_truth(own_scene(scene, 1e-3, scene.duration), scene.duration, coupled=False)
        grid = self._at(np.linspace(0.0, scene.duration, 1001))
        self.kinetic = float(grid.kinetic_energy(scene).max())
        self.start = float(self._energy(grid)[0])
        bound, mass = self.truth.bound, sum(body.mass for body in scene.bodies)
        speed = float(np.linalg.norm(grid.velocity, axis=-1).max())
        energy = mass * (speed * bound.velocity + float(np.linalg.norm(scene.gravity)) * bound.position)
        self.bounds = {
            "position": bound.position * (1.0 + 0.5 * scene.length) / scene.length,  # the second point turns too
            "energy": energy / self.kinetic,
        }

    def errors(self, motion: Trajectory) -> tuple[dict[str, float], str]:
        """Return the errors for the table, at least the truth's bounds, and a note on errors below their bound."""
        truth = self._at(np.minimum(motion.time, self.truth.end))
        signed = float(self._energy(motion)[-1] - self._energy(truth)[-1]) / self.kinetic
        away = max(float(np.linalg.norm(a - b, axis=-1).max())
                   for a, b in zip(self._points(motion), self._points(truth), strict=True))  # fmt: skip
        found = {"position": away / self.scene.length, "energy": abs(signed)}
        below = [name for name, value in found.items() if value < self.bounds[name]]
        found = {name: max(value, self.bounds[name]) for name, value in found.items()}
        gain = float((self._energy(motion) - self.start).max()) / self.kinetic
        return found | {"signed energy": float(np.copysign(found["energy"], signed)),
                        "energy made": max(0.0, gain - self.bounds["energy"])}, (
            f"{', '.join(below)} {BELOW}" if below else "")

    def _energy(self, motion: Trajectory) -> Any:
        return motion.kinetic_energy(self.scene) + motion.potential_energy(self.scene)

    def _points(self, motion: Trajectory) -> tuple[Floats, Floats]:
        beside = rotation(motion.orientation) @ np.array([0.5 * self.scene.length, 0.0, 0.0])
        return motion.position, motion.position + beside

    def _at(self, times: Floats) -> Trajectory:
        q, v = self.truth.state(times)
        return Trajectory(times, *world_state(q, v))


def _fixed(scene: FixedScene, step: float) -> dict[str, Any]:
    """Return the paper's walls, the same at every step: 1000 N/m without damping."""
    return {"stiffness": 1e3, "damping": 0.0, "coherence_distance": 2e-3}


def _stiffened(scene: FixedScene, step: float) -> dict[str, Any]:
    """Return walls that are as stiff as the step allows, with the damping that gives the scene's restitution e.

    A collision of the lightest body at one contact takes 8 steps, as in our settings of MuJoCo; for e = 0 the damping
    is critical. Where n contacts share a collision, stiffness and damping are n times as large, and e is too small.
    """
    mass, stiffness = min(body.mass for body in scene.bodies), (pi / (8.0 * step)) ** 2
    damping = 2.0 * sqrt(stiffness) if scene.restitution < LOWEST else damping_for(scene.restitution, stiffness)
    return _fixed(scene, step) | {"stiffness": mass * stiffness, "damping": mass * damping}


def _compiled(law_name: str, integrator: str, walls: Callable[[FixedScene, float], dict[str, Any]] = _fixed) -> Motion:
    """Return the motion function of one of the engine's laws in the compiled loop."""

    def run(scene: FixedScene, step: float, duration: float) -> tuple[Trajectory, float, float]:
        law = getattr(laws, law_name)(integrator=integrator)
        made = own_scene(scene, step, duration, forces="paper", **walls(scene, step))
        loop = RecordedLoop(Simulation(made, law), round(duration / step))
        seconds = loop.sample() * loop.steps
        run = loop.recording.run("", "")
        keep = slice(None, None, steps_between_samples(step))
        q, v = run.q[keep], run.v[keep]
        return Trajectory(run.time[keep], *world_state(q, v)), seconds, 0.0

    return run


def _adapter(name: str) -> Motion:
    """Return the motion function of an engine with an adapter; its set-up is timed as a run of one step."""

    def run(scene: FixedScene, step: float, duration: float) -> tuple[Trajectory, float, float]:
        engine = find_simulator(name)
        settings: Settings = engine.settings(scene, step)
        engine.run(scene, settings, step, 2.0 * step)  # warm
        set_up = min(timed(partial(engine.run, scene, settings, step, step))[1] for _ in range(_SET_UPS))
        motion, spent = timed(partial(engine.run, scene, settings, step, duration))
        if len(motion.time) < 2:
            raise IapbError("fewer than two instants were recorded")
        return motion, spent, set_up

    return run


def _motions_say(motions: Table) -> Iterator[Part]:
    """Yield one part per scene with the best errors, and our fastest time at MuJoCo's best accuracy."""
    for scene in dict.fromkeys(motions.where(outcome=OK).column("scene")):
        here = motions.where(scene=scene, outcome=OK).records()
        best = {name: min(chosen, key=lambda run: (run["position"], run["time"]))
                for name in ("IAPB", "PB", "ideal", "MuJoCo")
                if (chosen := [run for run in here if run["method"].startswith(name)])}  # fmt: skip
        ours, theirs, most = best["IAPB"], best.get("MuJoCo"), min(best, key=lambda name: float(best[name]["position"]))
        as_good = min((run["time"] for run in here if theirs and run["method"].startswith("IAPB")
                       and run["position"] <= theirs["position"]), default=inf)  # fmt: skip
        exact, fast = ours["position"] <= best[most]["position"], theirs is None or as_good <= theirs["time"]
        text = "; ".join(f"{SHORT.get(run['method'], name)}: {_error(run)} ({_took(run['time'])})"
                         for name, run in best.items())
        more = f". IAPB reaches MuJoCo's error in {_took(as_good)}" if as_good < inf else ""
        yield target(f"Whole motion ({scene}): the smallest position error that any tried time step reaches, in % of "
                     "the body's length (and the computing time per simulated second)", f"{text}{more}",
                     "IAPB has the smallest error, and reaches MuJoCo's error in less time than MuJoCo", exact and fast,
                     f"in the whole motion “{scene}” " + (
                         "another method is as exact in less time" if exact else
                         f"no time step makes IAPB as exact as {most} (smallest errors {_error(ours)} and "
                         f"{_error(best[most])} of the body's length)"))


def _took(milliseconds: float) -> str:
    return f"{milliseconds:.3g} ms" if milliseconds < 1000.0 else f"{milliseconds / 1000.0:.3g} s"


def _error(run: Row) -> str:
    return f"{BELOW} of {100 * run['position']:.2g} %" if by_chance(run) else f"{100 * run['position']:.2g} %"


MOTIONS = Check(
    key="motions", question="What does the accuracy of a whole motion cost?", cases=lambda _: TRAJECTORY_SCENES,
    row=motions_of, says=_motions_say, timed=("time", "outcome", "note"), digits=3,
    note="The truth is an event-driven solution with rigid walls. In the corner a constant force compresses the "
    "springs of IAPB and PB, and no time step removes the error that this causes. Time: computing time per simulated "
    "second. Position error: the largest distance from the truth, sampled every millisecond. Energy error: the error "
    "at the end, as size and with its sign. Energy made: the largest rise above the energy at the start. Energies are "
    "relative to the largest kinetic energy. An error below the error bound of the truth is replaced by this bound.",
)  # fmt: skip
WORTH = Check(
    key="worth", question="Which method is worth its time?", row=lambda _, row: row, digits=2,
    cases=lambda study: worth(study.table(MOTIONS), WORLDS).by_title(), timed=(
        "tenfold accuracy costs", "least cost", "largest cost", "scenes fitted", "error stays", "least error",
        "best for its time", "scenes", "most exact there", "least exact there", "energy made", "cut short", "failed"),
    note="Errors are position errors in body lengths. The factor in time for a tenth of the error is a median over "
    "the scenes. It is fitted to consecutive time steps between which the error falls by a factor of at least "
    f"{GAINED:g}; a fit needs {FIT_RUNS} runs and a total fall by a factor of {FIT_FALL:g}. Best for its time: scenes "
    f"with a run (error up to {USEFUL:g}) such that no other run is both faster and more accurate. Energy made: the "
    "largest rise above the energy at the start, relative to the largest kinetic energy. Failed: also runs that are "
    "too slow.",
)  # fmt: skip
