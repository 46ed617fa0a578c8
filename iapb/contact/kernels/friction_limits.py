"""Coulomb's law in an impact: tangential impulses and the limits μ p_n that move with them, settled together.

Each round moves the normal impulses to those that go with p_t, the limits with them, and p_t by a few sweeps. Where
contacts are redundant the normal impulses are not unique, and the choice must be continuous in p_t, or the limits
jump from round to round: here the non-negative ones *nearest to the round before*, by alternating projections; where
no non-negative ones explain the motion (some contact pulls), those of least norm, which are linear in p_t.
"""

from __future__ import annotations

import math

from iapb.compiled import kernel
from iapb.contact.kernels.friction import along, friction_sweeps
from iapb.contact.kernels.minimum_norm import add_minimum_norm, minimum_norm_factors, subtract_pushed
from iapb.contact.kernels.unilateral import push_only
from iapb.elementary import hypotenuse

# What has not settled by then swings or grows without end (no solution), or no non-negative impulses exist. Where the
# limits settle it takes 3 to 30 rounds, as a rule.
ROUNDS = 200
UNDAMPED, HALVED = 20, 120  # rounds after which limits move half way only, then a fifth: large μ can make them swing
HALF, FIFTH = 0.5, 0.2
STRIDE = 10.0  # times its change that a limit may move at once where friction loads its own contact, μ ∂p_n/∂p_t → 1
AT_LIMIT = 0.99  # of a limit: what is below it sticks, or will
# Of the speeds that a slip is summed from: a round that moves less is the last one. Some thousand roundings.
STILL = 1e-12
# Coulomb's law counts as met to this, as restitution does: two rows that differ by less count as one (RANK_TOLERANCE).
MET = 1e-10
# Sweeps of p_t in a round, for limits that move anyway: as many as make the last move a tenth of the first.
SWEEPS, SETTLED = 10, 0.1
HELD_SWEEPS = 200  # with the limits held for good
PUSHES = 1e-9  # share of the normal impulse that a non-negative choice may leave unexplained: an active set's rounding
# Of the largest normal impulse: friction may exceed a limit by this, the rounding of impulses that cancel.
CONE_ROUNDING = 1e-12
TRIMS = 5  # each takes what the last round left outside the cones, and leaves a share of μ of it


@kernel
def settle_friction(count, rank, work, push, f, d, scale):
    """Write p_t of Coulomb's law and the normal impulses without and with it; return whether the law is met to MET.

    Where it is not, p_t dissipates most under the limits of the impact *without* friction: a convex problem.
    scale : speed [m/s] to which STILL and MET are relative.
    """
    for i in range(count):
        f.inertia[i] = _inertia(f.free[:, :d], i * f.velocity.shape[0], f.velocity.shape[0])
    f.p[: count * f.velocity.shape[0]] = 0.0
    pushes = _start(count, rank, work, push, f, d)
    if pushes and _settle(count, rank, work, push, f, d, scale, True):
        _trim(count, rank, work, push, f, True)
        return True
    if pushes:  # not with friction: from here as where contacts pull
        _least_norm_start(count, rank, work, push, f)
    if _settle(count, rank, work, push, f, d, scale, False):
        _trim(count, rank, work, push, f, False)
        return True
    size = f.velocity.shape[0]
    for i in range(count):
        f.radius[i] = f.sliding[i] * max(f.without[i], 0.0)
    friction_sweeps(f.free[: count * size, :d], f.slip, f.radius[:count], f.inertia, f.p[: count * size], f.moved[:d],
                    f.velocity, HELD_SWEEPS, STILL * scale)
    _move_normals(count, rank, work, push, f, False)
    return False


@kernel
def _inertia(free, first, size):
    """Largest eigenvalue of B_i B_iᵀ, one or two rows."""
    x = free[first]
    xx = along(x, x)
    if size == 1:
        return xx
    y = free[first + 1]
    yy, xy = along(y, y), along(x, y)
    return 0.5 * (xx + yy) + hypotenuse(0.5 * (xx - yy), xy)


@kernel
def _start(count, rank, work, push, f, d):
    """Factor the normal rows and write the impulses without friction; return whether they can push only."""
    change, left = work.change[:d], f.left[:d]
    length = math.sqrt(along(change, change))
    for k in range(d):
        f.moved[k] = -change[k] / length if length > 0.0 else 0.0
    pushes = push_only(work.rows, count, f.moved[:d], f.without, left, push)
    pushes = pushes and along(left, left) <= PUSHES * PUSHES
    minimum_norm_factors(work.rows, work.length, count, d, work.basis, rank, work.columns, push.triangle)
    for j in range(rank):
        f.target[j] = along(work.basis[j], change)
    _responses(count, rank, work, push, f)
    if not pushes:
        _least_norm_start(count, rank, work, push, f)
        return False
    for i in range(count):
        f.without[i] = length * f.without[i] / work.length[i] if work.length[i] > 0.0 else 0.0
        f.wanted[i] = f.without[i]
        f.sliding[i], f.radius[i] = f.coefficient[i], 0.0
    _spread(count, rank, work, push, f)
    return True


