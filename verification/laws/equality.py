"""The laws of every impact, `LAWS`, and those of one restitution per row, `UNEQUAL_LAWS`.

A law returns its residual and tolerance, or None if it does not apply. To add a law, write its
function here.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from reference.exact import relative_energy_gain
from verification.impacts import EPS, Floats, ImpactCase
from verification.laws.bounds import Bounds, Found, Law, law
from verification.laws.resolver import Resolver, outcome, own_answer, own_outcome

LAWS: dict[str, Law] = {}
# Laws that need only the answer for the impact itself; they share this answer.
OF_ONE_CALL = ("kinetic_energy", "restitution", "impulse_range", "arguments")
# Laws that compare the answer for the impact with answers for variants of it that have the same e.
COMPARING = (
    "free_motion",
    "momentum",
    "redundancy",
    "duplicated_rows",
    "row_order",
    "row_scaling",
    "units",
    "coordinates",
    "groups",
    "repeatability",
)
_MASSES = np.array([1.0, 2.0, 0.5, 1.0])  # powers of two: S M S is as definite as M
_SEED = 20050621  # the same z for the same case, so that a failure repeats
_POWERS = np.array([0, 7, -5, 12, -11, 3])
# Numbers of few bits, so that rows dependent exactly stay so.
_FACTORS = np.array([3.0, 3.0 / 32.0, 7e2, 1.0, 5.0 / 4096.0])
_UNITS = np.array([1.0, 32.0, 1.0 / 64.0, 5.0, 0.75])  # mild: the laws' bounds grow with κ(S M S)


def _varied(case: ImpactCase, mass: Floats, rows: Floats, velocity: Floats) -> ImpactCase:
    return replace(
        case, mass_matrix=mass, contact_jacobian=rows, velocity=velocity, translations=None
    )


@law(LAWS, "kinetic_energy", "KE⁺ ≤ KE⁻")
def kinetic_energy_never_rises(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """Theorems 1 and 2, for every e in [−1, 1]; the tolerance is the gain that rounding can
    cause."""
    return relative_energy_gain(
        case.mass_matrix, case.velocity, own_outcome(resolver, case)
    ), bounds.energy_gain(case)


@law(LAWS, "restitution", "J v⁺ = −e J v⁻ on every row")
def restitution_is_met(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """(15), dependent rows included: max |Jᵢv⁺ + e Jᵢv⁻| / ‖Aᵢ‖, relative to max |Jᵢv⁻| / ‖Aᵢ‖, or
    |u| if this is 0.

    The products Lᵀv⁻ and L⁻ᵀu⁺ are exact for an L that is wrong by d ε |L| (Higham 2002, theorem
    8.5), which moves Jᵢv⁺ / ‖Aᵢ‖ by d ε ‖|Lᵀ||v|‖ at most: |u| √κ(M) d ε in the worst case. A
    solver that multiplies by an inverse adds d ε / σ, for rows of smallest singular value σ. A
    resolver may drop a row that others nearly determine, and choose which of these rows it uses;
    the limit is then `bounds.restitution`, relative to |u|.
    """
    v_plus = own_outcome(resolver, case)
    unmet = case.unmet_restitution(v_plus)
    if case.speed == 0.0 or case.contacts == 0:
        return unmet, bounds.restitution
    seen = float(np.max(np.abs(case.unit_rows @ case.u))) / case.speed
    spread = (
        sum(
            float(np.linalg.norm(np.abs(case.lower.T) @ np.abs(v))) for v in (case.velocity, v_plus)
        )
        / case.speed
    )
    rounding = 100.0 * case.coordinates * EPS * (spread + 1.0 / case.smallest_motion)
    limit = max(bounds.least, min(rounding if case.is_independent else np.inf, bounds.restitution))
    scale = seen if seen > limit else 1.0
    return unmet / scale, limit / scale


@law(LAWS, "impulse_range", "M(v⁺ − v⁻) lies in range(Jᵀ)")
def impulse_comes_from_the_contacts(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """(9): the part of Δu outside the span of the contacts' rows, relative to |u|.

    v⁺ = −e v⁻ keeps energy and restitution but breaks (9).
    """
    every = case.with_tangents
    if not every.is_separated or case.speed == 0.0:
        return None
    change = case.lower.T @ (own_outcome(resolver, case) - case.velocity)
    outside = change - every.row_space.T @ (every.row_space @ change)
    return float(np.linalg.norm(outside)) / case.speed, bounds.comparison(every)


@law(LAWS, "free_motion", "v⁺(v + z) = v⁺(v) + z for J z = 0")
def free_motion_is_kept(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """A motion z without any contact velocity, of kinetic norm |u|, is kept."""
    if not case.is_separated or case.speed == 0.0 or len(case.row_space) == case.coordinates:
        return None
    w = np.random.default_rng(_SEED).normal(size=case.coordinates)
    for _ in range(2):
        w -= case.row_space.T @ (case.row_space @ w)
    size = float(np.linalg.norm(w))
    z = np.linalg.solve(case.lower.T, w * (case.speed / size)) if size > 1e-8 else np.zeros_like(w)
    moved = outcome(resolver, replace(case, velocity=case.velocity + z))
    return case.distance(moved, own_outcome(resolver, case) + z), bounds.comparison(case)


@law(LAWS, "no_impulse", "e = −1 does not change v")
def minus_one_is_no_impulse(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """C09; the tolerance covers the rounding ε √κ(M) of the return from whitened coordinates."""
    v_plus = outcome(resolver, replace(case, restitution=-1.0))
    return case.distance(v_plus, case.velocity), 100.0 * case.coordinates * EPS * float(
        case.condition**0.5
    )


@law(LAWS, "elastic", "e = 1 conserves KE")
def elastic_conserves(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """C04. The clamp may cause a loss up to Cholesky's error d ε κ(M), which can exceed the bound
    of the gain."""
    v_plus = outcome(resolver, replace(case, restitution=1.0))
    gain = relative_energy_gain(case.mass_matrix, case.velocity, v_plus)
    return abs(gain), max(bounds.energy_gain(case), bounds.comparison(case))


@law(LAWS, "momentum", "momentum along every free translation is conserved, in any frame")
def momentum_is_conserved(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """A translation of all bodies changes no contact velocity, so its momentum is conserved, in
    every frame.

    The energy law alone does not detect the paper's per-body rows (13)-(14); this law does.
    """
    found = _change_and_ride(case, resolver)
    return None if found is None else (max(found), bounds.comparison(case))


def _change_and_ride(case: ImpactCase, resolver: Resolver) -> tuple[float, float] | None:
    """Return the largest |zᵀM(v⁺ − v⁻)| / (|z|_M |u|) and distance of f(v + z) from f(v) + z over
    translations z."""
    if case.translations is None or case.speed == 0.0 or not case.is_separated:
        return None
    v_plus = own_outcome(resolver, case)
    changed = 0.0
    apart = 0.0
    for z in case.translations:
        size = float(np.linalg.norm(case.lower.T @ z))
        change = abs(float(z @ case.mass_matrix @ (v_plus - case.velocity))) / (size * case.speed)
        ride = z * (case.speed / size)
        moved = outcome(resolver, replace(case, velocity=case.velocity + ride))
        changed = max(changed, change)
        apart = max(apart, case.distance(moved, v_plus + ride))
    return changed, apart


@law(LAWS, "redundancy", "redundant rows give the same v⁺ as independent rows alone (25), (33)")
def redundant_equals_reduced(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """C03: all rows together give the same velocity as any maximal independent subset of them."""
    rank = len(case.row_space)
    if not case.is_separated or rank == 0 or rank == case.contacts:
        return None
    from scipy.linalg import qr

    chosen = qr(case.unit_rows.T, mode="r", pivoting=True)[1][:rank]
    reduced = replace(case, contact_jacobian=case.contact_jacobian[sorted(chosen)])
    tolerance = max(bounds.comparison(case), bounds.comparison(reduced))
    return case.distance(own_outcome(resolver, case), outcome(resolver, reduced)), tolerance


@law(LAWS, "duplicated_rows", "a row given twice counts once")
def duplicated_rows_change_nothing(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """Distance between the velocities without and with copies of the first rows."""
    if not case.is_separated or case.contacts == 0:
        return None
    copies = case.contact_jacobian[: (case.contacts + 1) // 2]
    doubled = replace(case, contact_jacobian=np.vstack([case.contact_jacobian, copies, copies[:1]]))
    if not doubled.is_separated:
        return None
    return case.distance(
        own_outcome(resolver, case), outcome(resolver, doubled)
    ), bounds.comparison(case)


@law(LAWS, "row_order", "the order of the rows does not matter")
def row_order_does_not_matter(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """Distance between the velocities with the rows as given and in reverse order."""
    if not case.is_separated or case.contacts < 2:
        return None
    reversed_rows = replace(case, contact_jacobian=case.contact_jacobian[::-1].copy())
    return case.distance(
        own_outcome(resolver, case), outcome(resolver, reversed_rows)
    ), bounds.comparison(case)


@law(LAWS, "row_scaling", "the scale of a row does not matter")
def row_scale_does_not_matter(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """Distance between the velocities; infinite if a power of two changed a bit although the bounds
    forbid it.

    A row times a positive number is the same contact in other units.
    """
    if not case.is_separated or case.contacts == 0:
        return None
    plain = own_outcome(resolver, case)
    rows = case.contact_jacobian
    by_powers, by_factors = (
        outcome(
            resolver,
            replace(case, contact_jacobian=rows * np.resize(factors, case.contacts)[:, None]),
        )
        for factors in (np.ldexp(1.0, _POWERS), _FACTORS)
    )
    worst = max(case.distance(plain, by_powers), case.distance(plain, by_factors))
    changed = bounds.bitwise_scaling and not np.array_equal(plain, by_powers)
    return np.inf if changed else worst, bounds.comparison(case)


@law(LAWS, "units", "the units of the coordinates do not matter")
def units_do_not_matter(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """C06: q' = S⁻¹q turns M, J, v into S M S, J S, S⁻¹v and must turn v⁺ into S⁻¹v⁺."""
    if not case.is_separated:
        return None
    s = np.resize(_UNITS, case.coordinates)
    other = _varied(
        case, s[:, None] * case.mass_matrix * s, case.contact_jacobian * s, case.velocity / s
    )
    tolerance = max(bounds.comparison(case), bounds.comparison(other))
    return case.distance(own_outcome(resolver, case), s * outcome(resolver, other)), tolerance


