"""Accuracy against time: the problems have one truth for all methods, and the records hide nothing."""

from __future__ import annotations

import numpy as np
import pytest

from verification.cost.kernels import kernel_times
from verification.cost.measure import METHODS, work_precision
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
    records = work_precision(problems, rounds=4, progress=lambda done, of: seen.append((done, of)))
    assert [(r.label, r.method) for r in records] == [(p.label, m) for p in problems for m in METHODS]
    assert seen == [(1, 2), (2, 2)]
    for record in records:
        assert record.status == "ok" and record.note == ""
        assert 0.0 < record.seconds.lower <= record.seconds.median <= record.seconds.upper
        assert record.seconds.rounds >= 3
    errors = {r.method: r.forward_error for r in records if r.contacts == 4}
    assert errors["factored"] < 1e-14 and errors["svd"] < 1e-13
    assert errors["factored"] < errors["cvxpy QP"] < errors["factored, 2 rows"] < errors["factored, 1 row"]
    assert all(r.energy_gain < 0.0 for r in records)


def test_a_failure_is_recorded_with_its_reason() -> None:
    """More contacts than coordinates: the Cholesky of W refuses, and the record says so."""
    record = work_precision(timed_problems(("contacts",))[2:3], ["gram_cholesky"], rounds=3)[0]
    assert record.status == "failed"
    assert "independent rows" in record.note
    assert np.isnan(record.forward_error) and np.isnan(record.seconds.median) and record.seconds.rounds == 0
    assert record.failed_after > 0.0


def test_kernel_times_speak_of_the_sizes_asked_for() -> None:
    """Times themselves are never judged by a test: that is for `iapb bench`."""
    small, large = kernel_times(((3, 4), (12, 300)), rounds=3)
    assert [(found.coordinates, found.contacts) for found in (small, large)] == [(3, 4), (12, 300)]
    for found in (small, large):
        assert found.factored.rounds == found.printed.rounds == 3
        assert found.ratio == found.printed.median / found.factored.median
