"""Comparison of a scene in several worlds with one of them: distances over time, energy, penetration, time per step.

There are three distances. Each uses the kinetic metric M(q) at the reference world's configuration and the scene's
total mass m, so that joints and free bodies, metres and radians have comparable weights:

    configuration  √(Δqᵀ M Δq / m)   [m]     root mean square displacement over all mass (to first order)
    velocity       √(Δvᵀ M Δv / m)   [m/s]   root mean square velocity difference over all mass
    impulse        √(m ΔPᵀ M⁻¹ ΔP)   [N s]   P is the sum of all contact impulses so far, since single contacts need not
                                             be unique: their resultant if M is constant; otherwise the sum of
                                             generalized impulses, each with the Jacobian of its own pose

Every complementarity solver then solves the scene's impacts in IAPB; recomputed residuals judge the answers.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iapb.advice.effects import ignored_fields
from iapb.errors import ArgumentError, IapbError
from iapb.mechanics.mechanism import Mechanism
from iapb.names import one_of
from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene
from iapb.scene.mechanism import mechanism_of
from iapb.simulation import INTERRUPTED
from reference.complementarity.solvers import SOLVERS
from reference.datasets import StoredProblem
from reference.worlds import WORLDS, run_world
from verification.complementarity.agreement import compare_cases
from verification.complementarity.of_runs import impacts_of_run, problems_of_run
from verification.complementarity.solvers import VERDICTS, ProblemStudy, study_read
from verification.finding import MIXED, NOT_TESTABLE, REPRODUCED, Failure, Finding, Part, attempt, finding_of
from verification.table import Table, titled

Floats = NDArray[np.float64]
Progress = Callable[[str, int, int], None]

INSTANTS = 1000  # largest number of instants at which worlds are compared
QUESTION = (
    "The scene is simulated in each world. Distances from the reference world are in the kinetic metric, for the whole "
    "mass: root mean square displacement and velocity of its particles, and the impulse of all contacts so far. "
    "The impacts of IAPB are then given to every complementarity solver."
)
_UNITS = {"configuration": "m", "velocity": "m/s", "impulse": "N s"}  # of the three distances


@dataclass(frozen=True)
class WorldRun:
    """A run in one world, and the CPU time per step [s] without setup; NaN if the run was too short."""

    run: Run
    seconds: float


def default_worlds(scene: Scene) -> tuple[str, ...]:
    """Return the default worlds of a scene: those with friction only if it has friction, CBuc only if it has gains."""
    rough = scene.largest_friction > 0.0
    coupled = scene.hand is not None and scene.couplings.unilateral is not None
    return ("IAPB", "PB", *(["IAPB-friction"] if rough else []), "ideal", *(["ideal-friction"] if rough else []),
            *(["CBuc"] if coupled else []))


def compare_worlds(
    scene: Scene | str | Path, worlds: Sequence[str] | None = None, against: str | None = None, *,
    impacts: int = 12, progress: Progress | None = None,
) -> Finding:
    """Simulate a scene in several worlds and compare each with one of them.

    Parameters
    ----------
    scene : a validated scene, the path of a scene file, or the name of a scene that comes with the project
    worlds : names of `reference.worlds.WORLDS`; default: IAPB, PB and ideal; if the scene has friction, also
        IAPB-friction and ideal-friction; if the scene gives gains of the unilateral coupler, also CBuc
    against : the reference world of the comparison; default: ideal, or ideal-friction if the scene has friction
    impacts : largest number of impacts, spread over the motion, for all solvers; 0 for none
    progress : called as progress(stage, done, total)

    Returns
    -------
    Finding
        Its tables are "worlds" (one row per world), "over time", and, if there are impacts, "solvers" and "problems".
        The answer ranks the worlds whose runs are complete and trustworthy, and names the others with the reason.

    Raises
    ------
    ArgumentError, SceneError
        The world or scene does not exist, or the reference world cannot be simulated.
    """
    if not isinstance(scene, Scene):
        scene = load_scene(find_scene(scene))
    say = progress or (lambda *_: None)
    names, against = _chosen(scene, worlds, against)
    failures: list[Failure] = []
    runs = {name: found for name in names
            if (found := attempt(f"world {name}", partial(_run, scene, name, say), failures)) is not None}
    if against not in runs:
        reason = next((one.reason for one in failures if one.case == f"world {against}"), "")
        raise IapbError(f"{scene.name} cannot be simulated in the reference world {against}: {reason}; "
                        "choose another with `against`")
    mechanism = mechanism_of(scene)
    impulse = ("resultant of all contacts" if mechanism.has_constant_mass_matrix
               else "generalized, no resultant: M(q) varies")
    unfit = {name: why for name, found in runs.items() if (why := _unfit(scene, found.run))}
    series = {name: _series(mechanism, found.run, runs[against].run) for name, found in runs.items()}
    tables = {"worlds": _worlds_table(runs, series, against, impulse), "over time": _series_table(series)}
    parts = [_part_of_runs(scene, runs, unfit)]
    if impacts:
        struck = runs["IAPB"].run if "IAPB" in runs else run_world(scene, "IAPB", partial=True)
        judged = attempt("impacts", partial(compare_impacts, struck, scene, impacts, say, failures), failures)
        tables |= judged[1] if judged else {}
        parts += judged[0] if judged else []
    finding = finding_of(f"worlds of {scene.name}", scene.title or scene.name, QUESTION,
                         _answer(runs, series, against, unfit), parts, tables, failures)
    return replace(finding, details={"scene": scene.name, "worlds": ", ".join(runs), "against": against,
                                     "impulse": impulse})


def _chosen(scene: Scene, worlds: Sequence[str] | None, against: str | None) -> tuple[tuple[str, ...], str]:
    """Return the worlds in order, each once and including the reference world, and the name of the reference world."""
    if isinstance(worlds, str):
        worlds = worlds.split(",")
    names = tuple(dict.fromkeys(name.strip() for name in worlds)) if worlds else default_worlds(scene)
    if against is None:
        wanted = "ideal-friction" if scene.largest_friction > 0.0 else "ideal"
        against = wanted if worlds is None or wanted in names else "ideal" if "ideal" in names else wanted
    for argument, name in [*(("worlds", name) for name in names), ("against", against)]:
        if name not in WORLDS:
            raise ArgumentError(argument, name, one_of(name, WORLDS))
    return (*names, *([against] if against not in names else [])), against


def _run(scene: Scene, world: str, say: Progress) -> WorldRun:
    """Simulate the scene; the clock is read at the end of each chunk, which excludes the setup of the first chunk."""
    clock: list[tuple[int, float]] = []

    def progress(done: int, total: int) -> None:
        clock.append((done, time.thread_time()))
        say(f"{scene.name} in {world}: steps", done, total)

    say(f"{scene.name} in {world}: steps", 0, scene.steps)
    run = run_world(scene, world, progress=progress, partial=True)
    if run.stopped == INTERRUPTED:
        raise KeyboardInterrupt
    if len(clock) > 1:
        return WorldRun(run, (clock[-1][1] - clock[0][1]) / (clock[-1][0] - clock[0][0]))
    return WorldRun(run, float(run.chunk_seconds.sum()) / run.steps)  # one chunk: wall-clock time


def _series(mechanism: Mechanism, run: Run, reference: Run) -> dict[str, Floats]:
    """Return all compared quantities over time, at the instants that both runs have."""
    at = np.unique(np.linspace(0, reference.steps, min(reference.steps, INSTANTS) + 1).round().astype(np.int64))
    at = at[at <= run.steps]
    q, v = reference.q[at], reference.v[at]
    mass, whole = mechanism.mass_matrices(q), float(mechanism.arrays.mass.sum())
    moved = np.array([mechanism.difference(*pair) for pair in zip(q, run.q[at], strict=True)])
    given = _given(run)[at] - _given(reference)[at]
    answer = np.linalg.solve(mass, given[:, :, None])[:, :, 0]
    forms = {"configuration": _form(mass, moved) / whole, "velocity": _form(mass, run.v[at] - v) / whole,
             "impulse": np.einsum("ki,ki->k", given, answer) * whole}
    depth, steps = np.zeros(run.steps + 1), np.repeat(np.arange(run.steps), np.diff(run.contacts.offsets))
    np.maximum.at(depth, steps + 1, -run.contacts.gap)
    since = np.minimum(np.concatenate([[0], at[:-1] + 1]), run.steps)  # the deepest since the previous instant
    return {"time": run.time[at], **{name: np.sqrt(np.maximum(form, 0.0)) for name, form in forms.items()},
            "energy": run.energy["kinetic"][at] + run.energy["potential"][at],
            "penetration": np.maximum.reduceat(depth, since)}


def _form(matrices: Floats, vectors: Floats) -> Floats:
    """xᵀ M x of n matrices and n vectors."""
    return np.asarray(np.einsum("ki,kij,kj->k", vectors, matrices, vectors), np.float64)


def _given(run: Run) -> Floats:
    """Return the generalized impulse (n + 1, d) of all contacts since the start."""
    return np.vstack([np.zeros(run.v.shape[1]), np.cumsum(run.environment_force, axis=0) * run.dt])


def _worlds_table(
    runs: dict[str, WorldRun], series: dict[str, dict[str, Floats]], against: str, impulse: str
) -> Table:
    fastest = min(found.seconds for found in runs.values())
    rows = []
    for name, found in runs.items():
        run, apart = found.run, series[name]
        far = [value for key in _UNITS for value in _sizes(apart[key])] if name != against else [None] * 9
        rows.append((name, run.law, ", ".join(ignored_fields(run.effects)) or None, float(run.time[-1]), *far,
                     *_energies(run), 1e3 * float(max(0.0, -run.contacts.gap.min(initial=0.0))), len(run.impacts.step),
                     1e6 * found.seconds, found.seconds / fastest))
    far_titles = [f"{name}, {which} [{_UNITS[name]}]" for name in _UNITS for which in ("rms", "most", "end")]
    return titled(
        ("world", "law", "ignores", "simulated until [s]", *far_titles, "kinetic energy at the end [J]",
         "work done [J]", "energy lost [J]", "most above start and work [J]", "deepest overlap [mm]", "impacts",
         "time per step [µs]", "times the fastest"), rows, 3,
        f"Distances from {against}, in the kinetic metric for the whole mass, at {INSTANTS} instants at most. Impulse: "
        f"{impulse}. Lost: start and work done, minus the end. The time is the processor's, without set-up.",
        timed=("time per step [µs]", "times the fastest"))


def _sizes(values: Floats) -> tuple[float, float, float]:
    """Root mean square, largest and last value."""
    return float(np.sqrt(np.mean(values**2))), float(values.max()), float(values[-1])


def _energies(run: Run) -> tuple[float | None, ...]:
    """Return final kinetic energy, work done, energy lost, and the largest excess of energy over start plus work."""
    total = run.energy["kinetic"] + run.energy["potential"]
    if run.coupling == "unilateral":  # there is no energy balance of the tool, which the coupler moves at times
        return float(run.energy["kinetic"][-1]), None, None, None
    work = np.concatenate([[0.0], run.energy["hand_work"] + run.energy["coupling_work"]])
    above = total - total[0] - work
    return float(run.energy["kinetic"][-1]), float(work[-1]), 0.0 - float(above[-1]), float(above.max())


def _series_table(series: dict[str, dict[str, Floats]]) -> Table:
    units = {"time": "s", **_UNITS, "energy": "J", "penetration": "m"}
    rows = [(name, *map(float, row)) for name, found in series.items()
            for row in zip(*(found[key] for key in units), strict=True)]
    return titled(("world", *(f"{key} [{unit}]" for key, unit in units.items())), rows)


def _unfit(scene: Scene, run: Run) -> str:
    """Return why a run is unfit for the comparison; empty if it is complete and trustworthy."""
    if not run.complete or run.steps < scene.steps:
        return f"stopped after {run.time[-1]:g} s" + (f": {run.stopped}" if run.stopped else "")
    return f"not to be trusted: {'; '.join(run.distrust)}" if run.distrust else ""


def _part_of_runs(scene: Scene, runs: dict[str, WorldRun], unfit: dict[str, str]) -> Part:
    """Return the part on whether every world's run is complete and trustworthy."""
    fit = len(runs) - len(unfit)
    said = f"{fit} of {len(runs)} worlds ran to the end of {scene.duration:g} s and are to be trusted"
    said += "".join(f"; {name} {why}" for name, why in unfit.items())
    return Part(f"{said}.", MIXED if unfit else REPRODUCED, "runs", fit, len(runs))


