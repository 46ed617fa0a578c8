"""The laws of every impact; `LAWS` lists them by name.

A law is a function (case, resolver, bounds) -> LawResidual; it returns None if it does not apply. To add a law, write
the function here and add a line to LAWS.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from iapb.errors import ArgumentError
from reference.exact import bulk_energy_gain, relative_energy_gain
from verification.impacts import Floats, ImpactCase
from verification.laws.bounds import EPS, Bounds, LawResidual
from verification.laws.resolver import Resolver, outcome, own_answer, own_outcome


# Theorems 1 and 2: kinetic energy never rises, for every e in [−1, 1].
def relative_gain(case: ImpactCase, v_plus: Floats) -> float:
    """Return (KE⁺ − KE⁻)/KE⁻ in double-double or, beyond its range, exactly; infinite if motion begins at rest."""
    if not case.velocity.any():
        return np.inf if v_plus.any() else 0.0
    try:
        gain, bound = bulk_energy_gain(case.mass_matrix, case.velocity, v_plus)
    except ArgumentError:  # numbers below 1e-60 or above 1e60
        return relative_energy_gain(case.mass_matrix, case.velocity, v_plus)
    return float(gain[0]) if np.isfinite(bound[0]) else np.inf


def kinetic_energy_never_rises(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual:
    """Relative energy gain; the tolerance is the gain that rounding can cause."""
    return LawResidual("kinetic_energy", relative_gain(case, own_outcome(resolver, case)), bounds.energy_gain(case))


# (15): J v⁺ = −e J v⁻ on every row, dependent rows included.
def restitution_residual(case: ImpactCase, v_plus: Floats) -> float:
    """Return max |Jᵢv⁺ + e Jᵢv⁻| / (‖Aᵢ‖ |u|); zero rows give 0, and a system at rest must stay at rest."""
    unmet = np.abs(case.contact_jacobian @ v_plus + case.restitution * (case.contact_jacobian @ case.velocity))
    scale = np.linalg.norm(case.rows, axis=1) * case.speed
    relative = np.divide(unmet, scale, out=np.where(unmet > 0.0, np.inf, 0.0), where=scale > 0.0)
    return float(np.max(relative, initial=0.0))


def restitution_is_met(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual:
    """Largest relative residual of Newton's law."""
    return LawResidual("restitution", restitution_residual(case, own_outcome(resolver, case)), bounds.restitution)


