"""Executable forms of the floating-point bounds; the statements fp_* derive them.

The standard model applies: every operation rounds to nearest with a relative error of at most u = 2⁻⁵³, without
overflow or underflow; ε = 2u. κ is the condition number of the mass matrix. Since all rounding is componentwise, the
smallest κ(S M S) over positive diagonal S may replace κ, so units such as metres and radians do not matter.

Derivation of `gain_bound` (‖x‖² = xᵀMx, Δ the candidate change of velocity, x = vᵀMΔ, y = ΔᵀMΔ):

1. The clamp computes X ≈ x and Y ≈ y in double-double, rounds each once, and α = min(1, fl(−2X/Y)). The
   double-double sums err by at most τ‖v‖‖Δ‖ with τ = 16 (d+1) √d u² κ: each of the 2(d+1) compensated steps per
   entry errs by at most 8u² of the sum of magnitudes, and Σ|vᵢ||Mᵢⱼ||Δⱼ| ≤ √d λ_max |v||Δ| ≤ √d κ ‖v‖‖Δ‖.
2. Hence (fp_clamp) 2α x + α² y ≤ 3u α² y (1+…) + 2α τ ‖v‖‖Δ‖. As α ≤ 2‖v‖/‖Δ‖ up to rounding, the relative gain
   before v⁺ is rounded is at most 12u + 12τ.
3. v⁺ = fl(v + fl(αΔ)) is off by r with |r| ≤ u|v⁺| + u|αΔ|, so ‖r‖ ≤ u√κ (‖v⁺‖ + 2‖v‖) ≈ 3u√κ ‖v‖ (fp_rounding),
   which adds at most 6u√κ + 9u²κ.
4. The products of small quantities left out in 1-3 are covered by the factor 65/64 for u√κ ≤ 2⁻¹², τ ≤ 2⁻¹².
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np

from iapb.errors import ArgumentError

UNIT_ROUNDOFF = 2.0**-53
_MARGIN = 65.0 / 64.0  # covers products of terms that are each below 2⁻¹²
_SMALL = 2.0**-12


def gain_bound(d: int, kappa: float) -> float:
    """Return the largest relative gain of kinetic energy that the clamped resolver can have.

    (KE⁺ − KE⁻)/KE⁻ ≤ (65/64)(12u + 6u√κ) + 13τ + 10u²κ with τ = 16 (d+1) √d u² κ; see the module's derivation.

    Parameters
    ----------
    d : number of degrees of freedom.
    kappa : condition number of the mass matrix, at least 1.

    Raises
    ------
    ArgumentError
        If d < 1 or kappa < 1, or if kappa is so large that the derivation does not apply (u√κ or τ above 2⁻¹²).
    """
    if d < 1:
        raise ArgumentError("d", d, "at least one degree of freedom")
    if not kappa >= 1.0:
        raise ArgumentError("kappa", kappa, "a condition number, at least 1")
    u, root = UNIT_ROUNDOFF, math.sqrt(kappa)
    tau = 16.0 * (d + 1) * math.sqrt(d) * u**2 * kappa
    if u * root > _SMALL or tau > _SMALL:
        raise ArgumentError("kappa", kappa, "a condition number for which u√κ and τ stay below 2⁻¹²")
    return _MARGIN * (12.0 * u + 6.0 * u * root) + 13.0 * tau + 10.0 * u * u * kappa


def promised_bound(d: int, kappa: float) -> float:
    """Return 10 d ε √κ, the guaranteed bound; it is at least `gain_bound` for κ ≤ 10²⁴/d (fp_promise)."""
    return 20.0 * d * UNIT_ROUNDOFF * math.sqrt(kappa)


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


def gamma(n: int) -> float:
    """Return γₙ = n u / (1 − n u), Higham's bound for n accumulated roundings."""
    return n * UNIT_ROUNDOFF / (1.0 - n * UNIT_ROUNDOFF)


def projector_bound(d: int, departure: float) -> float:
    """Return the largest relative gain of |u|² by the computed projector, for any M and J.

    |û⁺|² ≤ (1 + g)|u|², g = (√(1 + 4δ(1+δ)) + ρ)² − 1, with δ = `departure` ≥ ‖QᵀQ − I‖₂ (fp_projector) and
    ρ = 2(γ_d + γ_{d+2} + u)√d (1+δ) for the two products with Q and the subtraction. No κ occurs.
    """
    rounding = 2.0 * (gamma(d) + gamma(d + 2) + UNIT_ROUNDOFF) * math.sqrt(d) * (1.0 + departure)
    exact = 4.0 * departure * (1.0 + departure)
    return exact + 2.0 * math.sqrt(1.0 + exact) * rounding + rounding * rounding
