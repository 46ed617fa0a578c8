"""Distinguish true adhesion from an artefact of the minimum norm.

With redundant contacts, many p give the same generalized impulse Jᵀp. A negative entry of the minimum-norm p alone does
not mean adhesion: the contacts pull only if *no* p >= 0 gives the same Jᵀp.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from iapb.errors import ArgumentError, SolverError
from reference import Floats

# Residual, as a share of |L⁻¹ Jᵀp|, below which a non-negative impulse exists: the active-set least squares ends near
# 1e-13 for a consistent problem and far above for an inconsistent one.
EXPLAINED = 1e-9
ROUNDING = 1e-12  # share of the largest impulse below which a negative one counts as rounding error
NONE, ARTEFACT, ADHESIVE = "none", "artefact of the minimum norm", "adhesive"


@dataclass(frozen=True)
class NonNegativeImpulse:
    """Non-negative impulses whose Jᵀp is nearest to a generalized impulse."""

    impulse: Floats  #: (c,) p >= 0 [N s]
    residual: float  #: |L⁻¹(Jᵀp − given)| / |L⁻¹ given| in the kinetic metric

    @property
    def exists(self) -> bool:
        """Whether the residual is zero up to rounding, so that p gives the same motion without pulling."""
        return self.residual <= EXPLAINED


def nonnegative_impulse(contact_jacobian: ArrayLike, generalized_impulse: ArrayLike,
                        mass_matrix: ArrayLike) -> NonNegativeImpulse:  # fmt: skip
    """Return p >= 0 with Jᵀp nearest to `generalized_impulse` (d,), for J (c, d) and M (d, d).

    Source: Lawson and Hanson, Solving Least Squares Problems (1974), by `scipy.optimize.nnls`.

    Raises
    ------
    SolverError
        The least-squares iteration does not converge.
    """
    from scipy.optimize import nnls

    rows, given = np.asarray(contact_jacobian, np.float64), np.asarray(generalized_impulse, np.float64)
    if rows.ndim != 2 or rows.shape[1:] != given.shape:
        raise ArgumentError("contact_jacobian", rows.shape, f"{len(given)} columns, as generalized_impulse")
    cholesky = np.linalg.cholesky(np.asarray(mass_matrix, np.float64))
    columns, goal = np.linalg.solve(cholesky, rows.T), np.linalg.solve(cholesky, given)
    size, length = float(np.linalg.norm(goal)), np.linalg.norm(columns, axis=0)
    if size == 0.0 or len(rows) == 0:
        return NonNegativeImpulse(np.zeros(len(rows)), 0.0 if size == 0.0 else 1.0)
    unit = np.where(length > 0.0, length, 1.0)
    try:
        scaled, residual = nnls(columns / unit, goal / size)
    except RuntimeError as error:
        raise SolverError(f"non-negative least squares: {error}") from error
    return NonNegativeImpulse(scaled * size / unit, float(residual))


def adhesion(contact_jacobian: ArrayLike, impulses: ArrayLike, mass_matrix: ArrayLike) -> str:
    """Return NONE, ARTEFACT or ADHESIVE for impulses (c,) of any law."""
    p = np.asarray(impulses, np.float64)
    if p.min(initial=0.0) >= -ROUNDING * np.abs(p).max(initial=0.0):
        return NONE
    given = np.asarray(contact_jacobian, np.float64).T @ p
    return ARTEFACT if nonnegative_impulse(contact_jacobian, given, mass_matrix).exists else ADHESIVE
