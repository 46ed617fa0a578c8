"""The impulses of least norm: those of numpy's least squares, whatever the rows repeat or the basis contains."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.contact.kernels.projector import minimum_norm_impulses


def impulses_of(rows: np.ndarray, basis: np.ndarray, change: np.ndarray) -> np.ndarray:
    """p of least norm with Aᵀ p = Δu; `rows` is A, one contact per row."""
    count, rank = len(rows), len(basis)
    length = np.linalg.norm(rows, axis=1)
    units = np.ascontiguousarray((rows / np.where(length > 0.0, length, 1.0)[:, None]).T)
    impulses, tall = np.full(count, np.nan), np.full((rank, count), np.nan)
    minimum_norm_impulses(
        units, length, count, basis, rank, change, impulses, tall, np.full((rank, rank), np.nan), np.full(rank, np.nan)
    )
    return impulses


@pytest.mark.parametrize("repeated", [0, 1, 3])
@pytest.mark.parametrize("rank", [1, 2, 4])
def test_they_are_the_least_squares_solution_of_least_norm(rank: int, repeated: int) -> None:
    rng = np.random.default_rng(10 * rank + repeated)
    rows = rng.normal(size=(rank, 5)) * 10.0 ** rng.uniform(-2, 2, (rank, 1))
    rows = np.vstack([rows, rng.normal(size=(repeated, rank)) @ rows])
    basis = np.linalg.qr(rows.T)[0].T[:rank].copy()
    change = basis.T @ rng.normal(size=rank)
    expected = np.linalg.lstsq(rows.T, change, rcond=None)[0]
    assert impulses_of(rows, basis, change) == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("order", [[0, 1, 2], [1, 0, 2], [2, 1, 0]])
def test_a_direction_that_no_row_reaches_gets_none_and_spoils_no_other(order: list[int]) -> None:
    rows = np.array([[2.0, 0.0, 0.0], [0.0, 0.5, 0.0]])
    assert impulses_of(rows, np.eye(3)[order], np.array([1.0, 3.0, 0.0])) == pytest.approx([0.5, 6.0], abs=0.0)
