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

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.contact.laws import StepResult
from iapb.errors import ArgumentError, SolverError
from iapb.run import COLLIDING, FREE, RESTING
from reference.complementarity.solvers import daqp_qp, quadprog_qp
from reference.contact_rows import ContactRows, find_rows, write_contacts, write_impact

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


@dataclass(frozen=True)
class RigidConstraints:
    """The law of the rigid worlds: frictionless contacts that no step ends by violating.

    Parameters
    ----------
    margin : contacts with gap <= margin [m] are given to the step; infinity takes every candidate pair, a
        finite margin must exceed the largest speed times the step
    stabilization : share of an overlap removed in each step, 0 for none
    """

    margin: float = np.inf
    stabilization: float = 0.0
    name = "rigid constraints"

    @property
    def settings(self) -> dict[str, Any]:
        """Margin and stabilization; the restitution is the scene's."""
        return {"margin": self.margin, "stabilization": self.stabilization}

    def advance(self, system: Any, state: Any, applied_force: Floats, dt: float) -> StepResult:
        """One step (see `iapb.contact.laws.ContactLaw`).

        Impulses of contacts that approached faster than the scene's approach velocity are reported as collision
        impulses, the rest as forces p/dt: only their sum is determined by the step.
        """
        mechanism, q, v = system.mechanism, state.q.copy(), state.v.copy()
        mass = mechanism.mass_matrix(q)
        found = find_rows(system, q, v, self.margin)
        force = applied_force - _inner_forces(system, q, v)
        e = system.scene.contact.restitution
        step = rigid_step(mass, v, force, dt, found.jacobian, found.gap, found.gamma, e, self.stabilization)
        blows = (found.gamma < -system.scene.contact.approach_velocity) & (step.impulse > 0.0)
        impulse = found.jacobian[blows].T @ step.impulse[blows]
        pressing = found.jacobian[~blows].T @ step.impulse[~blows] / dt
        write_contacts(state, found, step.impulse, ~blows, dt)
        write_impact(state, system, v, np.linalg.solve(mass, impulse), impulse, found.jacobian[blows])
        q_plus = mechanism.integrate(q, step.velocity, dt)
        contact_state = _contact_state(found, step.impulse, blows)
        return StepResult(q_plus, step.velocity, pressing, np.zeros_like(v), impulse, contact_state)


def _inner_forces(system: Any, q: Floats, v: Floats) -> Floats:
    """B + G (d,), each left out where it is zero for good."""
    forces = np.zeros_like(v)
    if system.mechanism.has_velocity_terms:
        forces += system.mechanism.bias(q, v)
    if np.any(system.gravity):
        forces += system.mechanism.gravity(q, system.gravity)
    return forces


def _contact_state(found: ContactRows, impulse: Floats, blows: NDArray[np.bool_]) -> int:
    if blows.any():
        return COLLIDING
    return RESTING if ((found.gap <= 0.0) | (impulse > 0.0)).any() else FREE


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
    return nearest_velocity(mass_matrix, v_free, contact_jacobian, bound)


def nearest_velocity(
    mass_matrix: Floats, v_free: Floats, contact_jacobian: Floats, bound: Floats
) -> RigidStep:
    """Return the velocity nearest to v_free in the kinetic metric with J v >= bound; −inf leaves a row out."""
    impulse, kept = np.zeros(len(bound)), np.isfinite(bound)
    offset = contact_jacobian[kept] @ v_free - bound[kept]
    if (offset >= 0.0).all():  # nothing is touched: the common step of free motion
        return RigidStep(v_free, impulse, 0.0)
    cholesky = np.linalg.cholesky(mass_matrix)
    rows = np.linalg.solve(cholesky, contact_jacobian[kept].T).T
    scale = float(np.max(np.abs(contact_jacobian[kept]) @ np.abs(v_free) + np.abs(bound[kept])))
    impulse[kept], residual = _solve_step(rows, offset, scale)
    return RigidStep(v_free + np.linalg.solve(cholesky.T, rows.T @ impulse[kept]), impulse, residual)


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