@law(LAWS, "coordinates", "the choice of coordinates does not matter")
def coordinates_do_not_matter(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """C06: q' = T⁻¹q gives v'⁺ = T⁻¹v⁺; T = I + (cyclic shift)/2 has a condition number of at most
    3."""
    if not case.is_separated:
        return None
    T = np.eye(case.coordinates) + 0.5 * np.roll(np.eye(case.coordinates), 1, axis=1)
    mass = T.T @ case.mass_matrix @ T
    other = _varied(
        case, 0.5 * (mass + mass.T), case.contact_jacobian @ T, np.linalg.solve(T, case.velocity)
    )
    if not other.is_separated:
        return None
    tolerance = max(bounds.comparison(case), bounds.comparison(other))
    return case.distance(own_outcome(resolver, case), T @ outcome(resolver, other)), tolerance


@law(LAWS, "groups", "bodies that share no contact do not influence each other")
def groups_do_not_interact(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """Distance between the velocities of the case and its mirror image, resolved together and
    separately."""
    if not case.is_separated or case.speed == 0.0:
        return None
    mass, rows, v, d = *case.arrays, case.coordinates
    mirror = -rows[::-1]
    blocks = (np.zeros_like(mass), np.zeros_like(rows))
    together = _varied(
        case,
        np.block([[mass, blocks[0]], [blocks[0], mass]]),
        np.block([[rows, blocks[1]], [blocks[1], mirror]]),
        np.concatenate([v, -2.0 * v]),
    )
    both = outcome(resolver, together)
    alone = own_outcome(resolver, case)
    mirrored = outcome(resolver, replace(case, contact_jacobian=mirror.copy(), velocity=-2.0 * v))
    distance = max(case.distance(both[:d], alone), case.distance(both[d:], mirrored))
    return distance, 2.0 * bounds.comparison(together)


@law(LAWS, "repeatability", "the same impact gives the same bits, whatever impacts came before")
def same_input_same_output(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """0 if the bits agree after another impact was resolved in between, else 1."""
    first = own_outcome(resolver, case)
    between = replace(
        case, contact_jacobian=case.contact_jacobian[::-1] + 0.5, velocity=-case.velocity
    )
    own_answer(resolver, between)  # whatever it is
    return 0.0 if np.array_equal(first, outcome(resolver, case)) else 1.0, 0.0


@law(LAWS, "arguments", "the arguments are not changed")
def arguments_are_left_alone(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """Number of arguments that the call has changed: the caller continues to use M, J and v⁻."""
    return float(own_answer(resolver, case)[1]), 0.0


@law(LAWS, "new_mass", "an impact repeated with only M changed: the impulse is of the new M")
def mass_is_not_remembered(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """Part of Δu outside the span of the contacts' rows, with S M S right after a call with M."""
    s = np.resize(_MASSES, case.coordinates)
    outcome(resolver, case)
    other = replace(case, mass_matrix=s[:, None] * case.mass_matrix * s)
    return impulse_comes_from_the_contacts(other, resolver, bounds)


# Laws of any rule of unequal restitution, whatever separation velocities it prescribes.
UNEQUAL_LAWS: dict[str, Law] = {
    f"unequal_{name}": Law(f"{LAWS[name].statement}, unequal e", LAWS[name].check)
    for name in ("kinetic_energy", "impulse_range", "momentum", "repeatability", "arguments")
}


@law(UNEQUAL_LAWS, "unequal_momentum", UNEQUAL_LAWS["unequal_momentum"].statement)
def momentum_is_conserved_unequal(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """The law of momentum for unequal restitutions; each of the two residuals is divided by its own
    tolerance.

    With unequal restitutions the sign of a contact's velocity matters, and a grazing contact within
    the restitution's tolerance may approach in one frame and separate in another. In addition, an
    impulse |Δu| ≤ √g |u| changes the energy by less than the gain g that rounding can cause, so the
    clamp may remove it in one frame (of speed 2|u| at most) and keep it in another. Neither reason
    applies to the momentum itself.
    """
    found = _change_and_ride(case, resolver)
    if found is None:
        return None
    tolerance = bounds.comparison(case)
    of_the_ride = max(tolerance, bounds.restitution, 2.0 * float(np.sqrt(bounds.energy_gain(case))))
    return max(found[0] / tolerance, found[1] / of_the_ride), 1.0


@law(
    UNEQUAL_LAWS,
    "unequal_row_order",
    "the order of the rows, their scale and copies of them do not matter, unequal e",
)
def unequal_rows_in_any_order(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> Found:
    """Largest distance of v⁺ from that with the rows scaled and in reverse order, and from that
    with the first row given twice, with its e.

    Poisson's v⁺ depends on the impulses of compression, which redundant rows leave open. A resolver
    that takes those its active set happens to find breaks this law.
    """
    if not case.is_separated or case.contacts == 0 or case.unequal is None:
        return None
    rows = case.contact_jacobian
    e = case.unequal
    scaled = rows * np.resize(_FACTORS, case.contacts)[:, None]
    turned = replace(case, contact_jacobian=scaled[::-1].copy(), unequal=e[::-1].copy())
    twice = replace(case, contact_jacobian=np.vstack([rows, rows[:1]]), unequal=np.append(e, e[0]))
    plain = own_outcome(resolver, case)
    worst = max(case.distance(plain, outcome(resolver, other)) for other in (turned, twice))
    return worst, max(bounds.comparison(case), bounds.comparison(twice), bounds.restitution)
