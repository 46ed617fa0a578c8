"""The floating-point bounds grow as they must, refuse what they do not cover, and hold where exact numbers judge."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.errors import ArgumentError
from verification.proofs.bounds import gain_bound, projector_bound, promised_bound, radius_margins
from verification.proofs.numbers import energy_factor, energy_factor_above_cutoff


@given(d=st.integers(1, 60), exponent=st.floats(0.0, 20.0))
def test_gain_bound_keeps_the_promise(d: int, exponent: float) -> None:
    kappa = 10.0**exponent
    assert gain_bound(d, kappa) <= promised_bound(d, kappa)


@given(d=st.integers(1, 60), exponent=st.floats(0.0, 12.0))
def test_bounds_grow_with_conditioning_and_size(d: int, exponent: float) -> None:
    kappa = 10.0**exponent
    assert gain_bound(d, 2.0 * kappa) > gain_bound(d, kappa)
    assert projector_bound(d + 1, 1e-15) > projector_bound(d, 1e-15)


@pytest.mark.parametrize(("d", "kappa"), [(0, 1.0), (3, 0.5), (3, math.nan), (3, 1e30)])
def test_bounds_refuse_what_they_do_not_cover(d: int, kappa: float) -> None:
    with pytest.raises(ArgumentError):
        gain_bound(d, kappa)


def test_projector_as_computed_stays_below_its_bound() -> None:
    """u⁺ = u − 2QQᵀu in doubles, judged exactly: the bound holds, with no condition number in it."""
    rng = np.random.default_rng(5)
    for d in (2, 5, 12):
        q = np.linalg.qr(rng.standard_normal((d, d)))[0][:, : max(1, d // 2)]
        u = rng.standard_normal(d)
        after = u - 2.0 * (q @ (q.T @ u))
        departure = float(np.linalg.norm(q.T @ q - np.eye(q.shape[1]), 2))
        gain = _square(after) / _square(u) - 1
        assert gain <= projector_bound(d, departure + 4 * d * 2.0**-53)


def _square(x: np.ndarray) -> Fraction:
    return sum((Fraction(float(entry)) ** 2 for entry in x), Fraction(0))


@pytest.mark.parametrize("sizes", [range(1, 130), (1000, 4096, 10_000, 2**15)])
def test_radius_of_the_last_step_is_above_the_error_that_coq_proves(sizes: range) -> None:
    """Each d up to 2¹⁵ was tried once, by hand; beyond some 2⁵² roundings would win."""
    assert all(min(radius_margins(d)) > 0 for d in sizes)
    assert min(radius_margins(2**40)) < 0, "the comparison can fail"


def test_the_family_against_the_printed_formula_is_what_doubles_compute() -> None:
    """The exact factors are those of numpy's own rounding of J Jᵀ."""
    a, t = 1.0 - 2.0**-40, 2.0**-28
    w = np.array([[1.0, a], [a, a * a + t * t]])
    assert w[1, 1] == 1.0 - 2.0**-39
    assert energy_factor(40) == (1 + Fraction(2) ** 25) ** 2
    assert energy_factor_above_cutoff(19) > 1
