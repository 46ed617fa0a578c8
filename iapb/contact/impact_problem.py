"""The impact as given, checked and scaled by powers of two.

Scaling every coordinate to a unit diagonal of M, every row to a largest entry near one and the velocity to a largest
entry near one is exact in binary arithmetic. So no intermediate over- or underflows, and a change of units or of
row scale by a power of two changes no bit of the result.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.errors import ArgumentError
from iapb.mechanics.kernels.cholesky import cholesky

Floats = NDArray[np.float64]
Exponents = NDArray[np.int32]

# |M − Mᵀ| up to this share of √(Mᵢᵢ Mⱼⱼ) is rounding of whoever computed M, and the symmetric part is used.
_SYMMETRY_TOLERANCE = 1e-9
_LOWEST_EXPONENT = -100_000  # exponent given to zeros, so that they never decide a maximum


@dataclass(frozen=True)
class ImpactInput:
    """A checked impact in scaled coordinates v' = 2^−(s + k) v, M' = 2^(s + s) M, rows J' = 2^(s + r) J."""

    mass_matrix: Floats  # (d, d) scaled
    lower: Floats  # (d, d) its Cholesky factor
    contact_jacobian: Floats  # (c, d) scaled
    velocity: Floats  # (d,) scaled
    restitution: float
    unequal: Floats | None  # (c,) where restitution differs between contacts
    coordinate_exponent: Exponents  # s (d,)
    row_exponent: Exponents  # r (c,)
    velocity_exponent: int  # k

    @property
    def coordinates(self) -> int:
        """d."""
        return len(self.velocity)

    @property
    def contacts(self) -> int:
        """c."""
        return len(self.contact_jacobian)

    def unscale_velocity(self, v: Floats) -> Floats:
        """Velocity in the caller's units."""
        return _ldexp(v, self.coordinate_exponent + self.velocity_exponent)

    def unscale_momentum(self, momentum: Floats) -> Floats:
        """Generalized impulse in the caller's units."""
        return _ldexp(momentum, self.velocity_exponent - self.coordinate_exponent)

    def unscale_impulses(self, p: Floats) -> Floats:
        """Impulses along the caller's rows."""
        return _ldexp(p, self.row_exponent + self.velocity_exponent)

    def unscale_energy(self, energy: float) -> float:
        """Energy in the caller's units."""
        try:
            return math.ldexp(energy, 2 * self.velocity_exponent)
        except OverflowError:
            return math.copysign(math.inf, energy)


def check_input(mass_matrix: ArrayLike, contact_jacobian: ArrayLike, velocity: ArrayLike,
                restitution: ArrayLike) -> ImpactInput:
    """Check shapes, finiteness, symmetry and definiteness, then scale; raise ArgumentError by name."""
    M = _finite("mass_matrix", mass_matrix, 2)
    d = len(M)
    if d == 0 or M.shape != (d, d):
        raise ArgumentError("mass_matrix", M.shape, "a square matrix with at least one row")
    v = _finite("velocity", velocity, 1)
    if v.shape != (d,):
        raise ArgumentError("velocity", v.shape, f"shape ({d},), one entry per row of mass_matrix")
    J = np.zeros((0, d)) if _is_empty(contact_jacobian) else _finite("contact_jacobian", contact_jacobian, 2)
    if J.shape[1] != d:
        raise ArgumentError("contact_jacobian", J.shape, f"shape (contacts, {d})")
    e, unequal = _checked_restitution(restitution, len(J))
    return _scaled(M, J, v, e, unequal)


def _is_empty(rows: ArrayLike) -> bool:
    """[] and zeros(0) have no second dimension to check."""
    given = _real_numbers(rows)
    return given is not None and given.shape == (0,)


def _real_numbers(value: Any) -> NDArray[Any] | None:
    """The value as an array; None for strings, truth values, time spans, complex numbers and masked arrays."""
    try:
        given = np.asarray(value)
    except (TypeError, ValueError):
        return None
    if isinstance(value, np.ma.MaskedArray):
        return None
    if given.dtype.kind == "O":
        return given if all(isinstance(x, Real) and not isinstance(x, bool) for x in given.flat) else None
    return given if given.dtype.kind in "fiu" else None


def _finite(name: str, value: Any, dimensions: int) -> Floats:
    given = _real_numbers(value)
    if given is None:
        raise ArgumentError(name, value, "an array of real numbers")
    try:
        array = given.astype(np.float64, copy=False)
    except OverflowError:
        raise ArgumentError(name, value, "an array of finite numbers") from None
    if array.ndim != dimensions:
        raise ArgumentError(name, array.shape, f"an array of {dimensions} dimension{'s' * (dimensions > 1)}")
    if not np.isfinite(array).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise ArgumentError(f"{name}[{', '.join(map(str, where))}]", float(array[where]), "a finite number")
    return array


