"""Resolve a simultaneous impact: equations (19)-(21), in the form that stays passive in floating
point.

With M = L Lᵀ, u = Lᵀ v and A = J L⁻ᵀ the paper's (21) is u⁺ = u − (1 + e) P u, P the orthogonal
projector onto the row space of A, which is applied through an orthonormal basis.
`verification.methods` has the formulas as printed.
"""

from __future__ import annotations

import threading
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from iapb.contact.kernels.resolve import (
    LARGEST_ENTRY,
    NOT_CONVERGED,
    SYMMETRY_TOLERANCE,
    Batch,
    resolve_each,
)
from iapb.contact.kernels.unilateral import ShareWork
from iapb.errors import ArgumentError, IapbError, RangeError, SolverError, counted
from iapb.mechanics.bodies import real_numbers
from iapb.names import one_of
from iapb.numerics.compiled import Entry, block
from iapb.numerics.linalg import cholesky
from iapb.numerics.schema import Floats, zeros_of

Arrays = tuple[Floats, Floats, Floats]  # M (d, d), J (c, d), v (d,), or n of each
METHODS = ("factored", "poisson")
NEWTON = "Newton, equality"
POISSON = "Poisson, two LCPs"
COULOMB = "Newton, equality, with Coulomb friction"
# codes of the kernel
_STATUS = ("complete", "budget", "cancelled", "reduced", "not solved", "scaled")
_resolve_each = Entry(resolve_each)
_ONE = "mass_matrix", "contact_jacobian", "velocity"
_MANY = "mass_matrices", "contact_jacobians", "velocities"
_DOUBLE = np.dtype(np.float64)


class Impact(NamedTuple):
    """The result of an impact (SI units; d generalized velocities, c contacts, m tangents each).

    The result of n impacts (`resolve_impacts`) has n of each quantity, along the first axis.

    Attributes
    ----------
    velocity : (d,) generalized velocity v⁺ after the impact [m/s, rad/s].
    generalized_impulse : (d,) M(v⁺ − v⁻) = Jᵀp [N s, N m s]; with friction Jᵀp + Tᵀp_t.
    impulses : (c,) p along the contact normals [N s]; a positive value pushes. With redundant rows
        p is not unique. Poisson's law returns the non-negative p that it found; with friction p is
        non-negative if non-negative impulses can produce the motion; else it is the p of least
        norm.
    rank : number of independent rows that were used; for Poisson's law, number of contacts that
        push.
    energy_change : KE⁺ − KE⁻ [J] of the rounded velocities, evaluated in double-double arithmetic.
    energy_interval : (lower, upper) [J], bounds of KE⁺ − KE⁻ in real arithmetic for the given M and
        v⁻ and the returned v⁺. With the clamp on, the upper bound is never above 0.
    clamp : factor in [0, 1] by which the final energy clamp scaled the change of velocity; 1 =
        inactive.
    status : ``"complete"``; ``"budget"``: the row budget stopped the method early;
        ``"not solved"``: a contact still closes after Poisson's law by more than 1e-6 of the
        largest |J v⁻|, which nearly opposed rows and κ(M) from 1e12 can cause (the energy does not
        rise in this case either); ``"reduced"``: no p_t that obeys Coulomb's law was found (there may be
        none). p_t then maximizes the dissipation within the friction limits of the frictionless
        impact. It stays in the friction cones, and passivity and restitution still hold.
        ``"scaled"``: Coulomb's law would add energy, and `friction_share` scales p_t down until the
        impact does not. ``"cancelled"``: no change of velocity without an energy gain was found, so
        v⁺ = v⁻, or an entry of v that takes part is so much smaller than the largest, by 2^1000,
        that scaling rounded it.
    method, law : the method that computed the impact, and its impact law.
    rows_used : the row budget used (None = unlimited); the same budget reproduces the result
        exactly.
    tangential_impulses : (c, m) p_t [N s], |p_t| ≤ μ p at every contact that pushes, zero at the
        others; m = 0 without friction.
    friction_share : factor in [0, 1] that scales friction so that the impact gains no energy and,
        with status ``"reduced"``, every contact stays in its friction cone; 1 = friction is not
        reduced.
    """

    velocity: Floats
    generalized_impulse: Floats
    impulses: Floats
    rank: Any
    energy_change: Any
    energy_interval: Any
    clamp: Any
    status: Any
    method: str
    law: str
    rows_used: int | None
    tangential_impulses: Floats
    friction_share: Any


