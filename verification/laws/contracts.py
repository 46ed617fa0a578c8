"""Three contracts between an impact and its resolver: which arguments it gets, and which laws its answer keeps.

``equality``: J v⁺ = −e J v⁻ on every row, impulses of either sign (the paper's (15)); `LAWS`. The other two are about
contacts that only push. With u = Lᵀv, A = J L⁻ᵀ, γ = J v and Δu = u⁺ − u⁻ = Aᵀp:

============ ============================================================ =============================================
contract     the law of a textbook                                        source
============ ============================================================ =============================================
unilateral   0 ≤ p ⟂ γ⁺ + e γ⁻ ≥ 0 (Newton, Moreau)                       Moreau 1988; Glocker and Pfeiffer 1995
unilateral   0 ≤ p_c ⟂ γ_c ≥ 0, then 0 ≤ p − (1 + e) p_c ⟂ γ⁺ ≥ 0         Poisson: Anitescu and Potra 1997
frictional   K ∋ p ⟂ w + μ|w_t| n ∈ K*, w = γ⁺ + e γ⁻ on the normals      Coulomb: Moreau 1988; de Saxcé and Feng 1998
============ ============================================================ =============================================

Where every contact approaches and e is one number, Newton's and Poisson's law have the same v⁺: p = (1 + e) p_c solves
both, and v⁺ is unique. So laws of restitution judge such impacts only, and both kinds of resolver keep all of
UNILATERAL_LAWS. A resolver with another law of restitution (one contact after the other, an energetic coefficient) is
judged by ``laws=``: all but `OF_RESTITUTION` and those that compare calls hold for any contacts that only push.

Coulomb's law with e > 0 may gain energy (Kane and Levinson 1985), and ``kinetic_energy`` finds that it does. Laws of
the tangents (``sticking``, ``friction_opposes``, ``maximal_dissipation``) judge one contact alone with e = 0, where all
forms of Coulomb's law agree. The convex relaxation (Anitescu and Tasora 2010) strikes contacts that separate while they
slide, and breaks ``separating``. A pyramid inside the friction cone keeps ``cone``; one around it breaks it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from iapb.certificate import exact_gain
from verification.impacts import (
    Floats,
    ImpactCase,
    adverse_cases,
    draw_frictional_case,
    draw_one_sided_case,
    draw_wide_case,
)
from verification.laws.bounds import KIT, ONE_SIDED, Bounds, LawResidual
from verification.laws.impact_laws import LAWS, Law, elastic_conserves
from verification.laws.resolver import Resolver, least_push, outcome, own_outcome

TOUCHING = 1e-12  # of ‖Aᵢ‖ |u|: a normal velocity below it is the rounding of none
CLEAR = 0.05  # least singular value of one contact's unit rows, for laws that need its impulse
_REFINEMENTS, NEAR = 30, 1e-9  # searches for the direction of friction in a cone, and the distance that ends them


def _normal_velocities(case: ImpactCase, velocity: Floats) -> Floats:
    """γᵢ / (‖Aᵢ‖ |u⁻|) (c,); 0 on zero rows, infinite where motion appears from rest."""
    gamma, scale = case.contact_jacobian @ velocity, np.linalg.norm(case.rows, axis=1) * case.speed
    appeared = np.where(gamma == 0.0, 0.0, np.copysign(np.inf, gamma))
    return np.divide(gamma, scale, out=appeared, where=scale > 0.0)


def _all_approach(case: ImpactCase) -> bool:
    return bool(np.all(_normal_velocities(case, case.velocity) <= TOUCHING))


def _change(case: ImpactCase, resolver: Resolver) -> Floats:
    """Δu (d,) of the resolver's answer."""
    return case.lower.T @ (own_outcome(resolver, case) - case.velocity)


def _with_tangents(case: ImpactCase) -> ImpactCase:
    """The case whose rows are normals and tangents alike; never put to a resolver."""
    if case.tangents is None:
        return case
    rows = np.vstack([case.contact_jacobian, case.tangents.reshape(-1, case.coordinates)])
    return ImpactCase(case.mass_matrix, rows, case.velocity)


