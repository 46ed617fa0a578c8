"""Dry friction in the collision response: an extension of (15)-(21) that the paper leaves to the future.

With u = Lᵀ v, rows A_n = J L⁻ᵀ and A_t = T L⁻ᵀ and P the projector onto A_n's rows, the change of velocity is split
into two orthogonal parts,

    Δu = −(1 + e) P u  +  α Bᵀ p_t,      B = A_t (I − P).

The first is the paper's impulse. The second is a tangential impulse *together with the normal impulse that keeps every
normal velocity at −e γ⁻*: so restitution is met exactly whatever friction does. p_t obeys Coulomb's law with the
tangential velocity after the impact (stick, or slip against it at |p_t| = μ p_n); α ≤ 1 is the largest factor for
which the impact gains no energy. By orthogonality ΔKE(α) = −½(1−e²)|P u|² + α u·Bᵀp_t + ½ α² |Bᵀp_t|², whose root
is α: Kane and Levinson's gain of Newton's law with friction cannot occur, and where it would not, α = 1 and the
outcome is Coulomb's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.contact.impact_laws_input import FrictionInput, check_friction
from iapb.contact.kernels.cholesky import to_whitened, whiten_columns
from iapb.contact.kernels.compensated import kinetic_energies
from iapb.contact.kernels.friction import friction_sweeps
from iapb.contact.kernels.impact import apply_change, make_impact_work, rank_tolerance
from iapb.contact.kernels.projector import orthonormal_basis, projected_change, unit_columns
from iapb.contact.kernels.unilateral import make_push_work, push_only
from iapb.errors import RangeError

Floats = NDArray[np.float64]

_ROUNDS = 200  # updates of the friction limits μ p_n, which depend on the tangential impulses
_UNDAMPED = 20  # rounds after which the limits move half way only: large μ can make them swing
_SWEEPS = 100  # within each round
_STILL = 1e-13  # of the largest velocity: a sweep, or an update of the limits, that moves less is the last one
_PUSHES = 1e-9  # share of the normal impulse that a non-negative choice may leave unexplained: an active set's rounding


@dataclass(frozen=True)
class FrictionalImpact:
    """What an impact with friction does (SI units; d velocities, c contacts, m tangents each).

    Attributes
    ----------
    velocity : (d,) v⁺; generalized_impulse : (d,) M(v⁺ − v⁻) = Jᵀp + Tᵀp_t.
    impulses : (c,) p along the normals [N s]: non-negative where some non-negative choice gives the motion.
    tangential_impulses : (c, m) p_t [N s], |p_t| ≤ μ p at every contact that pushes, zero at the others.
    energy_change : KE⁺ − KE⁻ [J], never positive beyond rounding.
    friction_share : α in [0, 1], by which friction was reduced so that no energy is gained; 1 = Coulomb's law.
    clamp : factor of the final clamp against rounding.
    status : ``"complete"``, or ``"not converged"``: Coulomb's law is then met only approximately, passivity and
        restitution as ever.
    """

    velocity: Floats
    generalized_impulse: Floats
    impulses: Floats
    tangential_impulses: Floats
    energy_change: float
    friction_share: float
    clamp: float
    status: str
    law: str = "Newton, equality, with Coulomb friction"


class _Split(NamedTuple):
    """The impact in whitened coordinates: rows, the paper's change, and what friction can still move."""

    u: Floats  # (d,)
    normal: Floats  # (c, d) A_n
    tangent: Floats  # (c m, d) A_t
    basis: Floats  # (r, d) of A_n's rows
    change: Floats  # (d,) −(1+e) P u
    free: Floats  # (c m, d) B


