"""Three contracts of an impact resolver: the arguments that it gets, and the laws that its answer
keeps.

``equality``: J v⁺ = −e J v⁻ on every row, impulses of either sign (the paper's (15)); its laws are
`LAWS`. In the other two contracts, contacts only push. With u = Lᵀv, A = J L⁻ᵀ, γ = J v and Δu = u⁺
− u⁻ = Aᵀp:

- ``unilateral``, Newton and Moreau: 0 ≤ p ⟂ γ⁺ + e γ⁻ ≥ 0 (Moreau 1988; Glocker and Pfeiffer
  1995);
- ``unilateral``, Poisson: 0 ≤ p_c ⟂ γ_c ≥ 0, then 0 ≤ p − (1 + e) p_c ⟂ γ⁺ ≥ 0 (Anitescu and Potra
  1997);
- ``frictional``, Coulomb: K ∋ p ⟂ w + μ|w_t| n ∈ K*, with w = γ⁺ + e γ⁻ on the normals (Moreau
  1988; de Saxcé and Feng 1998).

If every contact approaches and e is one number, Newton's and Poisson's laws have the same v⁺: p =
(1 + e) p_c solves both, and v⁺ is unique. If only some contacts approach, the two laws differ, and
v⁺ must satisfy one of them. Both kinds of resolver therefore keep all of UNILATERAL_LAWS. For a
resolver with another law of restitution (sequential contacts, an energetic coefficient) choose the
laws with ``laws=``: all laws hold for any contacts that only push, except ``restitution``,
``complementarity``, ``mixed_restitution``, ``elastic``, and those that compare calls.

Coulomb's law with e > 0 may gain energy (Kane and Levinson 1985); ``kinetic_energy`` detects this
gain. The laws for tangents use e = 0, for which all forms of Coulomb's law agree; they check one
contact, and ``maximal_dissipation`` all contacts together if their rows are independent. The convex
relaxation (Anitescu and Tasora 2010) gives impulses to contacts that separate while they slide, and
breaks ``separating``. A friction pyramid inside the cone breaks, with two tangents,
``maximal_dissipation``; one around it breaks ``cone``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from iapb.errors import SolverError
from reference.complementarity.solution import project_on_cone
from reference.complementarity.solvers.qp import daqp
from reference.exact import relative_energy_gain
from verification.impacts import (
    Floats,
    ImpactCase,
    adverse_cases,
    draw_frictional_case,
    draw_one_sided_case,
    draw_wide_case,
    over,
)
from verification.laws.bounds import KIT, ONE_SIDED, Bounds, Found, Law, law
from verification.laws.equality import (
    COMPARING,
    LAWS,
    elastic_conserves,
    impulse_comes_from_the_contacts,
)
from verification.laws.resolver import Resolver, outcome, own_outcome

TOUCHING = 1e-12  # relative to ‖Aᵢ‖ |u|: a smaller normal velocity counts as zero
# Laws that call the resolver on variants of an impact.
OF_VARIANTS = (
    *COMPARING,
    "no_impulse",
    "elastic",
    "separating",
    "sticking",
    "friction_opposes",
    "maximal_dissipation",
)
CLEAR = 0.05  # least singular value of one contact's unit rows, for laws that need its impulse
NEAR = 1e-8  # distance from a cone that counts as none

UNILATERAL_LAWS: dict[str, Law] = {name: LAWS[name] for name in ("kinetic_energy", "impulse_range")}
FRICTIONAL_LAWS: dict[str, Law] = UNILATERAL_LAWS | {
    "impulse_range": Law("M(v⁺ − v⁻) lies in range([Jᵀ Tᵀ])", LAWS["impulse_range"].check)
}


def _normal_velocities(case: ImpactCase, velocity: Floats) -> Floats:
    """Return γᵢ / (‖Aᵢ‖ |u⁻|) (c,); 0 on zero rows, infinite if motion appears from rest."""
    gamma = case.contact_jacobian @ velocity
    scale = np.linalg.norm(case.rows, axis=1) * case.speed
    appeared = np.where(gamma == 0.0, 0.0, np.copysign(np.inf, gamma))
    return np.divide(gamma, scale, out=appeared, where=scale > 0.0)


def _before_and_after(case: ImpactCase, resolver: Resolver) -> tuple[Floats, Floats]:
    """γ⁻ and γ⁺, each (c,), relative to ‖Aᵢ‖ |u⁻|."""
    return _normal_velocities(case, case.velocity), _normal_velocities(
        case, own_outcome(resolver, case)
    )


def _all_approach(case: ImpactCase) -> bool:
    return bool(np.all(_normal_velocities(case, case.velocity) <= TOUCHING))


def _change(case: ImpactCase, resolver: Resolver) -> Floats:
    """Δu (d,) of the resolver's answer."""
    return case.lower.T @ (own_outcome(resolver, case) - case.velocity)


