"""Impact laws against one another and against what is known of them."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.errors import SolverError
from reference.complementarity import ImpactProblem
from reference.complementarity.laws import newton_equality, newton_lcp, poisson, unpushed_share
from reference.complementarity.solvers import qp
from reference.exact import relative_energy_gain
from reference.rigid_step import STEP_SOLVERS, nearest_velocity


def random_problem(seed: int, contacts: int, e: object) -> ImpactProblem:
    """An impact whose contacts all approach: v is drawn, then rows are turned against it."""
    rng = np.random.default_rng(seed)
    d = int(rng.integers(1, 7))
    root = rng.normal(size=(d, d))
    v = rng.normal(size=d)
    rows = rng.normal(size=(contacts, d))
    rows *= -np.sign(rows @ v)[:, None]
    return ImpactProblem.from_impact(root @ root.T + 0.1 * np.eye(d), rows, v, e)


def gain(problem: ImpactProblem, v_plus: np.ndarray) -> float:
    return relative_energy_gain(problem.mass_matrix, problem.velocity, v_plus)


@given(st.integers(0, 100_000), st.floats(0.0, 1.0))
def test_equality_is_the_complementarity_solution_exactly_where_it_need_not_pull(
    seed: int, e: float
) -> None:
    """The wider class of C05: one e, and *some* p >= 0 gives the equality's motion, which then
    solves the LCP."""
    problem = random_problem(seed, 1 + seed % 8, e)
    rows = problem.contact_jacobian
    equality = newton_equality(problem)
    distance = np.abs(newton_lcp(problem).velocity - equality.velocity).max()
    lower = np.linalg.cholesky(problem.mass_matrix)
    columns = np.linalg.solve(lower, rows.T)
    pull = unpushed_share(columns, columns @ equality.impulse)
    if pull > 1e-9:  # nnls ends near 1e-13 for impulses that push
        assert distance > 0.0 or pull < 1e-7
    else:
        assert distance <= 1e-8 * np.linalg.cond(problem.factor) * np.abs(problem.velocity).max()


@given(st.integers(0, 100_000))
def test_sound_laws_never_gain_energy_with_unequal_restitution(seed: int) -> None:
    contacts = 1 + seed % 5
    problem = random_problem(seed, contacts, np.random.default_rng(seed).uniform(size=contacts))
    assert gain(problem, poisson(problem).velocity) <= 1e-11
    # Newton's velocities can be infeasible; Poisson always has a solution
    with suppress(SolverError):
        assert gain(problem, newton_lcp(problem).velocity) <= 1e-11


def test_contradicting_equalities_are_an_error() -> None:
    problem = ImpactProblem.from_impact(np.eye(1), [[1.0], [1.0]], [-1.0], [1.0, 0.0])
    with pytest.raises(SolverError, match="contradicting"):
        newton_equality(problem)
    assert poisson(problem).velocity[0] >= 0.0


def test_laws_and_steps_go_on_where_daqp_cycles(monkeypatch: pytest.MonkeyPatch) -> None:
    """The Newton LCP, Poisson and steps ask other solvers, and say so where
    none is left."""
    problem = random_problem(7, 8, 0.5)

    def outcomes() -> list[np.ndarray]:
        step = nearest_velocity(
            problem.mass_matrix, problem.velocity, problem.contact_jacobian, np.zeros(8)
        )
        return [
            newton_lcp(problem).velocity,
            poisson(problem).velocity,
            step.velocity,
        ]

    def cycle(*_: object) -> np.ndarray:
        raise SolverError("daqp: exit flag -2")

    usual = outcomes()
    monkeypatch.setattr(qp, "daqp", cycle)
    monkeypatch.setitem(STEP_SOLVERS, "daqp", cycle)
    assert all(
        found == pytest.approx(expected, abs=1e-9)
        for found, expected in zip(outcomes(), usual, strict=True)
    )
    with pytest.raises(SolverError, match="exit flag -2"):
        newton_lcp(problem, "daqp")


def test_poissons_law_on_dependent_rows_of_both_signs() -> None:
    """What compression stops leaves rounding in opposed rows, which no solver can meet: it is
    judged by the speeds."""
    for seed in range(12):
        rng = np.random.default_rng(seed)
        rows = rng.integers(-2, 3, size=(60, 3)).astype(float) @ rng.integers(-2, 3, size=(3, 5))
        v = rng.normal(size=5)
        e = (0.0, 0.5, 1.0)[seed % 3]
        outcome = poisson(ImpactProblem.from_impact(np.eye(5), rows, v, e))
        assert outcome.residual <= 1e-12
        assert outcome.velocity @ outcome.velocity <= v @ v * (1.0 + 1e-12)
        assert np.min(rows @ outcome.velocity) >= -1e-12
