"""Error and computing time of whole motions, over worlds and steps; the truth is the event-driven
solution.

Each world is timed in its loop, with the record and without the set-up. Short runs are repeated
REPEATS times, and the least time counts.

A run that raises an exception or gives values that are not finite is a failure. A run that, judged
by the coarser steps, would take longer than LONGEST is a time-out and is not made. Both have rows
in the table. If an error is below the error bound of the truth, the row has this bound instead, and
its note says so. No scene has an impact at a multiple of a step, because there a run would be exact
by chance.

`curves` computes the cost of ten times the accuracy for each world and scene, and the figure shows
the same curves. A cost is never extrapolated: it is fitted only to runs that themselves span ten
times the accuracy. `worth` summarizes the curves of each world.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from iapb.run import Run
from iapb.scene import Scene, load_scene
from iapb.scene.mechanism import mechanism_of
from iapb.simulation import Simulation, require_complete
from reference import Floats
from reference.mujoco import MuJoCo
from reference.one_thread import one_thread
from reference.scene_events import scene_truth
from reference.worlds import find_world
from verification.check import Check, Study
from verification.clock import target, timed
from verification.cost.steps import IDEAL, RecordedLoop
from verification.finding import Part, attempt
from verification.table import Row, Table

FOLDER = Path(__file__).with_name("scenes") / "motions"
# scene -> size of its bodies [m], the scale of errors
TRAJECTORY_SCENES = {
    "cradle": 0.1,
    "bouncing_ball": 0.1,
    "peg_landing": 0.021,
    "bernoulli": 0.1,
    "box_on_four_corners": 0.1,
    "box_on_sixteen_corners": 0.1,
}

STEPS = {
    "quick": (8e-3, 2e-3, 5e-4, 1e-4, 2e-5),
    "full": (8e-3, 4e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5),
}  # [s]
SAMPLES = 1000.0  # [1/s] of a motion that are compared with the truth
REPEATS = 5  # number of repetitions of runs below ONCE seconds
ONCE = 0.05
LONGEST = {"quick": 2.0, "full": 20.0}  # [s] largest time of one run
OK, FAILED, TIMED_OUT = "ok", "failed", "timed out"

# A world: it simulates a scene and returns the run with its computing time [s], without the set-up.
World = Callable[[Scene], tuple[Run, float]]


BELOW = "below the truth's error bound"
Record = dict[str, Any]
ERRORS = ("position", "energy", "signed energy", "energy made")


def scene_of(name: str) -> Scene:
    """Return a scene of the study."""
    return load_scene(FOLDER / f"{name}.yaml")


def motions_of(study: Study, name: str) -> Iterator[Row]:
    """Yield the runs of every world on a scene with every step, coarse to fine.

    position : largest distance of a body's centre, or of a point half a length beside it, from the
        truth
    signed energy : error of the energy at the end; positive is a gain
    energy made : largest rise of kinetic plus potential energy above its start value, without
        elastic energy
    time : computing time per simulated second; of a failed run until it failed, of a time-out the
        expected time
    """
    scene = scene_of(name)
    with one_thread():
        judge = Judge(scene, TRAJECTORY_SCENES[name])
        for world, simulated in WORLDS.items():
            over = partial(
                over_steps, scene, simulated, judge, STEPS[study.depth], LONGEST[study.depth]
            )
            for run in attempt(f"{world} on {scene.title}", over, study.failures) or ():
                yield {"scene": scene.title, "method": world, **run}


# a run belongs to a fit if its error is at least this many times smaller than that of the run
# before it
GAINED = 1.5
# [lengths] a run with a larger error is on no front: the coarsest step of any method is the fastest
# run
USEFUL = 0.1
FIT_RUNS, FIT_FALL = (
    3,
    10.0,
)  # a power is fitted to no fewer runs and no smaller fall of the error: no extrapolation
_LEAST_FALL = 3.0  # with a smaller fall of the error it is said to stay


@dataclass(frozen=True)
class Curve:
    """One world on one scene; runs are in the order of their steps, from the coarsest to the
    finest.

    Attributes
    ----------
    runs : all runs.
    used : those along which the error falls, for `words`; () if it falls less than threefold.
    cost : factor in computing time for a tenth of the error, fitted to `used`; None if these are
        too few (FIT_RUNS) or span too little (FIT_FALL).
    front : runs with a useful error such that no other run of the scene is better in both time and
        error.
    least : the smallest error of position, without runs that are exact by chance.
    too_few : whether there are no runs to use because finer steps would take too long.
    cut_short : whether the error still falls at the finest step that was run, and finer steps would
        take too long.
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
        """The other runs: before the error falls, after it stops falling, or exact by chance
        (`by_chance`)."""
        return [run for run in self.runs if run not in self.used]

    @property
    def words(self) -> str:
        """The cost of ten times the accuracy, or what was measured without a fit, as a label of the
        curve."""
        if not self.used:
            return "too few runs" if self.too_few else f"stays at {self.least:.2g}"
        first, last = self.used[0], self.used[-1]
        level = any(run["step"] < last["step"] and not by_chance(run) for run in self.left_out)
        told = f"{times(first['position'] / last['position'])} costs {times(last['time'] / first['time'])}"
        told = (
            f"{told} ({len(self.used)} runs)"
            if self.cost is None
            else f"10× costs {times(self.cost)}"
        )
        return told + ", then level" * level


