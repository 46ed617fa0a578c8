"""Comparison of a scene in several worlds with one of them: distances over time, energy,
penetration, time per step.

There are three distances. Each uses the kinetic metric M(q) at the reference world's configuration
and the scene's total mass m, so that joints and free bodies, metres and radians have comparable
weights:

    configuration  √(Δqᵀ M Δq / m)  [m]    root mean square displacement over all mass
    velocity       √(Δvᵀ M Δv / m)  [m/s]  root mean square velocity difference over all mass
    impulse        √(m ΔPᵀ M⁻¹ ΔP)  [N s]  of the sum P of all contact impulses so far

The first is exact to first order. P is compared, since single contacts need not be unique: it is
their resultant if M is constant; otherwise the sum of generalized impulses, each with the Jacobian
of its own pose.

The reference world runs a second time at half its step; the difference is its own error. Worlds
whose distances differ by less are not ordered.

The impacts of IAPB are then compared with the velocities of the frictionless LCP.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from iapb.effects import ignored_fields
from iapb.errors import ArgumentError, IapbError
from iapb.mechanics.mechanism import Mechanism
from iapb.names import one_of
from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene
from iapb.scene.mechanism import mechanism_of
from iapb.simulation import INTERRUPTED
from reference import Floats
from reference.complementarity.laws import newton_lcp
from reference.complementarity.problem import ImpactProblem
from reference.mujoco import MuJoCo
from reference.worlds import WORLDS, run_world
from verification.complementarity.agreement import PUSHED, SAME, distances
from verification.complementarity.of_runs import StruckImpact, impacts_of_run
from verification.finding import (
    BEYOND,
    MIXED,
    NOT_TESTABLE,
    REPRODUCED,
    Failure,
    Finding,
    Part,
    attempt,
    finding_of,
)
from verification.scenes.books import risen
from verification.table import Columns, Row, table_from

Progress = Callable[[str, int, int], None]
Ran = tuple[Run, float]  # a run, and the processor time per step [s] without set-up
# arrays of quantities over time, by their column; None where a run does not record them
Series = dict[str, Any]

INSTANTS = 1000  # largest number of instants at which worlds are compared
IMPACTS = 200  # largest number of impacts of IAPB that are compared with the LCP's
QUESTION = (
    "The scene is simulated in each world. Distances from the reference world are in the kinetic "
    "metric, for the whole "
    "mass: root mean square displacement and velocity of its particles, and the impulse of all "
    "contacts so far. "
    "The impacts of IAPB are then compared with the velocities of the frictionless LCP."
)
_UNITS = {"configuration": "m", "velocity": "m/s", "impulse": "N s"}  # of the three distances


def default_worlds(scene: Scene) -> tuple[str, ...]:
    """Return the default worlds of a scene.

    Those with friction only if it has friction, CBuc only if it has gains, MuJoCo if installed and
    it ignores nothing.
    """
    rough = scene.largest_friction > 0.0
    coupled = scene.hand is not None and scene.couplings.unilateral is not None
    return (
        "IAPB",
        "PB",
        *(["IAPB-friction"] if rough else []),
        "ideal",
        *(["ideal-friction"] if rough else []),
        *(["CBuc"] if coupled else []),
        *(["mujoco"] if find_spec("mujoco") and not MuJoCo().ignored(scene) else []),
    )


def compare_worlds(
    scene: Scene | str | Path,
    worlds: Sequence[str] | None = None,
    against: str | None = None,
    *,
    progress: Progress | None = None,
) -> Finding:
    """Simulate a scene in several worlds and compare each with one of them.

    Parameters
    ----------
    scene : a validated scene, the path of a scene file, or the name of a scene that comes with the
        project
    worlds : names of worlds as `iapb.worlds.find_world` takes them; default: IAPB, PB and ideal; if
        the scene has friction, also IAPB-friction and ideal-friction; if the scene gives gains of
        the unilateral coupler, also CBuc; mujoco if it is installed and its model lacks nothing
        that the scene has
    against : the reference world of the comparison; default: ideal, or ideal-friction if the scene
        has friction
    progress : called as progress(stage, done, total)

    Returns
    -------
    Finding
        Its tables are "worlds" (one row per world) and "over time". If IAPB is one of the worlds,
        the answer begins with its impacts beside the LCP's. Then it names the closest of the worlds
        whose runs are complete and trustworthy, unless they differ by less than the reference's own
        error (the difference from itself at half its step). The first part gives the reason of the
        others.

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
    runs = {
        name: found
        for name in names
        if (found := attempt(f"world {name}", partial(_run, scene, name, say), failures))
        is not None
    }
    if against not in runs:
        reason = next((one.reason for one in failures if one.case == f"world {against}"), "")
        raise IapbError(
            f"{scene.name} cannot be simulated in the reference world {against}: {reason}; "
            "choose another with `against`"
        )
    finer = None
    if not _unfit(scene, runs[against][0]):
        twice = scene.with_values({"rate": 2.0 * scene.rate})
        finer = attempt(f"{against} at half its step", partial(_run, twice, against, say), failures)
    mechanism = mechanism_of(scene)
    impulse = (
        "resultant of all contacts"
        if mechanism.has_constant_mass_matrix
        else "generalized, no resultant: M(q) varies"
    )
    unfit = {name: why for name, (run, _) in runs.items() if (why := _unfit(scene, run))}
    series = {name: _series(mechanism, run, runs[against][0]) for name, (run, _) in runs.items()}
    own = _series(mechanism, finer[0], runs[against][0], 2) if finer else None
    fastest = min(seconds for _, seconds in runs.values())
    tables = {
        "worlds": table_from(
            [
                _world(name, ran, own if name == against else series[name], fastest)
                for name, ran in runs.items()
            ],
            note=f"Distances from {against}, in the kinetic metric for the whole mass, at {INSTANTS} "
            f"instants at most. In its own row: from itself at half its step. "
            f"Impulse: {impulse}. Lost: start and work done, minus the end. The time is the "
            f"processor's, without "
            "set-up.",
            kinds=Columns(timed=("time per step", "times the fastest")),
        ),
        "over time": table_from(
            row for name, found in series.items() for row in _rows_of(name, found)
        ),
    }
    fit = len(runs) - len(unfit)
    said = (
        f"{fit} of {len(runs)} worlds ran to the end of {scene.duration:g} s and are to be trusted"
    )
    said += "".join(f"; {name} {why}" for name, why in unfit.items())
    parts = [Part(f"{said}.", MIXED if unfit else REPRODUCED, "runs", fit, len(runs))]
    headline: list[str] = []
    if "IAPB" in runs:
        judging = partial(compare_impacts, runs["IAPB"][0], scene, failures)
        if judged := attempt("impacts", judging, failures):
            parts.append(judged)
            headline.append(judged.sentence)
    finding = finding_of(
        f"worlds of {scene.name}",
        scene.title or scene.name,
        QUESTION,
        parts,
        tables,
        failures,
        " ".join([*headline, _answer(runs, series, own, against, unfit)]),
    )
    return replace(
        finding,
        details={
            "scene": scene.name,
            "against": against,
            "impulse": impulse,
        },
    )


