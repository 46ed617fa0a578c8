"""Studies of the laws: checks on random impacts, on the engine and along trajectories, each with a planted fault; the
energy gains of very many impacts; and the smallest inputs that break a law. The kit finds and shrinks these inputs, or
they are made by hand if that explains more.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from iapb import resolve_impact
from iapb.errors import IapbError
from reference.exact import exact_impact, relative_energy_gain
from verification.finding import (
    REFUTED,
    REPRODUCED,
    Column,
    Failure,
    Finding,
    Part,
    attempt,
    counted,
    finding_of,
    of_each,
    table_of,
    titled,
    verdict_of_law,
)
from verification.laws import LAWS, PLANTED_BUGS, bulk_impacts, check_passivity
from verification.laws.engine_laws import ENGINE_LAWS, judge_engine_law
from verification.laws.engine_laws import device_limits as limits
from verification.laws.impact_laws import relative_gain
from verification.laws.kit import residual_count
from verification.laws.planted import each_contact_its_own_restitution
from verification.laws.planted_runs import PLANTED_ENGINE_FAULTS, PLANTED_TRAJECTORY_FAULTS, first_occasion
from verification.laws.scenes import draw_scene, draw_spatial_scene
from verification.laws.trajectory_laws import TRAJECTORY_LAWS, Trajectory
from verification.methods import gram_pinv

IMPACTS = {"quick": 100_000, "full": 1_000_000}
COMPARED_IMPACTS = {"quick": 10_000, "full": 100_000}  # impacts of the compared variants
KIT_IMPACTS, FAULT_IMPACTS = 1500, 400
ENGINE_CASES, SIMULATED, FAULT_CASES = 300, 20, 60  # cases per law, per simulating law, with a fault
TRAJECTORIES, IN_SPACE, TRAJECTORY_STEPS = 60, 40, 300
COUNTER_IMPACTS, SEARCH = 500, 300  # for the search of a counterexample
SEED = 20050601
COLUMNS = (
    Column("law"), Column("cases"), Column("worst", prose=True), Column("bound"), Column("holds"), Column("fault"),
    Column("fault caught"),
)  # the worst of random cases depends on rounding, so it is printed but not compared
BULK = (
    "method", "condition of M from", "impacts", "largest relative energy gain", "gain / (10 d ε √κ)", "gain / (d ε κ)",
    "above 10 d ε √κ", "largest restitution residual",
)
Progress = Callable[[int, int], None]
Row = dict[str, Any]


def properties(run: Any, depth: str, progress: Progress) -> Finding:
    """Check every law on our resolver, on the rest of the engine and along trajectories, each with a planted fault."""
    failures: list[Failure] = []
    rows: list[Row] = []
    total = len(LAWS) + len(ENGINE_LAWS) + len(TRAJECTORY_LAWS)
    for row in (*_impact_laws(failures), *of_each(ENGINE_LAWS, _engine_law, failures), *_trajectory_laws(failures)):
        rows.append(row)
        progress(len(rows), total)
    kept, caught = [row["holds"] for row in rows], [row["fault caught"] for row in rows if row["fault"]]
    parts = (Part(f"{sum(kept)} of {len(kept)} laws hold on random and adverse inputs.", verdict_of_law(kept)),
             Part(f"{sum(caught)} of {len(caught)} planted faults are caught.", verdict_of_law(caught)))  # fmt: skip
    answer = f"{parts[0].sentence[:-1]}; {parts[1].sentence}"
    question = "Do the laws hold on every input, and does each check detect a planted fault?"
    return finding_of("properties", "Properties", question, answer, parts, {"laws": table_of(COLUMNS, rows)}, failures)


def _impact_laws(failures: list[Failure]) -> Iterator[Row]:
    """Yield a row per law of our resolver, with a planted bug that the law must detect if there is one."""
    first: dict[str, tuple[str, Any]] = {}
    for name, bug in PLANTED_BUGS.items():
        first.setdefault(bug.caught_by, (name, bug))

    def judged(verdict: Any) -> Iterator[Row]:
        if verdict.error is not None:
            raise verdict.error
        fault, caught = "", None
        if verdict.law in first:
            fault, bug = first[verdict.law]
            broken = check_passivity(bug.make(), impacts=FAULT_IMPACTS, search=0)
            caught = verdict.law in broken.broken_laws
        yield _row(verdict.statement, verdict.checked, verdict.worst, verdict.passed, fault, caught)

    kit = partial(check_passivity, resolve_impact, impacts=KIT_IMPACTS, search=0)
    report = attempt("laws of impacts", kit, failures)
    if report is not None:
        yield from of_each(report.verdicts, judged, failures, lambda verdict: verdict.law)


def _engine_law(name: str) -> Iterator[Row]:
    cases = SIMULATED if name in ("group_splitting", "device_port") else ENGINE_CASES
    verdict, (fault, make) = judge_engine_law(name, cases=cases, seed=SEED), PLANTED_ENGINE_FAULTS[name]
    with np.errstate(all="ignore"):  # the faulty subjects may overflow
        caught = not judge_engine_law(name, make(), cases=min(cases, FAULT_CASES), seed=SEED).passed
    yield _row(verdict.statement, verdict.checked, verdict.worst, verdict.passed, fault, caught)


def _trajectory_laws(failures: list[Failure]) -> Iterator[Row]:
    rng = np.random.default_rng(SEED)
    scenes = [draw_scene(rng, TRAJECTORY_STEPS) for _ in range(TRAJECTORIES)]
    scenes += [draw_spatial_scene(rng, TRAJECTORY_STEPS) for _ in range(IN_SPACE)]
    runs = list(of_each(enumerate(scenes, 1), lambda case: [case[1].simulate()], failures,
                        lambda case: f"trajectory of random scene {case[0]}"))  # fmt: skip
    trajectories, finite = [Trajectory(run) for run in runs], TRAJECTORY_LAWS["finite"]
    sound = attempt("finite", lambda: [(one, finite.check(one)) for one in trajectories], []) or ()
    whole = [one for one, found in sound if found is None or found.passed] or trajectories

    def judged(name: str) -> Iterator[Row]:
        law = TRAJECTORY_LAWS[name]
        residuals = (law.check(one) for one in (trajectories if name == "finite" else whole))
        found = residual_count(residual for residual in residuals if residual is not None)
        run = first_occasion(name, scenes)
        residual = law.check(Trajectory(run)) if run is not None else None
        caught = residual is not None and not residual.passed
        fault = PLANTED_TRAJECTORY_FAULTS[name].__name__
        statement = f"along a trajectory: {law.statement}"
        yield _row(statement, found.checked, found.worst, not found.failures, fault, caught)

    yield from of_each(TRAJECTORY_LAWS, judged, failures)


def _row(law: str, cases: int, worst: Any, holds: bool, fault: str, caught: bool | None) -> Row:
    """Return the row of a law; `worst` is None if the law applied to no case."""
    value, bound = (worst.value, worst.tolerance) if worst else (None, None)
    return {"law": law, "cases": cases, "worst": value, "bound": bound, "holds": holds,
            "fault": fault.replace("_", " "), "fault caught": caught}  # fmt: skip


def energy_gains(run: Any, depth: str, progress: Progress) -> Finding:
    """Measure the energy gain of random impacts against 10 d ε √κ(M): with and without the clamp, and as printed."""
    failures: list[Failure] = []
    studies: tuple[tuple[str, str, bool | None, int], ...] = (
        ("factored", "factored", None, IMPACTS[depth]),
        ("factored, no clamp", "factored", False, COMPARED_IMPACTS[depth]),
        ("gram_pinv, as printed", "gram_pinv", None, COMPARED_IMPACTS[depth]),
    )
    total, before = sum(study[3] for study in studies), itertools.accumulate((s[3] for s in studies), initial=0)

    def rows_of(study: tuple[str, str, bool | None, int]) -> Iterator[tuple[Any, ...]]:
        base = next(before)
        return _bulk_rows(*study, lambda done, _: progress(base + done, total))

    found = of_each(studies, rows_of, failures, lambda study: study[0])
    table = titled(BULK, found, 3, "d 1 to 30, c 0 to 100, rank deficient, e in [−1, 1]; velocities N(0, I) in v and "
                   "in Lᵀv; energies in double-double.")  # fmt: skip
    totals = {row["method"]: row for row in table.where(**{"condition of M from": "all"}).records()}
    ours, printed = totals.get("factored"), totals.get("gram_pinv, as printed")
    parts = []
    if ours and printed:
        gain, share = "largest relative energy gain", "gain / (10 d ε √κ)"
        most = " gains no energy" if ours[gain] <= 0.0 else \
            f"'s largest relative energy gain is {ours[gain]:.1e}, {ours[share]:.2g} of its bound 10 d ε √κ(M)"
        said = (f"In {ours['impacts']:,} random impacts the engine{most}; the printed formula gains up to "
                f"{printed[gain]:.1e}.")  # fmt: skip
        parts.append(Part(said, REPRODUCED if ours["above 10 d ε √κ"] == 0 else REFUTED))
    return finding_of("energy-gains", "Passive in floating point", "Does rounding make energy?",
                      " ".join(part.sentence for part in parts), parts, {"impacts": table}, failures)  # fmt: skip


def _bulk_rows(
    label: str, method: str, clamp: bool | None, count: int, progress: Callable[..., None]
) -> Iterator[tuple[Any, ...]]:
    result = bulk_impacts(count, SEED, method, clamp, progress=progress)
    for row in result.by_condition():
        yield (label, f"1e{row.decade}", row.impacts, row.worst_gain, row.worst_gain_over_bound,
               row.worst_gain_over_cholesky_bound, row.above_bound, row.worst_residual)
    yield (label, "all", count, float(result.gain.max()), result.worst_ratio,
           float((result.gain / result.cholesky_bound).max()), result.above_bound, float(result.residual.max()))


def counterexamples(progress: Progress, failures: list[Failure]) -> tuple[Finding, ...]:
    """Return inputs that break a law: for the printed formula, for one restitution per contact, and for saturation."""
    makers = (printed_formula, restitution_per_contact, saturation)
    return tuple(of_each(counted(makers, progress), lambda make: [make()], failures,
                         lambda make: make.__name__.replace("_", " ")))  # fmt: skip


def printed_formula() -> Finding:
    """Return the kit's counterexample to equations (20)-(21) as printed (`gram_pinv`), checked in exact rationals."""
    report = check_passivity(gram_pinv, impacts=COUNTER_IMPACTS, search=SEARCH)
    verdict, case = report.verdict("kinetic_energy"), report.counterexample
    if case is None or report.counterexample_law != "kinetic_energy":
        raise IapbError(f"in {COUNTER_IMPACTS} random impacts and the adverse ones the printed formula gains no energy")
    answer = gram_pinv(case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution)
    gain = relative_energy_gain(case.mass_matrix, case.velocity, answer)
    exact = exact_impact(case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution).rounded_velocity
    sentence = (
        f"The formula as printed gains {gain:.2g} of the kinetic energy, in exact rationals, on {case.contacts} rows "
        f"of {case.coordinates} coordinates with e = {case.restitution:g}. The passivity kit found and shrank this "
        f"case by itself; {verdict.failures} of its {verdict.checked} impacts gained energy, at most "
        f"{verdict.largest:.2g} of it."
    )
    given = (*_arrays(case), ("v⁺ as computed", _text(answer)), ("v⁺ exact, rounded", _text(exact)))
    return counterexample("gram_pinv", verdict.statement, sentence, given, report.counterexample_test)