def resolve_frictional_impact(
    mass_matrix: ArrayLike, contact_jacobian: ArrayLike, tangents: ArrayLike, velocity: ArrayLike,
    restitution: float, friction: ArrayLike,
) -> FrictionalImpact:
    """Resolve a simultaneous impact with restitution e and Coulomb friction μ; never gains energy.

    Parameters
    ----------
    mass_matrix : (d, d) symmetric positive definite M.
    contact_jacobian : (c, d) J, unit-normal rows; every row is an equality J v⁺ = −e J v⁻ (see `resolve_impact`).
    tangents : (c, d) or (c, m, d), m = 1 (planar) or 2 (spatial): unit tangents' rows T of each contact.
    velocity : (d,) v⁻.
    restitution : e in [0, 1], one for all contacts.
    friction : μ ≥ 0, one or (c,).

    Returns
    -------
    FrictionalImpact
        v⁺ (d,) [m/s | rad/s], normal and tangential impulses [N s], energy change [J].

    Raises
    ------
    ArgumentError, RangeError
        As `resolve_impact`; also for tangents or friction of the wrong shape or range.

    Notes
    -----
    Source: the split is ours; Coulomb's law at velocity level is Moreau's (1988); the gain it prevents is Kane and
    Levinson's (Dynamics, 1985). Which normal impulses limit friction at redundant contacts is not determined: here
    the non-negative ones found by least squares, and where some contact truly pulls, the least-norm ones.
    """
    given = check_friction(mass_matrix, contact_jacobian, tangents, velocity, restitution, friction)
    split = _split(given)
    p_t, converged = _coulomb(split, given.friction, given.tangents.shape[1])
    without, wanted = _normal_impulses(split, np.zeros(p_t.size)), _normal_impulses(split, p_t.ravel())
    within = _share_within_cone(without, wanted, p_t, given.friction)
    moved = within * (split.free.T @ p_t.ravel())
    alpha = _passive_share(split, moved, given.restitution)
    share = alpha * within
    impulses = without + share * (wanted - without)
    return _as_impact(given, split.change + alpha * moved, impulses, share * p_t, alpha, converged)


def _split(given: FrictionInput) -> _Split:
    """Whiten everything and take the normal part of the impact out."""
    (c, m, d), problem = given.tangents.shape, given.problem
    u, change, basis, work = np.empty(d), np.empty(d), np.zeros((d, d)), make_impact_work(d, max(1, c))
    to_whitened(problem.lower, problem.velocity, u)
    normal = _whitened(problem.lower, given.normals)
    work.columns[:, :c] = normal.T
    unit_columns(work.columns, c, work.length)
    rank = orthonormal_basis(work.columns, c, u, rank_tolerance(problem.lower), d, basis, work.closing, work.size,
                             work.overlap)
    projected_change(basis, rank, u, 1.0 + given.restitution, change)
    tangent, basis = _whitened(problem.lower, given.tangents.reshape(c * m, d)), basis[:rank]
    free = tangent.copy()
    for _ in range(2):  # twice is enough to be orthogonal to rounding (Kahan, in Parlett 1980)
        free -= (free @ basis.T) @ basis
    free[np.linalg.norm(free, axis=1) <= _STILL * np.linalg.norm(tangent, axis=1)] = 0.0
    return _Split(u, normal, tangent, basis, change, free)


def _whitened(lower: Floats, rows: Floats) -> Floats:
    """Rows times L⁻ᵀ."""
    columns = np.ascontiguousarray(rows.T)
    whiten_columns(lower, columns, len(rows))
    return np.ascontiguousarray(columns.T)


def _coulomb(split: _Split, friction: Floats, size: int) -> tuple[Floats, bool]:
    """Tangential impulses (c, m) of Coulomb's law, their limits updated until they stay; whether they did."""
    count = len(friction)
    of_contact = split.free.reshape(count, size, len(split.u))
    inertia = np.linalg.norm(of_contact @ of_contact.transpose(0, 2, 1), ord=2, axis=(1, 2)) if count else np.zeros(0)
    slip = split.tangent @ (split.u + split.change)
    p, moved, scratch = np.zeros(count * size), np.zeros(len(split.u)), np.zeros(size)
    still = _STILL * float(np.abs(slip).max(initial=0.0))
    sliding = np.where(_normal_impulses(split, p) > 0.0, friction, 0.0)  # what pulls without friction carries none
    radius = np.zeros(count)
    for done in range(_ROUNDS):
        wanted = sliding * np.maximum(_normal_impulses(split, p), 0.0)
        change = (1.0 if done < _UNDAMPED else 0.5) * (wanted - radius)
        radius = radius + change
        swept = friction_sweeps(split.free, slip, radius, inertia, p, moved, scratch, _SWEEPS, still)
        if swept >= 0 and np.all(inertia * np.abs(change) <= still):
            return p.reshape(count, size), True
    return p.reshape(count, size), not slip.any()