def _chosen(
    scene: Scene, worlds: Sequence[str] | None, against: str | None
) -> tuple[tuple[str, ...], str]:
    """Return the worlds in order, each once and including the reference world, and the name of the
    reference world."""
    if isinstance(worlds, str):
        worlds = worlds.split(",")
    names = tuple(name.strip() for name in worlds) if worlds else default_worlds(scene)
    if against is None:
        against = "ideal-friction" if scene.largest_friction > 0.0 else "ideal"
        if against not in names and "ideal" in names:
            against = "ideal"
    for argument, name in [*(("worlds", name) for name in names), ("against", against)]:
        if name not in WORLDS and ":" not in name:
            raise ArgumentError(
                argument, name, f"{one_of(name, WORLDS)}, or your engine as module:engine"
            )
    return tuple(dict.fromkeys((*names, against))), against


def _run(scene: Scene, world: str, say: Progress) -> Ran:
    """Simulate the scene; the clock is read at the end of each chunk, which excludes the setup of
    the first chunk."""
    clock: list[tuple[int, float]] = []

    def progress(done: int, total: int) -> None:
        clock.append((done, time.thread_time()))
        say(f"{scene.name} in {world}: steps", done, total)

    say(f"{scene.name} in {world}: steps", 0, scene.steps)
    run = run_world(scene, world, progress=progress, partial=True)
    if run.stopped == INTERRUPTED:
        raise KeyboardInterrupt
    if len(clock) > 1:
        return run, (clock[-1][1] - clock[0][1]) / (clock[-1][0] - clock[0][0])
    return run, float(run.chunk_seconds.sum()) / run.steps  # one chunk: wall-clock time


