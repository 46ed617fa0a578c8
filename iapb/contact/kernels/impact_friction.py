"""Dry friction in an impact: an extension of (15)-(21) that the paper leaves to future work. Linear
in the contacts.

With u = Lᵀ v, rows A_n = J L⁻ᵀ and A_t = T L⁻ᵀ and P = Q Qᵀ the projector onto A_n's rows, the
change of velocity is split into two orthogonal parts,

    Δu = −(1 + e) P u  +  α Bᵀ p_t,      B = A_t (I − P).

The first is the paper's impulse; its `ImpactWork` holds u, the change Δ_n and the basis Q. The
second, which these kernels add, is a tangential impulse *together with the normal impulse that
keeps every normal velocity at −e γ⁻*. Restitution is therefore met exactly, whatever the friction.
p_t obeys Coulomb's law with the tangential velocity after the impact: stick, or slip with |p_t| = μ
p_n against the velocity. α ≤ 1 is the largest factor for which the impact gains no energy. By
orthogonality ΔKE(α) = −½(1−e²)|P u|² + α u·Bᵀp_t + ½ α² |Bᵀp_t|²; if ΔKE(1) > 0, α is the positive
root of ΔKE. This excludes the energy gain that Kane and Levinson found for Newton's law with
friction. If ΔKE(1) ≤ 0, then α = 1 and the impact obeys Coulomb's law.
"""

from __future__ import annotations

from math import inf, sqrt
from typing import Annotated, NamedTuple

from iapb.contact.kernels.impact import apply_change, write_change
from iapb.contact.kernels.row_basis import add_minimum_norm, along_given_row, minimum_norm_factors
from iapb.contact.kernels.unilateral import push_only
from iapb.numerics.compiled import copy_into, kernel
from iapb.numerics.elementary import hypotenuse
from iapb.numerics.linalg import add_multiple, dot_of, multiply_by, norm_of, orthogonalize
from iapb.numerics.schema import FloatPerRow, FloatPerTangent, FloatPerVelocity, Floats

# share of a tangent's row: a smaller part outside the span of the normal rows is rounding
GONE = 1e-13


class FrictionWork(NamedTuple):
    """Scratch of the friction of one impact: each row is a contact with 1 (planar) or 2 (spatial)
    tangents."""

    rows: Annotated[Floats, "tangent velocity"]  # tangents' rows of J, then of A, then B
    normal_part: Annotated[Floats, "tangent velocity"]  # A_t Qᵀ: the removed part, along the basis
    speed: FloatPerTangent  # tangential velocity after the normal impact [m/s]
    p: FloatPerTangent  # tangential impulses [N s]
    block: Annotated[Floats, "row 3"]  # the entries xx, xy, yy of B_i B_iᵀ [1/kg]
    inertia: FloatPerRow  # its largest eigenvalue
    # ∂p_n,i / ∂p_t,i by least norm: effect on its contact's p_n
    response: FloatPerTangent
    coefficient: FloatPerRow  # μ
    limit: FloatPerRow  # Coulomb's limit μ p_n [N s]
    change: FloatPerRow  # change of each limit required by a round
    sliding: FloatPerRow  # μ; 0 where the frictionless normal impulse pulls
    without: FloatPerRow  # normal impulses without friction [N s]
    wanted: FloatPerRow  # normal impulses with friction
    # of contacts that only push: smallest velocity after, along unit rows of A
    least: FloatPerRow
    target: FloatPerVelocity  # Q Δ_n
    left: FloatPerVelocity
    moved: FloatPerVelocity  # Bᵀ p_t
    velocity: Annotated[Floats, "direction"]


