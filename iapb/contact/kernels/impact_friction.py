"""Dry friction in an impact: what `iapb.contact.impact_laws` states, on plain arrays and linear in the contacts.

The normal part is done and stands in an `ImpactWork`: u, its change Δ_n and the basis Q of the normal rows. Added is
Δ_t = α Bᵀ p_t with B = A_t (I − Q Qᵀ), which moves no normal velocity.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from iapb.compiled import kernel
from iapb.contact.kernels.friction import along, combine, friction_sweeps
from iapb.contact.kernels.impact import apply_change
from iapb.contact.kernels.minimum_norm import minimum_norm_impulses
from iapb.contact.kernels.unilateral import push_only

ROUNDS = 200  # updates of the friction limits μ p_n, which depend on the tangential impulses
UNDAMPED = 20  # rounds after which the limits move half way only: large μ can make them swing
SWEEPS = 100  # within each round
STILL = 1e-13  # of the largest velocity: a sweep, or an update of the limits, that moves less is the last one
PUSHES = 1e-9  # share of the normal impulse that a non-negative choice may leave unexplained: an active set's rounding


class FrictionWork(NamedTuple):
    """Scratch of the friction of one impact: d coordinates, c contacts, m tangents each (1 planar, 2 spatial)."""

    free: np.ndarray  # (c m, d) tangents' rows of J, then of A, then B
    normal_part: np.ndarray  # (c m, d) A_t Qᵀ: what was taken out, along the basis
    slip: np.ndarray  # (c m,) tangential velocity after the normal impact [m/s]
    p: np.ndarray  # (c m,) tangential impulses [N s]
    inertia: np.ndarray  # (c,) ‖B_i B_iᵀ‖ [1/kg]
    radius: np.ndarray  # (c,) Coulomb's limit μ p_n [N s]
    sliding: np.ndarray  # (c,) μ, 0 where the contact pulls without friction
    without: np.ndarray  # (c,) normal impulses without friction [N s]
    wanted: np.ndarray  # (c,) normal impulses with it
    target: np.ndarray  # (d,)
    left: np.ndarray  # (d,)
    moved: np.ndarray  # (d,) Bᵀ p_t
    velocity: np.ndarray  # (m,)


def make_friction_work(coordinates: int, contacts: int, tangents: int) -> FrictionWork:
    """Allocate the scratch for up to `contacts` contacts with `tangents` directions each."""
    d, c, m = coordinates, contacts, tangents
    return FrictionWork(
        free=np.zeros((c * m, d)), normal_part=np.zeros((c * m, d)), slip=np.zeros(c * m), p=np.zeros(c * m),
        inertia=np.zeros(c), radius=np.zeros(c), sliding=np.zeros(c), without=np.zeros(c), wanted=np.zeros(c),
        target=np.zeros(d), left=np.zeros(d), moved=np.zeros(d), velocity=np.zeros(m),
    )  # fmt: skip


@kernel
def add_impact_friction(mass_matrix, lower, v, count, friction, rank, work, push, f, impulses, v_plus, momentum):
    """Add Coulomb friction to the normal impact in `work`; `f.free` holds the tangents' rows of J.

    Writes v⁺, the generalized impulse, the normal impulses (count,) and the tangential ones, `f.p`; returns (α,
    clamp, whether Coulomb's law was met before the rounds ran out). Passive for every p_t, converged or not.
    """
    d, size = v.shape[0], f.velocity.shape[0]
    u, change, p, moved = work.u[:d], work.change[:d], f.p[: count * size], f.moved[:d]
    _split_tangents(lower, count * size, rank, work, f, d)
    met = _coulomb(count, friction, rank, work, push, f, d)
    _normal_impulses(count, rank, work, push, f, d, f.wanted)
    within = _share_within_cone(count, friction, f)
    combine(f.free, p, moved)
    for k in range(d):
        moved[k] *= within
    alpha = _passive_share(u, change, moved)
    for k in range(d):
        change[k] += alpha * moved[k]
    clamp = apply_change(mass_matrix, lower, v, True, work, v_plus, momentum)
    share = alpha * within
    for i in range(count):
        impulses[i] = clamp * (f.without[i] + share * (f.wanted[i] - f.without[i]))
    for j in range(count * size):
        p[j] *= clamp * share
    return alpha, clamp, met


@kernel
def _split_tangents(lower, count, rank, work, f, d):
    """Whiten the tangents' rows, write the slip, and take the normal rows' span out: B and A_t Qᵀ."""
    for j in range(count):
        row = f.free[j, :d]
        slip = before = left = 0.0
        for k in range(d):  # L x = row
            row[k] = (row[k] - along(lower[k], row[:k])) / lower[k, k]
            slip += row[k] * (work.u[k] + work.change[k])
            before += row[k] * row[k]
        f.slip[j] = slip
        f.normal_part[j, :rank] = 0.0
        for _ in range(2):  # twice is enough to be orthogonal to rounding (Kahan, in Parlett 1980)
            for i in range(rank):
                overlap = along(work.basis[i], row)
                f.normal_part[j, i] += overlap
                for k in range(d):
                    row[k] -= overlap * work.basis[i, k]
        for k in range(d):
            left += row[k] * row[k]
        if left <= STILL * STILL * before:
            row[:] = 0.0


@kernel
def _coulomb(count, friction, rank, work, push, f, d):
    """p_t of Coulomb's law, its limits updated until they stay; return whether they did."""
    size = f.velocity.shape[0]
    p, slip, free = f.p[: count * size], f.slip[: count * size], f.free[: count * size, :d]
    radius, inertia = f.radius[:count], f.inertia[:count]
    fastest = 0.0
    for j in range(count * size):
        p[j] = 0.0
        fastest = max(fastest, abs(slip[j]))
    _normal_impulses(count, rank, work, push, f, d, f.without)
    for i in range(count):
        inertia[i] = _inertia(free, i * size, size)
        f.sliding[i] = friction if f.without[i] > 0.0 else 0.0  # what pulls without friction carries none
        radius[i] = 0.0
    for done in range(ROUNDS):
        _normal_impulses(count, rank, work, push, f, d, f.wanted)
        moved = 0.0
        for i in range(count):
            step = (1.0 if done < UNDAMPED else 0.5) * (f.sliding[i] * max(f.wanted[i], 0.0) - radius[i])
            radius[i] += step
            moved = max(moved, inertia[i] * abs(step))
        swept = friction_sweeps(free, slip, radius, inertia, p, f.moved[:d], f.velocity, SWEEPS, STILL * fastest)
        if swept >= 0 and moved <= STILL * fastest:
            return True
    return fastest == 0.0


@kernel
def _inertia(free, first, size):
    """Largest eigenvalue of B_i B_iᵀ, one or two rows."""
    x = free[first]
    xx = along(x, x)
    if size == 1:
        return xx
    y = free[first + 1]
    yy, xy = along(y, y), along(x, y)
    return 0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy)


