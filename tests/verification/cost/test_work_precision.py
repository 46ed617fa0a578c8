"""Accuracy against time: the problems have one truth for all methods, and the records hide nothing."""

from __future__ import annotations

import numpy as np
import pytest

from verification.cost.impacts import METHODS, work_precision
from verification.impacts import timed_problems


@pytest.mark.parametrize("problem", timed_problems(), ids=lambda problem: problem.label)
def test_equalities_and_complementarity_have_the_same_answer(problem: object) -> None:
    """Impulses that push only solve the equalities, as far as v in doubles knows its nearly dependent directions."""
    J, v, e = problem.contact_jacobian, problem.velocity, problem.restitution
    truth = np.array([float(x) for x in problem.truth])
    momentum = problem.mass_matrix @ (truth - v)
    from scipy.optimize import nnls

    push, left = nnls(J.T, momentum, maxiter=10_000)
    assert push.min() >= 0.0
    known = 2.0**-52 * np.sqrt(problem.mass_condition) / problem.closeness
    assert left <= (1e-9 + 100.0 * known) * np.linalg.norm(momentum)
    assert np.abs(J @ truth + e * (J @ v)).max() <= 1e-12 * np.abs(J).max() * np.abs(v).max()


def test_a_small_study_is_complete_and_ordered() -> None:
    problems = timed_problems(("contacts",))[:2]
    seen: list[tuple[int, int]] = []
    found = work_precision(problems, rounds=4, progress=lambda done, of: seen.append((done, of)))
    assert [row[:2] for row in found.rows] == [(m, p.label) for p in problems for m in METHODS]
    assert seen == [(1, 2), (2, 2)]
    assert set(found.column("outcome")) == {"ok"} and min(found.column("time")) > 0.0
    errors = dict(found.where(problem=problems[0].label).select(("method", "relative error")).rows)
    assert errors["factored"] < 1e-14 and errors["svd"] < 1e-13
    assert errors["factored"] < errors["cvxpy QP"] < errors["factored, 2 rows"] < errors["factored, 1 row"]
    assert set(found.column("relative energy gain")) == {0.0}


def test_a_failure_is_recorded_with_its_reason() -> None:
    """More contacts than coordinates: the Cholesky of W refuses, and the row says so."""
    row = work_precision(timed_problems(("contacts",))[2:3], ["gram_cholesky"], rounds=3).records()[0]
    assert row["outcome"].startswith("failed: ") and "independent rows" in row["outcome"]
    assert row["relative error"] is row["time"] is None
    assert row["failed after"] > 0.0
