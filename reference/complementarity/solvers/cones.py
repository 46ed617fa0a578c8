"""Contacts with friction and joints on Coulomb's cones: semismooth Newton with an ADMM start, and cone programs.

ADMM minimises  ½ pᵀWp + (b + s)ᵀp  over the cones, with the shift s = mu |u_T| of Coulomb's law from the last iterate
(none if relaxed). One eigendecomposition of W serves every penalty rho, which is adapted to the residuals. Newton's
steps solve the natural map F(p) = p − proj_K(p − w) = 0, with F = w for joints. They use least squares of least norm,
because W is singular for redundant contacts. The Newton result with the smallest F is returned.
Source: Alart and Curnier, Comput. Methods Appl. Mech. Eng. 92 (1991); Carpentier, Montaut, Le Lidec, RSS (2024).

The cone program (by cvxpy) is the relaxed law,  min ½|Aᵀp|² + bᵀp  over the cones, or p >= 0. Coulomb's law is that
program with the shift added to the normal part of b. The shift depends on the solution, so the program is solved
repeatedly until the shift is constant (convergence is not guaranteed).
Source: Anitescu and Tasora, Comput. Optim. Appl. 47 (2010); Acary, Cadoux, Lemaréchal, Malick, ZAMM 91 (2011).
"""

from __future__ import annotations

import warnings
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.errors import SolverError
from reference import Floats
from reference.complementarity.problem import SYMMETRY_TOLERANCE, ImpactProblem
from reference.complementarity.solution import Answer, de_saxce_shift, project_on_cone, velocity_scale

_ITERATIONS = 20_000  # of ADMM
_TRIED = 250  # iterations before the first Newton attempt; doubled for each further attempt
_NEWTON_STEPS = 30
_BALANCE = 10.0  # ratio of ADMM's two residuals above which rho changes by the square root of the ratio
_BALANCED_EVERY = 20
_SOLVED = 1e-12  # largest |F| at unit W and b; Newton's last step leaves some hundred roundings
_SHORTEST = 2.0**-12  # of Newton's step in the line search
_DEPENDENT = 1e-11  # share of the largest singular value of F' below which a direction counts as none
_ROUNDS, _STILL = 50, 1e-9  # of cone programs; change of the shift, share of the velocity scale, at which they stop
# Backends and accuracy requested at unit W and b; the defaults are 1e-4 to 1e-6. Near the apex of cones, the natural
# map reaches its square root. Without friction, below 1e-11, Clarabel drifts along the unbounded set of impulses of
# opposed contacts (p to 6e9, residual up to 4e-6).
_CVXPY: dict[str, tuple[str, dict[str, Any]]] = {
    "socp": ("CLARABEL", {"tol_gap_abs": 1e-12, "tol_gap_rel": 1e-12, "tol_feas": 1e-12}),
    "CLARABEL": ("CLARABEL", {"tol_gap_abs": 1e-11, "tol_gap_rel": 1e-11, "tol_feas": 1e-11}),
    "OSQP": ("OSQP", {"eps_abs": 1e-9, "eps_rel": 1e-9, "max_iter": 20_000, "polishing": True, "time_limit": 10.0}),
    "SCS": ("SCS", {"eps_abs": 1e-9, "eps_rel": 1e-9, "max_iters": 20_000}),
}


def solve(problem: ImpactProblem, method: str) -> Answer:
    """Return the impulse by "newton" or by programs of _CVXPY; its residuals show whether it converged."""
    if method in _CVXPY:
        return _by_programs(problem, *_CVXPY[method])
    if problem.asymmetry > SYMMETRY_TOLERANCE:
        raise SolverError(f"refused: W is asymmetric (relative {problem.asymmetry:.1e})")
    k, m = problem.contacts, problem.contact_size
    blocks = problem.delassus.reshape(k, m, k, m)[np.arange(k), :, np.arange(k)]
    inertia = np.linalg.norm(blocks, ord=2, axis=(1, 2))
    scale = np.repeat(1.0 / np.sqrt(np.where(inertia > 0.0, inertia, 1.0)), m)
    speed = float(np.abs(scale * problem.offset).max()) or velocity_scale(problem)
    W = scale[:, None] * problem.delassus * scale
    mu = np.where(problem.two_sided, 0.0, problem.friction_or_zero)
    p, said = _admm(_Unit(0.5 * (W + W.T), scale * problem.offset / speed, mu, problem.two_sided, problem.relaxed))
    return Answer(p.ravel() * (scale * speed), said)


