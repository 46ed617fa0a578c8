"""Your own resolver under pytest, with iapb's plugin: one test per law of the contract.

Run it: pytest examples/test_my_resolver.py
"""

import numpy as np
import pytest
from scipy.optimize import nnls


def my_resolver(mass_matrix, contact_jacobian, velocity, restitution):
    """Moreau's law: away from the velocity that plastic impulses p >= 0 would leave."""
    if len(contact_jacobian) == 0:
        return velocity
    lower = np.linalg.cholesky(mass_matrix)
    rows = np.linalg.solve(lower, contact_jacobian.T)  # of Aᵀ = L⁻¹ Jᵀ
    impulses, _ = nnls(rows, -lower.T @ velocity)  # least |Lᵀ v + Aᵀ p|
    return velocity + (1.0 + restitution) * np.linalg.solve(lower.T, rows @ impulses)


@pytest.mark.iapb(contract="unilateral", laws=["kinetic_energy"], impacts=20)
def test_my_resolver(iapb_law):
    iapb_law(my_resolver)
