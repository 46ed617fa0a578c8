"""Topics on the laws, and the smallest inputs that break a law.

`properties` checks every law on random impacts, on the engine and along trajectories, each with a
planted fault; `energy_gains` measures the energy gains of very many impacts. The kit finds and
shrinks the counterexamples, or they are made by hand if that explains more.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from iapb import resolve_impact
from iapb.errors import IapbError
from reference.exact import exact_impact, relative_energy_gain
from verification.check import SEED, Check, Study, Topic
from verification.finding import (
    REFUTED,
    REPRODUCED,
    Failure,
    Finding,
    Part,
    attempt,
    counted,
    of_each,
    verdict_of_law,
)
from verification.impacts import ImpactCase
from verification.laws import (
    LAWS,
    PLANTED_BUGS,
    PassivityReport,
    bulk_impacts,
    check_passivity,
    engine,
    planted,
)
from verification.laws.bounds import LawCount, relative_gain
from verification.laws.bulk import ABOVE, GAIN, SHARE
from verification.laws.kit import LawVerdict
from verification.laws.scenes import SceneCase, draw_scene, draw_spatial_scene
from verification.laws.trajectories import TRAJECTORY_LAWS, Trajectory
from verification.methods import gram_pinv
from verification.table import HOLDS, Row, Table

IMPACTS = {"quick": 100_000, "full": 1_000_000}
COMPARED_IMPACTS = {"quick": 10_000, "full": 100_000}  # impacts of the compared variants
KIT_IMPACTS, FAULT_IMPACTS = 1500, 400
ENGINE_CASES, SIMULATED, FAULT_CASES = (
    300,
    20,
    60,
)  # cases per law, per simulating law, with a fault
TRAJECTORIES, IN_SPACE, TRAJECTORY_STEPS = 60, 40, 300
COUNTER_IMPACTS, SEARCH = 500, 300  # for the search of a counterexample
_CAUGHT = "fault caught"
Progress = Callable[[int, int], None]


def _row(law: str, count: LawCount, fault: str, caught: bool) -> Row:
    """Return the row of a law; the worst is empty if the law applied to no case."""
    value, bound = (count.worst.value, count.worst.tolerance) if count.worst else (None, None)
    return {
        "law": law,
        "cases": count.checked,
        "worst": value,
        "bound": bound,
        HOLDS: not count.failures,
        "fault": fault.replace("_", " "),
        _CAUGHT: caught,
    }


def _impact_law(study: Study, name: str) -> Row:
    report = study.once(
        "kit", lambda: check_passivity(resolve_impact, impacts=KIT_IMPACTS, search=0)
    )
    verdict, fault = report.verdict(name), PLANTED_BUGS[name]
    if verdict.error is not None:
        raise verdict.error
    broken = check_passivity(fault.make(), impacts=FAULT_IMPACTS, search=0)
    return _row(verdict.statement, verdict, fault.name, name in broken.broken_laws)


def _engine_law(study: Study, name: str) -> Row:
    cases = SIMULATED if name in ("group_splitting", "device_port") else ENGINE_CASES
    count, fault = (
        engine.judge_engine_law(name, cases=cases, seed=SEED),
        planted.PLANTED_ENGINE_FAULTS[name],
    )
    with np.errstate(all="ignore"):  # the faulty subjects may overflow
        broken = engine.judge_engine_law(
            name, fault.make(), cases=min(cases, FAULT_CASES), seed=SEED
        )
    return _row(engine.ENGINE_LAWS[name].statement, count, fault.name, broken.failures > 0)


def _trajectories(study: Study) -> tuple[list[SceneCase], list[Trajectory], list[Trajectory]]:
    """The random scenes, their trajectories, and those that stay finite."""
    rng = np.random.default_rng(SEED)
    scenes = [draw_scene(rng, TRAJECTORY_STEPS) for _ in range(TRAJECTORIES)]
    scenes += [draw_spatial_scene(rng, TRAJECTORY_STEPS) for _ in range(IN_SPACE)]
    runs = of_each(
        enumerate(scenes, 1),
        lambda case: [Trajectory(case[1].simulate())],
        study.failures,
        lambda case: f"trajectory of random scene {case[0]}",
    )
    every, finite = list(runs), TRAJECTORY_LAWS["finite"]
    sound = attempt("finite", lambda: [(one, finite.check(one)) for one in every], []) or ()
    return scenes, every, [one for one, found in sound if found is None or found.passed] or every


def _trajectory_law(study: Study, name: str) -> Row:
    scenes, every, whole = study.once("trajectories", lambda: _trajectories(study))
    law, count = TRAJECTORY_LAWS[name], LawCount(name)
    for one in every if name == "finite" else whole:
        if (found := law.check(one)) is not None:
            count.add(found)
    run = planted.first_occasion(name, scenes)
    residual = law.check(Trajectory(run)) if run is not None else None
    caught = residual is not None and not residual.passed
    return _row(
        f"along a trajectory: {law.statement}",
        count,
        planted.PLANTED_TRAJECTORY_FAULTS[name].__name__,
        caught,
    )


KINDS: dict[str, Callable[[Study, str], Row]] = {
    "impact": _impact_law,
    "engine": _engine_law,
    "trajectory": _trajectory_law,
}


def _laws(study: Study) -> Iterator[tuple[str, str]]:
    yield from (("impact", name) for name in LAWS)
    yield from (("engine", name) for name in engine.ENGINE_LAWS)
    yield from (("trajectory", name) for name in TRAJECTORY_LAWS)


def _laws_say(table: Table) -> Iterator[Part]:
    caught = table.column(_CAUGHT)
    yield Part(
        f"The engine keeps {sum(table.decided)} of {len(table.rows)} laws on random and on "
        f"provoking inputs. "
        f"{len(LAWS)} of the laws are about impacts; the function iapb.check_passivity tests them "
        f"on a solver "
        "of yours.",
        verdict_of_law(table.holds),
    )
    yield Part(
        f"The checks catch {sum(caught)} of {len(caught)} faults that are planted in the code to test them.",
        verdict_of_law(caught),
    )


properties = Topic(
    key="properties",
    title="Properties",
    question="Do the laws hold on every input, and does each check detect a planted fault?",
    checks=(
        Check(  # the worst of random cases depends on rounding, so it is printed but not compared
            key="laws",
            question="Does the law hold, and is its planted fault caught?",
            cases=_laws,
            row=lambda study, case: KINDS[case[0]](study, case[1]),
            says=_laws_say,
            prose=["worst"],
        ),
    ),
    says=lambda tables, parts: f"{parts[0].sentence} {parts[1].sentence}",
)


# method, clamp, number of impacts
METHODS: dict[str, tuple[str, bool | None, dict[str, int]]] = {
    "factored": ("factored", None, IMPACTS),
    "factored, no clamp": ("factored", False, COMPARED_IMPACTS),
    "gram_pinv, as printed": ("gram_pinv", None, COMPARED_IMPACTS),
}


def _gains(study: Study, name: str) -> Iterator[Row]:
    method, clamp, impacts = METHODS[name]
    for row in bulk_impacts(impacts[study.depth], SEED, method, clamp).by_condition():
        yield {"method": name, **row}


def _gains_say(table: Table) -> Iterator[Part]:
    totals = {row["method"]: row for row in table.where(**{"condition of M from": "all"}).records()}
    ours, printed = totals.get("factored"), totals.get("gram_pinv, as printed")
    if ours and printed:
        most = (
            " never adds energy"
            if ours[GAIN] <= 0.0
            else f"'s largest relative energy gain is {ours[GAIN]:.1e}, {ours[SHARE]:.2g} of its bound 10 d ε √κ(M)"
        )
        yield Part(
            f"In {ours['impacts']:,} random impacts, of up to 30 coordinates and 100 contacts, the "
            f"engine{most}. In {printed['impacts']:,} of them the paper's formula, computed as "
            f"printed, adds at "
            f"worst {printed[GAIN]:.2g} times the kinetic energy before the impact.",
            REPRODUCED if ours[ABOVE] == 0 else REFUTED,
        )


energy_gains = Topic(
    key="energy-gains",
    title="Passive in floating point",
    question="Does rounding make energy?",
    checks=(
        Check(
            key="impacts",
            question="How much energy do random impacts gain, with and without the clamp, and as printed?",
            cases=lambda study: METHODS,
            row=_gains,
            says=_gains_say,
            digits=3,
            note="1 to 30 coordinates d, 0 to 100 contacts, rows of any rank, e in [−1, 1]. The "
            "entries of v, or of Lᵀv "
            "with M = L Lᵀ, are normally distributed. Energies are computed in double-double. “No "
            "clamp” also omits the "
            "refinement, a correction for the rounding of L.",
        ),
    ),
    says=lambda tables, parts: " ".join(part.sentence for part in parts),
)


def counterexamples(progress: Progress, failures: list[Failure]) -> tuple[Finding, ...]:
    """Return inputs that break a law: for the printed formula, for one restitution per contact, and
    for saturation."""
    makers = (printed_formula, restitution_per_contact, saturation)
    return tuple(
        of_each(
            counted(makers, progress),
            lambda make: [make()],
            failures,
            lambda make: make.__name__.replace("_", " "),
        )
    )


def printed_formula() -> Finding:
    """Return the kit's counterexample to equations (20)-(21) as printed (`gram_pinv`), checked in
    exact rationals."""
    report, verdict, case, given = _found(gram_pinv, "kinetic_energy", impacts=COUNTER_IMPACTS)
    gain = relative_energy_gain(case.mass_matrix, case.velocity, given["v⁺ as computed"])
    exact = exact_impact(
        case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution
    ).rounded_velocity
    sentence = (
        f"With {case.contacts} rows, {case.coordinates} coordinates and e = {case.restitution:g}, "
        f"formula (21) as "
        f"printed adds {gain:.2g} of the kinetic energy (computed exactly). Asked for "
        f"{COUNTER_IMPACTS} impacts, "
        f"check_passivity tested this law on {verdict.checked:,}, with difficult ones and those "
        f"of other laws. "
        f"{verdict.failures} of them gained energy, at most {verdict.largest:.2g} of the energy "
        f"before."
    )
    return counterexample(
        "gram_pinv",
        verdict.statement,
        sentence,
        given | {"v⁺ exact, rounded": exact},
        report.counterexample_test,
    )


def restitution_per_contact() -> Finding:
    """Return the counterexample to the obvious extension of (15): equalities with one restitution
    per row."""
    report, verdict, case, given = _found(
        planted.each_contact_its_own_restitution,
        "unequal_kinetic_energy",
        impacts=COUNTER_IMPACTS // 2,
        unequal_restitution=True,
        laws=["unequal_kinetic_energy"],
    )
    gain = relative_gain(case.mass_matrix, case.velocity, given["v⁺ as computed"])
    sentence = (
        "Equalities with one restitution per contact, J v⁺ = −E J v⁻ with E = diag(e), multiply "
        "the kinetic energy by "
        f"{1.0 + gain:.3g}. The function check_passivity found and simplified this case. If "
        f"restitutions differ, the "
        "engine uses Poisson's law (two LCPs), which is passive."
    )
    return counterexample(
        "J v⁺ = −E J v⁻", verdict.statement, sentence, given, report.counterexample_test
    )


def _found(
    resolver: Any, law: str, **how: Any
) -> tuple[PassivityReport, LawVerdict, ImpactCase, dict[str, Any]]:
    """The kit's report on a resolver that breaks the law, its verdict, the counterexample, and that
    case by name."""
    report = check_passivity(resolver, search=SEARCH, **how)
    case = report.counterexample
    if case is None or report.counterexample_law != law:
        raise IapbError(
            f"in {how['impacts']} random impacts and the adverse ones the resolver breaks no law {law!r}"
        )
    return (
        report,
        report.verdict(law),
        case,
        _arrays(case) | {"v⁺ as computed": resolver(*case.given())},
    )


def saturation() -> Finding:
    """Return the counterexample to clipping an impulse component by component (section VI)."""
    case = engine.saturation_counterexample()
    check = engine.ENGINE_LAWS["device_limits"].check
    clipped, fitted = check(case, engine.saturated), check(case, engine.scaled)
    _, force = engine.saturated(case.impulse, case.dt, case.force_limit)
    sentence = (
        f"A device that clips each component of an impulse on its own gains {clipped.value:.2%} "
        f"of its kinetic energy, "
        f"while the tool loses energy. If one factor scales the whole impulse, both lose "
        f"{-fitted.value:.2%}."
    )
    given = {
        **_arrays(case.impact),
        "impulse [N s]": case.impulse,
        "force limit [N]": case.force_limit,
        "impulse the device renders [N s]": case.dt * force,
    }
    return counterexample(
        "saturate", "an impulse cut to the device's limits is passive", sentence, given
    )


def counterexample(
    who: str, law: str, sentence: str, given: Mapping[str, Any], test: str = ""
) -> Finding:
    """Return the Finding for a broken law, with the input and the answer by name and the source of
    a test, if any."""
    details = {name: str(np.asarray(array).tolist()) for name, array in given.items()}
    return Finding(who, who, law, sentence, REFUTED, details={**details, "test": test})


def _arrays(case: ImpactCase) -> dict[str, Any]:
    return {
        "M": case.mass_matrix,
        "J": case.contact_jacobian,
        "v⁻": case.velocity,
        "e": case.given_restitution(),
    }