def resolve_impact(
    mass_matrix: ArrayLike,
    contact_jacobian: ArrayLike,
    velocity: ArrayLike,
    restitution: ArrayLike,
    *,
    method: str = "factored",
    budget: int | None = None,
    clamp: bool = True,
    rank_tolerance: float | None = None,
) -> Impact:
    """Resolve a simultaneous impact: J v⁺ = −e J v⁻ for every row given, with M(v⁺ − v⁻) in
    range(Jᵀ).

    Every row is an equality, whatever the sign of its velocity. The caller chooses the rows that
    collide (γ < −v_approach, paper section V).

    Parameters
    ----------
    mass_matrix : (d, d) symmetric positive definite M (paper: D) [kg, kg m²].
    contact_jacobian : (c, d) J with one row nᵀJᵢ per contact; n is a unit normal; J v > 0
        separates. c = 0 and zero, repeated or dependent rows are allowed.
    velocity : (d,) generalized velocity v⁻ before the impact [m/s, rad/s].
    restitution : e in [−1, 1] for all contacts; or (c,) values in [0, 1], one per contact. Unequal
        values use Poisson's law by two LCPs (compression, then restitution; contacts only push),
        which is passive for any such values. Where rows are redundant, the least impulses of
        compression count (`share_compression`), so their order, scale and copies do not matter.
        Equal values use the scalar rule.
    method : ``factored`` (default), every row an equality; or ``poisson``, contacts only push, e in
        [0, 1]. It equals Newton's LCP if every row approaches and e is one number.
    budget : largest number of rows used, the most violated first (``factored`` only). Every budget
        is passive.
    clamp : whether to scale Δv so that rounding cannot raise the energy, in real arithmetic.
    rank_tolerance : a row closer than this to the span of the rows used (unit rows, kinetic metric)
        is not used. Default: 1e-10, or 4 d ε κ(L), the rounding of the rows, where this is larger.

    Returns
    -------
    Impact

    Raises
    ------
    ArgumentError
        Wrong shape, NaN or infinity, M not symmetric positive definite, e outside its range.
    RangeError
        The result would overflow.
    SolverError
        The active-set method of Poisson's law did not converge: rows are nearly opposed.

    Notes
    -----
    KE⁺ = KE⁻ − ½(1 − e²) vᵀJᵀ(J M⁻¹ Jᵀ)†J v (Theorem 2, with the factor ½ that the paper omits). In
    floating point the relative energy gain of ``factored`` stays below 10 d ε √κ(M): a refinement
    removes Cholesky's error d ε κ(M), then the energy is clamped. With the clamp no impact gains
    energy, not even in the last bit: a v⁺ is accepted only if a computed bound proves this for the
    given M (`iapb.contact.kernels.passive`). Source: Constantinescu, Salcudean, Croft (2005),
    section V.
    """
    arrays = _checked(_ONE, mass_matrix, contact_jacobian, velocity)
    contacts = len(arrays[1])
    e = _coefficients("restitution", restitution, contacts, "contact", -1.0)
    if not isinstance(method, str) or method not in METHODS:
        raise ArgumentError("method", method, one_of(method, METHODS))
    if not isinstance(e, float) and method == "factored" and (e == e[:1]).all():
        e = float(e[0]) if contacts else 0.0
    one_for_all = isinstance(e, float) and method == "factored"
    options = _options(budget, clamp, rank_tolerance, one_for_all)
    if one_for_all:
        return _resolve_one(arrays, NEWTON, options, restitution=e)
    e = _coefficients("restitution", restitution, contacts, "contact", 0.0)
    return _resolve_one(arrays, POISSON, options, method=method, unequal=e)