def _checked_restitution(restitution: ArrayLike, contacts: int) -> tuple[float, Floats | None]:
    if isinstance(restitution, float) and -1.0 <= restitution <= 1.0:
        return float(restitution), None
    e = _real_numbers(restitution)
    if e is None:
        raise ArgumentError("restitution", restitution, "a real number or one per contact")
    if e.ndim == 0:
        if not -1.0 <= float(e) <= 1.0:
            raise ArgumentError("restitution", float(e), "a number in [-1, 1]")
        return float(e), None
    values = e.astype(np.float64)
    if values.shape != (contacts,):
        raise ArgumentError("restitution", values.shape, f"a scalar or shape ({contacts},), one per contact")
    if contacts == 0:
        return 0.0, None
    if np.all(values == values[0]) and -1.0 <= values[0] <= 1.0:
        return float(values[0]), None
    for i, value in enumerate(values):
        if not 0.0 <= value <= 1.0:
            raise ArgumentError(f"restitution[{i}]", float(value), "a number in [0, 1] where contacts differ")
    return 0.0, values


def _exponents(array: Floats) -> Exponents:
    """Binary exponent of every entry; zeros get one that never is a maximum."""
    mantissa, exponents = np.frexp(array)
    exponents[mantissa == 0.0] = _LOWEST_EXPONENT
    return exponents


def _ldexp(array: Floats, exponent: Exponents) -> Floats:
    """array · 2^exponent; overflow becomes infinity for the caller to refuse.

    Exponents are sums of a few of doubles, far inside int32; the marks of zeros, some -1e5 each, are too.
    """
    with np.errstate(over="ignore", under="ignore"):
        return np.ldexp(array, exponent)


def _scaled(M: Floats, J: Floats, v: Floats, e: float, unequal: Floats | None) -> ImpactInput:
    diagonal = M.diagonal()
    if not diagonal.min() > 0.0:
        k = int(np.argmin(diagonal))
        raise ArgumentError(f"mass_matrix[{k}, {k}]", float(diagonal[k]), "a positive diagonal entry")
    s = -(np.frexp(diagonal)[1] // 2)
    mass, lower = _factored(M, _ldexp(M, s[:, None] + s))
    k = int((_exponents(v) - s).max(initial=_LOWEST_EXPONENT))
    k = 0 if k <= _LOWEST_EXPONENT // 2 else k
    row = -(_exponents(J) + s).max(axis=1, initial=_LOWEST_EXPONENT)
    row[np.abs(row) > abs(_LOWEST_EXPONENT) // 2] = 0  # a row of zeros
    return ImpactInput(
        mass_matrix=mass, lower=lower, contact_jacobian=_ldexp(J, row[:, None] + s), velocity=_ldexp(v, -(s + k)),
        restitution=e, unequal=unequal, coordinate_exponent=s, row_exponent=row, velocity_exponent=k)


def _factored(M: Floats, scaled: Floats) -> tuple[Floats, Floats]:
    """The symmetric part of the scaled M and its Cholesky factor; M as given is for messages."""
    if not (scaled.max() <= 2.0 and scaled.min() >= -2.0):  # |Mᵢⱼ| < √(Mᵢᵢ Mⱼⱼ) holds where M is positive definite
        i, j = np.unravel_index(int(np.argmax(np.abs(scaled))), M.shape)
        raise ArgumentError(f"mass_matrix[{i}, {j}]", float(M[i, j]), "a positive definite matrix")
    symmetric = np.ascontiguousarray(scaled)
    if not (scaled == scaled.T).all():
        skew = np.abs(scaled - scaled.T)
        if skew.max() > _SYMMETRY_TOLERANCE:
            i, j = np.unravel_index(int(np.argmax(skew)), M.shape)
            raise ArgumentError(f"mass_matrix[{i}, {j}]", float(M[i, j]),
                                f"a symmetric matrix; entry [{j}, {i}] is {float(M[j, i])!r}")
        symmetric = np.ascontiguousarray(0.5 * (scaled + scaled.T))
    lower = np.zeros_like(symmetric)
    pivot = cholesky(symmetric, lower)
    if pivot:
        raise ArgumentError("mass_matrix", M, f"a positive definite matrix (pivot {pivot} of Cholesky is not positive)")
    return symmetric, lower