# (9): the generalized impulse M(v⁺ − v⁻) is Jᵀp for some p. v⁺ = −e v⁻ keeps energy and restitution but breaks (9).
def impulse_comes_from_the_contacts(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Length of the part of Δu outside the row space of A, relative to |u|."""
    if not case.is_separated or case.speed == 0.0:
        return None
    change = case.lower.T @ (own_outcome(resolver, case) - case.velocity)
    outside = change - case.row_space.T @ (case.row_space @ change)
    return LawResidual("impulse_range", float(np.linalg.norm(outside)) / case.speed, bounds.comparison(case))


# Motion without any contact velocity is kept: f(v + z) = f(v) + z for every z with J z = 0.

_SEED = 20050621  # the same z for the same case, so that a failure repeats


def unseen_motion(case: ImpactCase) -> Floats:
    """Return a z with J z = 0 and kinetic norm |u|, or 0 if the rows span all directions."""
    w = np.random.default_rng(_SEED).normal(size=case.coordinates)
    w -= case.row_space.T @ (case.row_space @ w)
    w -= case.row_space.T @ (case.row_space @ w)
    size = float(np.linalg.norm(w))
    return np.linalg.solve(case.lower.T, w * (case.speed / size)) if size > 1e-8 else np.zeros_like(w)


def free_motion_is_kept(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Distance of f(v + z) from f(v) + z."""
    if not case.is_separated or case.speed == 0.0 or len(case.row_space) == case.coordinates:
        return None
    z = unseen_motion(case)
    moved = outcome(resolver, replace(case, velocity=case.velocity + z))
    return LawResidual("free_motion", case.distance(moved, own_outcome(resolver, case) + z), bounds.comparison(case))


# C09: e = −1 is no impulse at all.
def minus_one_is_no_impulse(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual:
    """Distance of v⁺ from v⁻; the tolerance covers the rounding ε √κ(M) of the return from whitened coordinates."""
    v_plus = outcome(resolver, replace(case, restitution=-1.0))
    tolerance = 100.0 * case.coordinates * EPS * float(case.condition**0.5)
    return LawResidual("no_impulse", case.distance(v_plus, case.velocity), tolerance)


# C04: an elastic impact (e = 1) conserves kinetic energy.
def elastic_conserves(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual:
    """|KE⁺ − KE⁻| / KE⁻ of the case with e = 1."""
    elastic = replace(case, restitution=1.0)
    # The clamp may cause a loss up to Cholesky's error d ε κ(M), which can exceed the bound of the gain.
    tolerance = max(bounds.energy_gain(case), bounds.comparison(case))
    return LawResidual("elastic", abs(relative_gain(elastic, outcome(resolver, elastic))), tolerance)


# Momentum: a translation of all bodies changes no contact velocity, so its momentum is conserved, in every frame.
#
# The energy law alone does not detect the paper's per-body rows (13)-(14); this law does.
def momentum_is_conserved(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Largest of |zᵀM(v⁺ − v⁻)| / (|z|_M |u|) and of the distance of f(v + z) from f(v) + z over translations z."""
    found = _change_and_ride(case, resolver)
    return None if found is None else LawResidual("momentum", max(found), bounds.comparison(case))


def momentum_is_conserved_unequal(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """The law of momentum for unequal restitutions; each of the two residuals is divided by its own tolerance.

    With unequal restitutions the sign of a contact's velocity matters, and a grazing contact within the restitution's
    tolerance may approach in one frame and separate in another. In addition, an impulse |Δu| ≤ √g |u| changes the
    energy by less than the gain g that rounding can cause, so the clamp may remove it in one frame (of speed 2|u| at
    most) and keep it in another. Neither reason applies to the momentum itself.
    """
    found = _change_and_ride(case, resolver)
    if found is None:
        return None
    tolerance = bounds.comparison(case)
    of_the_ride = max(tolerance, bounds.restitution, 2.0 * float(np.sqrt(bounds.energy_gain(case))))
    return LawResidual("momentum", max(found[0] / tolerance, found[1] / of_the_ride), 1.0)


def _change_and_ride(case: ImpactCase, resolver: Resolver) -> tuple[float, float] | None:
    """Return the largest relative change of momentum and the largest distance of f(v + z) from f(v) + z, or None."""
    if case.translations is None or case.speed == 0.0 or not case.is_separated:
        return None
    v_plus, changed, apart = own_outcome(resolver, case), 0.0, 0.0
    for z in case.translations:
        size = float(np.linalg.norm(case.lower.T @ z))
        change = abs(float(z @ case.mass_matrix @ (v_plus - case.velocity))) / (size * case.speed)
        ride = z * (case.speed / size)
        moved = outcome(resolver, replace(case, velocity=case.velocity + ride))
        changed, apart = max(changed, change), max(apart, case.distance(moved, v_plus + ride))
    return changed, apart


# C03, (25) and (33): all rows together give the same velocity as any maximal independent subset of them.
def redundant_equals_reduced(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Distance between the velocities with all rows and with independent ones only."""
    rank = len(case.row_space)
    if not case.is_separated or rank == 0 or rank == case.contacts:
        return None
    from scipy.linalg import qr

    chosen = qr(case.unit_rows.T, mode="r", pivoting=True)[1][:rank]
    reduced = replace(case, contact_jacobian=case.contact_jacobian[sorted(chosen)])
    tolerance = max(bounds.comparison(case), bounds.comparison(reduced))
    distance = case.distance(own_outcome(resolver, case), outcome(resolver, reduced))
    return LawResidual("redundancy", distance, tolerance)


# Reporting a contact twice does not change the outcome.
def duplicated_rows_change_nothing(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Distance between the velocities without and with copies of the first rows."""
    if not case.is_separated or case.contacts == 0:
        return None
    copies = case.contact_jacobian[: (case.contacts + 1) // 2]
    doubled = replace(case, contact_jacobian=np.vstack([case.contact_jacobian, copies, copies[:1]]))
    if not doubled.is_separated:
        return None
    distance = case.distance(own_outcome(resolver, case), outcome(resolver, doubled))
    return LawResidual("duplicated_rows", distance, bounds.comparison(case))


# The order of the contacts does not change the outcome.
def row_order_does_not_matter(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Distance between the velocities with the rows as given and in reverse order."""
    if not case.is_separated or case.contacts < 2:
        return None
    reversed_rows = replace(case, contact_jacobian=case.contact_jacobian[::-1].copy())
    distance = case.distance(own_outcome(resolver, case), outcome(resolver, reversed_rows))
    return LawResidual("row_order", distance, bounds.comparison(case))


# A row times a positive number is the same contact in other units. Powers of two change no bit, other factors ε/σ.

_POWERS = np.array([0, 7, -5, 12, -11, 3])
_FACTORS = np.array([3.0, 0.1, 7e2, 1.0, 1.3e-3])


def row_scale_does_not_matter(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Distance between the velocities; infinite if a power of two changed a bit although the bounds forbid it."""
    if not case.is_separated or case.contacts == 0:
        return None
    plain = own_outcome(resolver, case)
    powers = np.ldexp(1.0, np.resize(_POWERS, case.contacts))
    by_powers = outcome(resolver, _scaled(case, powers))
    by_factors = outcome(resolver, _scaled(case, np.resize(_FACTORS, case.contacts)))
    worst = max(case.distance(plain, by_powers), case.distance(plain, by_factors))
    if bounds.bitwise_scaling and not np.array_equal(plain, by_powers):
        worst = np.inf
    return LawResidual("row_scaling", worst, bounds.comparison(case))


def _scaled(case: ImpactCase, factor: np.ndarray) -> ImpactCase:
    return replace(case, contact_jacobian=case.contact_jacobian * factor[:, None])


# C06 for units: q' = S⁻¹q turns M, J, v into S M S, J S, S⁻¹v and must turn v⁺ into S⁻¹v⁺.

_UNITS = np.array([1.0, 30.0, 0.02, 5.0, 0.7])  # mild: the laws' bounds grow with κ(S M S)


def units_do_not_matter(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Distance of v⁺ from S v'⁺."""
    if not case.is_separated:
        return None
    s = np.resize(_UNITS, case.coordinates)
    other = replace(
        case,
        mass_matrix=s[:, None] * case.mass_matrix * s,
        contact_jacobian=case.contact_jacobian * s,
        velocity=case.velocity / s,
        translations=None,
    )
    tolerance = max(bounds.comparison(case), bounds.comparison(other))
    distance = case.distance(own_outcome(resolver, case), s * outcome(resolver, other))
    return LawResidual("units", distance, tolerance)


# C06: other coordinates q' = T⁻¹q give the same motion, v'⁺ = T⁻¹v⁺.
def coordinates_do_not_matter(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Distance of v⁺ from T v'⁺, where T = I + (cyclic shift)/2 has a condition number of at most 3."""
    if not case.is_separated:
        return None
    d = case.coordinates
    T = np.eye(d) + 0.5 * np.roll(np.eye(d), 1, axis=1)
    mass = T.T @ case.mass_matrix @ T
    other = replace(
        case,
        mass_matrix=0.5 * (mass + mass.T),
        contact_jacobian=case.contact_jacobian @ T,
        velocity=np.linalg.solve(T, case.velocity),
        translations=None,
    )
    if not other.is_separated:
        return None
    tolerance = max(bounds.comparison(case), bounds.comparison(other))
    distance = case.distance(own_outcome(resolver, case), T @ outcome(resolver, other))
    return LawResidual("coordinates", distance, tolerance)


# Two groups of bodies without common contacts move the same, whether resolved together or separately.
def groups_do_not_interact(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Distance between the velocities of the case and its mirror image, resolved together and separately."""
    if not case.is_separated or case.speed == 0.0:
        return None
    d = case.coordinates
    together = replace(
        case,
        mass_matrix=_blocks(case.mass_matrix, case.mass_matrix),
        contact_jacobian=_blocks(case.contact_jacobian, -case.contact_jacobian[::-1]),
        velocity=np.concatenate([case.velocity, -2.0 * case.velocity]),
        translations=None,
    )
    both, alone = outcome(resolver, together), own_outcome(resolver, case)
    mirrored = outcome(
        resolver, replace(case, contact_jacobian=-case.contact_jacobian[::-1].copy(), velocity=-2.0 * case.velocity)
    )
    distance = max(case.distance(both[:d], alone), case.distance(both[d:], mirrored))
    return LawResidual("groups", distance, 2.0 * bounds.comparison(together))


def _blocks(one: Floats, other: Floats) -> Floats:
    (m, n), (k, l) = one.shape, other.shape
    joined = np.zeros((m + k, n + l))
    joined[:m, :n], joined[m:, n:] = one, other
    return joined


# The same impact gives the same bits, even if another impact was resolved in between.
def same_input_same_output(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual:
    """0 if the bits agree, else 1; the tolerance is 0."""
    first = own_outcome(resolver, case)
    outcome(resolver, replace(case, contact_jacobian=case.contact_jacobian[::-1] + 0.5, velocity=-case.velocity))
    again = outcome(resolver, case)
    return LawResidual("repeatability", 0.0 if np.array_equal(first, again) else 1.0, 0.0)


# A resolver must not write to its arguments, because the caller continues to use M, J and v⁻.
def arguments_are_left_alone(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual:
    """Number of arguments that the call has changed; the tolerance is 0."""
    return LawResidual("arguments", float(own_answer(resolver, case).changed), 0.0)


Check = Callable[[ImpactCase, Resolver, Bounds], LawResidual | None]


class Law(NamedTuple):
    """A law: its statement in words and its check."""

    statement: str
    check: Check


LAWS: dict[str, Law] = {
    "kinetic_energy": Law("KE⁺ ≤ KE⁻", kinetic_energy_never_rises),
    "restitution": Law("J v⁺ = −e J v⁻ on every row", restitution_is_met),
    "impulse_range": Law("M(v⁺ − v⁻) lies in range(Jᵀ)", impulse_comes_from_the_contacts),
    "free_motion": Law("f(v + z) = f(v) + z for J z = 0", free_motion_is_kept),
    "no_impulse": Law("e = −1 leaves v as it is", minus_one_is_no_impulse),
    "elastic": Law("e = 1 conserves KE", elastic_conserves),
    "momentum": Law("momentum along every free translation is conserved, in any frame", momentum_is_conserved),
    "redundancy": Law("redundant rows give what an independent subset gives (25), (33)", redundant_equals_reduced),
    "duplicated_rows": Law("a row given twice counts once", duplicated_rows_change_nothing),
    "row_order": Law("the order of the rows does not matter", row_order_does_not_matter),
    "row_scaling": Law("the scale of a row does not matter", row_scale_does_not_matter),
    "units": Law("the units of the coordinates do not matter", units_do_not_matter),
    "coordinates": Law("the choice of coordinates does not matter", coordinates_do_not_matter),
    "groups": Law("bodies that share no contact do not feel one another", groups_do_not_interact),
    "repeatability": Law("the same impact gives the same bits, whatever came before", same_input_same_output),
    "arguments": Law("the arguments are left as they were", arguments_are_left_alone),
}

# Laws that need only the answer for the impact itself; they share this answer.
OF_ONE_CALL = ("kinetic_energy", "restitution", "impulse_range", "arguments")

# Laws that hold for any rule of unequal restitution, whatever separation velocities it prescribes.
UNEQUAL_LAWS: dict[str, Law] = {
    f"unequal_{name}": Law(f"{LAWS[name].statement}, unequal e", LAWS[name].check)
    for name in ("kinetic_energy", "impulse_range", "momentum", "repeatability", "arguments")
}
UNEQUAL_LAWS["unequal_momentum"] = UNEQUAL_LAWS["unequal_momentum"]._replace(check=momentum_is_conserved_unequal)