def resolve_impacts(
    mass_matrices: ArrayLike,
    contact_jacobians: ArrayLike,
    velocities: ArrayLike,
    restitution: ArrayLike,
    *,
    budget: int | None = None,
    clamp: bool = True,
    rank_tolerance: float | None = None,
) -> Impact:
    """Resolve n impacts of equal size in one call, bit for bit as `resolve_impact` with
    ``factored`` resolves each.

    Parameters
    ----------
    mass_matrices : (n, d, d).
    contact_jacobians : (n, c, d).
    velocities : (n, d).
    restitution : one number in [−1, 1], or (n,), one per impact.
    budget, clamp, rank_tolerance : see `resolve_impact`; one value for all n impacts.

    Returns
    -------
    Impact
        Velocities after the impacts (n, d), generalized impulses (n, d), impulses of the contacts
        (n, c), and the other attributes of `Impact` for each.

    Raises
    ------
    ArgumentError, RangeError
        As `resolve_impact`, for the first invalid impact. The index in the argument's name begins
        with the number of this impact: ``mass_matrices[17, 0, 0]``.
    """
    arrays = _checked(_MANY, mass_matrices, contact_jacobians, velocities)
    n, c, d = arrays[1].shape
    rows, clamped, tolerance = _options(budget, clamp, rank_tolerance, True)
    batch = make_batch(n, c, d)
    batch.masses[:], batch.jacobians[:], batch.velocities[:] = arrays
    batch.restitution[:] = _coefficients("restitution", restitution, n, "impact", -1.0)
    done = _resolve_each(batch, tolerance, d if rows is None else min(rows, d), clamped)
    out = batch.out
    if done < n:
        raise diagnose(*arrays, out, done, many=True)
    rank, status, change, low, high, kept, share = out.numbers.T
    return Impact(
        out.velocity,
        out.generalized_impulse,
        out.impulses,
        rank.astype(np.int64),
        change,
        np.column_stack((low, high)),
        kept,
        np.array(_STATUS)[status.astype(np.int64)],
        "factored",
        NEWTON,
        rows,
        np.zeros((n, c, 0)),
        share,
    )


def resolve_frictional_impact(
    mass_matrix: ArrayLike,
    contact_jacobian: ArrayLike,
    tangents: ArrayLike,
    velocity: ArrayLike,
    restitution: float,
    friction: ArrayLike,
) -> Impact:
    """Resolve a simultaneous impact with restitution e and Coulomb friction μ, without energy gain.

    Parameters
    ----------
    mass_matrix : (d, d) symmetric positive definite M.
    contact_jacobian : (c, d) J, unit-normal rows; every row is an equality J v⁺ = −e J v⁻ (see
        `resolve_impact`).
    tangents : (c, d) or (c, m, d), m = 1 (planar) or 2 (spatial): rows T of the unit tangents of
        each contact.
    velocity : (d,) v⁻.
    restitution : e in [0, 1], one for all contacts.
    friction : μ ≥ 0, one or (c,).

    Returns
    -------
    Impact
        v⁺ (d,) [m/s | rad/s], normal and tangential impulses [N s], energy change [J].

    Raises
    ------
    ArgumentError, RangeError
        As `resolve_impact`; also for tangents or friction of the wrong shape or range.

    Notes
    -----
    Sources: Coulomb's law at velocity level is from Moreau (1988). Kane and Levinson (Dynamics,
    1985) found the energy gain that this method prevents. The splitting into normal and tangential
    part is new here. At redundant contacts the normal impulses that limit friction are not unique.
    The method takes non-negative impulses near those of least norm, or those of least norm if some
    contact must pull. Both depend continuously on p_t, so the limits converge
    (`iapb.contact.kernels.impact_friction`).
    """
    if np.ndim(restitution) != 0:
        raise ArgumentError("restitution", restitution, "one number for all contacts")
    arrays = _checked(_ONE, mass_matrix, contact_jacobian, velocity)
    c, d = arrays[1].shape
    e = float(_coefficients("restitution", restitution, c, "contact", 0.0))
    mu = _coefficients("friction", friction, c, "contact", 0.0, np.finfo(float).max)
    T = np.zeros((0, 1, d))
    if c or np.size(tangents):
        T = _array("tangents", tangents, 2 if np.ndim(tangents) == 2 else 3)
        T = T[:, None] if T.ndim == 2 else T
    if len(T) != c or T.shape[1] not in (1, 2) or T.shape[2] != d:
        expected = f"shape ({c}, {d}) or ({c}, 1 or 2, {d})"
        raise ArgumentError("tangents", np.shape(tangents), expected)
    if not np.isfinite(T).all():
        raise ArgumentError("tangents", "a number that is not finite", "finite numbers")
    rough = T.reshape(-1, d), mu, T.shape[1]
    return _resolve_one(arrays, COULOMB, (None, True, 0.0), restitution=e, rough=rough)