@kernel
def _normal_impulses(count, rank, work, push, f, d, out):
    """p along the normals that go with p_t: non-negative where that explains the motion, else of least norm."""
    target, left = f.target[:d], f.left[:d]
    for k in range(d):
        target[k] = work.change[k]
    for i in range(rank):
        taken = 0.0
        for j in range(count * f.velocity.shape[0]):
            taken += f.normal_part[j, i] * f.p[j]
        for k in range(d):
            target[k] -= taken * work.basis[i, k]
    size = math.sqrt(along(target, target))
    for k in range(d):
        target[k] = -target[k] / size if size > 0.0 else 0.0
    pushes = push_only(work.rows, count, target, out, left, push)
    if pushes and along(left, left) <= PUSHES * PUSHES:
        for i in range(count):
            out[i] = size * out[i] / work.length[i] if work.length[i] > 0.0 else 0.0
        return
    for k in range(d):
        target[k] *= -size
    minimum_norm_impulses(work.rows, work.length, count, work.basis, rank, target, out, work.columns, push.triangle,
                          push.solution)


@kernel
def _share_within_cone(count, friction, f):
    """Largest common factor β of p_t with β |p_t| ≤ μ p(β) at every contact, p(β) linear between the two."""
    size = f.velocity.shape[0]
    share = 1.0
    for i in range(count):
        own = f.p[i * size : (i + 1) * size]
        length = math.sqrt(along(own, own))
        excess, room = length - friction * f.wanted[i], friction * max(f.without[i], 0.0)
        if excess > 0.0 and length > 0.0:
            share = min(share, room / (room + excess))
    return share


@kernel
def _passive_share(u, change, moved):
    """Largest α in [0, 1] with ½|Δ_t|² α² + (u·Δ_t) α ≤ what the normal part lost: the whole gains no energy."""
    square, slope = along(moved, moved), along(u, moved)
    lost = max(0.0, -along(u, change) - 0.5 * along(change, change))
    if square == 0.0 or 0.5 * square + slope <= lost:
        return 1.0
    root = math.sqrt(slope * slope + 2.0 * square * lost)
    return min(1.0, (root - slope) / square if slope <= 0.0 else 2.0 * lost / (root + slope))
