"""Resolvers with one planted bug each, made from the correct resolver, and the law that must detect each bug."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from reference.exact import exact_impact
from verification.impacts import Floats
from verification.laws.resolver import (
    RANK_CUT,
    Resolver,
    back,
    projecting,
    row_space,
    sound_resolver,
    whitened,
)
from verification.methods import gram_pinv

TOO_MUCH = Fraction(10001, 10000)  # factor on the impulse that e requires


def wrong_sign(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    return projecting(M, J, v, -(1.0 + e))


def squared_restitution(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    return projecting(M, J, v, 1.0 + e * e)


def lost_one_plus(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    return projecting(M, J, v, e)


def missing_half(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    return projecting(M, J, v, 0.5 * (1.0 + e))


def too_loose_rank(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    return projecting(M, J, v, 1.0 + e, cut=1e-2)


def too_tight_rank(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    return projecting(M, J, v, 1.0 + e, cut=1e-18)


def transposed_factor(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Uses L instead of Lᵀ."""
    parts = whitened(M, J, v)
    Q, u = row_space(parts.rows), parts.lower @ v
    return np.linalg.solve(parts.lower, u - (1.0 + e) * (Q.T @ (Q @ u)))


def forgotten_mass(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    return projecting(np.eye(len(v)), J, v, 1.0 + e)


def diagonal_mass(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Ignores the coupling between coordinates in M."""
    return projecting(np.diag(np.diag(M)), J, v, 1.0 + e)


def reversed_velocity(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Returns −e v: this keeps energy and restitution but ignores the contacts."""
    return -e * v


def one_after_the_other(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Resolves each contact once, in order, so later contacts undo earlier ones."""
    parts = whitened(M, J, v)
    u = parts.u.copy()
    for row in parts.rows:
        u -= (1.0 + e) * (row @ u) * row
    return back(parts, u)


def double_counted(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Adds the impulses that each contact would need alone."""
    parts = whitened(M, J, v)
    return back(parts, parts.u - (1.0 + e) * (parts.rows.T @ (parts.rows @ parts.u)))


def approaching_only(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Drops the rows with a separating velocity, although the caller included them."""
    return sound_resolver(M, J[J @ v < 0.0], v, e)


def pulling_clipped(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Sets each pulling impulse to zero separately."""
    parts = whitened(M, J, v)
    p = -(1.0 + e) * (np.linalg.pinv(parts.rows.T, rcond=RANK_CUT) @ parts.u)
    return back(parts, parts.u + parts.rows.T @ np.maximum(p, 0.0))


def per_body_rows(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """(13)-(14): reverses the two bodies of a self-collision separately (here: positive and negative entries)."""
    split = np.vstack([np.maximum(J, 0.0), np.minimum(J, 0.0)])
    return sound_resolver(M, split, v, e)


def single_precision(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    return sound_resolver(M, J, v, e).astype(np.float32).astype(np.float64)


def damped_formula(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Uses (W + λI)⁻¹ with a λ far above rounding."""
    X = np.linalg.solve(M, J.T)
    W = J @ X
    return v - (1.0 + e) * (X @ np.linalg.solve(W + 1e-3 * np.eye(len(W)), J @ v))


def unscaled_rows(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Decides the rank without scaling the rows, so short rows are lost."""
    lower = np.linalg.cholesky(M)
    rows = np.linalg.solve(lower, J.T).T
    _, values, right = np.linalg.svd(rows, full_matrices=False)
    Q = right[values > 1e-6 * np.max(values, initial=0.0)]
    u = lower.T @ v
    return np.linalg.solve(lower.T, u - (1.0 + e) * (Q.T @ (Q @ u)))


def fails_without_contacts(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    return sound_resolver(M, J, v, e) + 0.0 * np.max(np.abs(J))


def absolute_restitution(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    return projecting(M, J, v, 1.0 + abs(e))


def nearly_elastic(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Gives 1e-4 less of the impulse than e requires."""
    return projecting(M, J, v, (1.0 + e) * (1.0 - 1e-4))


def returns_too_much(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Gives 1e-4 more of the impulse than e requires; rationals, rounded once, give the same bits under every BLAS."""
    before = [Fraction(x) for x in v.tolist()]
    exact = exact_impact(M, J, v, e).velocity
    return np.array([float(a + TOO_MUCH * (b - a)) for a, b in zip(before, exact, strict=True)])


def one_gradient_step(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Stops an iteration after its first step, which depends on how often a row is repeated."""
    parts = whitened(M, J, v)
    largest = np.linalg.norm(parts.rows, 2) ** 2 if parts.rows.any() else 1.0
    return back(parts, parts.u - (1.0 + e) / largest * (parts.rows.T @ (parts.rows @ parts.u)))


def short_rows_dropped(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Drops rows below a fixed length, which depends on the units."""
    return sound_resolver(M, J[np.linalg.norm(J, axis=1) > 0.2], v, e)


def three_rows_at_most(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Uses at most three rows for all groups together."""
    parts = whitened(M, J, v)
    Q = row_space(parts.rows)[:3]
    return back(parts, parts.u - (1.0 + e) * (Q.T @ (Q @ parts.u)))


def makes_warm_start() -> Resolver:
    """Returns a resolver whose answer depends on the previous call."""
    left = [0.0]

    def warm_start(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
        v_plus = sound_resolver(M, J, v, e) * (1.0 + left[0])
        left[0] = 1e-15 * float(np.max(np.abs(v)))
        return v_plus

    return warm_start


def nan_without_contacts(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    return sound_resolver(M, J, v, e) if len(J) else np.full_like(v, np.nan)


def column_of_velocities(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Returns v⁺ with shape (d, 1)."""
    return sound_resolver(M, J, v, e)[:, None]


def writes_on_its_arguments(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    v[:] = sound_resolver(M, J, v, e)
    return v


def gives_up(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    raise RuntimeError("did not converge")


def makes_stale_jacobian() -> Resolver:
    """Returns a resolver that reuses the Jacobian of the first call with each shape."""
    remembered: dict[tuple[int, ...], Floats] = {}

    def stale_jacobian(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
        return sound_resolver(M, remembered.setdefault(J.shape, J), v, e)

    return stale_jacobian


def each_contact_its_own_restitution(M: Floats, J: Floats, v: Floats, e: Floats) -> Floats:
    """Newton's law as equalities with a restitution per row: every row meets it, but it can create energy."""
    if np.ndim(e) == 0:
        return sound_resolver(M, J, v, float(e))
    parts = whitened(M, J, v)
    wanted = (1.0 + np.asarray(e)) * (parts.rows @ parts.u)
    return back(parts, parts.u - np.linalg.pinv(parts.rows, rcond=RANK_CUT) @ wanted)


class PlantedBug(NamedTuple):
    """A bug: a function that makes the resolver, and a law that must detect it (other laws may detect it, too)."""

    make: Callable[[], Resolver]
    caught_by: str


def plain(resolver: Resolver, caught_by: str) -> PlantedBug:
    """Return the planted bug of a resolver without memory."""
    return PlantedBug(lambda: resolver, caught_by)


PLANTED_BUGS: dict[str, PlantedBug] = {
    "wrong_sign": plain(wrong_sign, "kinetic_energy"),
    "squared_restitution": plain(squared_restitution, "restitution"),
    "lost_one_plus": plain(lost_one_plus, "restitution"),
    "missing_half": plain(missing_half, "restitution"),
    "too_loose_rank": plain(too_loose_rank, "restitution"),
    "too_tight_rank": plain(too_tight_rank, "free_motion"),
    "transposed_factor": plain(transposed_factor, "impulse_range"),
    "forgotten_mass": plain(forgotten_mass, "kinetic_energy"),
    "diagonal_mass": plain(diagonal_mass, "coordinates"),
    "reversed_velocity": plain(reversed_velocity, "impulse_range"),
    "one_after_the_other": plain(one_after_the_other, "row_order"),
    "double_counted": plain(double_counted, "duplicated_rows"),
    "approaching_only": plain(approaching_only, "restitution"),
    "pulling_clipped": plain(pulling_clipped, "restitution"),
    "printed_formula": plain(gram_pinv, "kinetic_energy"),
    "per_body_rows": plain(per_body_rows, "momentum"),
    "single_precision": plain(single_precision, "restitution"),
    "damped_formula": plain(damped_formula, "restitution"),
    "unscaled_rows": plain(unscaled_rows, "row_scaling"),
    "fails_without_contacts": plain(fails_without_contacts, "kinetic_energy"),
    "absolute_restitution": plain(absolute_restitution, "no_impulse"),
    "nearly_elastic": plain(nearly_elastic, "elastic"),
    "one_gradient_step": plain(one_gradient_step, "redundancy"),
    "short_rows_dropped": plain(short_rows_dropped, "units"),
    "three_rows_at_most": plain(three_rows_at_most, "groups"),
    "warm_start": PlantedBug(makes_warm_start, "repeatability"),
    "nan_without_contacts": plain(nan_without_contacts, "kinetic_energy"),
    "column_of_velocities": plain(column_of_velocities, "kinetic_energy"),
    "writes_on_its_arguments": plain(writes_on_its_arguments, "arguments"),
    "gives_up": plain(gives_up, "kinetic_energy"),
    "stale_jacobian": PlantedBug(makes_stale_jacobian, "restitution"),
    "returns_too_much": plain(returns_too_much, "kinetic_energy"),
}
