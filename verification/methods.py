"""Other methods for an impact, to compare `iapb.resolve_impact` with: plain numpy, unscaled,
without clamp.

Each returns v⁺ (d,) from M (d, d), J (c, d), v (d,) and e. Through LAPACK the last bits depend on
the processor, and where W = J M⁻¹ Jᵀ is formed, its condition number amplifies them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any

import numpy as np

from iapb.contact.kernels.impact import rank_tolerance
from iapb.errors import ArgumentError
from verification.impacts import EPS, Floats, ImpactCase

Method = Callable[..., Any]


# A correct method, independent of the engine. The planted bugs of the laws are made from its parts.
RANK_CUT = 1e-10


def whitened(change: Callable[..., Floats]) -> Method:
    """Return the resolver with u⁺ = change(A, u, e) for u = Lᵀv, M = L Lᵀ and the unit rows A."""

    @wraps(change)
    def resolver(M: Floats, J: Floats, v: Floats, *given: Any, **more: Any) -> Floats:
        case = ImpactCase(M, J, v)
        return np.linalg.solve(case.lower.T, change(case.unit_rows, case.u, *given, **more))

    del resolver.__wrapped__  # the arguments are those of a resolver
    return resolver


def row_space(A: Floats, cut: float = RANK_CUT) -> Floats:
    _, values, right = np.linalg.svd(A, full_matrices=False)
    return right[values > cut]


@whitened
def projecting(A: Floats, u: Floats, factor: float, cut: float = RANK_CUT) -> Floats:
    Q = row_space(A, cut)
    return u - factor * (Q.T @ (Q @ u))


def sound_resolver(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Return v⁺ from u⁺ = u − (1 + e) Qᵀ Q u, with Q from the singular value decomposition of the
    unit rows of A."""
    return projecting(M, J, v, 1.0 + e)


def gram_pinv(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Return v⁺ by (20)-(21) as printed, with numpy's pseudo-inverse and its classical cutoff
    1e-15."""
    push = np.linalg.solve(M, J.T)
    return np.asarray(v - (1.0 + e) * (push @ (np.linalg.pinv(J @ push, rcond=1e-15) @ (J @ v))))


def gram_cholesky(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Return v⁺ by (19), with Cholesky's factor of W; the rows must be independent."""
    push = np.linalg.solve(M, J.T)
    W = J @ push
    length = np.sqrt(np.maximum(np.diag(W), 0.0))
    scale = np.sqrt(np.diag(M))
    # The solution with M leaves the smallest eigenvalue of the Gram matrix of unit rows known to
    # c·ε·κ only.
    known = 8.0 * len(J) * EPS * np.linalg.cond(M / np.outer(scale, scale))
    if (
        not length.all()
        or np.linalg.eigvalsh(W / np.outer(length, length)).min(initial=1.0) <= known
    ):
        raise ArgumentError(
            "contact_jacobian", J.shape, "independent rows for method 'gram_cholesky'"
        )
    root = np.linalg.cholesky(0.5 * (W + W.T))
    return np.asarray(
        v - (1.0 + e) * (push @ np.linalg.solve(root.T, np.linalg.solve(root, J @ v)))
    )


def damped(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Return v⁺ by (W + λI)⁻¹, λ = c ε of W's largest diagonal entry, the rounding of W.

    Each mode keeps part of its approach: with 1e-8, 1e-10, 1e-12 or 1e-14 in place of c ε more hard
    cases fail.
    """
    push = np.linalg.solve(M, J.T)
    W = J @ push
    share = len(J) * EPS * max(np.diag(W).max(initial=0.0), np.finfo(float).tiny)
    return np.asarray(v - (1.0 + e) * (push @ np.linalg.solve(W + share * np.eye(len(W)), J @ v)))


def svd(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Return v⁺ by (21) with the projector from the truncated singular value decomposition of the
    unit rows of A."""
    return projecting(M, J, v, 1.0 + e, cut=rank_tolerance(np.linalg.cholesky(M)))


# To add a method, add a line here.
COMPARED: dict[str, Method] = {
    "gram_pinv": gram_pinv,
    "gram_cholesky": gram_cholesky,
    "damped": damped,
    "svd": svd,
}
