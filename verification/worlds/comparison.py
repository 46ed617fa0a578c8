"""A scene in several worlds, beside one of them: distances over time, energy, penetration, time per step.

Three distances, each in the kinetic metric M(q) of the reference world's configuration and for the scene's whole mass
m, so that joints and free bodies, metres and radians count alike:

    configuration  √(Δqᵀ M Δq / m)   [m]     root mean square over all mass of how far it is displaced (to first order)
    velocity       √(Δvᵀ M Δv / m)   [m/s]   the same of its velocity
    impulse        √(m ΔPᵀ M⁻¹ ΔP)   [N s]   of P, all that contacts have given so far, not contact by contact, which
                                             is not unique: their resultant where M is constant; else the sum of
                                             generalized impulses, each with the Jacobian of its own pose

The scene's impacts in IAPB are then problems for every complementarity solver, judged by recomputed residuals.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iapb.effects import ignored_fields
from iapb.errors import ArgumentError, IapbError
from iapb.mechanics.mechanism import Mechanism
from iapb.names import one_of
from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene
from iapb.scene.mechanism import largest_friction, mechanism_of
from iapb.simulation import INTERRUPTED
from reference.worlds import WORLDS, run_world
from verification.finding import (
    MIXED,
    REPRODUCED,
    Failure,
    Finding,
    Part,
    Table,
    attempt,
    finding_of,
    titled,
)
from verification.worlds.impacts import compare_impacts

Floats = NDArray[np.float64]
Progress = Callable[[str, int, int], None]

INSTANTS = 1000  # of the motion, at most, at which worlds are compared
QUESTION = (
    "The scene is simulated in each world. Distances from the reference world are in the kinetic metric, for the whole "
    "mass: root mean square displacement and velocity of its particles, and the impulse of all contacts so far. "
    "The impacts of IAPB are then given to every complementarity solver."
)
DISTANCES = ("configuration", "velocity", "impulse")
RESULTANT, GENERALIZED = "resultant of all contacts", "generalized, no resultant: M(q) varies"
_UNITS = {"configuration": "m", "velocity": "m/s", "impulse": "N s"}


@dataclass(frozen=True)
class WorldRun:
    """A run of one world, and the processor time of a step [s], without set-up; NaN where the run was too short."""

    run: Run
    seconds: float


def default_worlds(scene: Scene) -> tuple[str, ...]:
    """Return the worlds that tell something about a scene: with friction where it has some, CBuc where it has gains."""
    rough = largest_friction(scene) > 0.0
    coupled = scene.hand is not None and scene.couplings.unilateral is not None
    return ("IAPB", "PB", *(["IAPB-friction"] if rough else []), "ideal", *(["ideal-friction"] if rough else []),
            *(["CBuc"] if coupled else []))  # fmt: skip


def compare_worlds(
    scene: Scene | str | Path, worlds: Sequence[str] | None = None, against: str | None = None, *,
    impacts: int = 12, progress: Progress | None = None,
) -> Finding:
    """Simulate a scene in several worlds and compare each with one of them.

    Parameters
    ----------
    scene : a checked scene, the path of a scene file, or the name of a scene that comes with the project
    worlds : names of `reference.worlds.WORLDS`; default: IAPB, PB and ideal, where the scene has friction IAPB-friction
        and ideal-friction too, and CBuc where the scene gives its gains
    against : the world that the others are compared with; default: ideal, or ideal-friction with friction
    impacts : most impacts that are given to all solvers, spread over the motion; 0 for none
    progress : called as progress(stage, done, total)

    Returns
    -------
    Finding
        with the tables "worlds" (a row for each), "over time", and, if there are impacts, "solvers" and "problems";
        the answer ranks the worlds whose runs are complete and trustworthy, and names the others with the reason

    Raises
    ------
    ArgumentError, SceneError
        There is no such world or scene, or the reference world cannot be simulated.
    """
    if not isinstance(scene, Scene):
        scene = load_scene(find_scene(scene))
    say = progress or (lambda *_: None)
    names, against = _chosen(scene, worlds, against)
    failures: list[Failure] = []
    runs = {name: found for name in names
            if (found := attempt(f"world {name}", partial(_run, scene, name, say), failures)) is not None}  # fmt: skip
    if against not in runs:
        reason = next((one.reason for one in failures if one.case == f"world {against}"), "")
        raise IapbError(f"{scene.name} cannot be simulated in the world {against}, which others were to be compared "
                        f"with: {reason}; name another with against")
    mechanism = mechanism_of(scene)
    impulse = RESULTANT if mechanism.has_constant_mass_matrix else GENERALIZED
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
                                     "impulse": impulse})  # fmt: skip


def _chosen(scene: Scene, worlds: Sequence[str] | None, against: str | None) -> tuple[tuple[str, ...], str]:
    """The worlds in order, each once, the reference world among them; and its name."""
    if isinstance(worlds, str):
        worlds = worlds.split(",")
    names = tuple(dict.fromkeys(name.strip() for name in worlds)) if worlds else default_worlds(scene)
    if against is None:
        wanted = "ideal-friction" if largest_friction(scene) > 0.0 else "ideal"
        against = wanted if worlds is None or wanted in names else "ideal" if "ideal" in names else wanted
    for argument, name in [*(("worlds", name) for name in names), ("against", against)]:
        if name not in WORLDS:
            raise ArgumentError(argument, name, one_of(name, WORLDS))
    return (*names, *([against] if against not in names else [])), against


def _run(scene: Scene, world: str, say: Progress) -> WorldRun:
    """Simulate; the clock is read as chunks end, so that the first one's set-up does not count."""
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
    return WorldRun(run, float(run.chunk_seconds.sum()) / run.steps)  # one chunk: by the clock on the wall