@kernel
def _responses(count, rank, work, push, f):
    """∂p_n,i / ∂p_t,i of each tangent: what a contact's own friction adds to its limit."""
    size = f.velocity.shape[0]
    for j in range(count * size):
        for i in range(rank):
            f.left[i] = -f.normal_part[j, i]
        f.wanted[:count] = 0.0
        add_minimum_norm(count, rank, f.left, work.columns, push.triangle, f.wanted)
        f.response[j] = f.wanted[j // size]


@kernel
def _stride(f, i, size):
    """Factor 1/(1 − μ ∂p_n/∂p_t) of a limit's change that settles a sliding contact by itself: Newton's step."""
    own = f.p[i * size : (i + 1) * size]
    length = math.sqrt(along(own, own))
    if length == 0.0 or length < AT_LIMIT * f.radius[i]:
        return 1.0
    gain = f.sliding[i] * along(f.response[i * size : (i + 1) * size], own) / length
    return 1.0 / max(1.0 - gain, 1.0 / STRIDE)


@kernel
def _spread(count, rank, work, push, f):
    """Start from the impulses of least norm: an active set loads few of many redundant contacts."""
    f.wanted[:count] = 0.0
    _move_normals(count, rank, work, push, f, True)


@kernel
def _least_norm_start(count, rank, work, push, f):
    """Impulses without friction by least norm; what pulls carries no friction."""
    f.p[: count * f.velocity.shape[0]] = 0.0
    _move_normals(count, rank, work, push, f, False)
    for i in range(count):
        f.without[i], f.radius[i] = f.wanted[i], 0.0
        f.sliding[i] = f.coefficient[i] if f.without[i] > 0.0 else 0.0


@kernel
def _move_normals(count, rank, work, push, f, near):
    """Move `f.wanted` to normal impulses that go with p_t: nearest to what they are, or of least norm.

    Returns how far they were from it [√J].
    """
    left, defect = f.left, 0.0
    for i in range(rank):
        left[i] = f.target[i]
    for j in range(count * f.velocity.shape[0]):
        if f.p[j] != 0.0:
            for i in range(rank):
                left[i] -= f.normal_part[j, i] * f.p[j]
    if near:
        subtract_pushed(count, rank, f.wanted, work.columns, push.triangle, f.moved, left)
        defect = math.sqrt(along(left[:rank], left[:rank]))
    else:
        f.wanted[:count] = 0.0
    add_minimum_norm(count, rank, left, work.columns, push.triangle, f.wanted)
    return defect


@kernel
def _settle(count, rank, work, push, f, d, scale, pushes):
    """Rounds of normal impulses, limits and p_t; return whether the last one moved less than MET of the scale."""
    size, speed = f.velocity.shape[0], math.sqrt(along(work.u[:d], work.u[:d]))
    moved = math.inf
    for done in range(ROUNDS):
        defect = _move_normals(count, rank, work, push, f, pushes)
        step = 1.0 if done < UNDAMPED else (HALF if done < HALVED else FIFTH)
        for i in range(count):
            if pushes:
                f.wanted[i] = max(f.wanted[i], 0.0)
            f.change[i] = f.sliding[i] * max(f.wanted[i], 0.0) - f.radius[i]
            f.radius[i] = max(0.0, f.radius[i] + step * _stride(f, i, size) * f.change[i])
        moved = _sweep_tangents(f, count, size, d, STILL * scale)
        if speed > 0.0:
            moved = max(moved, scale * (defect / speed))
        if moved <= STILL * scale:
            return True
    return moved <= MET * scale


@kernel
def _sweep_tangents(f, count, size, d, still):
    """Sweep p_t; return the largest velocity [m/s] that the first sweep, or a limit that holds p_t, moved.

    A limit counts by the whole change that it was to make, damped or not.
    """
    p, rows, radius = f.p[: count * size], f.free[: count * size, :d], f.radius[:count]
    moved = friction_sweeps(rows, f.slip, radius, f.inertia, p, f.moved[:d], f.velocity, 1, 0.0)
    if moved > still:
        friction_sweeps(rows, f.slip, radius, f.inertia, p, f.moved[:d], f.velocity, SWEEPS - 1, SETTLED * moved)
    for i in range(count):
        own = p[i * size : (i + 1) * size]
        length, change = math.sqrt(along(own, own)), abs(f.change[i])
        if length >= radius[i] - STRIDE * change:
            moved = max(moved, f.inertia[i] * min(change, length))
    return moved


@kernel
def _trim(count, rank, work, push, f, near):
    """Shorten what lies outside its cone by the last round's rest; the normal impulses follow."""
    size = f.velocity.shape[0]
    for _ in range(TRIMS):
        _move_normals(count, rank, work, push, f, near)
        within = True
        for i in range(count):
            own, limit = f.p[i * size : (i + 1) * size], f.sliding[i] * max(f.wanted[i], 0.0)
            length = math.sqrt(along(own, own))
            if length > limit:
                within = False
                for a in range(size):
                    own[a] *= limit / length
        if within:
            break
    else:
        _move_normals(count, rank, work, push, f, near)
    largest = 0.0
    for i in range(count):
        largest = max(largest, f.wanted[i])
    for i in range(count):
        if near and -CONE_ROUNDING * largest <= f.wanted[i] < 0.0:
            f.wanted[i] = 0.0
