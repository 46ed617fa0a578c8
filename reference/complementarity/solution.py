"""Solution: the answer of a solver, with residuals recomputed from the problem alone.

The block of a contact has 1 (normal), 2 or 3 components, normal first. Coulomb's cone with friction
mu is K = {(n, t): |t| <= mu n}; its dual is K* = {(n, t): n >= mu |t|}. Without friction K = K* =
{n >= 0}. Source: Acary and Brogliato, Numerical Methods for Nonsmooth Dynamical Systems (2008),
section 3.9.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from reference import Floats
from reference.complementarity.problem import ImpactProblem

# First-order solvers (OSQP, SCS, proxqp) reach about 1e-6 of the velocity scale, pivoting solvers
# 1e-12.
SOLVED_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Answer:
    """Return value of a solver module: impulse (n,) [N s] or None, and the solver's message."""

    impulse: Floats | None
    note: str = ""
    refused: bool = False  #: the solver does not accept this kind of problem


@dataclass(frozen=True)
class Residuals:
    """Residuals of an impulse, relative to the velocity scale; inf = unknown."""

    #: distance of the scaled impulse from its cone (without friction: adhesive impulses)
    impulse_cone: float = np.inf
    #: distance of the complementary velocity from the dual cone (penetrating velocities)
    velocity_cone: float = np.inf
    complementarity: float = np.inf  #: largest |p_i · w_i| of a contact
    #: largest component of p - proj_K(p - w), which is zero only at solutions
    natural_map: float = np.inf

    @property
    def worst(self) -> float:
        """The largest of the four residuals."""
        return max(self.impulse_cone, self.velocity_cone, self.complementarity, self.natural_map)


@dataclass(frozen=True)
class Solution:
    """An answer to an ImpactProblem."""

    problem: ImpactProblem
    impulse: Floats | None  #: (n,) p [N s], or None if the solver returned none
    solver: str = ""  #: name in the table of solvers
    note: str = ""  #: the solver's message, which is shown but not used for the verdict
    refused: bool = False  #: the solver does not accept this kind of problem
    seconds: float = np.nan  #: wall time of the call

    @cached_property
    def residuals(self) -> Residuals:
        """Residuals recomputed from the problem; all infinite without a usable impulse."""
        fits = self.impulse is not None and self.impulse.shape == self.problem.gamma_minus.shape
        return (
            residuals(self.problem, self.answer())
            if fits and np.isfinite(self.answer()).all()
            else Residuals()
        )

    def solved(self, tolerance: float = SOLVED_TOLERANCE) -> bool:
        """Whether every recomputed residual is at most `tolerance` of the velocity scale."""
        return self.residuals.worst <= tolerance

    def verdict(self, tolerance: float = SOLVED_TOLERANCE) -> str:
        """Return "solved", "refused" or "failed"."""
        return "solved" if self.solved(tolerance) else "refused" if self.refused else "failed"

    def answer(self) -> Floats:
        """Return the impulse (n,), or NaN if there is none."""
        return np.full(self.problem.size, np.nan) if self.impulse is None else self.impulse

    @property
    def gamma_plus(self) -> Floats:
        """Contact velocities after the impact (n,) [m/s]."""
        return self.problem.gamma_plus(self.answer())

    @property
    def velocity_plus(self) -> Floats:
        """Generalized velocity after the impact (d,)."""
        return self.problem.velocity_plus(self.answer())


def velocity_scale(problem: ImpactProblem) -> float:
    """Return the scale of residuals: the largest |b| [m/s], or 1 for the trivial problem b = 0."""
    return float(np.abs(problem.offset).max(initial=0.0)) or 1.0


def residuals(problem: ImpactProblem, impulse: Floats) -> Residuals:
    """Return the residuals of `impulse` (n,), recomputed from the problem (scale:
    `velocity_scale`)."""
    if problem.size == 0:
        return Residuals(0.0, 0.0, 0.0, 0.0)
    mu = problem.friction_or_zero
    size = problem.contact_size
    scale = velocity_scale(problem)
    w = problem.contact_velocity(impulse).reshape(-1, size) / scale
    if problem.friction is not None and not problem.relaxed:
        w = de_saxce_shift(w, mu)
    # per contact the largest |W| entry of its rows [1/kg] converts an impulse into a velocity
    largest = np.abs(problem.delassus).max(axis=1).reshape(-1, size).max(axis=1)
    p = np.where(largest > 0.0, largest, 1.0)[:, None] * impulse.reshape(-1, size) / scale
    natural = p - project_on_cone(p - w, mu)
    product = np.abs(np.einsum("ij,ij->i", p, w)) / np.maximum(1.0, np.linalg.norm(p, axis=1))
    # the distance from the dual cone is |proj_K(-w)| by Moreau's decomposition
    outside = p - project_on_cone(p, mu)
    penetrating = project_on_cone(-w, mu)
    return Residuals(
        float(np.linalg.norm(outside, axis=1).max()),
        float(np.linalg.norm(penetrating, axis=1).max()),
        float(product.max()),
        float(np.abs(natural).max()),
    )


def project_on_cone(blocks: Floats, friction: Floats) -> Floats:
    """Project each row of `blocks` (k, m) orthogonally on Coulomb's cone of `friction` (k,)."""
    normal = blocks[:, 0]
    tangent = np.linalg.norm(blocks[:, 1:], axis=1)
    inside = (normal >= 0.0) & (tangent <= friction * normal)
    polar = ~inside & (friction * tangent <= -normal)
    height = np.where(polar, 0.0, (normal + friction * tangent) / (1.0 + friction**2))
    shrink = np.divide(friction * height, tangent, out=np.zeros_like(tangent), where=tangent > 0.0)
    projected = np.column_stack([height, shrink[:, None] * blocks[:, 1:]])
    return np.where(inside[:, None], blocks, projected)


def de_saxce_shift(relative_velocity: Floats, friction: Floats) -> Floats:
    """Return the velocity blocks with mu |u_T| added to the normal component (de Saxcé and Feng,
    1998).

    With this shift Coulomb's law reads K ∋ p ⟂ shifted velocity ∈ K*.
    """
    shifted = relative_velocity.copy()
    shifted[:, 0] += friction * np.linalg.norm(relative_velocity[:, 1:], axis=1)
    return shifted