# (9): M(v⁺ − v⁻) = Jᵀp + Tᵀp_t for some p and p_t.
def impulse_comes_from_the_contacts(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Part of Δu outside the span of the contacts' rows, relative to |u|."""
    every = _with_tangents(case)
    if not every.is_separated or case.speed == 0.0:
        return None
    change = _change(case, resolver)
    outside = change - every.row_space.T @ (every.row_space @ change)
    return LawResidual("impulse_range", float(np.linalg.norm(outside)) / case.speed, bounds.comparison(every))


# p ≥ 0, and |p_t| ≤ μ p: p is not unique, so what counts is whether any such p explains the motion.
def contacts_only_push(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Distance of Δu's part in the rows' span from {Aᵀp : p ≥ 0} or, with friction, from the sum of the cones."""
    every = _with_tangents(case)
    if not every.is_separated or case.speed == 0.0:
        return None
    change = _change(case, resolver)
    seen = every.row_space.T @ (every.row_space @ change)
    name = "pushing" if case.tangents is None else "cone"
    return LawResidual(name, distance_from_cone(case, seen / case.speed), bounds.restitution)


def distance_from_cone(case: ImpactCase, target: Floats) -> float:
    """Return the least |Aᵀp − target| over impulses p that push, each inside its friction cone.

    Least squares over rays of the cones. With two tangents each contact gets two more rays and the search begins again:
    along the friction found, and in the direction that shortens the rest most. Any p found lies inside the cones: the
    distance is never too small. Where the target lies in the cones it is found to be so to 1e-8 or better.
    """
    tangents, friction = _friction(case)
    m = tangents.shape[1]
    fixed = np.repeat(np.vstack([np.zeros((1, m)), np.eye(m), -np.eye(m)])[None], case.contacts, axis=0)
    directions, distance = fixed, np.inf
    for _ in range(_REFINEMENTS if m > 1 else 1):  # directions (c, k, m): k rays of each contact
        rays = case.rows[:, None] + friction[:, None, None] * np.einsum("ckm,cmd->ckd", directions, tangents)
        p = least_push(rays.reshape(-1, case.coordinates), target).reshape(directions.shape[:2])
        rest = target - np.einsum("ck,ckd->d", p, rays)
        distance = min(distance, float(np.linalg.norm(rest)))
        if distance <= NEAR:
            break
        more = np.stack([np.einsum("ck,ckm->cm", p, directions), tangents @ rest], axis=1)
        size = np.linalg.norm(more, axis=2, keepdims=True)
        more = np.divide(more, size, out=np.zeros_like(more), where=size > 0.0)
        directions = np.concatenate([fixed, more], axis=1)
    return distance


def _friction(case: ImpactCase) -> tuple[Floats, Floats]:
    """T L⁻ᵀ (c, m, d) and μ (c,); without friction m = 0."""
    if case.tangents is None or case.friction is None:
        return np.zeros((case.contacts, 0, case.coordinates)), np.zeros(case.contacts)
    flat = case.tangents.reshape(-1, case.coordinates)
    return np.linalg.solve(case.lower, flat.T).T.reshape(case.tangents.shape), case.friction


# Whatever the law of restitution: what approached does not approach any more, and nothing else faster than at e γ⁻.
def nothing_is_driven_in(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual:
    """Largest of min(0, −e γ⁻) − γ⁺, relative to ‖Aᵢ‖ |u|."""
    before, after = (_normal_velocities(case, v) for v in (case.velocity, own_outcome(resolver, case)))
    short = np.minimum(0.0, -case.restitution * before) - after
    return LawResidual("no_penetration", float(np.max(short, initial=0.0)), bounds.restitution)


# Newton's inequality, which Poisson's law with one e shares where every contact approaches.
def restitution_is_met_or_exceeded(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Largest of −e γ⁻ − γ⁺, relative to ‖Aᵢ‖ |u|, where every contact approaches."""
    if not _all_approach(case):
        return None
    before, after = (_normal_velocities(case, v) for v in (case.velocity, own_outcome(resolver, case)))
    short = -case.restitution * before - after
    return LawResidual("restitution", float(np.max(short, initial=0.0)), bounds.restitution)


# pᵀ(γ⁺ + e γ⁻) = Δu·(u⁺ + e u⁻): a sum of terms ≥ 0 that is known without p, which redundant rows leave open.
def pushing_contacts_meet_restitution(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """|Δu·(u⁺ + e u⁻)| / |u⁻|², where every contact approaches."""
    if not _all_approach(case) or case.speed == 0.0:
        return None
    u, change = case.lower.T @ case.velocity, _change(case, resolver)
    value = abs(float(change @ (change + (1.0 + case.restitution) * u))) / case.speed**2
    return LawResidual("complementarity", value, 2.0 * bounds.restitution)


def separating_contacts_do_nothing(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual:
    """Distance of v⁺ from v⁻ for the case with its normals turned so that none approaches."""
    J = case.contact_jacobian
    v_plus = outcome(resolver, replace(case, contact_jacobian=np.where((J @ case.velocity < 0.0)[:, None], -J, J)))
    return LawResidual("separating", case.distance(v_plus, case.velocity), bounds.restitution)


def elastic_approach_conserves(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """|KE⁺ − KE⁻| / KE⁻ with e = 1, where every contact approaches."""
    return elastic_conserves(case, resolver, bounds) if _all_approach(case) else None


# Friction at one contact alone, without restitution.
class _Single(NamedTuple):
    """The first contact of a case alone, e = 0: its rows (1 + m, d), as given and whitened, W and μ."""

    case: ImpactCase
    given: Floats
    rows: Floats
    delassus: Floats
    friction: float


def _single(case: ImpactCase) -> _Single | None:
    """None where the contact does not approach clearly, or its rows are too close to dependent to tell its impulse."""
    if case.tangents is None or case.friction is None or case.contacts == 0 or case.speed == 0.0:
        return None
    alone = replace(case, contact_jacobian=case.contact_jacobian[:1], tangents=case.tangents[:1],
                    friction=case.friction[:1], restitution=0.0, translations=None)
    every = _with_tangents(alone)
    values = np.linalg.svd(every.unit_rows, compute_uv=False)
    if every.contacts > case.coordinates or values[-1] < CLEAR or _normal_velocities(alone, case.velocity)[0] > -CLEAR:
        return None
    return _Single(alone, every.contact_jacobian, every.rows, every.rows @ every.rows.T, float(case.friction[0]))


def contacts_stick_where_they_can(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """|v_t⁺| / (‖A_t‖ |u|) of one contact, e = 0, where p = −W⁻¹γ⁻ lies so far inside the cone that no other p solves.

    Another p' of Coulomb's law slides. From (p' − p)ᵀW(p' − p) ≥ 0 and its |p'_t| = μ p'_n follows μ p'_n ≤ |p_t|; from
    w_n = 0 of both follows p_n − p'_n ≤ κ (p'_n + |p_t|/μ) with κ = μ|W_nt|/W_nn. Both hold only if
    μ p_n ≤ (1 + 2κ)|p_t|.
    """
    single = _single(case)
    if single is None:
        return None
    W, mu = single.delassus, single.friction
    p = -np.linalg.solve(W, single.given @ case.velocity)
    kappa = mu * float(np.linalg.norm(W[0, 1:])) / W[0, 0]
    if not mu * p[0] > 1.001 * (1.0 + 2.0 * kappa) * float(np.linalg.norm(p[1:])):
        return None
    slip = single.given[1:] @ outcome(resolver, single.case)
    scale = np.sqrt(np.trace(W[1:, 1:])) * case.speed
    return LawResidual("sticking", float(np.linalg.norm(slip) / scale), bounds.restitution)


def friction_opposes_sliding(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """p_t·v_t⁺ / |u|² of one contact, e = 0: positive where friction pushes the way it slides."""
    found = _friction_power(case, resolver)
    return None if found is None else LawResidual("friction_opposes", max(0.0, found[0]), bounds.restitution)


def sliding_dissipates_most(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """(p_t·v_t⁺ + μ p_n |v_t⁺|) / |u|² of one contact, e = 0: 0 where friction is at its limit, against the sliding."""
    found = _friction_power(case, resolver)
    return None if found is None else LawResidual("maximal_dissipation", abs(found[0] + found[1]), bounds.restitution)


def _friction_power(case: ImpactCase, resolver: Resolver) -> tuple[float, float] | None:
    """p_t·v_t⁺ and μ p_n |v_t⁺|, both relative to |u|²."""
    single = _single(case)
    if single is None:
        return None
    v_plus = outcome(resolver, single.case)
    p = np.linalg.solve(single.delassus, single.rows @ (case.lower.T @ (v_plus - case.velocity)))
    slip = single.given[1:] @ v_plus
    limit = single.friction * float(p[0]) * float(np.linalg.norm(slip))
    return float(p[1:] @ slip) / case.speed**2, limit / case.speed**2


# Theorems 1 and 2 of the doubles themselves: a resolver may promise that no impact gains, not even in the last bit.
def no_gain_in_real_arithmetic(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual:
    """(KE⁺ − KE⁻)/KE⁻ by rationals, against 0; infinite where motion appears from rest."""
    v_plus = own_outcome(resolver, case)
    gain = exact_gain(case.mass_matrix, case.velocity, v_plus)
    before = -exact_gain(case.mass_matrix, case.velocity, np.zeros_like(v_plus))
    relative = float(gain / before) if before else (np.inf if gain > 0 else 0.0)
    return LawResidual("exact_energy", relative, 0.0, bounds.energy_gain(case))


EXACT_LAWS = {"exact_energy": Law("KE⁺ ≤ KE⁻ in real arithmetic", no_gain_in_real_arithmetic)}

# Laws that compare a call with another: v⁺ of contacts that only push is unique, whatever p is.
_UNIQUE = ("free_motion", "momentum", "duplicated_rows", "row_order", "units", "coordinates", "groups")

UNILATERAL_LAWS: dict[str, Law] = {
    "kinetic_energy": LAWS["kinetic_energy"],
    "impulse_range": Law(LAWS["impulse_range"].statement, impulse_comes_from_the_contacts),
    "pushing": Law("M(v⁺ − v⁻) = Jᵀp with p ≥ 0: no contact pulls", contacts_only_push),
    "no_penetration": Law("γ⁺ ≥ min(0, −e γ⁻): no contact is left approaching", nothing_is_driven_in),
    "restitution": Law("γ⁺ ≥ −e γ⁻ where every contact approaches", restitution_is_met_or_exceeded),
    "complementarity": Law("p ⟂ γ⁺ + e γ⁻ where every contact approaches", pushing_contacts_meet_restitution),
    "separating": Law("where no contact approaches v is left as it is", separating_contacts_do_nothing),
    "elastic": Law("e = 1 conserves KE where every contact approaches", elastic_approach_conserves),
    **{name: LAWS[name] for name in (*_UNIQUE, "repeatability", "arguments")},
}

FRICTIONAL_LAWS: dict[str, Law] = {
    "kinetic_energy": LAWS["kinetic_energy"],
    "impulse_range": Law("M(v⁺ − v⁻) lies in range([Jᵀ Tᵀ])", impulse_comes_from_the_contacts),
    "cone": Law("M(v⁺ − v⁻) = Jᵀp + Tᵀp_t with |p_t| ≤ μ p at every contact", contacts_only_push),
    "no_penetration": UNILATERAL_LAWS["no_penetration"],
    "restitution": UNILATERAL_LAWS["restitution"],
    "separating": UNILATERAL_LAWS["separating"],
    "sticking": Law("one contact, e = 0: it sticks where Coulomb's law leaves no other answer",
                    contacts_stick_where_they_can),
    "friction_opposes": Law("one contact, e = 0: p_t·v_t⁺ ≤ 0", friction_opposes_sliding),
    "maximal_dissipation": Law("one contact, e = 0: p_t·v_t⁺ = −μ p |v_t⁺|", sliding_dissipates_most),
    **{name: LAWS[name] for name in ("momentum", "repeatability", "arguments")},
}


OF_RESTITUTION = ("restitution", "complementarity", "elastic")


class Contract(NamedTuple):
    """What a kind of resolver is tried on and judged by.

    laws, optional : by name; those of `optional` judge only where they are asked for.
    bounds, largest_condition : tolerances, and the largest κ(M) drawn, unless the caller has others.
    draw : impact of a number; first : impacts that come before the drawn ones.
    table : name of its table of laws in `verification.laws`, for a test to paste.
    """

    laws: dict[str, Law]
    bounds: Bounds
    largest_condition: float
    draw: Callable[[np.random.Generator, int, float], ImpactCase]
    first: Callable[[np.random.Generator], Iterator[ImpactCase]]
    table: str
    optional: tuple[str, ...] = ("exact_energy",)


def _nothing(rng: np.random.Generator) -> Iterator[ImpactCase]:
    return iter(())


CONTRACTS: dict[str, Contract] = {
    "equality": Contract(LAWS | EXACT_LAWS, KIT, 1e8, draw_wide_case, adverse_cases, "LAWS"),
    "unilateral": Contract(UNILATERAL_LAWS | EXACT_LAWS, ONE_SIDED, 1e4, draw_one_sided_case, _nothing,
                           "UNILATERAL_LAWS"),
    "frictional": Contract(FRICTIONAL_LAWS | EXACT_LAWS, ONE_SIDED, 1e2, draw_frictional_case, _nothing,
                           "FRICTIONAL_LAWS", ("exact_energy", "maximal_dissipation")),
}
