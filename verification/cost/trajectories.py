"""Error and computing time of whole motions, over worlds and steps; the truth is the event-driven
solution.

Each world is timed in its loop, with the record and without the set-up. Short runs are repeated
REPEATS times, and the least time counts.

A run that raises an exception or gives values that are not finite is a failure. A run that, judged
by the coarser steps, would take longer than LONGEST is a time-out and is not made. Both have rows
in the table. If an error is below the error bound of the truth, the row has this bound instead, and
its note says so. No scene has an impact at a multiple of a step, because there a run would be exact
by chance.

`worth` computes the cost of ten times the accuracy for each world. A cost is never extrapolated: it
is fitted only to runs that themselves span ten times the accuracy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from importlib.util import find_spec
from math import hypot, inf, log, pi
from pathlib import Path
from typing import Any

import numpy as np

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
from verification.clock import timed
from verification.cost.steps import IDEAL, RecordedLoop
from verification.finding import attempt
from verification.scenes.points import placed, points_of
from verification.table import Columns, Row, Table

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
OK = "ok"
FAILED = "failed"
TIMED_OUT = "timed out"

# A world: it simulates a scene and returns the run with its computing time [s], without the set-up.
World = Callable[[Scene], tuple[Run, float]]


BELOW = "below the truth's error bound"
Record = dict[str, Any]
ERRORS = ("position", "energy made")


def scene_of(name: str) -> Scene:
    """Return a scene of the study."""
    return load_scene(FOLDER / f"{name}.yaml")


def motions_of(study: Study, name: str) -> Iterator[Row]:
    """Yield the runs of every world on a scene with every step, coarse to fine.

    position : largest distance of a body's centre, or of a point half a length beside it, from the
        truth
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
# a power is fitted to no fewer runs and no smaller fall of the error: no extrapolation
FIT_RUNS = 3
FIT_FALL = 10.0


def by_chance(run: Row) -> bool:
    """Whether the error of position is below the truth's own bound, because the step meets the
    instants of impact."""
    return bool(run["note"] == BELOW)


def runs_of(motions: Table, **chosen: str) -> list[Record]:
    """Return the finished runs of a scene or a method, coarse to fine, without those that are exact
    by chance."""
    runs = motions.where(outcome=OK, **chosen).records()
    return sorted((run for run in runs if not by_chance(run)), key=lambda run: -float(run["step"]))


def falling(runs: Sequence[Record]) -> list[Record]:
    """Return the runs, coarse to fine, along which the error falls by a factor of at least GAINED
    each.

    The first of them is the last run before the error falls.
    """
    kept = list(runs[:1])
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


def worth(motions: Table, method: str) -> Row:
    """Return the cost of ten times the accuracy, and the smallest errors, of one world.

    The cost is the median over the scenes on which it can be fitted. A world has the smallest error
    of a scene if no run of another world has a smaller one.
    """
    scenes = dict.fromkeys(motions["scene"])
    costs = list[float]()
    least = list[float]()
    first = 0
    for scene in scenes:
        mine = runs_of(motions, scene=scene, method=method)
        if not mine:
            continue
        least.append(min(run["position"] for run in mine))
        first += least[-1] <= min(run["position"] for run in runs_of(motions, scene=scene))
        cost = tenfold_cost(falling(mine))
        if cost is not None:
            costs.append(cost)
    made = motions.where(method=method, outcome=OK)["energy made"]
    return {
        "method": method,
        "called": "compiled" if method in COMPILED else "from Python",
        "tenfold accuracy costs [times]": float(np.median(costs)) if costs else None,
        "least cost [times]": min(costs, default=None),
        "largest cost [times]": max(costs, default=None),
        "scenes fitted": len(costs),
        "least error, median [lengths]": float(np.median(least)) if least else None,
        "smallest error of all [scenes]": first,
        "scenes": len(scenes),
        "energy made": max(made, default=None),
        "failed or too slow [runs]": len(motions.where(method=method).rows) - len(made),
    }


def aims(motions: Table) -> Iterator[Row]:
    """Yield for each scene our smallest error over that of the best other world, and our time over
    MuJoCo's at MuJoCo's smallest error.

    Our worlds are those of `OURS`. None: we never reach that error.
    """
    for scene in dict.fromkeys(motions["scene"]):
        runs = runs_of(motions, scene=scene)
        ours = [run for run in runs if run["method"] in OURS]
        others = [run for run in runs if run["method"] not in OURS]
        theirs = min(
            (run for run in others if run["method"] == MUJOCO),
            key=lambda run: (run["position"], run["time"]),
            default=None,
        )
        if not ours or not others:
            continue
        least = min(others, key=lambda run: float(run["position"]))
        yield {
            "scene": scene,
            "most exact other": least["method"],
            "error": min(run["position"] for run in ours) / least["position"],
            "time": None
            if theirs is None
            else min(
                (run["time"] for run in ours if run["position"] <= theirs["position"]), default=inf
            )
            / theirs["time"],
        }


