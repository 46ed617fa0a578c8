"""The cones of contact: the half line of a normal impulse, Coulomb's cone, and their duals.

A contact's block has 1 (normal), 2 or 3 components, normal first. Coulomb's cone with friction mu is
K = {(n, t): |t| <= mu n}; its dual is K* = {(n, t): n >= mu |t|}. Without friction K = K* = {n >= 0}.
Source: Acary and Brogliato, Numerical Methods for Nonsmooth Dynamical Systems (2008), section 3.9.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def project_on_cone(blocks: Floats, friction: Floats) -> Floats:
    """Project each row of `blocks` (k, m) orthogonally on Coulomb's cone of `friction` (k,)."""
    normal, tangent = blocks[:, 0], np.linalg.norm(blocks[:, 1:], axis=1)
    inside = (normal >= 0.0) & (tangent <= friction * normal)
    polar = ~inside & (friction * tangent <= -normal)
    height = np.where(polar, 0.0, (normal + friction * tangent) / (1.0 + friction**2))
    shrink = np.divide(friction * height, tangent, out=np.zeros_like(tangent), where=tangent > 0.0)
    projected = np.column_stack([height, shrink[:, None] * blocks[:, 1:]])
    return np.where(inside[:, None], blocks, projected)


def distance_to_cone(blocks: Floats, friction: Floats) -> Floats:
    """Distance (k,) of each row of `blocks` from Coulomb's cone."""
    return np.linalg.norm(blocks - project_on_cone(blocks, friction), axis=1)


def distance_to_dual_cone(blocks: Floats, friction: Floats) -> Floats:
    """Distance (k,) of each row from the dual cone: by Moreau's decomposition |proj_K(-x)|."""
    return np.linalg.norm(project_on_cone(-blocks, friction), axis=1)


def de_saxce_shift(relative_velocity: Floats, friction: Floats) -> Floats:
    """Return the velocity blocks with mu |u_T| added to the normal component (de Saxcé and Feng, 1998).

    With this shift Coulomb's law reads K ∋ p ⟂ shifted velocity ∈ K*.
    """
    shifted = relative_velocity.copy()
    shifted[:, 0] += friction * np.linalg.norm(relative_velocity[:, 1:], axis=1)
    return shifted