class _Unit(NamedTuple):
    """The problem scaled to unit blocks of W and unit b."""

    W: Floats
    b: Floats
    mu: Floats
    joints: NDArray[np.bool_]
    relaxed: bool

    def natural_map(self, p: Floats) -> Floats:
        """Return F (k, m), with Coulomb's shift in W p + b."""
        w = (self.W @ p.ravel() + self.b).reshape(p.shape)
        w = w if self.relaxed else de_saxce_shift(w, self.mu)
        return np.where(self.joints[:, None], w, p - project_on_cone(p - w, self.mu))


def _admm(unit: _Unit) -> tuple[Floats, str]:
    """Return p (k, m) and a note; Newton is tried at increasing intervals."""
    shape = (len(unit.mu), -1)
    values, vectors = np.linalg.eigh(unit.W)
    values = np.clip(values, 0.0, None)
    if values.max() == 0.0:
        return np.zeros_like(unit.b).reshape(shape), "W = 0: no impulse changes a velocity"
    rho = float(np.sqrt(values.max() * max(values[values > _DEPENDENT * values.max()].min(initial=1.0), 1e-6)))
    z, y, shift = np.zeros_like(unit.b), np.zeros_like(unit.b), np.zeros_like(unit.b)
    best, least, tried = z.reshape(shape), np.inf, _TRIED
    for done in range(1, _ITERATIONS + 1):
        right = rho * z - y - unit.b - shift
        x = vectors @ ((vectors.T @ right) / (values + rho))
        if not unit.relaxed:  # the velocity of x follows from the residual of the right side
            slip = (right - rho * x + unit.b).reshape(shape)[:, 1:]
            shift.reshape(shape)[:, 0] = unit.mu * np.linalg.norm(slip, axis=1)
        moved = (x + y / rho).reshape(shape)
        before, z = z, np.where(unit.joints[:, None], moved, project_on_cone(moved, unit.mu)).ravel()
        y += rho * (x - z)
        if done % _BALANCED_EVERY == 0:
            primal, dual = np.abs(x - z).max(), rho * np.abs(z - before).max()
            if primal > _BALANCE * dual or dual > _BALANCE * primal:
                rho *= float(np.clip(np.sqrt(primal / max(dual, 1e-300)), 0.1, 10.0))
        if done == tried:
            tried *= 2
            p, left, steps = _newton(unit, z.reshape(shape))
            if left < least:
                best, least = p, left
            if least <= _SOLVED:
                return best, f"{steps} Newton steps after {done} iterations of ADMM"
    return best, f"natural map {least:.1e} after {_ITERATIONS} iterations of ADMM"


def _newton(unit: _Unit, p: Floats) -> tuple[Floats, float, int]:
    """Return p, largest |F| and the number of steps, after F vanishes or no step reduces it."""
    from scipy.linalg import lstsq

    F = unit.natural_map(p)
    for step in range(_NEWTON_STEPS):
        if np.abs(F).max() <= _SOLVED:
            return p, float(np.abs(F).max()), step
        change = lstsq(_derivative(unit, p), -F.ravel(), _DEPENDENT, lapack_driver="gelsy")[0].reshape(p.shape)
        share = 1.0
        while share >= _SHORTEST:
            tried = unit.natural_map(p + share * change)
            if np.linalg.norm(tried) < (1.0 - 1e-4 * share) * np.linalg.norm(F):
                break
            share *= 0.5
        else:
            break
        p, F = p + share * change, tried
    return p, float(np.abs(F).max()), _NEWTON_STEPS