@law(UNILATERAL_LAWS, "pushing", "M(v⁺ − v⁻) = Jᵀp with p ≥ 0: no contact pulls")
@law(FRICTIONAL_LAWS, "cone", "M(v⁺ − v⁻) = Jᵀp + Tᵀp_t with |p_t| ≤ μ p at every contact")
def contacts_only_push(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """Distance of Δu, projected on the span of the rows, from {Aᵀp : p ≥ 0}; with friction from the
    sum of cones.

    p is not unique, so the law holds if any such p explains the motion.
    """
    every = case.with_tangents
    if not every.is_separated or case.speed == 0.0:
        return None
    seen = every.row_space.T @ (every.row_space @ _change(case, resolver))
    distance = distance_from_cone(case, seen / case.speed)
    return None if np.isnan(distance) else (distance, bounds.restitution)


def pushed(rows: Floats, target: Floats) -> Floats:
    """Return the point Aᵀp (d,) with p ≥ 0 that is closest to the target (d,); NaN if daqp finds
    none, or one that breaks 0 ≤ p ⟂ A(Aᵀp − target) ≥ 0 by more than NEAR.

    A contact of its own, along a direction of its own, gives daqp's accuracy the target's scale.
    """
    every = np.pad(np.asarray(rows, np.float64), ((0, 1), (0, 1)))
    every[-1, -1] = 1.0
    whole = np.append(np.asarray(target, np.float64), np.linalg.norm(target))
    try:
        p = daqp(every, -every @ whole)[:-1]
    except SolverError:
        p = np.full(len(rows), np.nan)
    point = np.asarray(rows.T @ p)
    beyond = point - target
    size = float(np.linalg.norm(target))
    length = np.linalg.norm(rows, axis=1)
    pushes = np.all(p * length >= -NEAR * size)
    no_closer = np.all(rows @ beyond >= -NEAR * size * length)
    orthogonal = abs(point @ beyond) <= NEAR * size**2
    return point if pushes and no_closer and orthogonal else np.full(len(point), np.nan)


def distance_from_cone(case: ImpactCase, target: Floats) -> float:
    """Return the least |Aᵀp − target| over impulses p that push, each inside its friction cone.

    Normal impulses alone are tried first, by daqp. Then Clarabel's interior points solve the
    cone program  min t  with |target − Aᵀp| ≤ t. Its p is moved into the cones, so the distance is
    never too small. It is NEAR or less if the target lies in the cones, and NaN if the program's
    dual value does not show that no other p halves it.
    """
    # extra packages, which the laws of equality do not need
    import clarabel
    from scipy.sparse import csc_matrix

    nearest = float(np.linalg.norm(target - pushed(case.rows, target)))
    if nearest <= NEAR:
        return nearest
    (c, d) = case.rows.shape
    m = 0 if case.tangents is None else case.tangents.shape[1]
    tangents = case.with_tangents.rows[c:].reshape(c, m, d)
    blocks = np.concatenate([case.rows[:, None], tangents], axis=1)
    size = np.linalg.norm(blocks, axis=(1, 2), keepdims=True)
    rows = np.divide(blocks, size, out=blocks, where=size > 0.0).reshape(-1, d)
    unknowns = np.eye(1 + len(rows))  # t, then p
    impulses = unknowns[1:]
    normal = impulses[:: 1 + m]
    within = impulses.copy()
    within[:: 1 + m] *= case.mu[:, None]
    apart = np.vstack([unknowns[:1], -rows.T @ impulses])  # to which the target is added
    values = [apart, normal]
    cones = [clarabel.SecondOrderConeT(1 + d), clarabel.NonnegativeConeT(c)]
    if m:
        values.append(within)
        cones += c * [clarabel.SecondOrderConeT(1 + m)]
    matrix = np.vstack(values)
    given = np.zeros(len(matrix))
    given[1 : 1 + d] = target
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-12
    found = clarabel.DefaultSolver(
        csc_matrix(unknowns.shape), unknowns[0], csc_matrix(-matrix), given, cones, settings
    ).solve()
    p = project_on_cone(np.reshape(found.x[1:], (c, 1 + m)), case.mu)
    nearest = float(np.fmin(nearest, np.linalg.norm(target - p.ravel() @ rows)))
    return nearest if nearest <= NEAR or found.obj_val_dual > 0.5 * nearest else np.nan


@law(UNILATERAL_LAWS, "no_penetration", "γ⁺ ≥ min(0, −e γ⁻): no contact is left approaching")
def nothing_is_driven_in(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """Largest of min(0, −e γ⁻) − γ⁺, relative to ‖Aᵢ‖ |u|, for any law of restitution."""
    before, after = _before_and_after(case, resolver)
    return float(
        np.max(np.minimum(0.0, -case.restitution * before) - after, initial=0.0)
    ), bounds.restitution


@law(UNILATERAL_LAWS, "restitution", "γ⁺ ≥ −e γ⁻ where every contact approaches")
def restitution_is_met_or_exceeded(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """Largest of −e γ⁻ − γ⁺, relative to ‖Aᵢ‖ |u|: Newton's inequality, which Poisson's law with
    one e keeps, too."""
    if not _all_approach(case):
        return None
    before, after = _before_and_after(case, resolver)
    return float(np.max(-case.restitution * before - after, initial=0.0)), bounds.restitution


@law(UNILATERAL_LAWS, "complementarity", "p ⟂ γ⁺ + e γ⁻ where every contact approaches")
def pushing_contacts_meet_restitution(
    case: ImpactCase, resolver: Resolver, bounds: Bounds
) -> Found:
    """|pᵀ(γ⁺ + e γ⁻)| / |u⁻|² = |Δu·(u⁺ + e u⁻)| / |u⁻|²: known without p, which redundant rows do
    not determine."""
    if not _all_approach(case) or case.speed == 0.0:
        return None
    u = case.u
    change = _change(case, resolver)
    value = abs(float(change @ (change + (1.0 + case.restitution) * u))) / case.speed**2
    return value, 2.0 * bounds.restitution


@law(
    UNILATERAL_LAWS,
    "mixed_restitution",
    "v⁺ is Newton's or Poisson's where some contacts approach and others separate",
)
def mixed_impacts_follow_newton_or_poisson(
    case: ImpactCase, resolver: Resolver, bounds: Bounds
) -> Found:
    """Smaller of the distances of v⁺ from Newton's and from Poisson's v⁺; each of these is unique
    (a projection)."""
    before = _normal_velocities(case, case.velocity)
    if (
        not case.is_separated
        or case.speed == 0.0
        or not np.any(before < -TOUCHING)
        or not np.any(before > TOUCHING)
    ):
        return None
    u = case.u
    rows = case.unit_rows
    e = case.restitution
    newton = u + (1.0 + e) * pushed(rows, -u)
    poisson = newton + pushed(rows, -newton)
    found = case.lower.T @ own_outcome(resolver, case)
    distances = np.linalg.norm(np.subtract(found, [newton, poisson]), axis=1) / case.speed
    if np.isnan(distances).any():
        return None
    return float(distances.min()), max(bounds.restitution, bounds.comparison(case))


@law(UNILATERAL_LAWS, "separating", "where no contact approaches v is left as it is")
def separating_contacts_do_nothing(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """Distance of v⁺ from v⁻ after the normals are turned so that no contact approaches."""
    J = case.contact_jacobian
    v_plus = outcome(
        resolver,
        replace(case, contact_jacobian=np.where((J @ case.velocity < 0.0)[:, None], -J, J)),
    )
    return case.distance(v_plus, case.velocity), bounds.restitution


@law(UNILATERAL_LAWS, "elastic", "e = 1 conserves KE where every contact approaches")
def elastic_approach_conserves(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """|KE⁺ − KE⁻| / KE⁻ with e = 1."""
    return elastic_conserves(case, resolver, bounds) if _all_approach(case) else None


@law(
    FRICTIONAL_LAWS,
    "separating",
    "where no contact approaches and friction cannot jam, v is left as it is",
)
def separating_contacts_stay_free(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """As without friction, with μ reduced until v⁺ = v⁻ is the only answer.

    An impulse at contacts that end with γ⁺ = 0 ≤ γ⁻ needs |Aₙᵀpₙ| ≤ |A_tᵀp_t|: Coulomb's law has a
    second, jammed solution. With x_i = ‖A_n,i‖ p_i, σ the smallest singular value of the unit
    normals and τ_i = μ_i ‖A_t,i‖ / ‖A_n,i‖, the left side is at least σ |x| and the right side at
    most |τ| |x|. So |τ| < σ excludes it.
    """
    if case.tangents is None or case.friction is None:
        return None
    tangents = case.with_tangents.rows[case.contacts :].reshape(*case.tangents.shape)
    length = np.linalg.norm(tangents, 2, axis=(1, 2))
    steepness = over(case.friction * length, np.linalg.norm(case.rows, axis=1))
    needed = float(np.linalg.norm(steepness))
    room = 0.9 * case.smallest_value
    share = 1.0 if needed <= room else room / needed
    return separating_contacts_do_nothing(
        replace(case, friction=share * case.friction), resolver, bounds
    )


FRICTIONAL_LAWS |= {name: UNILATERAL_LAWS[name] for name in ("no_penetration", "restitution")}
# Laws that compare two calls: v⁺ of contacts that only push is unique, even if p is not.
UNILATERAL_LAWS |= {
    name: LAWS[name]
    for name in (*COMPARING, "arguments", "new_mass")
    if name not in ("redundancy", "row_scaling")
}


# Friction without restitution, at a single contact or at all contacts together.
def _is_determined(case: ImpactCase) -> bool:
    """Whether normals and tangents are far enough from dependent to determine the impulses."""
    every = case.with_tangents
    if case.friction is None or every.contacts > case.coordinates:
        return False
    return bool(np.linalg.svd(every.unit_rows, compute_uv=False)[-1] >= CLEAR)


def _single(case: ImpactCase) -> ImpactCase | None:
    """The first contact alone, with e = 0; None if it hardly approaches or its rows are too close
    to dependent."""
    if case.tangents is None or case.friction is None or case.contacts == 0 or case.speed == 0.0:
        return None
    alone = replace(
        case,
        contact_jacobian=case.contact_jacobian[:1],
        tangents=case.tangents[:1],
        friction=case.friction[:1],
        restitution=0.0,
        translations=None,
    )
    approaches = _normal_velocities(alone, case.velocity)[0] <= -CLEAR
    return alone if approaches and _is_determined(alone) else None


@law(
    FRICTIONAL_LAWS,
    "sticking",
    "one contact, e = 0: it sticks where Coulomb's law leaves no other answer",
)
def contacts_stick_where_they_can(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """|v_t⁺| / (‖A_t‖ |u|) of one contact with e = 0, if p = −W⁻¹γ⁻ lies so far inside the cone
    that p is unique.

    Any other solution p' of Coulomb's law slides, so |p'_t| = μ p'_n. With (p' − p)ᵀW(p' − p) ≥ 0
    this gives μ p'_n ≤ |p_t|. Both solutions have w_n = 0, which gives p_n − p'_n ≤ κ (p'_n +
    |p_t|/μ) with κ = μ|W_nt|/W_nn. Both inequalities hold only if μ p_n ≤ (1 + 2κ)|p_t|.
    """
    single = _single(case)
    if single is None:
        return None
    every = single.with_tangents
    W = every.rows @ every.rows.T
    (mu,) = single.mu
    p = -np.linalg.solve(W, every.contact_jacobian @ case.velocity)
    kappa = mu * float(np.linalg.norm(W[0, 1:])) / W[0, 0]
    if not mu * p[0] > 1.001 * (1.0 + 2.0 * kappa) * float(np.linalg.norm(p[1:])):
        return None
    slip = every.contact_jacobian[1:] @ outcome(resolver, single)
    scale = np.sqrt(np.trace(W[1:, 1:])) * case.speed
    return float(np.linalg.norm(slip) / scale), bounds.restitution


@law(FRICTIONAL_LAWS, "friction_opposes", "one contact, e = 0: p_t·v_t⁺ ≤ 0")
def friction_opposes_sliding(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """p_t·v_t⁺ / |u|² of one contact with e = 0; it is positive if friction pushes in the direction
    of sliding."""
    single = _single(case)
    if single is None:
        return None
    return max(0.0, float(_friction_power(single, resolver)[0][0])), bounds.restitution


@law(FRICTIONAL_LAWS, "maximal_dissipation", "e = 0: p_t·v_t⁺ = −μ p |v_t⁺| at every contact")
def sliding_dissipates_most(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """Largest |p_t·v_t⁺ + μ p_n |v_t⁺|| / |u|² of a contact with e = 0; 0 if friction at its limit
    opposes sliding.

    The law checks all contacts together if their rows determine every impulse, else the first
    contact alone. It skips contacts that pull; ``cone`` detects those.
    """
    tried = replace(case, restitution=0.0)
    several = case.contacts > 1 and case.speed > 0.0 and _is_determined(tried)
    chosen = tried if several else _single(case)
    if chosen is None:
        return None
    power, limit = _friction_power(chosen, resolver)
    return float(np.max(np.abs(power + limit))), bounds.restitution


def _friction_power(case: ImpactCase, resolver: Resolver) -> tuple[Floats, Floats]:
    """p_t·v_t⁺ and μ p_n |v_t⁺| of each contact (c,), both relative to |u|²; 0 for a contact that
    pulls."""
    c = case.contacts
    every = case.with_tangents
    v_plus = outcome(resolver, case)
    change = case.lower.T @ (v_plus - case.velocity)
    p = np.linalg.solve(every.rows @ every.rows.T, every.rows @ change)
    friction = p[c:].reshape(c, -1)
    slip = (every.contact_jacobian[c:] @ v_plus).reshape(c, -1)
    pushes = (p[:c] >= 0.0) / case.speed**2
    limit = case.mu * p[:c] * np.linalg.norm(slip, axis=1)
    return pushes * np.einsum("cm,cm->c", friction, slip), pushes * limit


FRICTIONAL_LAWS |= {
    name: LAWS[name] for name in ("momentum", "repeatability", "arguments", "new_mass")
}


@law(FRICTIONAL_LAWS, "new_friction", "an impact repeated with only μ changed, to 0: p_t = 0")
def friction_is_not_remembered(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """Part of Δu outside the span of the normals, with μ = 0 right after a call with μ."""
    if case.friction is None or not case.friction.any():
        return None
    outcome(resolver, case)
    v_plus = outcome(resolver, replace(case, friction=0.0 * case.friction))
    smooth = replace(case, tangents=None, friction=None)
    return impulse_comes_from_the_contacts(smooth, lambda *given: v_plus, bounds)


# A resolver may promise no gain at all, not even in the last bit.
EXACT_LAWS: dict[str, Law] = {}


@law(EXACT_LAWS, "exact_energy", "KE⁺ ≤ KE⁻ in real arithmetic")
def no_gain_in_real_arithmetic(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """(KE⁺ − KE⁻)/KE⁻ in rationals on the doubles, with tolerance 0; infinite if motion appears
    from rest."""
    v_plus = own_outcome(resolver, case)
    return relative_energy_gain(case.mass_matrix, case.velocity, v_plus), 0.0


class Contract(NamedTuple):
    """Laws, tolerances and impacts for one kind of resolver.

    laws : the laws by name; those in EXACT_LAWS are checked only on request.
    bounds, largest_condition : default tolerances, and default largest κ(M) drawn.
    draw : makes the impact of a number; first : makes the impacts that come before the drawn ones.
    table : name of the table of laws in `verification.laws`, for generated tests.
    least_restitution : smallest e drawn.
    unjudged : what a resolver that keeps all laws may still get wrong.
    """

    laws: dict[str, Law]
    bounds: Bounds
    largest_condition: float
    draw: Callable[[np.random.Generator, int, float], ImpactCase]
    table: str
    first: Callable[[np.random.Generator], Iterator[ImpactCase]] = lambda rng: iter(())
    least_restitution: float = 0.0
    unjudged: str = ""


_UNJUDGED_FRICTION = (
    "how much friction there is with e > 0, or at several contacts whose rows depend on each "
    "other (it stays in its "
    "cone); restitution where only some contacts approach; a rebound faster than e asks for"
)


CONTRACTS: dict[str, Contract] = {
    "equality": Contract(LAWS | EXACT_LAWS, KIT, 1e8, draw_wide_case, "LAWS", adverse_cases, -1.0),
    "unilateral": Contract(
        UNILATERAL_LAWS | EXACT_LAWS, ONE_SIDED, 1e4, draw_one_sided_case, "UNILATERAL_LAWS"
    ),
    "frictional": Contract(
        FRICTIONAL_LAWS | EXACT_LAWS,
        ONE_SIDED,
        1e2,
        draw_frictional_case,
        "FRICTIONAL_LAWS",
        unjudged=_UNJUDGED_FRICTION,
    ),
}
