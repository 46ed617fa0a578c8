"""Rigid contacts at velocity level, one QP per step: the law of the "ideal" world and of CBuc.

One step of length dt from velocity v, with generalized force f and contact rows J:

    v_free = v + dt M⁻¹ f,   v⁺ = argmin ½|v⁺ − v_free|²_M  subject to  J v⁺ >= b,   p the multipliers,

    b_i = −gap_i/dt         open contact (gap > 0), e = 0: it may close, not pass (Stewart-Trinkle, Anitescu)
    b_i = −inf              open contact, e > 0: nothing happens before it closes (Moreau)
    b_i = −e gamma_minus_i  closed contact that approaches
    b_i = 0                 closed contact that does not; `stabilization` adds a share of −gap_i/dt where gap < 0

Source: Moreau, in Nonsmooth Mechanics and Applications (1988); Stewart and Trinkle, Int. J. Numer. Methods Eng. 39
(1996); Anitescu and Potra, Nonlinear Dynamics 14 (1997).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.errors import ArgumentError, SolverError
from reference.complementarity.solvers import daqp_qp, quadprog_qp

Floats = NDArray[np.float64]

# Active-set answers carry a few hundred roundings of the velocities involved; anything above is a wrong active set.
STEP_TOLERANCE = 1e-10


class RigidStep(NamedTuple):
    """Outcome of one rigid step.

    velocity : (d,) v⁺
    impulse : (c,) p >= 0 [N s], zeros for contacts left out; not unique where contacts are redundant
    residual : natural-map residual of the step's LCP, recomputed, relative to the velocities involved
    """

    velocity: Floats
    impulse: Floats
    residual: float


def rigid_step(
    mass_matrix: Floats,
    velocity: Floats,
    force: Floats,
    dt: float,
    contact_jacobian: Floats,
    gap: Floats,
    gamma_minus: Floats,
    restitution: float,
    stabilization: float = 0.0,
) -> RigidStep:
    """Advance v (d,) by dt [s] under generalized force f (d,) and unilateral contacts.

    Parameters
    ----------
    contact_jacobian : (c, d) unit-normal rows; gap : (c,) [m]; gamma_minus : (c,) J v [m/s]
    restitution : Newton's e in [0, 1], one for all contacts
    stabilization : share in [0, 1] of an overlap that is removed in this step (0: none, as Moreau's step)

    Raises
    ------
    SolverError
        where no velocity satisfies all contacts (two closed contacts that face each other, e > 0), or no
        solver reaches a residual of STEP_TOLERANCE
    """
    bound = velocity_bounds(gap, gamma_minus, restitution, dt, stabilization)
    v_free = velocity + dt * np.linalg.solve(mass_matrix, force)
    impulse = np.zeros(len(gap))
    kept = np.isfinite(bound)
    offset = contact_jacobian[kept] @ v_free - bound[kept]
    if (offset >= 0.0).all():  # nothing is touched: the common step of free motion
        return RigidStep(v_free, impulse, 0.0)
    cholesky = np.linalg.cholesky(mass_matrix)
    rows = np.linalg.solve(cholesky, contact_jacobian[kept].T).T
    scale = float(np.max(np.abs(contact_jacobian[kept]) @ np.abs(v_free) + np.abs(bound[kept])))
    impulse[kept], residual = _solve_step(rows, offset, scale)
    v_plus = v_free + np.linalg.solve(cholesky.T, rows.T @ impulse[kept])
    return RigidStep(v_plus, impulse, residual)


def velocity_bounds(
    gap: Floats, gamma_minus: Floats, restitution: float, dt: float, stabilization: float = 0.0
) -> Floats:
    """Return b (c,) of J v⁺ >= b [m/s]; −inf marks contacts that the step leaves out."""
    if not 0.0 <= restitution <= 1.0:
        raise ArgumentError("restitution", restitution, "a value in [0, 1]")
    if not 0.0 <= stabilization <= 1.0:
        raise ArgumentError("stabilization", stabilization, "a value in [0, 1]")
    when_open = -gap / dt if restitution == 0.0 else np.full_like(gap, -np.inf)
    when_closed = restitution * np.maximum(-gamma_minus, 0.0)
    push_out = stabilization * np.maximum(-gap, 0.0) / dt
    return np.where(gap > 0.0, when_open, np.maximum(when_closed, push_out))


def _solve_step(rows: Floats, offset: Floats, scale: float) -> tuple[Floats, float]:
    """Return p and its recomputed residual from the first solver that reaches STEP_TOLERANCE."""
    said = []
    for solver in (daqp_qp, quadprog_qp):
        try:
            impulse = solver.multipliers(rows, offset)
        except SolverError as error:
            said.append(str(error))
            continue
        residual = step_residual(rows, offset, impulse) / scale
        if residual <= STEP_TOLERANCE:
            return impulse, residual
        said.append(f"{solver.__name__.rsplit('.', 1)[-1]}: residual {residual:.1e}")
    raise SolverError(f"rigid step with {len(offset)} contacts has no accepted solution: " + "; ".join(said))


def step_residual(rows: Floats, offset: Floats, impulse: Floats) -> float:
    """Largest |min(W_ii p_i, w_i)| [m/s] of  0 <= p ⟂ w = A Aᵀ p + offset >= 0; infinite where p is not finite."""
    if not np.isfinite(impulse).all():
        return np.inf
    w = rows @ (rows.T @ impulse) + offset
    inertia = np.einsum("ij,ij->i", rows, rows)
    return float(np.abs(np.minimum(inertia * impulse, w)).max(initial=0.0))