def _series(mechanism: Mechanism, run: Run, reference: Run) -> dict[str, Floats]:
    """Everything over time, at the instants that both runs have."""
    at = _instants(reference)
    at = at[at <= run.steps]
    q, v = reference.q[at], reference.v[at]
    mass, whole = mechanism.mass_matrices(q), float(mechanism.arrays.mass.sum())
    moved = np.array([mechanism.difference(*pair) for pair in zip(q, run.q[at], strict=True)])
    given = _given(run)[at] - _given(reference)[at]
    answer = np.linalg.solve(mass, given[:, :, None])[:, :, 0]
    forms = {"configuration": _form(mass, moved) / whole, "velocity": _form(mass, run.v[at] - v) / whole,
             "impulse": np.einsum("ki,ki->k", given, answer) * whole}  # fmt: skip
    found = {"time": run.time[at]} | {name: np.sqrt(np.maximum(form, 0.0)) for name, form in forms.items()}
    return found | {"energy": run.energy["kinetic"][at] + run.energy["potential"][at],
                    "penetration": _deepest_until(run, at)}  # fmt: skip


def _instants(run: Run) -> NDArray[np.int64]:
    return np.unique(np.linspace(0, run.steps, min(run.steps, INSTANTS) + 1).round().astype(np.int64))


def _form(matrices: Floats, vectors: Floats) -> Floats:
    """xᵀ M x of n matrices and n vectors."""
    return np.asarray(np.einsum("ki,kij,kj->k", vectors, matrices, vectors), np.float64)


def _given(run: Run) -> Floats:
    """The generalized impulse (n + 1, d) of all contacts since the start."""
    return np.vstack([np.zeros(run.v.shape[1]), np.cumsum(run.environment_force, axis=0) * run.dt])


def _deepest_until(run: Run, at: NDArray[np.int64]) -> Floats:
    """Deepest overlap in the steps between an instant and the one before it [m]."""
    depth = np.zeros(run.steps + 1)
    steps = np.repeat(np.arange(run.steps), np.diff(run.contacts.offsets))
    np.maximum.at(depth, steps + 1, -run.contacts.gap)
    return np.maximum.reduceat(depth, np.minimum(np.concatenate([[0], at[:-1] + 1]), run.steps))