def times(factor: float) -> str:
    """Return a factor as short text, for example 3.4× or 49×."""
    return f"{factor:.2g}×" if factor < 10.0 else f"{factor:.0f}×"


def by_chance(run: Row) -> bool:
    """Whether the error of position is below the truth's own bound, because the step meets the
    instants of impact."""
    return "position" in run["note"] and str(run["note"]).endswith(BELOW)


def curves(motions: Table) -> list[Curve]:
    """Return a curve for each scene and each world that has a run."""
    found: list[Curve] = []
    for scene in dict.fromkeys(motions.column("scene")):
        here = sorted(
            (run for run in motions.where(scene=scene, outcome=OK).records() if run["time"] > 0.0),
            key=lambda run: -float(run["step"]),
        )
        honest = [run for run in here if not by_chance(run)]
        for method in dict.fromkeys(motions.column("method")):
            runs = [run for run in honest if run["method"] == method]
            if not runs:
                continue
            kept = falling(runs)
            used = kept if kept[0]["position"] >= _LEAST_FALL * kept[-1]["position"] else []
            late = bool(motions.where(scene=scene, method=method, outcome=TIMED_OUT).rows)
            found.append(
                Curve(
                    scene,
                    method,
                    tuple(run for run in here if run["method"] == method),
                    tuple(used),
                    tenfold_cost(used),
                    tuple(
                        run
                        for run in runs
                        if run["position"] <= USEFUL
                        and not any(
                            one["time"] < run["time"] and one["position"] < run["position"]
                            for one in honest
                        )
                    ),
                    float(min(run["position"] for run in runs)),
                    not used and late and len(kept) == len(runs),
                    late and kept[-1] is runs[-1],
                )
            )
    return found


