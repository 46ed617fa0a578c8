"""One step with rigid contacts at velocity level: one QP, or two with Poisson's law of restitution.

One step of length dt from velocity v, with generalized force f and contact rows J:

    v_free = v + dt M⁻¹ f,   v⁺ = argmin ½|v⁺ − v_free|²_M  subject to  J v⁺ >= b,   p the
    multipliers,

    b_i = −gap_i/dt          open contact (gap > CLOSED) with e_i = 0: it may close but not pass
                             (Stewart-Trinkle, Anitescu)
    b_i = −inf               open contact with e_i > 0: it acts only after it closes (Moreau)
    b_i = −e gamma_minus_i   closed contact that approaches (Newton); 0 in Poisson's step
    b_i = 0                  closed contact that does not approach; a share of −gap_i/dt if gap < 0

Poisson's step adds the impulses e p at the contacts that approached, and solves once more with the
same b. It has a solution also if Newton's law has none (opposed closed contacts with e > 0). Each
contact may have its own e_i.

Newton's step can gain energy, even with equal e_i: approaching rows get J v⁺ = −e J v⁻, but
separating rows get J v⁺ >= 0, which amounts to a different e. Example: a bar of 1 kg on two closed
contacts with e = 1, one end falling at 1 m/s and the other rising at 0.1 m/s. Then p = (0.65, 0.3)
N s, and the impulse on the other end, which comes to rest, adds 0.015 J. The contacts do the work ½
pᵀ(J v + J v⁺), or ½ pᵀ(J v_free + J v⁺) after the forces. If e > 0 and both are positive, Poisson's
step is used, which never gains energy. Source: Moreau, in Nonsmooth Mechanics and Applications
(1988); Stewart and Trinkle, Int. J. Numer. Methods Eng. 39 (1996); Anitescu and Potra, Nonlinear
Dynamics 14 (1997).

With dry friction (`friction_step`) the step's contacts are blocks (normal, one tangent in the plane
or two in space): K ∋ p ⟂ w + mu |w_T| n ∈ K*, where w is J v⁺ − b on the normals and the tangential
velocity after the step. The problem is first solved for the closing contacts alone. Contacts that
close under this solution are then added, and it is solved again; the last solution solves the whole
problem. Contacts without a common body (zero blocks of W) form separate problems, the islands.
Source: Stewart and Trinkle (1996); Anitescu and Tasora, Comput. Optim. Appl. 47 (2010).
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from iapb.errors import SolverError
from reference import Floats
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import SOLVED_TOLERANCE, Solution
from reference.complementarity.solvers import solve
from reference.complementarity.solvers.qp import daqp, quadprog
from reference.complementarity.solvers.sweeps import projected_sweeps

# Active-set solutions have errors of a few hundred roundings of the velocities; a larger error
# means a wrong set.
STEP_TOLERANCE = 1e-10
# Velocities that cancel leave rounding errors even with the right active set: a box of 1 g under a
# tonne gets 250 m/s from above and as much from below. Each is a sum of some dozens of products.
STEP_ROUNDING = 100.0 * float(np.finfo(np.float64).eps)

# [m] A contact with a smaller gap is closed: above the rounding of positions within a kilometre.
CLOSED = 1e-12

# Active sets cycle for some redundant rows, projections do not.
STEP_SOLVERS = {"daqp": daqp, "quadprog": quadprog, "gauss_seidel": projected_sweeps}

# Gauss-Seidel reaches 1e-13 of the velocities if it converges; such a solution is accepted at once.
# On hyperstatic contacts it converges slowly, and an interior point stops at the square root of its
# accuracy. Then the best solution is accepted if it reaches the tolerance of
# `reference.complementarity`.
CONVERGED = 1e-8
FRICTION_TOLERANCE = SOLVED_TOLERANCE
FRICTION_SOLVERS = ("nsgs", "pinocchio_admm", "cvxpy_socp")


class RigidStep(NamedTuple):
    """Result of one rigid step."""

    velocity: Floats  #: (d,) v⁺
    #: (c,) p >= 0 [N s], zero for contacts left out; not unique for redundant contacts
    impulse: Floats
    residual: float  #: recomputed natural-map residual of the step's LCP, relative to the velocities involved


class StepContacts(NamedTuple):
    """The c contacts of a step."""

    jacobian: Floats  #: (c, d) unit-normal rows
    gap: Floats  #: (c,) [m]
    restitution: float | Floats  #: e in [0, 1], one for all contacts or (c,)
    removed: float | Floats = 0.0  #: share in [0, 1] of an overlap that this step removes, or (c,)


def rigid_step(
    mass_matrix: Floats,
    velocity: Floats,
    force: Floats,
    dt: float,
    contacts: StepContacts,
    together: bool = False,
) -> RigidStep:
    """Advance v (d,) by dt [s] under generalized force f (d,) and unilateral contacts.

    Parameters
    ----------
    together : whether open contacts with e > 0 act, too: Stewart-Trinkle's step for all, with
        Poisson's law if an e > 0

    If Newton's law has no solution (opposed closed contacts with e > 0) or would gain energy, the
    step uses Poisson's law.

    Raises
    ------
    SolverError
        No solver reaches a residual of STEP_TOLERANCE; the message gives the number of contacts and
        each solver's text.
    """
    contact_jacobian, gap, restitution, removed = contacts
    gamma_minus = contact_jacobian @ velocity
    bounces = bool(np.any(restitution))
    bound = velocity_bounds(gap, gamma_minus, restitution, dt, removed, together)
    v_free = velocity + dt * solve_mass(mass_matrix, force)
    poisson = together and bounces
    if not poisson:
        try:
            newton = nearest_velocity(mass_matrix, v_free, contact_jacobian, bound)
            # With e = 0 the step is a projection onto a set with v = 0, so it cannot gain energy.
            if not bounces or not _gains(newton, contact_jacobian, gamma_minus, v_free):
                return newton
        except SolverError:
            if not bounces or np.count_nonzero(gap <= 0.0) < 2:
                raise
    compression = velocity_bounds(gap, gamma_minus, 0.0, dt, removed if poisson else 0.0)
    compression = np.where(np.isfinite(bound), compression, -np.inf)
    compressed = nearest_velocity(mass_matrix, v_free, contact_jacobian, compression)
    returned = np.where(gamma_minus < 0.0, restitution, 0.0) * compressed.impulse
    bounced = compressed.velocity + solve_mass(mass_matrix, contact_jacobian.T @ returned)
    kept = nearest_velocity(mass_matrix, bounced, contact_jacobian, compression)
    impulse = compressed.impulse + returned + kept.impulse
    return RigidStep(kept.velocity, impulse, max(compressed.residual, kept.residual))


def _gains(step: RigidStep, contact_jacobian: Floats, gamma_minus: Floats, v_free: Floats) -> bool:
    """Whether the works of the contacts, ½ pᵀ(γ⁻ + γ⁺) and ½ pᵀ(γ_free + γ⁺), are both positive
    beyond rounding."""
    gamma_plus = contact_jacobian @ step.velocity
    gamma_free = contact_jacobian @ v_free
    # includes γ_free, the effect of the load: at rest, γ⁻ is rounding error of either sign
    size = float(step.impulse @ (np.abs(gamma_minus) + np.abs(gamma_free) + np.abs(gamma_plus)))
    work = min(float(step.impulse @ (gamma + gamma_plus)) for gamma in (gamma_minus, gamma_free))
    return work > STEP_TOLERANCE * size


def nearest_velocity(
    mass_matrix: Floats, v_free: Floats, contact_jacobian: Floats, bound: Floats
) -> RigidStep:
    """Return the velocity nearest to v_free in the kinetic metric with J v >= bound; −inf ignores a
    row.

    The impulse is that of the first solver whose recomputed residual is at most STEP_TOLERANCE or
    rounding.
    """
    impulse = np.zeros(len(bound))
    kept = np.isfinite(bound)
    offset = contact_jacobian[kept] @ v_free - bound[kept]
    if (offset >= 0.0).all():  # no contact acts: the common step of free motion
        return RigidStep(v_free, impulse, 0.0)
    factor = _cholesky(mass_matrix)
    said = list[str]()
    rows = _whitened(factor, contact_jacobian[kept])
    scale = _scale(contact_jacobian, v_free, bound)
    for name, solver in STEP_SOLVERS.items():
        if name == "gauss_seidel" and "infeasible" in said[0]:
            break
        try:
            p = solver(rows, offset)
        except SolverError as error:
            said.append(str(error))
            continue
        natural, cancelling = _natural(rows, p, offset)
        residual = natural / scale
        if residual <= max(STEP_TOLERANCE, STEP_ROUNDING * cancelling / scale):
            impulse[kept] = p
            return RigidStep(v_free + _back(factor, rows.T @ p), impulse, residual)
        said.append(f"{name}: residual {residual:.1e}")
    raise SolverError(
        f"rigid step with {len(offset)} contacts has no accepted solution: " + "; ".join(said)
    )


def solve_mass(mass_matrix: Floats, right: Floats) -> Floats:
    """Return M⁻¹ b for one vector b (d,)."""
    factor = _cholesky(mass_matrix)
    return np.asarray(_back(factor, _whitened(factor, right[None])[0]))


@numba.njit(cache=True, fastmath=False)
def _cholesky(mass):  # type: ignore[no-untyped-def]
    """Return the lower L of M = L Lᵀ; for such small matrices, numpy's call overhead would
    dominate."""
    factor = np.zeros_like(mass)
    for j in range(len(mass)):
        for i in range(j, len(mass)):
            rest = mass[i, j]
            for k in range(j):
                rest -= factor[i, k] * factor[j, k]
            if i == j:
                if not rest > 0.0:
                    raise np.linalg.LinAlgError("Matrix is not positive definite")
                factor[j, j] = np.sqrt(rest)
            else:
                factor[i, j] = rest / factor[j, j]
    return factor


@numba.njit(cache=True, fastmath=False)
def _whitened(factor, rows):  # type: ignore[no-untyped-def]
    """Return the rows J L⁻ᵀ."""
    found = np.empty(rows.shape)
    for c in range(len(rows)):
        for i in range(len(factor)):
            rest = rows[c, i]
            for k in range(i):
                rest -= factor[i, k] * found[c, k]
            found[c, i] = rest / factor[i, i]
    return found


@numba.njit(cache=True, fastmath=False)
def _back(factor, right):  # type: ignore[no-untyped-def]
    """Return L⁻ᵀ b."""
    found = np.empty(len(right))
    for i in range(len(right) - 1, -1, -1):
        rest = right[i]
        for k in range(i + 1, len(right)):
            rest -= factor[k, i] * found[k]
        found[i] = rest / factor[i, i]
    return found


@numba.njit(cache=True, fastmath=False)
def _scale(jacobian, velocity, bound):  # type: ignore[no-untyped-def]
    """Return the largest sum of the terms [m/s] of a row of J v − b, of those with a bound."""
    largest = 0.0
    for c in range(len(bound)):
        terms = abs(bound[c])
        for k in range(len(velocity)):
            terms += abs(jacobian[c, k] * velocity[k])
        if np.isfinite(terms):
            largest = max(largest, terms)
    return largest


@numba.njit(cache=True, fastmath=False)
def _natural(rows, impulse, offset):  # type: ignore[no-untyped-def]
    """Return the largest |min(W_ii p_i, w_i)| [m/s] of 0 <= p ⟂ w = A Aᵀ p + b >= 0, and the
    largest sum of the terms that cancel in A Aᵀ p."""
    count, d = rows.shape
    change = np.zeros(d)
    size = np.zeros(d)
    for c in range(count):
        for k in range(d):
            change[k] += rows[c, k] * impulse[c]
            size[k] += abs(rows[c, k] * impulse[c])
    natural = 0.0
    cancelling = 0.0
    for c in range(count):
        diagonal = 0.0
        w = offset[c]
        terms = 0.0
        for k in range(d):
            diagonal += rows[c, k] ** 2
            w += rows[c, k] * change[k]
            terms += abs(rows[c, k]) * size[k]
        natural = max(natural, abs(min(diagonal * impulse[c], w)))
        cancelling = max(cancelling, terms)
    return natural, cancelling


def velocity_bounds(
    gap: Floats,
    gamma_minus: Floats,
    restitution: float | Floats,
    dt: float,
    removed: float | Floats = 0.0,
    together: bool = False,
) -> Floats:
    """Return b (c,) of J v⁺ >= b [m/s], for one e or e (c,); −inf marks contacts that the step
    ignores."""
    closing = np.where(together or np.equal(restitution, 0.0), -gap / dt, -np.inf)
    bounced = 0.0 if together else restitution * np.maximum(-gamma_minus, 0.0)
    back = removed * np.maximum(-gap, 0.0) / dt
    return np.where(gap > CLOSED, closing, np.maximum(bounced, back))


def friction_step(
    mass_matrix: Floats,
    v_free: Floats,
    normal_rows: Floats,
    tangent_rows: Floats,
    bound: Floats,
    friction: float | Floats,
) -> tuple[Floats, Floats, Floats]:
    """Return v⁺ (d,), normal (c,) and tangential impulses (c, s) [N s] of one step.

    Parameters
    ----------
    normal_rows : (c, d) unit-normal rows; tangent_rows : (c, s, d) rows of s = 1 (plane) or 2
        (space) unit tangents
    bound : (c,) lower bounds of the normal velocities after the step [m/s]; −inf ignores a contact
    friction : mu >= 0, one for all contacts or (c,)

    Raises
    ------
    SolverError
        No solver reaches FRICTION_TOLERANCE; the message gives the number of contacts and each
        solver's text.
    """
    blocks = np.concatenate([normal_rows[:, None], tangent_rows], axis=1)
    count, size = blocks.shape[:2]
    mu = np.broadcast_to(np.asarray(friction, np.float64), count)
    impulse = np.zeros((count, size))
    velocity = v_free
    taken = np.zeros(count, np.bool_)
    while (closing := ~taken & (normal_rows @ velocity < bound)).any():
        taken |= closing
        rows = blocks[taken].reshape(-1, len(v_free))
        offset = rows @ v_free
        offset[::size] -= bound[taken]
        response = np.linalg.solve(mass_matrix, rows.T)
        impulse[taken] = _by_islands(rows @ response, offset.reshape(-1, size), mu[taken])
        velocity = v_free + response @ impulse[taken].ravel()
    return velocity, impulse[:, 0], impulse[:, 1:]


def _by_islands(w: Floats, offset: Floats, friction: Floats) -> Floats:
    """Return p (k, size) for offset (k, size) [m/s]: of each island, the first that converges, or
    the best."""
    from scipy.sparse.csgraph import connected_components

    count, size = offset.shape
    blocks = w.reshape(count, size, count, size)
    impulse = np.zeros_like(offset)
    islands, island = connected_components((blocks != 0.0).any(axis=(1, 3)), directed=False)
    for mine in (np.flatnonzero(island == k) for k in range(islands)):
        problem = ImpactProblem.from_delassus(
            blocks[mine][:, :, mine].reshape(len(mine) * size, -1),
            offset[mine].ravel(),
            0.0,
            friction[mine],
            contact_size=size,
        )
        found: list[Solution] = []
        while len(found) < len(FRICTION_SOLVERS) and not (found and found[-1].solved(CONVERGED)):
            found.append(solve(problem, FRICTION_SOLVERS[len(found)]))
        best = (
            found[-1]
            if found[-1].solved(CONVERGED)
            else min(found, key=lambda one: one.residuals.worst)
        )
        if not best.solved(FRICTION_TOLERANCE):
            said = "; ".join(
                f"{x.solver}: residual {x.residuals.worst:.1e}, {x.note}" for x in found
            )
            raise SolverError(
                f"rigid step with friction and {len(mine)} contacts has no accepted solution: {said}"
            )
        impulse[mine] = best.answer().reshape(-1, size)
    return impulse