def _answer(
    runs: dict[str, WorldRun], series: dict[str, dict[str, Floats]], against: str, unfit: dict[str, str]
) -> str:
    """Return the answer: the closest world to the reference and its distance, among the worlds fit for the comparison.
    """
    if len(series) == 1:
        return f"Only {against} was simulated."
    if against in unfit:
        return f"No world is called closest: the reference {against} {unfit[against]}."
    others = {name: found for name, found in series.items() if name != against and name not in unfit}
    left_out = f" Not ranked: {'; '.join(f'{name} {why}' for name, why in unfit.items())}." if unfit else ""
    if not others:
        return f"No world can be compared with {against}.{left_out}"
    closest = min(others, key=lambda name: _sizes(others[name]["configuration"])[0])
    rms, most, _ = _sizes(others[closest]["configuration"])
    ratio = runs[against].seconds / runs[closest].seconds
    speed = f"{ratio:.3g} times as fast" if ratio >= 1.0 else f"{1.0 / ratio:.3g} times as slow"
    return (f"Closest to {against} is {closest}: {1e3 * rms:.3g} mm apart (rms over mass and time), "
            f"{1e3 * most:.3g} mm at most; its step is {speed}.{left_out}")


# The impacts of IAPB as complementarity problems, with and without friction, for every solver.
LONGEST = 0.4  # [s] a solver that takes longer on one impact skips larger ones
CASES = 200  # largest number of impacts for which IAPB's motion is compared with that of the Newton LCP


