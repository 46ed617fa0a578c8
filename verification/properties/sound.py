"""A sound resolver of plain numpy, written apart from the engine; the planted bugs are made from its parts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from verification.properties.case import Floats

RANK_CUT = 1e-10


class Parts(NamedTuple):
    """M = L Lᵀ, u = Lᵀv, unit rows of A."""

    lower: Floats
    u: Floats
    rows: Floats


def whitened(M: Floats, J: Floats, v: Floats) -> Parts:
    lower = np.linalg.cholesky(M)
    rows = np.linalg.solve(lower, J.T).T
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    return Parts(lower, lower.T @ v, np.divide(rows, length, out=np.zeros_like(rows), where=length > 0.0))


def row_space(rows: Floats, cut: float = RANK_CUT) -> Floats:
    _, values, right = np.linalg.svd(rows, full_matrices=False)
    return right[values > cut]


def back(parts: Parts, u_plus: Floats) -> Floats:
    return np.linalg.solve(parts.lower.T, u_plus)


def projecting(M: Floats, J: Floats, v: Floats, factor: float, cut: float = RANK_CUT) -> Floats:
    parts = whitened(M, J, v)
    Q = row_space(parts.rows, cut)
    return back(parts, parts.u - factor * (Q.T @ (Q @ parts.u)))


def sound_resolver(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """u⁺ = u − (1 + e) Qᵀ Q u, Q from the singular value decomposition of the unit rows of A."""
    return projecting(M, J, v, 1.0 + e)