@kernel
def add_impact_friction(d, count, rank, work, push, f, only_push, impulses):
    """Add Coulomb friction to the normal impact in `work`; `f.rows` holds the tangents' rows of J,
    `f.coefficient` μ.

    Writes v⁺, the generalized impulse, the normal impulses (count,) and the tangential ones, `f.p`;
    returns (share of friction kept, clamp, whether Coulomb's law is met). Passive for every p_t,
    also before convergence. The share is α times a factor that keeps p_t within the friction cones
    if no p_t obeys Coulomb's law.
    only_push : whether contacts only push; `impulses` then holds the normal impulses of Poisson's
        law.
    """
    p = f.p[: count * len(f.velocity)]
    u = work.u[:d]
    change = work.change[:d]
    moved = f.moved[:d]
    largest = 0.0
    # whiten the tangents' rows, and remove the span of the normal rows: B and A_t Qᵀ
    for j in range(len(p)):
        row = f.rows[j, :d]
        slip = 0.0
        whiten_row(row, work)
        for k in range(d):
            slip += row[k] * (u[k] + change[k])
        f.speed[j] = slip
        before = dot_of(row, row)
        largest = max(largest, before)
        if orthogonalize(row, work.basis, rank, f.normal_part[j]) <= GONE * GONE * before:
            row[:] = 0.0
    # of the rounding of a tangential velocity [m/s]
    scale = sqrt(largest) * norm_of(u)
    met = settle_friction(count, rank, work, push, f, d, scale, only_push, impulses)
    share = share_within_cone(count, f)
    combine(count, f, d)
    multiply_by(moved, share)
    alpha = passive_share(u, change, moved)
    share *= alpha
    add_multiple(change, alpha, moved)
    write_change(d, work)
    clamp = apply_change(d, True, work)
    for i in range(count):
        impulses[i] = clamp * (f.without[i] + share * (f.wanted[i] - f.without[i]))
    for j in range(len(p)):
        p[j] *= clamp * share
    return share, clamp, met


@kernel
def whiten_row(row, work):
    """Solve L x = row in place, or L C x = row (`correct_factor`)."""
    for turn in range(2 if work.corrected[0] else 1):
        factor = work.correction if turn else work.lower
        for k in range(len(row)):
            row[k] = (row[k] - dot_of(factor[k], row[:k])) / factor[k, k]


@kernel
def length_of_friction(f, i):
    """Return |p_t| of contact i [N s]."""
    size = len(f.velocity)
    return norm_of(f.p[i * size : (i + 1) * size])


@kernel
def cone(f, i):
    """Return Coulomb's limit of contact i at its present normal impulse [N s]."""
    return f.sliding[i] * max(f.wanted[i], 0.0)


@kernel
def share_within_cone(count, f):
    """Return the largest β with β |p_t| ≤ μ p(β) at every contact; p(β) is linear between `without`
    and `wanted`."""
    share = 1.0
    largest = 0.0
    for i in range(count):
        largest = max(largest, abs(f.wanted[i]))
    for i in range(count):
        mu = f.coefficient[i]
        length = length_of_friction(f, i)
        excess = length - mu * max(f.wanted[i], 0.0)
        room = mu * max(f.without[i], 0.0)
        if excess > mu * CONE_ROUNDING * largest and length > 0.0:
            share = min(share, room / (room + length - mu * f.wanted[i]))
    return share


@kernel
def passive_share(u, change, moved):
    """Return the largest α in [0, 1] with ½|Δ_t|² α² + (u·Δ_t) α ≤ loss of the normal part: the sum
    gains no energy."""
    square = dot_of(moved, moved)
    slope = dot_of(u, moved)
    lost = max(0.0, -dot_of(u, change) - 0.5 * dot_of(change, change))
    if square == 0.0 or 0.5 * square + slope <= lost:
        return 1.0
    root = sqrt(slope * slope + 2.0 * square * lost)
    return min(1.0, (root - slope) / square if slope <= 0.0 else 2.0 * lost / (root + slope))


# Coulomb's law in an impact: an iteration for the tangential impulses p_t and the limits μ p_n,
# which depend on p_t.
#
# Each round updates the normal impulses for p_t, then the limits, then p_t by a few sweeps. At
# redundant contacts the normal impulses are not unique. The choice must be continuous in p_t, or
# the limits jump from round to round. The iteration takes the non-negative impulses nearest to
# those of the round before, by alternating projections. If no non-negative impulses produce the
# motion (some contact pulls), it takes those of least norm, which are linear in p_t.