def _resolve_one(
    arrays: Arrays,
    law: str,
    options: tuple[int | None, bool, float],
    *,
    method: str = "factored",
    restitution: float = 0.0,
    unequal: Floats | None = None,
    rough: tuple[Floats, Floats, int] | None = None,
) -> Impact:
    """Resolve one impact; `rough`: tangents (c m, d), friction, and m."""
    M, J, v = arrays
    contacts, d = J.shape
    budget, clamped, tolerance = options
    directions = rough[2] if rough else 0
    one = _KEPT.of_size(contacts, d, directions, unequal is not None)
    one.mass[...] = M
    one.jacobian[...] = J
    one.velocity[...] = v
    batch = one.batch
    batch.restitution[0] = restitution
    if unequal is not None:
        batch.unequal[0] = unequal
    if rough:
        batch.tangents[0], batch.friction[0] = rough[:2]
    done = _resolve_each(batch, tolerance, d if budget is None else min(budget, d), clamped)
    if not done:
        raise diagnose(M[None], J[None], v[None], batch.out, 0, many=False)
    rank, status, change, low, high, clamp, share = one.numbers.tolist()
    return Impact(
        one.after.copy(),
        one.generalized_impulse.copy(),
        one.impulses.copy(),
        int(rank),
        change,
        (low, high),
        clamp,
        _STATUS[int(status)],
        method,
        law,
        budget,
        one.tangential.copy(),
        share,
    )


def make_batch(n: int, c: int, d: int, directions: int = 0, unequal: bool = False) -> Any:
    """Return memory for n impacts of c contacts on d coordinates, and their results."""
    rows = max(1, c)
    batch = zeros_of(
        Batch,
        impact=n,
        contact=c,
        velocity=d,
        row=rows,
        direction=directions,
        tangent=rows * directions,
        slip=c * directions,
        rubbing=n if directions else 0,
        unequal=n if unequal else 0,
    )
    share = zeros_of(ShareWork, velocity=(rows + 1) * unequal, row=rows * unequal)
    return block(batch._replace(share=share))


class _One:
    """Memory for one impact, with views on it."""

    def __init__(self, c: int, d: int, directions: int, unequal: bool) -> None:
        self.batch = batch = make_batch(1, c, d, directions, unequal)
        self.mass = batch.masses[0]
        self.jacobian = batch.jacobians[0]
        self.velocity = batch.velocities[0]
        self.after = batch.out.velocity[0]
        self.generalized_impulse = batch.out.generalized_impulse[0]
        self.impulses = batch.out.impulses[0]
        self.numbers = batch.out.numbers[0]
        self.tangential = batch.out.tangential.reshape(c, directions)


class _Kept(threading.local):
    """Memory for one impact of each size; to make it takes longer than to resolve a small impact.
    Each thread has its own."""

    def __init__(self) -> None:
        self.of_size = lru_cache(256)(_One)


_KEPT = _Kept()