def _worlds_table(
    runs: dict[str, WorldRun], series: dict[str, dict[str, Floats]], against: str, impulse: str
) -> Table:
    fastest = min(found.seconds for found in runs.values())
    rows = []
    for name, found in runs.items():
        run, apart = found.run, series[name]
        far = [value for key in DISTANCES for value in _sizes(apart[key])] if name != against else [None] * 9
        rows.append((name, run.law, ", ".join(ignored_fields(run.effects)) or None, float(run.time[-1]), *far,
                     *_energies(run), 1e3 * float(max(0.0, -run.contacts.gap.min(initial=0.0))), len(run.impacts.step),
                     1e6 * found.seconds, found.seconds / fastest))  # fmt: skip
    far_titles = [f"{name}, {which} [{_UNITS[name]}]" for name in DISTANCES for which in ("rms", "most", "end")]
    return titled(
        ("world", "law", "ignores", "until [s]", *far_titles, "kinetic energy at the end [J]", "work done [J]",
         "energy lost [J]", "most above start and work [J]", "deepest overlap [mm]", "impacts", "time per step [µs]",
         "times the fastest"), rows, 3,
        f"Distances from {against}, in the kinetic metric for the whole mass, at {INSTANTS} instants at most. Impulse: "
        f"{impulse}. Lost: start and work done, minus the end. The time is the processor's, without set-up.",
        timed=("time per step [µs]", "times the fastest"))  # fmt: skip


def _sizes(values: Floats) -> tuple[float, float, float]:
    """Root mean square, largest and last value."""
    return float(np.sqrt(np.mean(values**2))), float(values.max()), float(values[-1])


def _energies(run: Run) -> tuple[float | None, ...]:
    """Kinetic energy at the end, work done, energy lost, and the most that was there above start and work."""
    total = run.energy["kinetic"] + run.energy["potential"]
    if run.coupling == "unilateral":  # its ledger has no balance of the tool, which is carried at times
        return float(run.energy["kinetic"][-1]), None, None, None
    work = np.concatenate([[0.0], run.energy["hand_work"] + run.energy["coupling_work"]])
    above = total - total[0] - work
    return float(run.energy["kinetic"][-1]), float(work[-1]), 0.0 - float(above[-1]), float(above.max())


def _series_table(series: dict[str, dict[str, Floats]]) -> Table:
    units = {"time": "s", **_UNITS, "energy": "J", "penetration": "m"}
    rows = [(name, *map(float, row)) for name, found in series.items()
            for row in zip(*(found[key] for key in units), strict=True)]  # fmt: skip
    return titled(("world", *(f"{key} [{unit}]" for key, unit in units.items())), rows)


def _unfit(scene: Scene, run: Run) -> str:
    """Why a run says nothing about its world; empty where it ran to the end and is to be trusted."""
    if not run.complete or run.steps < scene.steps:
        return f"stopped after {run.time[-1]:g} s" + (f": {run.stopped}" if run.stopped else "")
    return f"not to be trusted: {'; '.join(run.distrust)}" if run.distrust else ""


def _part_of_runs(scene: Scene, runs: dict[str, WorldRun], unfit: dict[str, str]) -> Part:
    """Whether every world ran to the end, and is to be trusted."""
    fit = len(runs) - len(unfit)
    said = f"{fit} of {len(runs)} worlds ran to the end of {scene.duration:g} s and are to be trusted"
    said += "".join(f"; {name} {why}" for name, why in unfit.items())
    return Part(f"{said}.", MIXED if unfit else REPRODUCED, "runs", fit, len(runs))


def _answer(
    runs: dict[str, WorldRun], series: dict[str, dict[str, Floats]], against: str, unfit: dict[str, str]
) -> str:
    """Which world is closest to the reference, and how far it is; only worlds that are fit to be ranked."""
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
            f"{1e3 * most:.3g} mm at most; its step is {speed}.{left_out}")  # fmt: skip