# Largest number of rounds. Convergence usually takes 3 to 30; an iteration that has not converged
# by then oscillates or diverges (no solution), or no non-negative impulses exist.
ROUNDS = 200
# rounds after which limits move half way only, then a fifth: large μ can make them swing
UNDAMPED = 20
HALVED = 120
HALF = 0.5
FIFTH = 0.2
# largest over-relaxation of a limit, for friction that loads its own contact, μ ∂p_n/∂p_t → 1
STRIDE = 10.0
AT_LIMIT = 0.99  # share of a limit: a contact below it sticks
# Share of the speeds that a slip is summed from: a round with smaller changes is the last one. Some
# thousand roundings.
STILL = 1e-12
# Tolerance for Coulomb's law, the same as for restitution: rows that differ by less count as one
# (RANK_TOLERANCE).
MET = 1e-10
# Sweeps of p_t in a round, as the limits change anyway: until one changes velocities by a tenth of
# the first.
SWEEPS = 10
SETTLED = 0.1
HELD_SWEEPS = 200  # with the limits held for good
# Sweeps over normal impulses and friction. Nearly parallel contacts share their load anew for
# thousands of sweeps, long after the velocities are right. Of 54 impacts that the rounds failed to
# settle, 200 sweeps end 52 within a thousandth of |u| of what 20,000 give, and the others within
# 4e-3.
IMPACT_SWEEPS = 200
SWEPT = 3e-3  # share of |u|: the sweeps have settled if the last one changed velocities by less
# share of the normal impulse that non-negative impulses may miss: rounding of the active set
PUSHES = 1e-9
# Of the largest normal impulse: friction may exceed a limit by this, the rounding of impulses that
# cancel.
CONE_ROUNDING = 1e-12
TRIMS = 5  # each removes the excess over the cones and leaves a share of μ of it


@kernel
def settle_friction(count, rank, work, push, f, d, scale, only_push, impulses):
    """Write p_t of Coulomb's law and the normal impulses without and with it; return whether the
    law is met within MET.

    If it is not, p_t maximizes the dissipation under the limits of the frictionless impact, a
    convex problem. Contacts that only push get no limits from impulses that pull: these brace one
    another, and friction would stop anything.
    scale : speed [m/s] to which STILL and MET are relative.
    """
    size = len(f.velocity)
    for i in range(count):
        set_inertia(f, i, d)
    f.p[: count * size] = 0.0
    if _start(count, rank, work, push, f, d) and _settle(count, rank, work, f, d, scale, True):
        _trim(count, rank, work, f, True)
        return True
    f.p[: count * size] = 0.0
    _move_normals(count, rank, work, f, False)
    for i in range(count):
        f.without[i] = f.wanted[i] = impulses[i] if only_push else f.wanted[i]
        f.limit[i] = 0.0
        # contacts that pull get no friction
        f.sliding[i] = f.coefficient[i] if f.without[i] > 0.0 else 0.0
    if not only_push and _settle(count, rank, work, f, d, scale, False):
        _trim(count, rank, work, f, False)
        return True
    for i in range(count):
        f.limit[i] = f.sliding[i] * max(f.without[i], 0.0)
    friction_sweeps(count, f, d, HELD_SWEEPS, STILL * scale)
    _move_normals(count, rank, work, f, only_push)
    return False


@kernel
def sweep_impact(d, count, work, f, impulses):
    """Sweep over contacts that only push, velocity ≥ `f.least`, with friction; return (clamp,
    whether this settled).

    A sweep sets each normal impulse, then the friction within its limit. Where the sweeps settle
    without a gain of energy, the result is written as by `add_impact_friction`; else all but
    scratch stays as it is.
    impulses : (≥count,) of the result so far, from which the sweeps start, as they do from `f.p`.
    """
    size = len(f.velocity)
    u = work.u[:d]
    moved = f.moved[:d]
    p_n = f.wanted
    for j in range(count * size):
        whiten_row(f.rows[j, :d], work)
        f.speed[j] = dot_of(f.rows[j, :d], u)
    for i in range(count):
        set_inertia(f, i, d)
        p_n[i] = impulses[i] * work.length[i]
    speed = norm_of(u)
    fastest = inf
    for _ in range(IMPACT_SWEEPS):
        combine(count, f, d)
        for k in range(d):
            for i in range(count):
                moved[k] += work.rows[k, i] * p_n[i]
        fastest = 0.0
        for i in range(count):
            closing = -f.least[i]
            for k in range(d):
                closing += work.rows[k, i] * (u[k] + moved[k])
            change = max(-p_n[i], -closing)
            p_n[i] += change
            for k in range(d):
                moved[k] += work.rows[k, i] * change
            f.limit[i] = along_given_row(work, i, f.coefficient[i] * p_n[i])
            fastest = max(fastest, abs(change))
            if f.inertia[i] > 0.0:
                fastest = max(fastest, _slide(f, i, d) / sqrt(f.inertia[i]))
        if fastest <= MET * speed:
            break
    if fastest > SWEPT * speed or dot_of(u, moved) + 0.5 * dot_of(moved, moved) > 0.0:
        return 1.0, False
    copy_into(work.change[:d], moved)
    write_change(d, work)
    clamp = apply_change(d, True, work)
    for i in range(count):
        impulses[i] = along_given_row(work, i, clamp * p_n[i])
    return clamp, True