def restitution_per_contact() -> Finding:
    """Return the counterexample to the obvious extension of (15): equalities with one restitution per row."""
    resolver = each_contact_its_own_restitution
    report = check_passivity(resolver, impacts=COUNTER_IMPACTS // 2, search=SEARCH, unequal_restitution=True)
    verdict, case = report.verdict("unequal_kinetic_energy"), report.counterexample
    if case is None:
        raise IapbError("the kit found no impact in which restitution per contact gains energy")
    answer = resolver(case.mass_matrix, case.contact_jacobian, case.velocity, case.given_restitution())
    sentence = (
        f"Equalities with one restitution per contact, J v⁺ = −E J v⁻, multiply the kinetic energy by "
        f"{1.0 + relative_gain(case, answer):.3g}. The passivity kit found and shrank this case. Where restitutions "
        "differ, the engine uses Poisson's law (two LCPs), which is passive."
    )
    given = (*_arrays(case), ("v⁺ as computed", _text(answer)))
    return counterexample("J v⁺ = −E J v⁻", verdict.statement, sentence, given, report.counterexample_test)


def saturation() -> Finding:
    """Return the counterexample to clipping an impulse component by component (section VI)."""
    case = limits.saturation_counterexample()
    clipped = limits.limited_impulses_are_passive(case, limits.saturated)
    scaled = limits.limited_impulses_are_passive(case, limits.ours)
    _, force = limits.saturated(case.impulse, case.dt, case.force_limit)
    sentence = (
        f"A device that clips each component of an impulse by itself gains {clipped.value:.2%} of its kinetic energy, "
        f"while the tool loses energy. With one factor for the whole impulse both lose {-scaled.value:.2%}."
    )
    given = (
        *_arrays(case.impact), ("impulse [N s]", _text(case.impulse)),
        ("force limit [N]", _text(case.force_limit)), ("impulse the device renders [N s]", _text(case.dt * force)),
    )  # fmt: skip
    return counterexample("saturate", "an impulse cut to the device's limits is passive", sentence, given)


def counterexample(
    who: str, law: str, sentence: str, given: tuple[tuple[str, str], ...], test: str = ""
) -> Finding:
    """Return the Finding for a broken law, with the input and the answer by name and the source of a test, if any."""
    return Finding(who, who, law, sentence, REFUTED, details={**dict(given), "test": test})


def _arrays(case: Any) -> tuple[tuple[str, str], ...]:
    e = case.restitution if case.unequal is None else case.unequal
    return (("M", _text(case.mass_matrix)), ("J", _text(case.contact_jacobian)), ("v⁻", _text(case.velocity)),
            ("e", _text(np.asarray(e))))  # fmt: skip


def _text(array: np.ndarray) -> str:
    return str(array.tolist())