def _derivative(unit: _Unit, p: Floats) -> Floats:
    """Return a generalized derivative of F at p (n, n)."""
    k, m = p.shape
    w = (unit.W @ p.ravel() + unit.b).reshape(k, m)
    G = unit.W.reshape(k, m, k * m).copy()  # derivative of the shifted velocity
    if not unit.relaxed:
        slip = np.linalg.norm(w[:, 1:], axis=1)
        along = np.divide(w[:, 1:], slip[:, None], out=np.zeros_like(w[:, 1:]), where=slip[:, None] > 0.0)
        G[:, 0] += unit.mu[:, None] * np.einsum("kt,ktn->kn", along, G[:, 1:])
    D = _projection_derivative(p - (w if unit.relaxed else de_saxce_shift(w, unit.mu)), unit.mu)
    moved = np.eye(k * m).reshape(k, m, k * m)
    J = moved - np.einsum("kij,kjn->kin", D, moved - G)
    J[unit.joints] = G[unit.joints]
    return np.asarray(J.reshape(k * m, k * m))


def _projection_derivative(x: Floats, mu: Floats) -> Floats:
    """Return the derivative of the projection on each cone (k, m, m)."""
    k, m = x.shape
    tangent = np.linalg.norm(x[:, 1:], axis=1)
    inside = (x[:, 0] >= 0.0) & (tangent <= mu * x[:, 0])
    outside = ~inside & (mu * tangent <= -x[:, 0])
    along = np.divide(x[:, 1:], tangent[:, None], out=np.zeros_like(x[:, 1:]), where=tangent[:, None] > 0.0)
    normal = np.concatenate([np.ones((k, 1)), mu[:, None] * along], axis=1)  # gradient of the height, times 1 + mu²
    D = normal[:, :, None] * normal[:, None, :] / (1.0 + mu**2)[:, None, None]
    bend = np.divide(mu * (x[:, 0] + mu * tangent) / (1.0 + mu**2), tangent, out=np.zeros(k), where=tangent > 0.0)
    D[:, 1:, 1:] += bend[:, None, None] * (np.eye(m - 1) - along[:, :, None] * along[:, None, :])
    D[inside], D[outside] = np.eye(m), 0.0
    return D


def _by_programs(problem: ImpactProblem, backend: str, settings: dict[str, Any]) -> Answer:
    """Use the factor A, not a quadratic form of W, because redundant contacts make W rank deficient."""
    import cvxpy as cp

    rows, speed, mu = problem.factor, velocity_scale(problem), problem.friction_or_zero
    root = float(np.linalg.norm(rows, axis=1).max(initial=0.0)) or 1.0
    p, offset = cp.Variable(problem.size), cp.Parameter(problem.size)  # a parameter makes repeated solves cheap
    blocks = cp.reshape(p, (problem.contact_size, problem.contacts), order="F")
    rough, smooth = (np.flatnonzero(~problem.two_sided & kind) for kind in (mu > 0.0, mu == 0.0))
    cones: list[Any] = []
    if len(rough):
        cones.append(cp.SOC(cp.multiply(mu[rough], blocks[0, rough]), blocks[1:, rough]))
    if len(smooth):
        cones.append(blocks[0, smooth] >= 0.0)
        cones += [blocks[1:, smooth] == 0.0] if problem.contact_size > 1 else []
    program = cp.Problem(cp.Minimize(0.5 * cp.sum_squares((rows.T / root) @ p) + offset @ p), cones)
    shift = np.zeros(problem.contacts)
    for done in range(1, _ROUNDS + 1):
        scaled = problem.offset / speed
        scaled[:: problem.contact_size] += shift
        offset.value = scaled
        try:
            with warnings.catch_warnings():  # "may be inaccurate": the status says so too, and residuals are recomputed
                warnings.simplefilter("ignore", UserWarning)
                program.solve(solver=backend, **settings)
        except cp.error.SolverError as error:
            return Answer(None, f"{backend}: {error}")
        impulse = None if p.value is None else np.asarray(p.value) * speed / root**2
        if impulse is None or problem.friction is None or problem.relaxed:
            ended = f" in round {done}" if impulse is None and problem.friction is not None else ""
            return Answer(impulse, f"{backend}: {program.status}{ended}")
        u = problem.contact_velocity(impulse).reshape(-1, problem.contact_size)
        slipping = np.where(problem.two_sided, 0.0, mu * np.linalg.norm(u[:, 1:], axis=1))
        before, shift = shift, slipping / speed
        if np.abs(shift - before).max(initial=0.0) <= _STILL:
            return Answer(impulse, f"fixed point after {done} programs")
    return Answer(impulse, f"fixed point not reached in {_ROUNDS} programs")