def falling(runs: Sequence[Record]) -> list[Record]:
    """Return the runs, coarse to fine, along which the error falls by a factor of at least GAINED
    each.

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
    """Return the factor in time for a tenth of the error; None with fewer than FIT_RUNS runs or a
    fall below FIT_FALL.

    The factor is 10^(−1/slope), with the slope of log(error) over log(time) by least squares.
    """
    if len(runs) < FIT_RUNS or runs[0]["position"] < FIT_FALL * runs[-1]["position"]:
        return None
    time, error = (np.log10([run[key] for run in runs]) for key in ("time", "position"))
    return float(10.0 ** (-1.0 / np.polyfit(time, error, 1)[0]))


def worth(motions: Table) -> Table:
    """Return for each world its errors over all scenes, its cost of ten times the accuracy, and its
    best scenes.

    The cost is the median over the scenes on which it can be fitted (see `Curve.cost`). "Error
    stays" is the number of scenes on which the error does not fall. "Best for its time" is the
    number of scenes in which the world is on the front with an error of at most USEFUL. "Cut short"
    is the number of scenes in which the world might still reach the front with steps that would
    take too long.
    """
    rows, by_method = list[Row](), dict[str, list[Curve]]()
    worlds = [*dict.fromkeys(motions.column("method"))]
    for curve in sorted(curves(motions), key=lambda curve: worlds.index(curve.method)):
        by_method.setdefault(curve.method, []).append(curve)
    for method, mine in by_method.items():
        costs = [curve.cost for curve in mine if curve.cost is not None]
        front = [run["position"] for curve in mine for run in curve.front]
        rows.append(
            {
                "method": method,
                "called": "compiled" if method in COMPILED else "from Python",
                "tenfold accuracy costs": float(np.median(costs)) if costs else None,
                "least cost": min(costs, default=None),
                "largest cost": max(costs, default=None),
                "scenes fitted": len(costs),
                "error stays": sum(not curve.used and not curve.too_few for curve in mine),
                "least error": float(np.median([curve.least for curve in mine])),
                "best for its time [scenes]": sum(bool(curve.front) for curve in mine),
                "scenes": len(mine),
                "most exact there": min(front, default=None),
                "least exact there": max(front, default=None),
                "energy made": max(run["energy made"] for curve in mine for run in curve.runs),
                "cut short [scenes]": sum(curve.cut_short for curve in mine),
                "failed [runs]": sum(
                    run["outcome"] != OK for run in motions.where(method=method).records()
                ),
            }
        )
    return WORTH.table_of(rows)


def _our_world(name: str) -> World:
    """Return one of our worlds, timed in its loop."""

    def run(scene: Scene) -> tuple[Run, float]:
        loop = RecordedLoop(Simulation(scene, find_world(name).law), scene.steps)
        seconds = loop.sample() * loop.steps
        return loop.recording.run(name, ""), seconds

    return run


def _mujoco(scene: Scene) -> tuple[Run, float]:
    """Run MuJoCo on the scene with its restitution and its own contact forces."""
    run = MuJoCo().run(scene.with_values({"contact": {"restitution": scene.contact.restitution}}))
    require_complete(run)
    return run, float(run.chunk_seconds.sum())


COMPILED = ("IAPB", "PB")
# To add a world, add a line here.
WORLDS: dict[str, World] = {
    **{name: _our_world(name) for name in COMPILED},
    IDEAL: _our_world("ideal"),
}
if find_spec("mujoco"):
    WORLDS["MuJoCo"] = _mujoco


def over_steps(
    scene: Scene, world: World, judge: Judge, steps: Sequence[float], longest: float
) -> list[Record]:
    """Run one world with every step; failures and runs that would take longer than `longest` [s]
    also give rows."""
    runs: list[Record] = []
    per_step = 0.0
    for step in sorted(steps, reverse=True):
        seconds = per_step * scene.duration / step
        run: Record = {
            "step [ms]": 1e3 * step,
            "time [ms/s]": None,
            **dict.fromkeys(ERRORS),
            "outcome": TIMED_OUT,
            "note": f"would take {seconds:.3g} s; limit: {longest:g} s",
        }
        if seconds <= longest:
            found, seconds = timed(partial(_tried, world, scene.with_values({"rate": 1.0 / step})))
            if isinstance(found, Exception):
                run |= {
                    "outcome": FAILED,
                    "note": " ".join(f"{type(found).__name__}: {found}".split())[:160],
                }
            else:
                motion, seconds = found
                per_step = seconds / (scene.duration / step)
                finite = bool(np.isfinite(motion.q).all() and np.isfinite(motion.v).all())
                errors, note = judge.errors(motion) if finite else ({}, "not a number")
                run |= {**errors, "outcome": OK if finite else FAILED, "note": note}
        runs.append(run | {"time [ms/s]": 1e3 * seconds / scene.duration})
    return runs


def _tried(world: World, scene: Scene) -> tuple[Run, float] | Exception:
    """Return the run and its least time, or the exception of a run."""
    try:
        found = [world(scene)]
        while len(found) < REPEATS and found[0][1] < ONCE:
            found.append(world(scene))
    except Exception as error:  # engines raise exceptions of any type, and each is a result
        return error
    return found[-1][0], min(seconds for _, seconds in found)


class Judge:
    """The truth of a scene, the errors of a motion, and bounds of the truth's own errors."""

    def __init__(self, scene: Scene, length: float) -> None:
        self.length = length
        self.gravity = np.array(scene.gravity or (0.0, 0.0, 0.0))
        self.mechanism = mechanism_of(scene)
        self.truth = scene_truth(scene, scene.duration)
        q, v = self.truth.state(np.linspace(0.0, scene.duration, 1001))
        self.kinetic = float(self.mechanism.energies(q, v, self.gravity)[0].max())
        self.start = float(self._energy(q, v)[0])
        bound, mass = self.truth.bound, sum(body.mass for body in scene.bodies)
        speed = float(np.linalg.norm(v.reshape(len(v), -1, 6)[..., :3], axis=-1).max())
        energy = mass * (
            speed * bound.velocity + float(np.linalg.norm(self.gravity)) * bound.position
        )
        self.bounds = {
            "position": bound.position
            * (1.0 + 0.5 * length)
            / length,  # the second point turns too
            "energy": energy / self.kinetic,
        }

    def errors(self, run: Run) -> tuple[dict[str, float], str]:
        """Return the errors for the table, at least the truth's bounds, and a note on errors below
        their bound."""
        kept = slice(None, None, max(1, round(1.0 / (SAMPLES * run.dt))))
        true_q, true_v = self.truth.state(np.minimum(run.time[kept], self.truth.end))
        energy = self._energy(run.q[kept], run.v[kept])
        signed = float(energy[-1] - self._energy(true_q, true_v)[-1]) / self.kinetic
        away = np.linalg.norm(self._points(run.q[kept]) - self._points(true_q), axis=-1)
        found = {"position": float(away.max()) / self.length, "energy": abs(signed)}
        below = [name for name, value in found.items() if value < self.bounds[name]]
        found = {name: max(value, self.bounds[name]) for name, value in found.items()}
        gain = float((energy - self.start).max()) / self.kinetic
        return found | {
            "signed energy": float(np.copysign(found["energy"], signed)),
            "energy made": max(0.0, gain - self.bounds["energy"]),
        }, (f"{', '.join(below)} {BELOW}" if below else "")

    def _energy(self, q: Floats, v: Floats) -> Floats:
        kinetic, potential = self.mechanism.energies(q, v, self.gravity)
        return kinetic + potential

    def _points(self, q: Floats) -> Floats:
        """Return the centre of each body and a point beside it (n, 2 b, 3) [m], in world axes."""
        pose = self.mechanism.poses(q, planar=False)
        turned = Rotation.from_quat(pose[..., 3:].reshape(-1, 4)).apply(
            [0.5 * self.length, 0.0, 0.0]
        )
        center = pose[..., :3]
        return np.concatenate([center, center + turned.reshape(center.shape)], axis=1)