def compare_impacts(
    run: Run, scene: Scene, most: int, progress: Progress, failures: list[Failure]
) -> tuple[list[Part], dict[str, Table]]:
    """Return the parts on the impacts of an IAPB run, and the tables "solvers" and "problems"."""
    problems, left_out = problems_of_run(run, scene, most)
    if not problems:
        why = f"{left_out} impacts follow another law than (21)" if left_out else "nothing collides"
        said = f"No impact of {scene.name} can be given to solvers: {why}."
        return [Part(said, NOT_TESTABLE, "impacts", optional=True)], {}
    stored = [StoredProblem(problem, format="built here") for problem in problems]
    study = study_read(f"impacts of {scene.name}", stored, longest=LONGEST, progress=progress, failures=failures)
    return [_motion(run, scene, failures), _solved(study)], {"solvers": _solvers(study), "problems": _problems(study)}


def _motion(run: Run, scene: Scene, failures: list[Failure]) -> Part:
    """Return the part on whether IAPB's impacts equal those of the Newton LCP, as they do if all contacts push."""
    compared = compare_cases(impacts_of_run(run, scene).cases[:CASES], failures=failures)
    agree, push = sum(one.agrees for one in compared), sum(one.pushes for one in compared)
    sentence = (f"IAPB moves as the frictionless Newton LCP in {agree} of its {len(compared)} impacts; in "
                f"{len(compared) - push} an impulse pulls. The largest distance is "
                f"{max(one.distance for one in compared):.2g} of |v⁻|.")
    return Part(sentence, REPRODUCED if agree == len(compared) else MIXED, "motion", agree, len(compared))


