"""The default method is stable on every hard case, and the verdicts tell methods apart."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from verification.hard_cases import HARD_CASES, judge_hard_case
from verification.hard_cases.poisson import exact_poisson
from verification.hard_cases.verdict import WITHOUT_CLAMP


@pytest.mark.parametrize("name", HARD_CASES)
def test_the_default_method_is_stable(name: str) -> None:
    case = HARD_CASES[name]()
    verdict = judge_hard_case(case, "factored")
    assert verdict.is_stable, verdict
    assert verdict.rank == verdict.exact_rank


@pytest.mark.parametrize("name", HARD_CASES)
def test_every_case_says_what_it_is(name: str) -> None:
    case = HARD_CASES[name]()
    assert min(map(len, (case.name, case.source, case.why_hard, case.expected))) > 5
    assert case.contact_jacobian.shape[1] == len(case.velocity) == len(case.mass_matrix)
    assert len({HARD_CASES[other]().name for other in HARD_CASES}) == len(HARD_CASES)


@pytest.mark.parametrize(
    ("name", "method", "verdict"),
    [
        ("mass_ratio", "gram_pinv", "gains energy"),
        ("printed_formula_gains", "gram_pinv", "restitution unmet"),
        ("nearly_parallel_normals", "damped", "restitution unmet"),
        ("tiny_lever_arm", "gram_pinv", "wrong motion"),
        ("hilbert_rows", "gram_cholesky", "refused"),
        ("light_direction", WITHOUT_CLAMP, "gains energy"),
    ],
)
def test_the_verdict_can_be_other_than_stable(name: str, method: str, verdict: str) -> None:
    judged = judge_hard_case(HARD_CASES[name](), method)
    assert judged.verdict == verdict, judged
    assert not judged.is_stable


def test_the_clamp_costs_restitution_less_than_it_saves_energy() -> None:
    case = HARD_CASES["light_direction"]()
    clamped, free = judge_hard_case(case, "factored"), judge_hard_case(case, WITHOUT_CLAMP)
    assert clamped.energy_gain <= clamped.energy_bound < free.energy_gain


def test_the_face_keeps_its_sliding_exactly_in_the_truth() -> None:
    truth = HARD_CASES["face_at_three_points"]().truth
    tangent = (Fraction(4, 5), Fraction(3, 5))
    sliding = tangent[0] * truth.velocity[0] + tangent[1] * truth.velocity[1]
    assert abs(sliding - 3) < Fraction(1, 10**14)  # the velocity itself is given in doubles
    assert truth.rank == 2


def test_poissons_truth_on_the_bar() -> None:
    """Contact 1 alone stops and returns the bar: p_c = 1/(1 + 3) each way, by hand."""
    case = HARD_CASES["bar_with_unequal_restitution"]()
    mass = np.array([[Fraction(1), 0], [0, Fraction(1, 12)]], dtype=object)
    velocity, pushing = exact_poisson(mass, [[1, Fraction(1, 2)], [1, Fraction(2, 5)]], [-1, 0], [1, 0])
    before = Fraction(1, 2)
    after = (velocity[0] ** 2 + velocity[1] ** 2 / 12) / 2
    assert after <= before
    assert velocity[0] + velocity[1] / 2 >= 0 and velocity[0] + 2 * velocity[1] / 5 >= 0
    assert pushing >= 1 and case.truth.rank == pushing


def test_the_truth_of_equal_restitution_is_the_same_by_either_law() -> None:
    """One contact: Poisson's law is Newton's."""
    velocity, _ = exact_poisson([[2]], [[1]], [-3], [Fraction(1, 2)])
    assert velocity == (Fraction(3, 2),)