LOWEST = 1e-3  # restitution below which the walls are damped critically


def stiffened(scene: Scene) -> Scene:
    """Return the scene with walls as stiff as its step allows, damped to its restitution.

    A collision of the lightest body at one contact takes eight steps. Where n contacts share a
    collision, the walls are n times too stiff and the restitution is too small.
    """
    mass = min(body.mass for body in scene.bodies)
    e = scene.contact.restitution
    frequency = pi / (8.0 * scene.step)
    damping = 1.0 if e < LOWEST else -log(e) / hypot(pi, log(e))
    return scene.with_values(
        {
            "contact.stiffness": mass * frequency**2,
            "contact.damping": 2.0 * damping * mass * frequency,
        }
    )


def _our_world(name: str, stiff: bool = False) -> World:
    """Return one of our worlds, timed in its loop; `stiff` uses the walls of `stiffened`."""

    def run(scene: Scene) -> tuple[Run, float]:
        given = stiffened(scene) if stiff else scene
        loop = RecordedLoop(Simulation(given, find_world(name).law), scene.steps)
        seconds = loop.sample() * loop.steps
        return loop.recording.run(name, ""), seconds

    return run


def _mujoco(scene: Scene) -> tuple[Run, float]:
    """Run MuJoCo on the scene with its restitution and its own contact forces."""
    run = MuJoCo().run(scene.with_values({"contact": {"restitution": scene.contact.restitution}}))
    require_complete(run)
    return run, float(run.chunk_seconds.sum())


STIFF_IAPB = "IAPB, stiff springs"
STIFF_PB = "PB, stiff springs"
MUJOCO = "MuJoCo"
OURS = ("IAPB", STIFF_IAPB)
COMPILED = (*OURS, STIFF_PB)
# To add a world, add a line here.
WORLDS: dict[str, World] = {
    "IAPB": _our_world("IAPB"),
    STIFF_IAPB: _our_world("IAPB", stiff=True),
    STIFF_PB: _our_world("PB", stiff=True),
    IDEAL: _our_world("ideal"),
}
if find_spec("mujoco"):
    WORLDS[MUJOCO] = _mujoco


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
    """The truth of a scene, the errors of a motion, and a bound of the truth's own error."""

    def __init__(self, scene: Scene, length: float) -> None:
        self.length = length
        self.gravity = np.array(scene.gravity or (0.0, 0.0, 0.0))
        self.mechanism = mechanism_of(scene)
        self.truth = scene_truth(scene, scene.duration)
        q, v = self.truth.state(np.linspace(0.0, scene.duration, 1001))
        self.kinetic = float(self.mechanism.energies(q, v, self.gravity)[0].max())
        self.start = float(self._energy(q, v)[0])
        # the second point turns too
        self.bound = self.truth.bound.position * (1.0 + 0.5 * length) / length

    def errors(self, run: Run) -> tuple[dict[str, float], str]:
        """Return the errors for the table, at least the truth's bound, and a note if below it."""
        kept = slice(None, None, max(1, round(1.0 / (SAMPLES * run.dt))))
        true_q, _ = self.truth.state(np.minimum(run.time[kept], self.truth.end))
        away = np.linalg.norm(self._points(run.q[kept]) - self._points(true_q), axis=-1)
        error = float(away.max()) / self.length
        made = float((self._energy(run.q[kept], run.v[kept]) - self.start).max())
        found = {"position": max(error, self.bound), "energy made": max(0.0, made / self.kinetic)}
        return found, BELOW if error < self.bound else ""

    def _energy(self, q: Floats, v: Floats) -> Floats:
        kinetic, potential = self.mechanism.energies(q, v, self.gravity)
        return kinetic + potential

    def _points(self, q: Floats) -> Floats:
        """Return the centre of each body and a point beside it (n, b, 2, 3) [m], in world axes."""
        return points_of(*placed(self.mechanism, q), 0.5 * self.length, (0,))


MOTIONS = Check(
    key="motions",
    question="What does the accuracy of a whole motion cost?",
    cases=lambda _: TRAJECTORY_SCENES,
    row=motions_of,
    columns=Columns(timed=("time", "outcome", "note")),
)
WORTH = Check(
    key="worth",
    question="What does ten times the accuracy cost?",
    cases=lambda _: WORLDS,
    row=lambda study, world: worth(study.table(MOTIONS), world),
    columns=Columns(
        timed=(
            "tenfold accuracy costs",
            "least cost",
            "largest cost",
            "scenes fitted",
            "least error, median",
            "smallest error of all",
            "energy made",
            "failed or too slow",
        )
    ),
)
