"""The compared methods give v⁺ = −e v where every coordinate is stopped, and v where nothing
touches."""

from __future__ import annotations

import numpy as np
import pytest

from verification.methods import COMPARED


@pytest.mark.parametrize("method", COMPARED)
def test_a_compared_method_meets_the_law_and_takes_no_rows(method: str) -> None:
    M = np.array([[2.0, 0.5], [0.5, 1.0]])
    v = np.array([-1.0, -2.0])
    np.testing.assert_allclose(COMPARED[method](M, np.zeros((0, 2)), v, 0.5), v, rtol=1e-14)
    np.testing.assert_allclose(COMPARED[method](M, np.eye(2), v, 0.5), -0.5 * v, rtol=1e-6)
