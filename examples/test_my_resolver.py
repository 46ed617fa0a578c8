"""Your own resolver under pytest, with iapb's plugin: one test per law of the contract.

Run it: pytest examples/test_my_resolver.py
"""

import numpy as np
import pytest


def my_resolver(mass_matrix, contact_jacobian, velocity, restitution):
    """Newton's law as a linear complementarity problem for one row at a time, repeated until
    nothing approaches."""
    J, v, p = contact_jacobian, np.array(velocity), np.zeros(len(contact_jacobian))
    away = np.linalg.solve(mass_matrix, J.T)  # M⁻¹ Jᵀ
    wanted = -restitution * J @ velocity
    for _ in range(1_000):
        before = v.copy()
        for i, row in enumerate(J):
            stiffness = row @ away[:, i]
            step = (
                max(p[i] + (wanted[i] - row @ v) / stiffness, 0.0) - p[i]
                if stiffness > 0.0
                else 0.0
            )
            p[i] += step
            v += step * away[:, i]
        if np.array_equal(v, before):
            break
    return v


@pytest.mark.iapb(contract="unilateral", laws=["kinetic_energy"], impacts=20)
def test_my_resolver(iapb_law):
    iapb_law(my_resolver)
