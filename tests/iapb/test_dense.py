"""Products and solutions without BLAS, against exact rationals and numpy."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from iapb.dense import product, solve


def test_products_of_integers_are_exact() -> None:
    numbers = np.random.default_rng(1)
    a, b = numbers.integers(-9, 10, (4, 3)), numbers.integers(-9, 10, (3, 5))
    np.testing.assert_array_equal(product(a, b), a @ b)
    np.testing.assert_array_equal(product(b.T, a[0]), b.T @ a[0])
    assert product(np.zeros((0, 3)), b).shape == (0, 5)
    assert (product(np.zeros((2, 0)), np.zeros(0)) == 0.0).all()


def test_terms_are_added_in_order() -> None:
    assert product([[1.0, 1e16, -1e16]], [1.0, 1.0, 1.0])[0] == (1.0 + 1e16) - 1e16


def test_solve_exchanges_rows() -> None:
    matrix = np.array([[0.0, 2.0, 1.0], [1.0, 0.0, 0.0], [4.0, 1.0, 0.0]])
    x = solve(matrix, [5.0, 1.0, 7.0])
    exact = [sum(Fraction(m) * Fraction(value) for m, value in zip(row, x, strict=True)) for row in matrix]
    assert exact == [5, 1, 7]


def test_a_singular_matrix_is_refused() -> None:
    with pytest.raises(ZeroDivisionError, match="singular"):
        solve([[1.0, 2.0], [2.0, 4.0]], [1.0, 1.0])
