"""Friction: a mass on a plane by hand, and the two cone solvers against each other and their residuals."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from reference.complementarity import SOLVERS, ImpactProblem, Solution, solve, solver_names
from reference.complementarity.solution import (
    distance_to_cone,
    distance_to_dual_cone,
    project_on_cone,
)

CONE_SOLVERS = ("nsgs", "cvxpy_socp", "pinocchio_pgs", "pinocchio_admm")


def mass_on_a_plane(v: list[float], mu: float, relaxed: bool = False) -> ImpactProblem:
    """A point mass of 2 kg; the contact's frame is (normal, two tangents)."""
    return ImpactProblem.from_impact(2.0 * np.eye(3), np.eye(3), v, 0.0, mu, relaxed=relaxed)


@pytest.mark.parametrize("solver", CONE_SOLVERS)
def test_a_mass_sticks_or_slides_as_coulomb_says(solver: str) -> None:
    sticks = solve(mass_on_a_plane([-1.0, 0.2, 0.1], 0.5), solver)
    slides = solve(mass_on_a_plane([-1.0, 3.0, 4.0], 0.5), solver)
    assert sticks.solved(1e-8) and np.abs(sticks.velocity_plus).max() <= 1e-8
    # the friction impulse 0.5 · 2 N s takes 0.5 m/s off the 5 m/s of sliding, along its direction
    assert slides.solved(1e-7)
    assert slides.velocity_plus == pytest.approx([0.0, 2.7, 3.6], abs=1e-6)


RELAXED_SOLVERS = ("nsgs", "cvxpy_socp", "pinocchio_admm")


@pytest.mark.parametrize("solver", RELAXED_SOLVERS)
def test_the_relaxed_law_lifts_off_where_it_slides(solver: str) -> None:
    """What the convex relaxation costs: sliding bodies separate with mu times their sliding speed."""
    solution = solve(mass_on_a_plane([-1.0, 3.0, 4.0], 0.5, relaxed=True), solver)
    v = solution.velocity_plus
    assert solution.solved(1e-7)
    assert v[0] == pytest.approx(0.5 * np.hypot(v[1], v[2]), rel=1e-6) and v[0] > 0.1


@pytest.mark.parametrize("relaxed", [True, False])
def test_solvers_agree_on_random_problems(relaxed: bool) -> None:
    for seed in range(6):
        rng = np.random.default_rng(seed)
        k = int(rng.integers(1, 4))
        root = rng.normal(size=(6, 6))
        problem = ImpactProblem.from_impact(
            root @ root.T + np.eye(6),
            rng.normal(size=(3 * k, 6)),
            rng.normal(size=6),
            0.2,
            0.3,
            relaxed=relaxed,
        )
        solutions = [solve(problem, name) for name in (RELAXED_SOLVERS if relaxed else CONE_SOLVERS)]
        for solution in solutions:
            assert solution.solved(1e-5), (seed, solution.solver, solution.note, solution.residuals)
        if relaxed:  # convex: one velocity; Coulomb's law may have several
            first, *others = (solution.velocity_plus for solution in solutions)
            assert all(np.abs(first - other).max() <= 1e-5 for other in others)


def test_relaxed_and_coulomb_answers_are_not_taken_for_each_other() -> None:
    coulomb = mass_on_a_plane([-1.0, 3.0, 4.0], 0.5)
    relaxed = mass_on_a_plane([-1.0, 3.0, 4.0], 0.5, relaxed=True)
    assert not Solution(coulomb, solve(relaxed, "nsgs").impulse).solved(1e-3)
    assert not Solution(relaxed, solve(coulomb, "nsgs").impulse).solved(1e-3)


def test_kinds_of_problems_are_refused_by_solvers_of_the_other_kind() -> None:
    here = solver_names(mass_on_a_plane([1.0, 0.0, 0.0], 0.5))
    assert tuple(name for name in here if not SOLVERS[name].of_the_machine) == CONE_SOLVERS
    assert solve(mass_on_a_plane([-1.0, 0.0, 0.0], 0.5), "daqp").verdict() == "refused"
    assert solve(mass_on_a_plane([-1.0, 1.0, 0.0], 0.5, relaxed=True), "pinocchio_pgs").verdict() == "refused"
    assert solve(ImpactProblem.from_delassus([[1.0]], [-1.0]), "nsgs").verdict() == "refused"


@hypothesis_settings(max_examples=50)
@given(st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3), st.floats(0.0, 2.0))
def test_projection_obeys_moreau(x: list[float], mu: float) -> None:
    """x = proj_K(x) − proj_K*(−x), the two parts orthogonal, each in its cone."""
    point, friction = np.array([x]), np.array([mu])
    inside = project_on_cone(point, friction)
    rest = inside - point  # lies in the dual cone
    assert distance_to_cone(inside, friction)[0] <= 1e-12
    assert abs((inside * rest).sum()) <= 1e-12
    assert distance_to_dual_cone(rest, friction)[0] <= 1e-12