def _series(mechanism: Mechanism, run: Run, reference: Run, every: int = 1) -> Series:
    """Return all compared quantities over time, at the instants that both runs have; `every` steps
    of `run` are one of the reference."""
    at = np.unique(
        np.linspace(0, reference.steps, min(reference.steps, INSTANTS) + 1).round().astype(np.int64)
    )
    at = at[every * at <= run.steps]
    mine = every * at
    q = reference.q[at]
    v = reference.v[at]
    mass = mechanism.mass_matrices(q)
    whole = float(mechanism.arrays.mass.sum())
    moved = np.array([mechanism.difference(*pair) for pair in zip(q, run.q[mine], strict=True)])
    faster = run.v[mine] - v
    forms: dict[str, Floats | None] = {
        "configuration": np.einsum("ki,kij,kj->k", moved, mass, moved) / whole,
        "velocity": np.einsum("ki,kij,kj->k", faster, mass, faster) / whole,
        "impulse": None,
    }
    if run.records_contacts and reference.records_contacts:
        given = _given(run)[mine] - _given(reference)[at]
        answer = np.linalg.solve(mass, given[:, :, None])[:, :, 0]
        forms["impulse"] = np.einsum("ki,ki->k", given, answer) * whole
    depth = np.zeros(run.steps + 1)
    steps = np.repeat(np.arange(run.steps), np.diff(run.contacts.offsets))
    np.maximum.at(depth, steps + 1, -run.contacts.gap)
    # the deepest since the previous instant
    since = np.minimum(np.concatenate([[0], mine[:-1] + 1]), run.steps)
    return {
        "time [s]": run.time[mine],
        **{
            f"{name} [{_UNITS[name]}]": None if form is None else np.sqrt(np.maximum(form, 0.0))
            for name, form in forms.items()
        },
        "energy [J]": run.energy["kinetic"][mine] + run.energy["potential"][mine],
        "penetration [m]": np.maximum.reduceat(depth, since) if run.records_contacts else None,
    }


def _rows_of(world: str, found: Series) -> Iterator[Row]:
    """Yield the row of each instant."""
    for k in range(len(found["time [s]"])):
        cells = {
            title: None if values is None else float(values[k]) for title, values in found.items()
        }
        yield {"world": world} | cells


def _given(run: Run) -> Floats:
    """Return the generalized impulse (n + 1, d) of all contacts since the start."""
    return np.vstack([np.zeros(run.v.shape[1]), np.cumsum(run.environment_force, axis=0) * run.dt])


def _world(name: str, ran: Ran, apart: Series | None, fastest: float) -> Row:
    """Return the row of a world; `apart` has its distances, those of the reference world from
    itself at half its step."""
    run, seconds = ran
    far: dict[str, float | None] = {}
    for key, unit in _UNITS.items():
        values = None if apart is None else apart[f"{key} [{unit}]"]
        for which in ("rms", "most", "end"):
            far[f"{key}, {which} [{unit}]"] = None if values is None else _sizes(values)[which]
    # a unilateral coupler moves the tool at times, so there is no energy balance
    above = None if run.coupling == "unilateral" else risen(run)
    touching = run.records_contacts
    return {
        "world": name,
        "law": run.law,
        "ignores": ", ".join(ignored_fields(run.effects)) or None,
        "simulated until [s]": float(run.time[-1]),
        **far,
        "energy lost [J]": None if above is None else 0.0 - float(above[-1]),
        "most above start and work [J]": None if above is None else float(above.max()),
        "deepest overlap [mm]": 1e3 * max(0.0, -float(run.contacts.gap.min(initial=0.0)))
        if touching
        else None,
        "impacts": len(run.impacts.step) if touching else None,
        "time per step [µs]": 1e6 * seconds,
        "times the fastest": seconds / fastest,
    }


def _sizes(values: Floats) -> dict[str, float]:
    """Root mean square, largest and last value."""
    return {
        "rms": float(np.sqrt(np.mean(values**2))),
        "most": float(values.max()),
        "end": float(values[-1]),
    }


