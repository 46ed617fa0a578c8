"""Dry friction in an impact: what `iapb.contact.impact_laws` states, on plain arrays and linear in the contacts.

The normal part is done and stands in an `ImpactWork`: u, its change Δ_n and the basis Q of the normal rows. Added is
Δ_t = α Bᵀ p_t with B = A_t (I − Q Qᵀ), which moves no normal velocity.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from iapb.compiled import kernel
from iapb.contact.kernels.friction import along, combine
from iapb.contact.kernels.friction_limits import CONE_ROUNDING, settle_friction
from iapb.contact.kernels.impact import apply_change

GONE = 1e-13  # of a tangent's row: less than this outside the normal rows' span is their rounding


class FrictionWork(NamedTuple):
    """Scratch of the friction of one impact: d coordinates, c contacts, m tangents each (1 planar, 2 spatial)."""

    free: np.ndarray  # (c m, d) tangents' rows of J, then of A, then B
    normal_part: np.ndarray  # (c m, d) A_t Qᵀ: what was taken out, along the basis
    slip: np.ndarray  # (c m,) tangential velocity after the normal impact [m/s]
    p: np.ndarray  # (c m,) tangential impulses [N s]
    inertia: np.ndarray  # (c,) ‖B_i B_iᵀ‖ [1/kg]
    response: np.ndarray  # (c m,) ∂p_n,i / ∂p_t,i by least norm: how friction at a contact loads or relieves it
    coefficient: np.ndarray  # (c,) μ
    radius: np.ndarray  # (c,) Coulomb's limit μ p_n [N s]
    change: np.ndarray  # (c,) what a round finds the limits off by
    sliding: np.ndarray  # (c,) μ, 0 where the contact pulls without friction
    without: np.ndarray  # (c,) normal impulses without friction [N s]
    wanted: np.ndarray  # (c,) normal impulses with it
    target: np.ndarray  # (d,) Q Δ_n
    left: np.ndarray  # (d,)
    moved: np.ndarray  # (d,) Bᵀ p_t
    velocity: np.ndarray  # (m,)


def make_friction_work(coordinates: int, contacts: int, tangents: int) -> FrictionWork:
    """Allocate the scratch for up to `contacts` contacts with `tangents` directions each."""
    d, c, m = coordinates, contacts, tangents
    per_contact = {name: np.zeros(c) for name in (
        "inertia", "coefficient", "radius", "change", "sliding", "without", "wanted")}
    per_coordinate = {name: np.zeros(d) for name in ("target", "left", "moved")}
    return FrictionWork(
        free=np.zeros((c * m, d)), normal_part=np.zeros((c * m, d)), slip=np.zeros(c * m), p=np.zeros(c * m),
        response=np.zeros(c * m), velocity=np.zeros(m), **per_contact, **per_coordinate,
    )


@kernel
def add_impact_friction(mass_matrix, lower, v, count, rank, work, push, f, impulses, v_plus, momentum):
    """Add Coulomb friction to the normal impact in `work`; `f.free` holds the tangents' rows of J, `f.coefficient` μ.

    Writes v⁺, the generalized impulse, the normal impulses (count,) and the tangential ones, `f.p`; returns (share of
    friction kept, clamp, whether Coulomb's law is met). Passive for every p_t, settled or not.
    """
    d = v.shape[0]
    share, met = friction_change(lower, count, rank, work, push, f, d)
    clamp = apply_change(mass_matrix, lower, v, True, work, v_plus, momentum)
    for i in range(count):
        impulses[i] = clamp * (f.without[i] + share * (f.wanted[i] - f.without[i]))
    for j in range(count * f.velocity.shape[0]):
        f.p[j] *= clamp * share
    return share, clamp, met


@kernel
def friction_change(lower, count, rank, work, push, f, d):
    """Add α Bᵀ p_t to `work.change`; return the share of p_t that is kept and whether Coulomb's law is met.

    The share is α times what keeps p_t within the cones where no p_t obeyed Coulomb's law.
    """
    u, change, moved = work.u[:d], work.change[:d], f.moved[:d]
    scale = split_tangents(lower, count, rank, work, f, d)
    met = settle_friction(count, rank, work, push, f, d, scale)
    within = share_within_cone(count, f)
    combine(f.free[:, :d], f.p[: count * f.velocity.shape[0]], moved)
    for k in range(d):
        moved[k] *= within
    alpha = passive_share(u, change, moved)
    for k in range(d):
        change[k] += alpha * moved[k]
    return alpha * within, met


@kernel
def split_tangents(lower, count, rank, work, f, d):
    """Whiten the tangents' rows, write the slip, and take the normal rows' span out: B and A_t Qᵀ.

    Returns the largest |A_t,j| |u| [m/s]: what a tangential velocity is summed from, so its rounding's scale.
    """
    u, largest = work.u[:d], 0.0
    for j in range(count * f.velocity.shape[0]):
        row = f.free[j, :d]
        slip = before = left = 0.0
        for k in range(d):  # L x = row
            row[k] = (row[k] - along(lower[k], row[:k])) / lower[k, k]
            slip += row[k] * (u[k] + work.change[k])
            before += row[k] * row[k]
        f.slip[j] = slip
        largest = max(largest, before)
        f.normal_part[j, :rank] = 0.0
        for _ in range(2):  # twice is enough to be orthogonal to rounding (Kahan, in Parlett 1980)
            for i in range(rank):
                overlap = along(work.basis[i], row)
                f.normal_part[j, i] += overlap
                for k in range(d):
                    row[k] -= overlap * work.basis[i, k]
        for k in range(d):
            left += row[k] * row[k]
        if left <= GONE * GONE * before:
            row[:] = 0.0
    return math.sqrt(largest) * math.sqrt(along(u, u))


@kernel
def share_within_cone(count, f):
    """Largest common factor β of p_t with β |p_t| ≤ μ p(β) at every contact, p(β) linear between the two."""
    size = f.velocity.shape[0]
    share, largest = 1.0, 0.0
    for i in range(count):
        largest = max(largest, abs(f.wanted[i]))
    for i in range(count):
        own, mu = f.p[i * size : (i + 1) * size], f.coefficient[i]
        length = math.sqrt(along(own, own))
        excess, room = length - mu * max(f.wanted[i], 0.0), mu * max(f.without[i], 0.0)
        if excess > mu * CONE_ROUNDING * largest and length > 0.0:
            share = min(share, room / (room + length - mu * f.wanted[i]))
    return share


@kernel
def passive_share(u, change, moved):
    """Largest α in [0, 1] with ½|Δ_t|² α² + (u·Δ_t) α ≤ what the normal part lost: the whole gains no energy."""
    square, slope = along(moved, moved), along(u, moved)
    lost = max(0.0, -along(u, change) - 0.5 * along(change, change))
    if square == 0.0 or 0.5 * square + slope <= lost:
        return 1.0
    root = math.sqrt(slope * slope + 2.0 * square * lost)
    return min(1.0, (root - slope) / square if slope <= 0.0 else 2.0 * lost / (root + slope))
