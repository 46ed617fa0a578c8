"""Stage: the smallest inputs that break a law: found and shrunk by the kit, or made by hand where that says more."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from iapb import resolve_impact
from iapb.errors import IapbError
from reference.exact import exact_impact, relative_energy_gain
from reports.pages.records import Counterexample
from verification.finding import Failure, attempt
from verification.laws import check_passivity
from verification.laws.engine_laws import device_limits as law
from verification.laws.impact_laws import relative_gain
from verification.laws.planted import each_contact_its_own_restitution as resolver

IMPACTS, SEARCH = 500, 300


def compute(progress: Callable[[int, int], None], failures: list[Failure]) -> tuple[Counterexample, ...]:
    """The printed formula, a restitution per contact as equalities, and saturation."""
    makers = (printed_formula, restitution_per_contact, saturation)
    records = []
    for done, make in enumerate(makers):
        progress(done, len(makers))
        records.append(attempt(make.__name__.replace("_", " "), make, failures))
    progress(len(makers), len(makers))
    return tuple(record for record in records if record is not None)


def printed_formula() -> Counterexample:
    """Equations (20)-(21) to the letter, `gram_pinv`: what the kit finds by itself, judged in exact rationals."""
    resolver = partial(resolve_impact, method="gram_pinv")
    report = check_passivity(resolver, impacts=IMPACTS, search=SEARCH)
    verdict, case = report.verdict("kinetic_energy"), report.counterexample
    if case is None or report.counterexample_law != "kinetic_energy":
        raise IapbError(f"the kit found no gain of the printed formula in {IMPACTS} impacts and the adverse ones")
    answer = resolver(case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution).velocity
    gain = relative_energy_gain(case.mass_matrix, case.velocity, answer)
    exact = exact_impact(case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution).rounded_velocity
    sentence = (
        f"The formula as printed gains {gain:.2g} of the kinetic energy, in exact rationals, on {case.contacts} rows "
        f"of {case.coordinates} coordinates with e = {case.restitution:g}. The kit found and shrank it by itself; of "
        f"{verdict.checked} impacts {verdict.failures} gained energy, the largest {verdict.largest:.2g}."
    )
    given = (*_arrays(case), ("v⁺ as computed", _text(answer)), ("v⁺ exact, rounded", _text(exact)))
    return Counterexample("gram_pinv", verdict.statement, sentence, given, report.counterexample_test)


def restitution_per_contact() -> Counterexample:
    """Newton's law as equalities with a restitution per row: erratum of whoever extends (15) in the obvious way."""
    report = check_passivity(resolver, impacts=IMPACTS // 2, search=SEARCH, unequal_restitution=True)
    verdict, case = report.verdict("unequal_kinetic_energy"), report.counterexample
    if case is None:
        raise IapbError("the kit found no gain of one restitution per contact, which exact arithmetic says is there")
    answer = resolver(case.mass_matrix, case.contact_jacobian, case.velocity, case.given_restitution())
    sentence = (
        f"One restitution per contact, as equalities J v⁺ = −E J v⁻, multiplies the kinetic energy by "
        f"{1.0 + relative_gain(case, answer):.3g}. The kit found and shrank it; Poisson's law by two LCPs, which the "
        "engine uses where restitutions differ, is passive."
    )
    given = (*_arrays(case), ("v⁺ as computed", _text(answer)))
    return Counterexample("J v⁺ = −E J v⁻", verdict.statement, sentence, given, report.counterexample_test)


def saturation() -> Counterexample:
    """Section VI: clipping an impulse component by component."""
    case = law.saturation_counterexample()
    clipped = law.limited_impulses_are_passive(case, law.saturated)
    scaled = law.limited_impulses_are_passive(case, law.ours)
    _, force = law.saturated(case.impulse, case.dt, case.force_limit)
    sentence = (
        f"A device that clips an impulse component by component gains {clipped.value:.2%} of its kinetic energy where "
        f"the tool loses some; with one factor for the whole impulse both lose {-scaled.value:.2%}."
    )
    given = (
        *_arrays(case.impact), ("impulse [N s]", _text(case.impulse)),
        ("force limit [N]", _text(case.force_limit)), ("impulse the device renders [N s]", _text(case.dt * force)),
    )  # fmt: skip
    return Counterexample("saturate", "an impulse cut to the device's limits is passive", sentence, given)


def _arrays(case: Any) -> tuple[tuple[str, str], ...]:
    e = case.restitution if case.unequal is None else case.unequal
    return (("M", _text(case.mass_matrix)), ("J", _text(case.contact_jacobian)), ("v⁻", _text(case.velocity)),
            ("e", _text(np.asarray(e))))  # fmt: skip


def _text(array: np.ndarray) -> str:
    return str(array.tolist())