def diagnose(M: Floats, J: Floats, v: Floats, out: Any, refused: int, many: bool) -> IapbError:
    """Return the error that explains why the kernel refused one of n impacts, given as arrays (n,
    ...).

    It names the first wrong entry of M, v or J, else the result that is out of range.
    """
    names = _MANY if many else _ONE
    M = M[refused]
    J = J[refused]
    v = v[refused]

    def named(name: str, *place: Any) -> str:
        index = ", ".join(map(str, (refused, *place) if many else place))
        return f"{name}[{index}]" if index else name

    for name, array in zip((names[0], names[2], names[1]), (M, v, J), strict=True):
        for place in np.argwhere(~np.isfinite(array))[:1]:
            return ArgumentError(named(name, *place), float(array[tuple(place)]), "a finite number")
    k = int(np.argmin(np.diag(M)))
    if not M[k, k] > 0.0:
        return ArgumentError(named(names[0], k, k), float(M[k, k]), "a positive diagonal entry")
    exponents = -(np.frexp(np.diag(M))[1] // 2)
    with np.errstate(over="ignore", invalid="ignore"):
        scaled = np.ldexp(M, exponents[:, None] + exponents)
        skew = np.abs(scaled - scaled.T)
    for wrong, limit, expected in (
        (np.abs(scaled), LARGEST_ENTRY, "a positive definite matrix"),
        (skew, SYMMETRY_TOLERANCE, "a symmetric matrix"),
    ):
        i, j = np.unravel_index(np.argmax(wrong), M.shape)
        if not wrong[i, j] <= limit:
            expected += f"; entry [{j}, {i}] is {float(M[j, i])!r}"
            return ArgumentError(named(names[0], i, j), float(M[i, j]), expected)
    lower = 0.5 * (scaled + scaled.T)
    if pivot := cholesky(lower, lower):
        expected = f"a positive definite matrix (pivot {pivot} of Cholesky is not positive)"
        return ArgumentError(named(names[0]), M, expected)
    if out.numbers[refused, 1] == NOT_CONVERGED:
        said = "Poisson's law: the active-set method did not converge on"
        return SolverError(f"{said} {len(J)} contacts")
    quantities = names[2], "generalized_impulse", "impulses", "tangential_impulses"
    for quantity, values in zip(quantities, out.members.values(), strict=False):
        if not np.isfinite(values[refused]).all():
            return RangeError(named(quantity), "the impact of these magnitudes is above 1.8e308")
    energy = named("energy_change")
    return RangeError(energy, "the kinetic energy of these magnitudes is above 1.8e308")


def _checked(names: tuple[str, str, str], mass_matrix: Any, jacobian: Any, velocity: Any) -> Arrays:
    """Return the arrays of one impact as doubles, or of many if the names are those of many."""
    many = names is _MANY
    M = _array(names[0], mass_matrix, 2 + many)
    v = _array(names[2], velocity, 1 + many)
    lead = v.shape[:many]
    d = M.shape[-1]
    if d == 0 or M.shape != (*lead, d, d):
        each = " for each line of velocities" if many else ""
        raise ArgumentError(names[0], M.shape, f"a square matrix with at least one row{each}")
    if v.shape[-1] != d:
        raise ArgumentError(names[2], v.shape, f"{d} entries, one per row of {names[0]}")
    rows = jacobian if type(jacobian) is np.ndarray else real_numbers(jacobian)
    empty = rows is not None and rows.shape == (0,)  # [] has no second dimension to check
    J = np.zeros((*lead, 0, d)) if empty else _array(names[1], jacobian, 2 + many)
    if J.shape[:many] != lead or J.shape[-1] != d:
        shape = ", ".join(map(str, (*lead, "contacts", d)))
        raise ArgumentError(names[1], J.shape, f"shape ({shape})")
    return M, J, v


def _array(name: str, value: Any, dimensions: int) -> Floats:
    """Return an array of doubles, without a check that they are finite."""
    if type(value) is np.ndarray and value.dtype is _DOUBLE and value.ndim == dimensions:
        return value
    given = real_numbers(value)
    if given is None:
        raise ArgumentError(name, value, "an array of real numbers")
    array = given.astype(np.float64, copy=False)
    if array.ndim != dimensions:
        raise ArgumentError(name, array.shape, f"an array of {counted(dimensions, 'dimension')}")
    return array


def _coefficients(
    name: str, value: Any, size: int, each: str, low: float, high: float = 1.0
) -> Any:
    """Return one number, or one for each of `size` contacts or impacts, between low and high."""
    if type(value) is float and low <= value <= high:
        return value
    given = real_numbers(value)
    if given is None or given.shape not in ((), (size,)):
        raise ArgumentError(name, value, f"a real number or shape ({size},), one per {each}")
    numbers = given.astype(np.float64)
    for i in np.flatnonzero(~((numbers >= low) & (numbers <= high)))[:1]:
        raise ArgumentError(
            f"{name}[{i}]" if numbers.ndim else name,
            float(numbers.flat[i]),
            f"a number in [{low:g}, 1]" if high == 1.0 else "a finite number >= 0",
        )
    return numbers if numbers.ndim else float(numbers)


def _options(
    budget: Any, clamp: Any, tolerance: Any, can_stop: bool
) -> tuple[int | None, bool, float]:
    """Return row budget, whether to clamp, and rank tolerance, 0 for the default."""
    if budget is not None:
        if isinstance(budget, bool) or not isinstance(budget, int | np.integer) or budget < 0:
            raise ArgumentError("budget", budget, "a whole number of rows, 0 or more")
        if not can_stop:
            expected = "None: only 'factored', with one restitution for all, can stop early"
            raise ArgumentError("budget", budget, expected)
        budget = int(budget)
    if not isinstance(clamp, bool | np.bool_):
        raise ArgumentError("clamp", clamp, "True or False")
    is_number = isinstance(tolerance, float | int | np.floating)
    if tolerance is not None and not (is_number and 0.0 < tolerance < 1.0):
        raise ArgumentError("rank_tolerance", tolerance, "a number strictly between 0 and 1")
    return budget, bool(clamp), float(tolerance or 0.0)
