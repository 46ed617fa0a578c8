"""The bulk study: the bound on the energy gain holds with the clamp, and is not kept by accident without."""

from __future__ import annotations

import numpy as np
import pytest

from iapb import resolve_impact
from reference.exact import relative_energy_gain
from verification.laws import ImpactCase, bulk_impacts
from verification.laws.bounds import FACTORED

DEPTH = 2000


def test_the_gain_stays_below_ten_d_eps_root_kappa() -> None:
    study = bulk_impacts(DEPTH, seed=1)
    assert study.gain_error.max() < 1e-12
    assert study.above_bound == 0 and study.worst_ratio <= 1.0
    assert study.condition.max() > 1e11 and study.contacts.max() > 90 and study.coordinates.max() > 25
    assert (study.rank < np.minimum(study.contacts, study.coordinates)).any()
    assert study.residual.max() <= 1e-6


def test_without_the_clamp_only_the_bound_of_cholesky_is_reached() -> None:
    study = bulk_impacts(DEPTH, seed=0, clamp=False)
    assert (study.gain <= np.maximum(study.bound, study.cholesky_bound)).all()


def test_the_clamp_is_what_keeps_the_bound() -> None:
    """An impact of written numbers and a resolver without BLAS: the same gain on every processor."""
    T, D = np.array([[1.0, 0.0, 0.0], [-2.0, 1.0, 0.0], [-2.0, 1.0, 1.0]]), np.array([1e-3, 1e-11, 1e-11])
    M = np.sum(T[:, None, :] * D * T[None, :, :], axis=2)
    J, v = np.array([[1.0, 0.0, 3.0]]), np.array([0.0, -2.0, 2.0])
    bound = FACTORED.energy_gain(ImpactCase(M, J, v, 1.0))
    gains = [relative_energy_gain(M, v, resolve_impact(M, J, v, 1.0, clamp=clamp).velocity) for clamp in (False, True)]
    assert gains[0] > 10.0 * bound and gains[1] <= bound


def test_the_printed_formula_exceeds_the_bound() -> None:
    """By how much is up to the BLAS; in some two of a hundred impacts by more than the gain's own error."""
    study = bulk_impacts(1500, seed=2, method="gram_pinv")
    assert np.sum(study.gain - study.gain_error > study.bound) > 5


def test_the_tables_add_up() -> None:
    study = bulk_impacts(200, seed=3)
    assert sum(row.impacts for row in study.by_condition()) == 200
    assert sum(row.impacts for _, _, row in study.by_family()) == 200
    assert max(row.worst_gain for row in study.by_condition()) == pytest.approx(study.gain.max())


def test_the_same_seed_gives_the_same_numbers_and_progress_is_told() -> None:
    seen: list[tuple[int, int]] = []
    first = bulk_impacts(300, seed=4, progress=lambda done, of: seen.append((done, of)))
    assert seen[-1] == (300, 300)
    assert np.array_equal(first.gain, bulk_impacts(300, seed=4).gain)
