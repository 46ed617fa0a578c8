"""A pivot of the Cholesky factor that fails is named; exact impacts test the rest of the linear algebra."""

from __future__ import annotations

import numpy as np

from iapb.linalg import cholesky


def test_the_failing_pivot_is_named() -> None:
    lower = np.zeros((3, 3))
    assert cholesky(np.diag([1.0, 2.0, -1.0]), lower) == 3
    assert cholesky(np.array([[1.0, 1.0], [1.0, 1.0]]), np.zeros((2, 2))) == 2
    assert cholesky(np.diag([np.nan, 1.0]), np.zeros((2, 2))) == 1