@kernel
def _start(count, rank, work, push, f, d):
    """Factor the normal rows and write the impulses without friction; return whether non-negative
    ones exist."""
    change = work.change[:d]
    left = f.left[:d]
    size = len(f.velocity)
    length = norm_of(change)
    for k in range(d):
        f.moved[k] = -change[k] / length if length > 0.0 else 0.0
    pushes = push_only(work.rows, count, f.moved[:d], f.without, left, push)
    pushes = pushes and dot_of(left, left) <= PUSHES * PUSHES
    minimum_norm_factors(d, count, rank, work.length, work)
    for j in range(rank):
        f.target[j] = dot_of(work.basis[j], change)
    # ∂p_n,i / ∂p_t,i: the change of a contact's normal impulse with its own friction
    for j in range(count * size):
        for i in range(rank):
            f.left[i] = -f.normal_part[j, i]
        f.wanted[:count] = 0.0
        add_minimum_norm(count, rank, f.left, f.wanted, work)
        f.response[j] = f.wanted[j // size]
    if not pushes:
        return False
    for i in range(count):
        f.without[i] = along_given_row(work, i, length * f.without[i])
        f.sliding[i] = f.coefficient[i]
        f.limit[i] = 0.0
    # an active set loads only a few of redundant contacts
    _move_normals(count, rank, work, f, False)
    return True


@kernel
def _move_normals(count, rank, work, f, near):
    """Move `f.wanted` to the nearest normal impulses consistent with p_t, or those of least norm;
    return the defect."""
    left = f.left[:rank]
    defect = 0.0
    copy_into(left, f.target)
    for j in range(count * len(f.velocity)):
        if f.p[j] != 0.0:
            add_multiple(left, -f.p[j], f.normal_part[j])
    if near:
        for j in range(rank):  # left −= Bᵀ p = Tᵀ Vᵀ p
            f.moved[j] = dot_of(work.columns[j], f.wanted[:count])
            for m in range(j + 1):
                left[j] -= work.triangle[m, j] * f.moved[m]
        defect = norm_of(left)
    else:
        f.wanted[:count] = 0.0
    add_minimum_norm(count, rank, left, f.wanted, work)
    return defect


@kernel
def _settle(count, rank, work, f, d, scale, pushes):
    """Iterate normal impulses, limits and p_t; return whether the last round changed less than MET
    times the scale."""
    size = len(f.velocity)
    speed = norm_of(work.u[:d])
    still = STILL * scale
    moved = inf
    for done in range(ROUNDS):
        defect = _move_normals(count, rank, work, f, pushes)
        step = 1.0 if done < UNDAMPED else (HALF if done < HALVED else FIFTH)
        for i in range(count):
            if pushes:
                f.wanted[i] = max(f.wanted[i], 0.0)
            stride = 1.0
            length = length_of_friction(f, i)
            # Newton's step for a single sliding contact
            if length > 0.0 and length >= AT_LIMIT * f.limit[i]:
                own = f.p[i * size : (i + 1) * size]
                gain = f.sliding[i] * dot_of(f.response[i * size : (i + 1) * size], own) / length
                stride = 1.0 / max(1.0 - gain, 1.0 / STRIDE)
            f.change[i] = cone(f, i) - f.limit[i]
            f.limit[i] = max(0.0, f.limit[i] + step * stride * f.change[i])
        moved = friction_sweeps(count, f, d, 1, 0.0)
        if moved > still:
            friction_sweeps(count, f, d, SWEEPS - 1, SETTLED * moved)
        for i in range(count):  # an undamped limit that holds p_t would move it on
            change = abs(f.change[i])
            length = length_of_friction(f, i)
            if length >= f.limit[i] - STRIDE * change:
                moved = max(moved, f.inertia[i] * min(change, length))
        if speed > 0.0:
            moved = max(moved, scale * (defect / speed))
        if moved <= still:
            return True
    return moved <= MET * scale


@kernel
def _trim(count, rank, work, f, near):
    """Shorten each contact's p_t that the last round left outside its cone, and update the normal
    impulses."""
    largest = 0.0
    for turn in range(TRIMS + 1):
        _move_normals(count, rank, work, f, near)
        within = True
        for i in range(count if turn < TRIMS else 0):
            limit = cone(f, i)
            length = length_of_friction(f, i)
            if length > limit:
                within = False
                size = len(f.velocity)
                multiply_by(f.p[i * size : (i + 1) * size], limit / length)
        if within:
            break
    for i in range(count):
        largest = max(largest, f.wanted[i])
    for i in range(count):
        if near and -CONE_ROUNDING * largest <= f.wanted[i] < 0.0:
            f.wanted[i] = 0.0


# Tangential impulses within Coulomb's discs: sweeps over the contacts; each contact stops or slides
# at its limit.

# sin² of the angle between two tangents' rows; below it one row is a multiple of the other, up to
# rounding.
SINGULAR = 1e-12


@kernel
def set_inertia(f, i, d):
    """Write the entries of B_i B_iᵀ, which has one or two rows, and its largest eigenvalue."""
    size = len(f.velocity)
    x = f.rows[i * size, :d]
    y = f.rows[i * size + size - 1, :d]
    xx = dot_of(x, x)
    xy = dot_of(x, y)
    yy = dot_of(y, y)
    f.block[i, 0] = xx
    f.block[i, 1] = xy
    f.block[i, 2] = yy
    f.inertia[i] = xx if size == 1 else 0.5 * (xx + yy) + hypotenuse(0.5 * (xx - yy), xy)


@kernel
def combine(count, f, d):
    """Write moved = Bᵀ p."""
    moved = f.moved[:d]
    moved[:] = 0.0
    for j in range(count * len(f.velocity)):
        add_multiple(moved, f.p[j], f.rows[j])


@kernel
def friction_sweeps(count, f, d, sweeps, still):
    """Sweep over the contacts: set p_i so that w_i = 0 if its disc allows this, else to proj(p_i −
    w_i / ρ_i).

    w = speed + B moved is the tangential velocity, moved = Bᵀ p, proj projects on the disc of
    radius limit_i. p and moved change in place; each sweep combines moved anew, so that rounding
    does not add up. Stops after a sweep that changes no velocity by more than `still`; returns the
    largest change of the last one [m/s].
    """
    fastest = 0.0
    for _ in range(sweeps):
        combine(count, f, d)
        fastest = 0.0
        for i in range(count):
            if f.inertia[i] > 0.0:
                fastest = max(fastest, _slide(f, i, d))
        if fastest <= still:
            break
    return fastest


@kernel
def _slide(f, i, d):
    """Move one contact's impulse to stop its slip, or towards its limit; return the change of
    velocity [m/s]."""
    velocity = f.velocity
    size = len(f.velocity)
    moved = f.moved[:d]
    first = i * size
    limit = f.limit[i]
    inertia = f.inertia[i]
    for a in range(size):
        velocity[a] = f.speed[first + a] + dot_of(f.rows[first + a], moved)
    fastest = norm_of(velocity)
    if not _stops(f, i, first):
        for a in range(size):
            velocity[a] = f.p[first + a] - velocity[a] / inertia
        length = norm_of(velocity)
        share = limit / length if length > limit else 1.0
        multiply_by(velocity, share)
        fastest = 0.0
        for a in range(size):
            fastest = max(fastest, inertia * abs(velocity[a] - f.p[first + a]))
    for a in range(size):
        change = velocity[a] - f.p[first + a]
        f.p[first + a] += change
        add_multiple(moved, change, f.rows[first + a])
    return fastest


@kernel
def _stops(f, i, first):
    """Write into `velocity` the impulse that stops a contact with two tangents; False if it exceeds
    the limit."""
    # of two, steps of length 1/ρ would need κ(B_i B_iᵀ) sweeps; with a lever, hundreds
    if len(f.velocity) != 2:
        return False
    xx = f.block[i, 0]
    xy = f.block[i, 1]
    yy = f.block[i, 2]
    v = f.velocity[0]
    w = f.velocity[1]
    det = xx * yy - xy * xy
    if det <= SINGULAR * xx * yy:
        return False
    one = f.p[first] - (yy * v - xy * w) / det
    two = f.p[first + 1] - (xx * w - xy * v) / det
    if one * one + two * two > f.limit[i] * f.limit[i]:
        return False
    f.velocity[0] = one
    f.velocity[1] = two
    return True
