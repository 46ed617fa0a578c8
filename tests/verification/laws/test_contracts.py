"""Contracts of resolvers whose contacts only push: textbook ones pass, each planted bug fails by
its law's name."""

from __future__ import annotations

import pickle
from functools import partial

import numpy as np
import pytest

from iapb import resolve_frictional_impact, resolve_impact
from iapb.errors import ArgumentError
from reference.complementarity.solvers.qp import daqp
from tests.verification.laws.faults import PUSHING, newton, no_friction, returns_too_much
from verification import check_passivity
from verification.impacts import ImpactCase
from verification.laws import CONTRACTS, contracts, sound_resolver
from verification.laws.bounds import ONE_SIDED
from verification.laws.contracts import UNILATERAL_LAWS, distance_from_cone


@pytest.mark.parametrize(("contract", "name"), PUSHING)
def test_every_planted_bug_is_caught_by_its_law(contract: str, name: str) -> None:
    law, resolver = PUSHING[contract, name]
    report = check_passivity(resolver, contract=contract, laws=[law], impacts=80, search=0)
    assert report.broken_laws == (law,)
    with pytest.raises(AssertionError, match=law):
        exec(report.counterexample_test + f"\n\ntest_{law}()", {"resolver": resolver})


def test_a_push_along_nearly_opposed_rows_is_no_pull_and_a_pull_is_one() -> None:
    """Non-negative least squares end 2e-7 before the first; a target opposite to every row is at its
    own distance."""
    rng = np.random.default_rng(98)
    rows = rng.normal(size=(6, 4))
    for i in range(4):
        opposed = rows[4] + rows[5] if i % 2 else rows[4]
        rows[i] = 3e-5 * rng.normal(size=4) - opposed
    pushed = rows.T @ rng.random(6)
    pushed /= np.linalg.norm(pushed)
    assert not distance_from_cone(ImpactCase(np.eye(4), rows, -pushed, 0.0), pushed) > 1e-7
    rows = np.abs(rng.normal(size=(3, 4)))
    pulled = -rows.sum(axis=0) / np.linalg.norm(rows.sum(axis=0))
    assert distance_from_cone(ImpactCase(np.eye(4), rows, -pulled, 0.0), pulled) == pytest.approx(
        1.0
    )


def test_a_wrong_answer_of_daqp_is_no_closest_point(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither accuses nor acquits: the solver is among those that the kit judges."""
    rng = np.random.default_rng(5)
    rows = rng.normal(size=(5, 4))
    targets = rng.normal(size=(40, 4))
    nearest = [contracts.pushed(rows, target) for target in targets]
    assert np.isfinite(nearest).all()

    def weaker(rows: np.ndarray, offset: np.ndarray) -> np.ndarray:
        p = daqp(rows, offset)
        p[:-1][p[:-1].argmax()] *= 0.9
        return p

    monkeypatch.setattr(contracts, "daqp", weaker)
    for right, target in zip(nearest, targets, strict=True):
        found = contracts.pushed(rows, target)
        assert np.isnan(found).all() if right.any() else not found.any()


def test_a_contact_that_is_left_approaching_slower_is_driven_in() -> None:
    case = ImpactCase(np.eye(1), np.eye(1), np.array([-1.0]), 0.5)
    residual = UNILATERAL_LAWS["no_penetration"].check(case, lambda M, J, v, e: 0.4 * v, ONE_SIDED)
    assert residual is not None and not residual.passed


def test_the_engines_friction_keeps_what_holds_for_equalities() -> None:
    """`resolve_frictional_impact` takes every normal as an equality, so it may pull and holds what
    separates.

    A contact that pushes only because of the friction at another one slides without friction, in
    few impacts: `maximal_dissipation` is not asked.
    """
    broken = ("cone", "separating")
    apart = (*broken, "maximal_dissipation")
    kept = [name for name in CONTRACTS["frictional"].laws if name not in apart]  # exact_energy too
    assert check_passivity(
        resolve_frictional_impact, contract="frictional", laws=kept, impacts=100
    ).passed
    report = check_passivity(
        resolve_frictional_impact, contract="frictional", laws=broken, impacts=100, search=0
    )
    assert set(report.broken_laws) == set(broken)


def test_gains_in_real_arithmetic_are_found() -> None:
    """The engine gains in no bit; a sound resolver by rounding."""
    exact = {"laws": ["exact_energy"], "impacts": 100, "search": 0}
    assert check_passivity(resolve_impact, **exact).passed
    assert check_passivity(
        partial(resolve_impact, method="poisson"), contract="unilateral", **exact
    ).passed
    both = {"laws": ["exact_energy", "kinetic_energy"], "impacts": 100, "search": 0}
    assert check_passivity(sound_resolver, **both).broken_laws == ("exact_energy",)
    assert set(check_passivity(returns_too_much, **both).broken_laws) == set(both["laws"])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"contract": "one-sided"}, "expected one of equality, unilateral, frictional"),
        ({"laws": ["pushin"], "contract": "unilateral"}, "did you mean pushing?"),
        ({"laws": 1}, "laws = 1: expected names of laws"),
        (
            {"contract": "frictional", "unequal_restitution": True},
            "False with contract 'frictional'",
        ),
        ({"call_limit": 0.0}, "call_limit = 0.0: expected seconds above 0"),
    ],
)
def test_what_would_judge_nothing_is_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        check_passivity(newton, **options)
    assert message in str(caught.value)


def test_a_broken_report_raises_with_the_matrices_and_what_came_back() -> None:
    report = check_passivity(
        sound_resolver, contract="unilateral", laws=["pushing"], impacts=30, search=30
    )
    with pytest.raises(AssertionError) as caught:
        report.raise_if_broken()
    text = str(caught.value)
    assert all(f"\n  {name} = " in text for name in ("M", "J", "v", "e", "returned"))
    assert "def test_pushing():" in text and str(report) == repr(report) == text
    asked = ["pushing", "kinetic_energy"]
    report = check_passivity(newton, contract="unilateral", laws=asked, impacts=3)
    report.raise_if_broken()
    assert [verdict.law for verdict in report.verdicts] == asked[::-1]  # in the contract's order
    assert pickle.loads(pickle.dumps(report)) == report  # travels between processes


def test_a_counterexample_with_friction_shrinks_to_one_contact() -> None:
    report = check_passivity(
        no_friction, contract="frictional", laws=["sticking"], impacts=60, search=60
    )
    case = report.counterexample
    assert (
        case.contacts == 1
        and case.tangents.shape == (1, 1, case.coordinates)
        and case.coordinates == 2
    )
    assert "  T = [[[" in report and "  μ = [" in report
