"""An impact method: (21) with the projector from LAPACK's pivoted QR factorisation.

In the project it is a file of `verification`, and one line of `COMPARED` in verification/methods.py.

Prints:
    True, worst: kinetic_energy
"""

import numpy as np
from scipy.linalg import qr

from verification import check_passivity
from verification.methods import COMPARED

RANK_TOLERANCE = 1e-10  # share of a unit row below which it is a combination of the others


def pivoted_qr(M: np.ndarray, J: np.ndarray, v: np.ndarray, e: float) -> np.ndarray:
    """Return v⁺ by u⁺ = u − (1 + e) Q Qᵀ u, with Q from the columns of Aᵀ = L⁻¹ Jᵀ."""
    lower = np.linalg.cholesky(M)
    columns = np.linalg.solve(lower, J.T)
    u = lower.T @ v
    length = np.linalg.norm(columns, axis=0)
    rows = columns[:, length > 0.0] / length[length > 0.0]
    Q, R, _ = qr(rows, mode="economic", pivoting=True)
    Q = Q[:, np.abs(np.diag(R)) > RANK_TOLERANCE]
    return np.asarray(np.linalg.solve(lower.T, u - (1.0 + e) * Q @ (Q.T @ u)))


COMPARED["pivoted_qr"] = pivoted_qr  # hard cases and tables now have it, too

report = check_passivity(COMPARED["pivoted_qr"], impacts=100)
print(f"{report.passed}, worst: {report.worst.law}")