def _motions_say(motions: Table) -> Iterator[Part]:
    """Yield one part per scene with the best errors, and our fastest time at MuJoCo's best
    accuracy."""
    for scene in dict.fromkeys(motions.where(outcome=OK).column("scene")):
        here = motions.where(scene=scene, outcome=OK).records()
        best = {
            name: min(chosen, key=lambda run: (run["position"], run["time"]))
            for name in dict.fromkeys(run["method"] for run in here)
            if (chosen := [run for run in here if run["method"] == name])
        }
        ours, theirs, most = (
            best["IAPB"],
            best.get("MuJoCo"),
            min(best, key=lambda name: float(best[name]["position"])),
        )
        as_good = min(
            (
                run["time"]
                for run in here
                if theirs and run["method"] == "IAPB" and run["position"] <= theirs["position"]
            ),
            default=inf,
        )
        exact, fast = (
            ours["position"] <= best[most]["position"],
            theirs is None or as_good <= theirs["time"],
        )
        text = "; ".join(
            f"{name}: {_error(run)} ({_took(run['time'])})" for name, run in best.items()
        )
        more = f". IAPB reaches MuJoCo's error in {_took(as_good)}" if as_good < inf else ""
        yield target(
            f"Whole motion ({scene}): the smallest position error that any tried time step "
            f"reaches, in % of "
            "the body's length (and the computing time per simulated second)",
            f"{text}{more}",
            "IAPB has the smallest error, and reaches MuJoCo's error in less time than MuJoCo",
            exact and fast,
            f"in the whole motion “{scene}” "
            + (
                "another method is as exact in less time"
                if exact
                else f"no time step makes IAPB as exact as {most} (smallest errors {_error(ours)} and "
                f"{_error(best[most])} of the body's length)"
            ),
        )


def _took(milliseconds: float) -> str:
    return f"{milliseconds:.3g} ms" if milliseconds < 1000.0 else f"{milliseconds / 1000.0:.3g} s"


def _error(run: Row) -> str:
    return (
        f"{BELOW} of {100 * run['position']:.2g} %"
        if by_chance(run)
        else f"{100 * run['position']:.2g} %"
    )


MOTIONS = Check(
    key="motions",
    question="What does the accuracy of a whole motion cost?",
    cases=lambda _: TRAJECTORY_SCENES,
    row=motions_of,
    says=_motions_say,
    timed=("time", "outcome", "note"),
    digits=3,
    note="The truth is an event-driven solution with rigid walls. In the corner a constant force compresses the "
    "springs of IAPB and PB, and no time step removes the error that this causes. Time: computing "
    "time per simulated "
    "second. Position error: the largest distance from the truth, sampled every millisecond. "
    "Energy error: the error "
    "at the end, as size and with its sign. Energy made: the largest rise above the energy at the "
    "start. Energies are "
    "relative to the largest kinetic energy. An error below the error bound of the truth is "
    "replaced by this bound.",
)
WORTH = Check(
    key="worth",
    question="Which world is worth its time?",
    row=lambda _, row: row,
    digits=2,
    cases=lambda study: worth(study.table(MOTIONS)).by_title(),
    timed=(
        "tenfold accuracy costs",
        "least cost",
        "largest cost",
        "scenes fitted",
        "error stays",
        "least error",
        "best for its time",
        "scenes",
        "most exact there",
        "least exact there",
        "energy made",
        "cut short",
        "failed",
    ),
    note="Errors are position errors in body lengths. The factor in time for a tenth of the error is a median over "
    "the scenes. It is fitted to consecutive time steps between which the error falls by a factor "
    "of at least "
    f"{GAINED:g}; a fit needs {FIT_RUNS} runs and a total fall by a factor of {FIT_FALL:g}. Best "
    f"for its time: scenes "
    f"with a run (error up to {USEFUL:g}) such that no other run is both faster and more "
    f"accurate. Energy made: the "
    "largest rise above the energy at the start, relative to the largest kinetic energy. Failed: "
    "also runs that are "
    "too slow.",
)