def _normal_impulses(split: _Split, p_t: Floats) -> Floats:
    """p (c,) along the normals that go with p_t: non-negative where that explains the motion, else of least norm."""
    wanted = split.change - split.basis.T @ (split.basis @ (split.tangent.T @ p_t))
    count, size = len(split.normal), float(np.linalg.norm(wanted))
    if count == 0 or size == 0.0:
        return np.zeros(count)
    length = np.linalg.norm(split.normal, axis=1)
    unit = split.normal / np.where(length > 0.0, length, 1.0)[:, None]
    pushes, left, scratch = np.zeros(count), np.zeros(len(wanted)), make_push_work(len(wanted), count)
    found = push_only(np.ascontiguousarray(unit.T), count, -wanted / size, pushes, left, scratch)
    if found and np.linalg.norm(left) <= _PUSHES:
        return size * pushes / np.where(length > 0.0, length, 1.0)
    return np.asarray(np.linalg.lstsq(split.normal.T, wanted)[0], np.float64)


def _share_within_cone(without: Floats, wanted: Floats, p_t: Floats, friction: Floats) -> float:
    """Largest common factor β of p_t with β |p_t| ≤ μ p(β) at every contact, p(β) linear between the two."""
    length = np.linalg.norm(p_t, axis=1)
    excess, room = length - friction * wanted, friction * np.maximum(without, 0.0)
    over = (excess > 0.0) & (length > 0.0)
    return float(np.min(np.where(over, room / np.where(over, room + excess, 1.0), 1.0), initial=1.0))


def _passive_share(split: _Split, moved: Floats, restitution: float) -> float:
    """Largest α in [0, 1] with ½|Δ_t|² α² + (u·Δ_t) α <= loss of the normal part: the whole impact gains no energy."""
    square, along = float(moved @ moved), float(split.u @ moved)
    lost = 0.5 * (1.0 - restitution) / (1.0 + restitution) * float(split.change @ split.change)
    if square == 0.0 or 0.5 * square + along <= lost:
        return 1.0
    root = math.sqrt(along * along + 2.0 * square * lost)
    return min(1.0, (root - along) / square if along <= 0.0 else 2.0 * lost / (root + along))


def _as_impact(given: FrictionInput, change: Floats, impulses: Floats, p_t: Floats, alpha: float,
               converged: bool) -> FrictionalImpact:
    """Clamp what rounding left, undo the scaling by powers of two, and refuse what overflows."""
    problem, d = given.problem, len(change)
    work, v_plus, momentum = make_impact_work(d, 1), np.empty(d), np.empty(d)
    work.change[:] = change
    clamp = apply_change(problem.mass_matrix, problem.lower, problem.velocity, True, work, v_plus, momentum)
    scale = np.ldexp(1.0, problem.velocity_exponent)
    _, energy = kinetic_energies(problem.mass_matrix, problem.velocity, v_plus)
    found = FrictionalImpact(
        problem.unscale_velocity(v_plus), problem.unscale_momentum(momentum), clamp * scale * impulses,
        clamp * scale * p_t, problem.unscale_energy(energy), alpha, clamp,
        "complete" if converged else "not converged",
    )  # fmt: skip
    for name in ("velocity", "generalized_impulse", "impulses", "tangential_impulses"):
        if not np.all(np.isfinite(getattr(found, name))):
            raise RangeError(name, "the impact of these magnitudes is above 1.8e308")
    return found
