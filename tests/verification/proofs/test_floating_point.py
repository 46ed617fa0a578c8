"""The radius of the last step exceeds the error that Coq proves; the family against the printed formula is exact."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from verification.proofs.numbers import energy_factor, energy_factor_above_cutoff


def radius_margins(d: int) -> tuple[Fraction, ...]:
    """Margins of the radius of `iapb.contact.kernels.passive.gain` above the need of Coq's `accepted_never_gains`.

    `Passive.v` proves bounds of the error of `gain` (gain_error) and of its low part (loop_error). They are linear in
    W = Σ|Δᵢ||Aᵢⱼ||sⱼ| of the high parts, η Σ|Δᵢ| and η = 2⁻¹⁰⁷⁴. This function returns the three exact coefficients of
    (1 − u) r − error − u|low|, where r is a lower bound of the radius that `gain` returns: its S loses at most 2d + 1
    roundings and η/2 in each product, `underflow` d + 1 and η/2. G = 1 + 2 (d + 2) u exceeds (1 + u) to the power
    d + 2.
    """
    u, n = Fraction(1, 2**53), Fraction(d)
    row, each, eta = np.vectorize(Fraction, otypes=[object])(np.eye(3, dtype=int))  # W, η |Δᵢ| of a row, η
    grown = 1 + 2 * (n + 2) * u  # G

    def error(total: Any, b: Any, g: Fraction, f: Any) -> Any:  # error_bound of Passive.v, s = S
        one = total * u * grown + b + f
        inner = (total * u * grown + b) * 2 * n + total * (2 * u + g + n * (u + g)) + f * n
        return (inner + one * n * (n + 1) / 2) * grown * u

    g1, f1, first = 2 * u * (1 + u), Fraction(2), row * (1 + u) + each * n
    row_error = error(first, each * 4, g1, each * f1) + row * u * u * (5 + 2 * u) + each * 5 * n
    q, z, b = n * u * grown + u + g1, grown * n * (4 + f1), eta * 4
    g, f = (1 + u) * (q + u), each * (1 + u) ** 2 * z + eta * 2
    total = first * (1 + u) * grown + eta * n
    left = (first * q * grown + each * z) * u * (3 + u) + first * u * (2 + u) * u * grown + eta * 5 * n
    wanted = error(total, b, g, f) + left + row_error * (1 + u)
    low = ((total * u * grown + b + f) * n + total * (u + g)) * grown
    kept, share = 1 - (2 * n + 5) * u, 2 * (n + 6) ** 2 * u * u
    underflow = kept * 2**54 * n - share * n
    returned = (row * kept * share + each * underflow + eta * (underflow - 2)) * (1 - u)
    return tuple(returned * (1 - u) - wanted - low * u)


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