def _solved(study: ProblemStudy) -> Part:
    """Return the part on correct answers and on solvers with wrong ones; a refusal or an error is no answer."""
    solved = [row for row in study.rows if row.verdict == "solved"]
    wrong = Counter(row.solver for row in study.rows if row.verdict == "failed" and np.isfinite(row.residuals.worst))
    answers = len(solved) + wrong.total()
    unsolved = [line["problem"] for line in study.lines if "solved" not in line.values()]
    sentence = (f"{len(solved)} of {answers} answers are solutions, by residuals recomputed from the problem; "
                f"{len(study.lines) - len(unsolved)} of {len(study.lines)} problems have one.")
    if wrong:
        sentence += f" Wrong answers: {', '.join(f'{solver} {count}' for solver, count in wrong.items())}."
    verdict = MIXED if unsolved or wrong else REPRODUCED
    return Part(sentence, verdict, "solvers", len(solved), answers, timed=True)


def _solvers(study: ProblemStudy) -> Table:
    """Return a table with one row per solver."""
    rows = []
    for solver in study.solvers:
        mine = [row for row in study.rows if row.solver == solver]
        solved = [row for row in mine if row.verdict == "solved"]
        counts = [sum(row.verdict == verdict for row in mine) for verdict in VERDICTS[1:]]
        rows.append((solver, "friction" if SOLVERS[solver].takes == "cone" else "none", len(mine), len(solved), *counts,
                     max((row.residuals.worst for row in solved), default=None),
                     max((row.spread for row in solved), default=None),
                     float(np.median([1e6 * row.seconds for row in solved])) if solved else None))
    return titled(("solver", "friction", "problems", *VERDICTS, "worst residual", "spread of velocities",
                   "median time [µs]"), rows, 3,
                  "Residuals are recomputed from the problem, relative to its velocities; solved: at most 1e-6.",
                  timed=("median time [µs]", "left out"))


def _problems(study: ProblemStudy) -> Table:
    """Return a table with one row per solver and problem."""
    size = {line["problem"]: line for line in study.lines}
    rows = [(row.problem, size[row.problem]["unknowns"], size[row.problem]["rank"], row.solver, row.verdict,
             _known(row.residuals.worst), _known(row.spread), _known(1e6 * row.seconds), row.note)
            for row in study.rows]
    return titled(("problem", "unknowns", "rank", "solver", "outcome", "worst residual", "spread of velocities",
                   "time [µs]", "note"), rows, 3, timed=("time [µs]", "note"))


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
