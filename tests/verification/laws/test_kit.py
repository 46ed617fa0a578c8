"""The kit passes sound resolvers, finds what is wrong in others by itself, and says it so that one
can paste it."""

from __future__ import annotations

import time
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.optimize import nnls

from iapb import resolve_impact
from reference.exact import relative_energy_gain
from tests.verification.laws.faults import returns_too_much, reversed_velocity
from verification import check_passivity
from verification.impacts import Floats, ImpactCase, adverse_cases
from verification.laws import EXACT_LAWS, PLANTED_BUGS, sound_resolver
from verification.laws.bounds import KIT
from verification.laws.counterexample import as_test, shrink, smaller_impacts
from verification.laws.planted import each_contact_its_own_restitution, wrong_sign
from verification.laws.resolver import Resolver


@pytest.mark.parametrize("law", PLANTED_BUGS)
def test_every_planted_bug_is_caught_by_its_law(law: str) -> None:
    resolver = PLANTED_BUGS[law].make()
    laws = None if law == "arguments" else [law]
    assert check_passivity(resolver, impacts=60, search=0, laws=laws).broken_laws == (law,)


@pytest.mark.parametrize("index", range(3))
def test_shrinking_ends_and_leaves_nothing_to_take(index: int) -> None:
    """The resolver gains in exact rationals, so neither its answers nor the verdicts depend on a
    BLAS."""

    def gains(case: ImpactCase) -> bool:
        after = returns_too_much(*case.arrays, case.restitution)
        return relative_energy_gain(case.mass_matrix, case.velocity, after) > 1e-6

    drawn = list(adverse_cases(np.random.default_rng(5)))[index]
    smallest = shrink(drawn, gains, smaller_impacts)
    assert (smallest.coordinates, smallest.contacts, smallest.restitution) == (1, 1, 1.0)
    assert all(np.array_equal(x, np.round(x, 1)) for x in (smallest.mass_matrix, smallest.velocity))


@pytest.mark.parametrize(
    ("answer", "complaint"),
    [
        (lambda v: v[:-1], "shape"),
        (lambda v: v * np.nan, "not finite"),
        (lambda v: np.full(len(v), np.longdouble("1e400")), "not finite"),
        (lambda v: "fast", "returned"),
        (lambda v: [[1.0], [1.0, 2.0]], "returned list, which is no array"),
        (lambda v: 1 / 0, "ZeroDivisionError"),
    ],
)
def test_a_resolver_that_gives_nothing_usable_fails_with_its_complaint(
    answer: Any, complaint: str
) -> None:
    report = check_passivity(lambda M, J, v, e: answer(v), impacts=5, search=0)
    assert (
        not report.passed
        and complaint in report.verdict("kinetic_energy").fault
        and complaint in report
    )


def test_errors_of_an_iteration_get_a_hint_and_others_none() -> None:
    def iterated(M: Any, J: Any, v: Any, e: Any) -> Any:
        return sound_resolver(M, J, v, e) * (1.0 + 1e-6)

    assert "least=1e-05" in str(check_passivity(iterated, impacts=10, search=0))
    assert "hint" not in str(check_passivity(wrong_sign, impacts=10, search=0))
    assert "hint" not in str(check_passivity(sound_resolver, impacts=10, search=0))


def test_unequal_restitution_is_opt_in() -> None:
    """Newton's equalities with a restitution per row: sound while they are equal, and a gain of
    energy when not."""
    assert check_passivity(each_contact_its_own_restitution, impacts=30).passed
    report = check_passivity(
        each_contact_its_own_restitution,
        impacts=30,
        search=60,
        unequal_restitution=True,
        laws=["unequal_kinetic_energy"],
    )
    assert report.broken_laws == ("unequal_kinetic_energy",)
    assert report.verdict("unequal_kinetic_energy").largest > 0.1
    scope: dict[str, object] = {}
    with pytest.raises(AssertionError, match="kinetic_energy"):
        exec(report.counterexample_test + "\n\ntest_unequal_kinetic_energy()", scope)
    assert scope["resolver"] is each_contact_its_own_restitution


def test_with_unequal_restitution_rows_may_come_in_any_order() -> None:
    """Poisson's law with the impulses of compression that an active set happens to find."""

    def poisson_of_the_active_set(M: Floats, J: Floats, v: Floats, e: Floats | float) -> Floats:
        lower = np.linalg.cholesky(M)
        A = np.linalg.solve(lower, J.T)
        u = lower.T @ v
        returned = u + A @ ((1.0 + e) * nnls(A, -u)[0])
        return np.asarray(np.linalg.solve(lower.T, returned + A @ nnls(A, -returned)[0]))

    how: dict[str, Any] = {"laws": ["unequal_row_order"], "unequal_restitution": True}
    found = check_passivity(
        poisson_of_the_active_set, contract="unilateral", impacts=60, search=0, **how
    )
    assert found.broken_laws == ("unequal_row_order",), found
    poisson = partial(resolve_impact, method="poisson")
    assert check_passivity(poisson, contract="unilateral", impacts=300, search=0, **how).passed
    assert check_passivity(resolve_impact, impacts=100, search=0, **how).passed


def test_a_slow_resolver_ends_unfinished_and_not_passed() -> None:
    def slow(M: np.ndarray, J: np.ndarray, v: np.ndarray, e: float) -> np.ndarray:
        time.sleep(0.02)
        return sound_resolver(M, J, v, e)

    report = check_passivity(slow, impacts=1000, patience=0.2)
    assert not report.passed and report.broken_laws == () and report.impacts < 1000
    assert "NOT FINISHED" in str(report) and "too slow" in str(report)


@pytest.mark.parametrize(
    ("law", "resolver"),
    [
        ("kinetic_energy", wrong_sign),
        ("momentum", PLANTED_BUGS["momentum"].make()),
        ("impulse_range", reversed_velocity),
        ("restitution", partial(resolve_impact, budget=0)),
    ],
)
def test_every_pasted_test_fails_on_its_resolver_and_passes_on_a_sound_one(
    law: str, resolver: Resolver
) -> None:
    report = check_passivity(resolver, impacts=30, search=20, laws=[law])
    for text in (
        report.counterexample_test,
        as_test(report.verdict(law).worst_case, law, resolver=resolver),
    ):
        name = text.split("def ")[1].split("(")[0]
        with pytest.raises(AssertionError):
            exec(f"{text}\n\n{name}()", {})
    exec(
        as_test(report.verdict(law).worst_case, law, resolver=sound_resolver) + f"\n\ntest_{law}()",
        {},
    )


def test_the_exact_law_sees_gains_that_no_double_can_hold() -> None:
    """Relative to KE⁻ they are above 1.8e308, which raised, or below 5e-324, which passed."""
    report = check_passivity(
        lambda M, J, v, e: 1e300 * v, impacts=3, laws=["exact_energy"], search=20
    )
    assert not report.passed and "the law itself raised" not in report
    case = ImpactCase(np.eye(2), np.zeros((0, 2)), np.array([1.0, 0.0]), 0.5, "x")
    exact = EXACT_LAWS["exact_energy"].check
    for gain in (1e-200, 1e200):
        assert not exact(case, lambda M, J, v, e, gain=gain: v + [0.0, gain], KIT).passed
    assert exact(case, lambda M, J, v, e: v - [0.5**53, 0.0], KIT).passed