def _unfit(scene: Scene, run: Run) -> str:
    """Return why a run is unfit for the comparison; empty if it is complete and trustworthy."""
    if not run.complete or run.steps < scene.steps:
        return f"stopped after {run.time[-1]:g} s" + (f": {run.stopped}" if run.stopped else "")
    ignored = () if run.records_contacts else ignored_fields(run.effects)
    if ignored:  # another engine simulated another scene
        return f"ignores {', '.join(ignored)}"
    return f"not to be trusted: {'; '.join(run.distrust)}" if run.distrust else ""


def _answer(
    runs: dict[str, Ran],
    series: dict[str, Series],
    own: Series | None,
    against: str,
    unfit: dict[str, str],
) -> str:
    """Return which world is closest to the reference, and how close, among the worlds fit for the
    comparison.

    Worlds are equally close if their distances differ by less than the reference's own error.
    """
    if len(series) == 1:
        return f"Only {against} was simulated."
    if against in unfit:
        return f"No world is called closest: the reference {against} {unfit[against]}."
    far = {
        name: _sizes(found["configuration [m]"])
        for name, found in series.items()
        if name != against and name not in unfit
    }
    if not far:
        return f"No world can be compared with {against}."
    if own is None:
        return f"No order of the worlds: {against} fails at half its step."
    error = _sizes(own["configuration [m]"])["rms"]
    known = f"{against} itself moves by {1e3 * error:.3g} mm at half its step."
    closest = min(far, key=lambda name: far[name]["rms"])
    nearest = far[closest]["rms"]
    equal = [name for name in far if far[name]["rms"] - nearest <= error]
    if len(equal) > 1:
        each = ", ".join(f"{name} {1e3 * far[name]['rms']:.3g}" for name in equal)
        return (
            f"Equally close to {against}: {each} mm apart (rms over mass and time), as far "
            f"as it can tell: {known}"
        )
    ratio = runs[against][1] / runs[closest][1]
    speed = f"{ratio:.3g} times as fast" if ratio >= 1.0 else f"{1.0 / ratio:.3g} times as slow"
    return (
        f"Closest to {against} is {closest}: {1e3 * nearest:.3g} mm apart (rms over "
        f"mass and time), "
        f"{1e3 * far[closest]['most']:.3g} mm at most; its step is {speed}. {known}"
    )


def compare_impacts(run: Run, scene: Scene, failures: list[Failure]) -> Part | None:
    """Return the part on IAPB's velocities and those of the LCP, which are equal if all contacts
    push; None without an impact."""
    struck = impacts_of_run(run, scene)
    if not struck:
        return None
    alike = [one for one in struck if not one.other_law][:IMPACTS]
    pairs = [attempt(one.case.family, partial(_apart, one), failures) for one in alike]
    compared = [pair for pair in pairs if pair is not None]
    left_out = Counter(one.other_law for one in struck if one.other_law)
    besides = "".join(f" Not compared: {many} with {why}." for why, many in left_out.items())
    if unequal := sum(np.ptp(one.case.given_restitution()) > 0.0 for one in alike):
        besides = f" In {unequal} contacts differ in e: there IAPB uses Poisson's law.{besides}"
    if not compared:
        said = f"No impact of IAPB is compared with the LCP.{besides}"
        return Part(said, NOT_TESTABLE, "motion", role=BEYOND)
    agree = sum(distance <= SAME for distance, _ in compared)
    pulled = sum(outside > PUSHED for _, outside in compared)
    said = (
        f"IAPB moves as the LCP in {agree} of {len(compared)} impacts; in {pulled} an impulse "
        f"pulls; largest distance {max(compared)[0]:.2g} |v⁻|.{besides}"
    )
    verdict = REPRODUCED if agree == len(compared) else MIXED
    return Part(said, verdict, "motion", agree, len(compared))


def _apart(one: StruckImpact) -> tuple[float, float]:
    """Return the distances of IAPB's answer from the LCP's velocity, and from impulses that
    push."""
    case = one.case
    problem = ImpactProblem.from_impact(*case.arrays, case.given_restitution())
    return distances(case, one.velocity, newton_lcp(problem).velocity)
