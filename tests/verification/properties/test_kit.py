"""The kit passes sound resolvers, finds what is wrong in others by itself, and says it so that one can paste it."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from iapb import Impact, resolve_impact
from verification import check_passivity
from verification.properties import LAWS, PLANTED_BUGS, sound_resolver
from verification.properties.bounds import FACTORED, KIT
from verification.properties.case import ImpactCase
from verification.properties.laws.kinetic_energy import relative_gain


@pytest.mark.parametrize("resolver", [sound_resolver, resolve_impact, partial(resolve_impact, method="svd")])
def test_sound_resolvers_pass(resolver: object) -> None:
    report = check_passivity(resolver, impacts=200)
    assert report.passed, report
    assert report.counterexample is None and report.counterexample_test == ""
    assert all(verdict.checked > 0 for verdict in report.verdicts)
    assert report.worst.worst.ratio <= 1.0


def test_our_resolver_keeps_its_own_bounds_on_wider_families() -> None:
    report = check_passivity(resolve_impact, impacts=200, bounds=FACTORED, largest_condition=1e10)
    assert report.passed, report


@pytest.mark.parametrize("name", PLANTED_BUGS)
def test_every_planted_bug_is_caught_by_its_law(name: str) -> None:
    bug = PLANTED_BUGS[name]
    report = check_passivity(bug.make(), impacts=150, search=0)
    assert not report.passed
    assert bug.caught_by in report.broken_laws, report


def test_the_printed_formula_is_found_to_gain_energy() -> None:
    """Above 1e-6 and by itself, with a small counterexample that still shows it."""
    printed = partial(resolve_impact, method="gram_pinv")
    report = check_passivity(printed, impacts=500, search=60)
    assert report.verdict("kinetic_energy").largest > 1e-6
    case = report.counterexample
    assert report.counterexample_law == "kinetic_energy"
    assert case.coordinates <= 3 and case.contacts <= 3
    answer = printed(case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution)
    assert isinstance(answer, Impact)
    assert relative_gain(case, answer.velocity) > 1e-6


def test_the_counterexample_can_be_pasted() -> None:
    resolver = PLANTED_BUGS["wrong_sign"].make()
    report = check_passivity(resolver, impacts=50, search=50)
    scope = {"np": np, "ImpactCase": ImpactCase, "LAWS": LAWS, "KIT": KIT, "resolver": resolver}
    exec(report.counterexample_test, scope)
    with pytest.raises(AssertionError, match="kinetic_energy"):
        scope["test_kinetic_energy"]()
    scope["resolver"] = sound_resolver
    scope["test_kinetic_energy"]()


def test_the_report_reads_as_text() -> None:
    report = check_passivity(PLANTED_BUGS["squared_restitution"].make(), impacts=50, search=0)
    text = str(report)
    assert "FAILED on 50 impacts" in text
    assert "BROKEN J v⁺ = −e J v⁻" in text and "kept   KE⁺ ≤ KE⁻" in text


@pytest.mark.parametrize(
    ("answer", "complaint"),
    [
        (lambda M, J, v, e: v[:-1], "shape"),
        (lambda M, J, v, e: v * np.nan, "not finite"),
        (lambda M, J, v, e: "fast", "returned"),
        (lambda M, J, v, e: 1 / 0, "ZeroDivisionError"),
    ],
)
def test_a_resolver_that_gives_nothing_usable_fails_with_its_complaint(answer: object, complaint: str) -> None:
    report = check_passivity(answer, impacts=5, search=0)
    assert not report.passed
    assert complaint in report.verdict("kinetic_energy").fault


def test_a_resolver_that_writes_on_its_input_harms_nobody() -> None:
    def in_place(M: np.ndarray, J: np.ndarray, v: np.ndarray, e: float) -> np.ndarray:
        v[:] = sound_resolver(M, J, v, e)
        return v

    assert check_passivity(in_place, impacts=60, search=0).passed


def test_the_same_seed_gives_the_same_report() -> None:
    first, second = (check_passivity(sound_resolver, impacts=40, seed=3) for _ in range(2))
    assert [v.worst for v in first.verdicts] == [v.worst for v in second.verdicts]
