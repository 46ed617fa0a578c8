"""The comparison with complementarity sees what it is made to see."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.errors import ArgumentError
from reference.complementarity import ImpactProblem
from reference.complementarity.adhesion import ADHESIVE, NONE
from reference.complementarity.agreement import compare_with_law
from reference.complementarity.laws import newton_equality, newton_lcp

# A bar (m = 1, I = 1/12) that comes down on two contacts at the same side: the equality pulls at the inner one.
PULLING = ImpactProblem.from_impact(np.diag([1.0, 1.0 / 12.0]), [[1.0, 0.5], [1.0, 0.2]], [-1.0, -0.1], 0.0)


def test_the_law_agrees_with_itself() -> None:
    outcome = newton_lcp(PULLING)
    found = compare_with_law(PULLING, outcome.velocity, outcome.impulse)
    assert found.distance == 0.0 and found.adhesion == NONE and found.adhesive_share == 0.0
    assert found.energy_candidate == found.energy_law <= found.energy_before
    assert found.momentum_residual <= 1e-14 and found.approaching == 0


def test_an_equality_that_pulls_is_far_and_adhesive() -> None:
    outcome = newton_equality(PULLING)
    found = compare_with_law(PULLING, outcome.velocity, outcome.impulse)
    assert outcome.impulse.min() < 0.0
    assert found.adhesion == ADHESIVE and found.adhesive_share > 0.0 and found.distance > 0.1
    assert found.momentum_residual <= 1e-14


def test_a_reversal_of_everything_is_caught_by_momentum() -> None:
    """v⁺ = −e v⁻ obeys restitution and passivity; only the range of Jᵀ sees it."""
    problem = ImpactProblem.from_impact(np.eye(2), [[1.0, 0.0]], [-1.0, 0.5], 0.5)
    found = compare_with_law(problem, [0.5, -0.25], [1.5])
    assert found.energy_candidate < found.energy_before and found.approaching == 0
    assert found.momentum_residual > 0.1


def test_nothing_done_leaves_contacts_approaching() -> None:
    assert compare_with_law(PULLING, PULLING.velocity, [0.0, 0.0]).approaching == 2


def test_border() -> None:
    with pytest.raises(ArgumentError, match="one of newton_lcp"):
        compare_with_law(PULLING, [0.0, 0.0], [0.0, 0.0], law="hertz")
    with pytest.raises(ArgumentError, match="from_impact"):
        compare_with_law(ImpactProblem.from_delassus([[1.0]], [-1.0]), [0.0], [0.0])
