"""Dry friction in the collision response: an extension of (15)-(21) that the paper leaves to future work.

With u = Lᵀ v, rows A_n = J L⁻ᵀ and A_t = T L⁻ᵀ and P the projector onto A_n's rows, the change of velocity is split
into two orthogonal parts,

    Δu = −(1 + e) P u  +  α Bᵀ p_t,      B = A_t (I − P).

The first is the paper's impulse. The second is a tangential impulse *together with the normal impulse that keeps every
normal velocity at −e γ⁻*. Restitution is therefore met exactly, whatever the friction. p_t obeys Coulomb's law with the
tangential velocity after the impact: stick, or slip with |p_t| = μ p_n against the velocity. α ≤ 1 is the largest
factor for which the impact gains no energy. By orthogonality ΔKE(α) = −½(1−e²)|P u|² + α u·Bᵀp_t + ½ α² |Bᵀp_t|²;
if ΔKE(1) > 0, α is the positive root of ΔKE. This excludes the energy gain that Kane and Levinson found for Newton's
law with friction. If ΔKE(1) ≤ 0, then α = 1 and the impact obeys Coulomb's law.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.contact.impact_methods import ImpactInput, check_input, outcome
from iapb.contact.kernels.impact import factored_impact, make_impact_work, rank_tolerance
from iapb.contact.kernels.impact_friction import add_impact_friction, make_friction_work
from iapb.contact.kernels.unilateral import make_push_work
from iapb.errors import ArgumentError, RangeError

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class FrictionalImpact:
    """The result of an impact with friction (SI units; d velocities, c contacts, m tangents each).

    Attributes
    ----------
    velocity : (d,) v⁺; generalized_impulse : (d,) M(v⁺ − v⁻) = Jᵀp + Tᵀp_t.
    impulses : (c,) p along the normals [N s]; non-negative if non-negative impulses can produce the motion.
    tangential_impulses : (c, m) p_t [N s], |p_t| ≤ μ p at every contact that pushes, zero at the others.
    energy_change : KE⁺ − KE⁻ [J]; energy_interval : (lower, upper), its bounds in real arithmetic; upper ≤ 0.
    friction_share : factor in [0, 1] that scales friction so that the impact gains no energy and, with status
        ``"reduced"``, every contact stays in its friction cone; 1 = friction is not reduced.
    clamp : factor by which the final energy clamps against rounding scaled the change of velocity.
    status : ``"complete"``: p_t obeys Coulomb's law, up to the factor `friction_share`. ``"reduced"``: no p_t that
        obeys the law was found (there may be none). p_t then maximizes the dissipation within the friction limits of
        the frictionless impact. It stays in the friction cones, and passivity and restitution still hold.
        ``"cancelled"``: as in `resolve_impact`.
    """

    velocity: Floats
    generalized_impulse: Floats
    impulses: Floats
    tangential_impulses: Floats
    energy_change: float
    energy_interval: tuple[float, float]
    friction_share: float
    clamp: float
    status: str
    law: str = "Newton, equality, with Coulomb friction"


def resolve_frictional_impact(
    mass_matrix: ArrayLike, contact_jacobian: ArrayLike, tangents: ArrayLike, velocity: ArrayLike,
    restitution: float, friction: ArrayLike,
) -> FrictionalImpact:
    """Resolve a simultaneous impact with restitution e and Coulomb friction μ, without energy gain.

    Parameters
    ----------
    mass_matrix : (d, d) symmetric positive definite M.
    contact_jacobian : (c, d) J, unit-normal rows; every row is an equality J v⁺ = −e J v⁻ (see `resolve_impact`).
    tangents : (c, d) or (c, m, d), m = 1 (planar) or 2 (spatial): rows T of the unit tangents of each contact.
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
    Sources: Coulomb's law at velocity level is from Moreau (1988). Kane and Levinson (Dynamics, 1985) found the energy
    gain that this method prevents. The splitting into normal and tangential part is new here. At redundant contacts the
    normal impulses that limit friction are not unique. The method takes non-negative impulses near those of least norm,
    or those of least norm if some contact must pull. Both depend continuously on p_t, so the limits converge
    (`iapb.contact.kernels.impact_friction`).
    """
    given = check_friction(mass_matrix, contact_jacobian, tangents, velocity, restitution, friction)
    problem, (c, m, d) = given.problem, given.tangents.shape
    work, friction_work = make_impact_work(d, max(1, c)), make_friction_work(d, max(1, c), m)
    work.columns[:, :c] = given.normals.T
    friction_work.free[: c * m] = given.tangents.reshape(c * m, d)
    friction_work.coefficient[:c] = given.friction
    v_plus, momentum, impulses = np.empty(d), np.empty(d), np.zeros(c)
    impact = problem.mass_matrix, problem.lower, problem.velocity
    rank, before = factored_impact(*impact, given.restitution, c, rank_tolerance(problem.lower), d, True, work, v_plus,
                                   momentum)
    share, clamp, met = add_impact_friction(*impact, c, rank, work, make_push_work(d, max(1, c)), friction_work,
                                            impulses, v_plus, momentum)
    p_t = friction_work.p[: c * m].reshape(c, m)
    return _as_impact(given, v_plus, momentum, impulses, p_t, share, before * clamp, met)


def _as_impact(given: FrictionInput, v_plus: Floats, momentum: Floats, impulses: Floats, p_t: Floats, share: float,
               clamp: float, met: bool) -> FrictionalImpact:
    """Undo the scaling by powers of two; raise RangeError if a result overflows."""
    problem = given.problem
    out = outcome(problem, v_plus, momentum, np.zeros(problem.contacts), clamped=True)
    scale = np.ldexp(1.0, problem.velocity_exponent) * out.factor
    clamp *= out.factor
    status = "complete" if met else "reduced"
    found = FrictionalImpact(
        out.velocity, out.momentum, scale * impulses, scale * p_t,
        out.energy_change, out.energy_interval, share, clamp, "cancelled" if clamp == 0.0 else status,
    )
    for name in ("velocity", "generalized_impulse", "impulses", "tangential_impulses"):
        if not np.all(np.isfinite(getattr(found, name))):
            raise RangeError(name, "the impact of these magnitudes is above 1.8e308")
    return found


# The arguments of an impact with friction, checked and scaled as `check_input` does.


class FrictionInput(NamedTuple):
    """A checked impact with friction: the coordinates are scaled as in `problem`, the rows are not scaled.

    normals : (c, d); tangents : (c, m, d); restitution in [0, 1]; friction : (c,)
    """

    problem: ImpactInput
    normals: Floats
    tangents: Floats
    restitution: float
    friction: Floats


def check_friction(
    mass_matrix: ArrayLike, contact_jacobian: ArrayLike, tangents: ArrayLike, velocity: ArrayLike,
    restitution: float, friction: ArrayLike,
) -> FrictionInput:
    """Check shapes, ranges and finiteness; an ArgumentError names the wrong argument."""
    if np.ndim(restitution) != 0:
        raise ArgumentError("restitution", restitution, "one number for all contacts")
    problem = check_input(mass_matrix, contact_jacobian, velocity, restitution)
    if not 0.0 <= problem.restitution <= 1.0:
        raise ArgumentError("restitution", restitution, "a number in [0, 1]")
    scale = problem.coordinate_exponent
    rows = np.ldexp(problem.contact_jacobian, -problem.row_exponent[:, None].astype(np.int32))
    along = np.ldexp(_tangents(tangents, problem.contacts, problem.coordinates), scale.astype(np.int32))
    return FrictionInput(problem, rows, along, problem.restitution, _friction(friction, problem.contacts))


def _tangents(tangents: ArrayLike, contacts: int, coordinates: int) -> Floats:
    array = np.array(tangents, np.float64)
    if contacts == 0 and array.size == 0:
        return np.zeros((0, 1, coordinates))
    if array.ndim == 2:
        array = array[:, None, :]
    expected = f"shape ({contacts}, {coordinates}) or ({contacts}, 1 or 2, {coordinates})"
    if array.ndim != 3 or array.shape[0] != contacts or array.shape[1] not in (1, 2) or array.shape[2] != coordinates:
        raise ArgumentError("tangents", np.shape(tangents), expected)
    if not np.all(np.isfinite(array)):
        raise ArgumentError("tangents", "a number that is not finite", "finite numbers")
    return array


def _friction(friction: ArrayLike, contacts: int) -> Floats:
    array = np.array(friction, np.float64)
    if array.shape not in ((), (contacts,)):
        raise ArgumentError("friction", array.shape, f"a scalar or shape ({contacts},), one per contact")
    if not np.all((array >= 0.0) & np.isfinite(array)):
        raise ArgumentError("friction", friction, "finite numbers >= 0")
    return np.ascontiguousarray(np.broadcast_to(array, contacts))
