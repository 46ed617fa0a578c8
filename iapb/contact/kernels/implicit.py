"""Resting contact, implicit in the velocity: the forces of a step act at its end, so no stiffness
makes energy.

v* is the velocity after impulses and applied forces. Over the contacts of a group, with γ = J v and
gap φ <= 0,

    v⁺ = argmin ½ (v − v*)ᵀ M (v − v*) + Σ Δt f(γ)²/2k + Σ c h(|w|) + Σ Δt F h(|v_i|),
    f = max(0, −K φ − k γ),   k = K Δt + B,

w the tangential velocities, c = μ Δt f the limit of friction, F the dry friction of a joint
[N, N m], also of trees without contact. h(|w|) = |w|, rounded below the speed STICKING so that it
has a derivative: a contact that sticks creeps more slowly than that. The function is strictly
convex: one answer, also where contacts are redundant. M contains Δt D of damped joints. Newton's
method with a line search solves it, from the velocity before the step's forces, which at rest is
the answer. The limits of friction follow from the forces, so both are solved in turns; any limit
c >= 0 dissipates.

A gap that bends over the step (a ball in a drum, a slider on a turning arm) closes by ½ Δt² of an
acceleration more than by Δt γ. What it closed more in the step before is added to γ in f; without
this the contact would sink. In the same way w gets what the touching points have moved apart on
their arcs in the step before and, where they stick, since they stick.

Where a gap is linear over the step, KE⁺ + Φ⁺ <= KE* + Φ with Φ = Σ ½ K min(φ, 0)², for every K, B
>= 0 and Δt > 0 (`verification.proofs`). A solution that is not accurate enough to show this in
numbers is shortened until it does.
"""

from __future__ import annotations

from math import inf, sqrt
from typing import Annotated, NamedTuple

from iapb.contact.kernels.contact_set import (
    LEFT,
    TOUCHING,
    contact_before,
    group_of_contact,
    trees_of,
)
from iapb.contact.kernels.rows import friction_of, tangent_of, twist, write_pair_rows
from iapb.numerics.compiled import kernel
from iapb.numerics.linalg import (
    ZERO,
    add,
    add_multiple,
    cross,
    dot,
    dot_of,
    load,
    multiply_by,
    placed,
    scale,
    store,
    subtract,
    transform_back,
    write_difference,
)
from iapb.numerics.schema import (
    FloatPerContact,
    FloatPerRestRow,
    FloatPerVelocity,
    Floats,
    Integers,
    NumberPerContact,
    NumberPerTree,
    NumberPerVelocity,
    SingleFloat,
    SingleInteger,
)

# m/s: a contact that slips more slowly sticks, with a friction in proportion to its slip
STICKING = 1e-10
ROUNDED = 1e-14  # m: points that are this close are together
EXACT = 1e-20  # share of the energy of a step that the open balance of momentum may give the bodies
GOOD = 1e-14  # the same, where rounding allows no better
ITERATIONS = 60  # of Newton's method for given limits of friction
TURNS = 12  # of the limits of friction in a step; the next step goes on from the last ones
# of these take the new limits whole; the others half, for limits that swing to and fro
FREE_TURNS = 3
DRY = -2  # in place of the first contact of a group that has joint friction alone
SETTLED = 1e-3  # share of a limit of friction whose change ends the turns
SEARCHES = 40  # evaluations of a line search
# In units of Δt/m, m the heaviest tree of the group: what is left of rigid contact, so that forces
# at redundant contacts are unique. A box sags by 4e-12 m at 1 kHz.
COMPLIANCE = 1e-6
LEAST_COMPLIANCE = 1e-12  # the same for the lightest tree; less is lost in rounding
SHORT = 0.1  # share of a step: what a contact bends in a shorter part tells nothing of the next
FADING = 100.0  # steps in which an overlap fades to 1/e; fewer would throw a body out of it
BENT = 0.01  # share of the energy of a step that the arcs of contacts may seem to create
GAIN = 1e-11  # share of the energy of a step that rounding may seem to create


class RestWork(NamedTuple):
    """Scratch of resting contact, implicit in the velocity, of one group (`rest_group`).

    Each contact has a row for the normal and, with friction, for each tangent. Local coordinates
    number those of the group. `width` is twice the number of coordinates of the largest tree.
    """

    contact: NumberPerContact  # contacts of the group
    at: Annotated[Integers, "contact 2"]  # first local coordinate of each of their two trees
    # number of coordinates of these; 0 = no tree, or the first one again
    size: Annotated[Integers, "contact 2"]
    direction: Annotated[Floats, "rest_row 3"]  # of each row: the normal, then the tangents
    rows: Annotated[Floats, "rest_row width"]  # rows of J: one half for each of the two trees
    speed: FloatPerRestRow  # J v [m/s]
    p: FloatPerRestRow  # impulses of the step [N s]
    limit: FloatPerContact  # limits c = μ F_n Δt of friction [N s]
    # what a contact moved more than Δt J v in the step before, by Δt [m/s]
    bend: FloatPerRestRow
    stiffness: SingleFloat  # K of the group's contacts [N/m]
    first: NumberPerTree  # first contact of each group, by its first tree, −1 = none
    next: NumberPerContact  # contact of the same group that follows, −1 = none
    next_tree: NumberPerTree  # tree of the same group that follows, −1 = none
    offset: NumberPerTree  # first local coordinate of each tree
    dof: NumberPerVelocity  # the coordinate v[dof] of each local one
    begin: NumberPerVelocity  # first local coordinate of its tree
    end: NumberPerVelocity  # and the one after the last
    # first nonzero column of each row of the Newton matrix
    envelope: NumberPerVelocity
    change: FloatPerRestRow  # J Δv of a Newton step
    v: FloatPerVelocity  # local velocities
    free: FloatPerVelocity  # v*
    dry: FloatPerVelocity  # limits Δt F of joint friction [N s, N m s]
    balance: FloatPerVelocity  # M (v − v*) − Jᵀ p
    change_of_v: FloatPerVelocity  # v − v*
    step: FloatPerVelocity  # Newton step
    given: FloatPerVelocity  # M times a vector, or L⁻¹ of one
    energy: SingleFloat  # ½ v*ᵀ M v* [J]
    shortened: SingleInteger  # solutions that were shortened, since the start


@kernel
def rest_implicitly(world, state, touches, rubs):
    """Give v the forces of all resting contacts and of joint friction; write them to the contacts,
    to penalty_force and friction_force."""
    work = state.rest_work
    contacts = state.contacts
    some = False
    work.first[:] = -1
    for i in range(state.contact_count[0] - 1 if touches else -1, -1, -1):
        if contacts.idle[i]:
            continue
        contacts.normal_force[i] = 0.0
        if rubs:
            store(contacts.friction_force, i, ZERO)
        group = group_of_contact(world, contacts, i, state.group_of_tree)
        if contacts.mark[i] != LEFT:
            work.next[i] = work.first[group]
            work.first[group] = i
            some = True
    for t in range(world.trees if world.switches.joint_friction else 0):
        if state.moving[t] and is_dry(world, t):
            group = state.group_of_tree[t]
            some = True
            work.first[group] = work.first[group] if work.first[group] >= 0 else DRY
    if not some:
        return
    work.next_tree[:] = -1
    for t in range(world.trees - 1, -1, -1):
        group = state.group_of_tree[t]
        if group != t:  # its first tree is the group's number
            work.next_tree[t] = work.next_tree[group]
            work.next_tree[group] = t
    for group in range(world.trees):
        if work.first[group] >= 0 or work.first[group] == DRY:
            rest_group(world, state, group, 1 + world.tangents if rubs else 1)


@kernel
def is_dry(world, t):
    """Return whether a joint of tree t has friction."""
    found = False
    for k in range(world.tree_start[t], world.tree_stop[t]):
        found = found or world.joint_friction[k] > 0.0
    return found


@kernel
def dry_impulse(work, i, speed):
    """Return the impulse of joint friction against the speed of local coordinate i: Δt F, less
    below STICKING."""
    return work.dry[i] * speed / max(abs(speed), STICKING)


@kernel
def rest_group(world, state, group, s):
    """Solve one group, with s rows a contact, and give its trees their new velocity.

    The first guess is the velocity before the forces of the step.
    """
    work = state.rest_work
    size = 0
    t = group
    while t >= 0:
        work.offset[t] = begin = size
        for dof in range(world.tree_start[t], world.tree_stop[t]):
            work.dof[size] = dof
            work.begin[size] = begin
            work.envelope[size] = begin
            work.end[size] = begin + world.tree_stop[t] - world.tree_start[t]
            work.free[size] = state.v[dof]
            work.v[size] = state.start_v[dof]
            work.dry[size] = state.h[0] * world.joint_friction[dof]
            size += 1
        t = work.next_tree[t]
    work.energy[0] = -1.0  # not known yet
    work.stiffness[0], k = stiffness_of_group(world, work, group, state.h[0])
    count = gather_contacts(world, state, group, s)
    solved = solve_in_turns(world, state, size, count, s, k)
    if not solved or bends_too_far(world, state, size, count, s):
        work.bend[: count * s] = 0.0  # it is not in the energy that `guard` compares
        if not solve_in_turns(world, state, size, count, s, k):
            guard(world, state, size, count, s)
    give_back(world, state, size, count, s)


@kernel
def bends_too_far(world, state, size, count, s):
    """Return whether what contacts bend in a step gives the bodies noticeable energy: then the step
    is too long for their arcs."""
    work = state.rest_work
    bends = False
    for j in range(count * s):
        bends = bends or work.bend[j] != 0.0
    if not bends:
        return False
    after = 0.5 * mass_form(world, state, size, work.v, work.v)
    before = free_energy(world, state, size) + spring_energy(state, count, s, 0.0)
    return after > (1.0 + BENT) * before


@kernel
def solve_in_turns(world, state, size, count, s, k):
    """Solve for the velocity and for the limits of friction in turns; return whether the last
    velocity is solved."""
    solved = solve(world, state, size, count, s, k)
    for turn in range(TURNS if s > 1 else 0):
        if not follow_limits(world, state, count, s, 1.0 if turn < FREE_TURNS else 0.5):
            break
        solved = solve(world, state, size, count, s, k)
    return solved


@kernel
def stiffness_of_group(world, work, group, h):
    """Return K [N/m] of a group's contacts, and k = K Δt + B [N s/m].

    Where the scene gives none, k follows from the masses of the group's own trees alone.
    """
    if not world.rigid:
        return world.stiffness, world.stiffness * h + world.damping
    heaviest = 0.0
    lightest = inf
    t = group
    while t >= 0:
        heaviest = max(heaviest, world.tree_mass[t])
        lightest = min(lightest, world.tree_mass[t])
        t = work.next_tree[t]
    k = min(heaviest / COMPLIANCE, lightest / LEAST_COMPLIANCE) / h
    return k / ((1.0 + FADING) * world.dt), k


@kernel
def gather_contacts(world, state, group, s):
    """Write rows, limits and softness of the group's contacts; return their number."""
    work = state.rest_work
    contacts = state.contacts
    count = begin = 0
    i = work.first[group]
    while i >= 0:
        work.contact[count] = i
        work.limit[count] = 0.0
        trees = trees_of_contact(world, work, contacts, i, count)
        if trees[1] >= 0:
            high = work.offset[max(trees)]
            for k in range(high, work.end[high]):
                work.envelope[k] = min(work.envelope[k], work.offset[min(trees)])
        n = load(contacts.normal, i)
        own = count * s
        for j in range(s):
            store(work.direction, own + j, n if j == 0 else tangent_of(n, j - 1, s - 1))
            work.bend[own + j] = 0.0
        directions = work.direction[own : own + s]
        write_pair_rows(world, state, trees, i, directions, work.rows[own : own + s])
        before = contact_before(state, i, begin)
        store(contacts.drift, i, ZERO)
        if before >= 0:
            begin = before + 1
            force = state.previous.normal_force[before]
            work.limit[count] = (
                friction_of(world, contacts, i) * force * state.h[0] if s > 1 else 0.0
            )
            bend = contacts.gap[i] - state.previous.expected[before]
            span = state.previous.span[before]
            if force > 0.0 and abs(bend) > TOUCHING and span >= SHORT * world.dt:
                if span < world.dt or state.h[0] < world.dt:  # it grows with the square of time
                    bend *= world.dt / span * (state.h[0] / span)
                work.bend[own] = bend / world.dt
            if force > 0.0 and s > 1:
                follow_arc(world, state, before, i, own, s)
        if contacts.lift[i] > 0.0:
            work.bend[own] = contacts.lift[i] / state.h[0]
        count = count + 1
        i = work.next[i]
    return count


@kernel
def material_point(state, body, x):
    """Return the world point x in the axes of a body (−1: the world)."""
    if body < 0:
        return x
    return transform_back(state.body.rotation, body, subtract(x, load(state.body.position, body)))


@kernel
def moved_aside(state, before):
    """Return how far the points that touched in the step before have moved apart in it [m].

    Where one body rolls on the other, the points also part by the arc of a cycloid: the lift, times
    a third of the angle, to third order. This is no slip.
    """
    old = state.previous
    a = old.body_a[before]
    b = old.body_b[before]
    n = load(old.normal, before)
    apart = subtract(
        placed(state.body, a, load(old.point_a, before)),
        placed(state.body, b, load(old.point_b, before)),
    )
    return subtract(apart, scale(dot(apart, n) / 3.0, load(old.rolled, before)))


@kernel
def follow_arc(world, state, before, i, row, s):
    """Write to the rows of contact i how much faster its points slide than J v says, so far."""
    moved = moved_aside(state, before)
    old = state.previous
    aside = subtract(moved, load(old.slid, before))
    if old.sticks[before]:
        drift = add(load(old.drift, before), moved)
        store(state.contacts.drift, i, drift)
        aside = add(aside, drift)
    if dot(aside, aside) > ROUNDED * ROUNDED:
        for j in range(row + 1, row + s):
            state.rest_work.bend[j] = dot(aside, load(state.rest_work.direction, j)) / world.dt


@kernel
def trees_of_contact(world, work, contacts, i, r):
    """Return the two trees of contact i, the second −1: none, or the same; write what row r needs
    of them to `work`."""
    a, b = trees_of(world, contacts, i)
    trees = (a, -1 if a == b else b)
    for side in range(2):
        t = trees[side]
        work.at[r, side] = work.offset[t] if t >= 0 else 0
        work.size[r, side] = world.tree_stop[t] - world.tree_start[t] if t >= 0 else 0
    return trees


@kernel
def along_row(work, r, j, v):
    """Return row j, of contact r, times v; each half of the row holds the entries of one of the
    contact's two trees."""
    total = 0.0
    row = work.rows[j]
    half = work.rows.shape[1] // 2
    for side in range(2):
        at = work.at[r, side]
        for k in range(work.size[r, side]):
            total += row[side * half + k] * v[at + k]
    return total


@kernel
def add_along_row(work, r, j, factor, out):
    """out += factor times row j, of contact r."""
    row = work.rows[j]
    half = work.rows.shape[1] // 2
    for side in range(2):
        at = work.at[r, side]
        for k in range(work.size[r, side]):
            out[at + k] += factor * row[side * half + k]


@kernel
def along_rows(work, count, s, v, out):
    """out <- J v of local velocities."""
    for r in range(count):
        for j in range(r * s, (r + 1) * s):
            out[j] = along_row(work, r, j, v)


@kernel
def times_mass(world, state, size, v, out):
    """out <- M v of local velocities, with Δt D of damped joints."""
    work = state.rest_work
    damped = world.switches.joint_damping
    for i in range(size):
        dof = work.dof[i]
        total = 0.0
        row = state.mass_matrix[dof]
        ahead = dof - i
        for j in range(work.begin[i], work.end[i]):
            total += row[ahead + j] * v[j]
        if damped:
            total += state.h[0] * world.joint_damping[dof] * v[i]
        out[i] = total


@kernel
def mass_form(world, state, size, v, w):
    """Return wᵀ M v of local velocities."""
    given = state.rest_work.given[:size]
    times_mass(world, state, size, v, given)
    return dot_of(w, given)


@kernel
def speed_at(work, j, share):
    """Return the velocity of row j at `share` of the present step, and its bend."""
    return work.speed[j] + share * work.change[j] + work.bend[j]


@kernel
def push(state, r, s, k, share):
    """Return the normal impulse Δt f of contact r at `share` of the present step."""
    work = state.rest_work
    gap = state.contacts.gap[work.contact[r]]
    gamma = speed_at(work, r * s, share)
    return state.h[0] * max(0.0, -work.stiffness[0] * gap - k * gamma)


@kernel
def slide_speed(work, r, s, share):
    """Return |w| at `share` of the present step, or STICKING where it is less."""
    square = 0.0
    for j in range(r * s + 1, (r + 1) * s):
        w = speed_at(work, j, share)
        square += w * w
    return sqrt(square) if square > STICKING * STICKING else STICKING


@kernel
def set_impulses(state, count, s, k, share):
    """Write the impulses of the speeds at `share` of the present step."""
    work = state.rest_work
    for r in range(count):
        n = r * s
        work.p[n] = push(state, r, s, k, share)
        if s > 1:
            grip = work.limit[r] / slide_speed(work, r, s, share)
            for j in range(n + 1, n + s):
                work.p[j] = -grip * speed_at(work, j, share)


@kernel
def slope(world, state, size, count, s, k, share, linear, quadratic):
    """Write the impulses at `share` of the Newton step; return the derivative of the minimised
    function along it."""
    work = state.rest_work
    total = linear + share * quadratic
    set_impulses(state, count, s, k, share)
    for j in range(count * s):
        total -= work.p[j] * work.change[j]
    for i in range(size if world.switches.joint_friction else 0):
        total += dry_impulse(work, i, work.v[i] + share * work.step[i]) * work.step[i]
    return total


@kernel
def open_balance(world, state, size, count, s, k):
    """Write impulses and balance M (v − v*) − Jᵀ p at v; return the energy that the balance would
    give the bodies.

    It is a share of the energy of the step, that of v* and of the springs.
    """
    work = state.rest_work
    squares = 0.0
    along_rows(work, count, s, work.v, work.speed)
    write_difference(work.change_of_v[:size], work.v, work.free)
    times_mass(world, state, size, work.change_of_v, work.balance)
    set_impulses(state, count, s, k, 0.0)
    for r in range(count):
        for j in range(r * s, (r + 1) * s):
            if work.p[j] != 0.0:
                add_along_row(work, r, j, -work.p[j], work.balance)
        squares += work.p[r * s] * work.p[r * s]
    for i in range(size if world.switches.joint_friction else 0):
        work.balance[i] += dry_impulse(work, i, work.v[i])
    given = work.given[:size]
    springs = 0.5 * squares / (state.h[0] * k) if squares > 0.0 else 0.0
    for i in range(size):  # |L⁻¹ r|² = rᵀ M⁻¹ r
        dof = work.dof[i]
        entry = work.balance[i]
        row = state.lower[dof]
        ahead = dof - i
        for j in range(work.begin[i], i):
            entry -= row[ahead + j] * given[j]
        given[i] = entry / row[dof]
    wrong = 0.5 * dot_of(given, given)
    if wrong <= EXACT * springs:  # at rest: the energy of v* is not needed
        return EXACT
    energy = free_energy(world, state, size) + springs
    return wrong / energy if energy > 0.0 else wrong


@kernel
def free_energy(world, state, size):
    """Return ½ v*ᵀ M v* [J]."""
    work = state.rest_work
    if work.energy[0] < 0.0:
        work.energy[0] = 0.5 * mass_form(world, state, size, work.free, work.free)
    return work.energy[0]


@kernel
def add_squares(work, matrix, r, s, push_back, grip, slip):
    """Add −Jᵀ (∂p/∂γ) J of contact r to the lower triangle of the Newton matrix: −∂p/∂γ is
    `push_back` along the normal and, along the tangents, grip (1 − w wᵀ/|w|²) where it slips."""
    half = work.rows.shape[1] // 2
    n = r * s
    first = n + min(1, s - 1)
    last = n + s - 1
    along = across = 0.0
    if slip > STICKING:
        along = speed_at(work, first, 0.0) / slip
        across = speed_at(work, last, 0.0) / slip if s > 2 else 0.0
    one = grip * (1.0 - along * along)
    both = -grip * along * across
    two = grip * (1.0 - across * across) if s > 2 else 0.0
    normal = work.rows[n]
    tangent = work.rows[first]
    other = work.rows[last]
    for side in range(2):
        for i in range(work.size[r, side]):
            at = side * half + i
            a = push_back * normal[at]
            b = one * tangent[at] + both * other[at]
            c = both * tangent[at] + two * other[at]
            row = work.at[r, side] + i
            for second in range(2):
                to = work.at[r, second]
                start = second * half
                for j in range(min(work.size[r, second], row + 1 - to)):
                    matrix[row, to + j] += (
                        a * normal[start + j] + b * tangent[start + j] + c * other[start + j]
                    )


@kernel
def newton_matrix(world, state, size, count, s, k):
    """Write M + Jᵀ (∂p/∂γ) J to the lower triangle of `work.lower`, within the envelope."""
    work = state.rest_work
    matrix = state.work.lower
    for i in range(size):
        dof = work.dof[i]
        begin = work.begin[i]
        for j in range(work.envelope[i], begin):
            matrix[i, j] = 0.0
        for j in range(begin, i + 1):
            matrix[i, j] = state.mass_matrix[dof, dof - i + j]
        if world.switches.joint_damping:
            matrix[i, i] += state.h[0] * world.joint_damping[dof]
        if world.switches.joint_friction and abs(work.v[i]) <= STICKING:
            matrix[i, i] += work.dry[i] / STICKING
    for r in range(count):
        n = r * s
        push_back = state.h[0] * k if work.p[n] > 0.0 else 0.0
        grip = 0.0
        slip = STICKING
        if s > 1:
            slip = slide_speed(work, r, s, 0.0)
            grip = work.limit[r] / slip
        if push_back > 0.0 or grip > 0.0:
            add_squares(work, matrix, r, s, push_back, grip, slip)


@kernel
def factor_envelope(matrix, envelope, size):
    """Overwrite the lower triangle by its Cholesky factor, inverse diagonal; False: a pivot is not
    positive."""
    for i in range(size):
        row = matrix[i]
        for j in range(envelope[i], i):
            total = row[j]
            other = matrix[j]
            for k in range(max(envelope[i], envelope[j]), j):
                total -= row[k] * other[k]
            row[j] = total * other[j]
        pivot = row[i]
        for k in range(envelope[i], i):
            pivot -= row[k] * row[k]
        if not pivot > 0.0:
            return False
        row[i] = 1.0 / sqrt(pivot)
    return True


@kernel
def solve_envelope(matrix, envelope, size, x):
    """Solve L Lᵀ x = x in place, with the factor of `factor_envelope`."""
    for i in range(size):
        total = x[i]
        for k in range(envelope[i], i):
            total -= matrix[i, k] * x[k]
        x[i] = total * matrix[i, i]
    for i in range(size - 1, -1, -1):
        x[i] *= matrix[i, i]
        for k in range(envelope[i], i):
            x[k] -= matrix[i, k] * x[i]


@kernel
def solve(world, state, size, count, s, k):
    """Minimise for the present limits of friction, from work.v; return whether the balance is
    solved."""
    work = state.rest_work
    v = work.v[:size]
    step = work.step[:size]
    worst = open_balance(world, state, size, count, s, k)
    for _ in range(ITERATIONS):
        if worst <= EXACT:
            return True
        newton_matrix(world, state, size, count, s, k)
        if not factor_envelope(state.work.lower, work.envelope, size):
            return worst <= GOOD
        for i in range(size):
            step[i] = -work.balance[i]
        solve_envelope(state.work.lower, work.envelope, size, step)
        along_rows(work, count, s, step, work.change)
        if is_quadratic(world, state, size, count, s, k):  # the step is exact
            add_multiple(v, 1.0, step)
            set_impulses(state, count, s, k, 1.0)
            add_multiple(work.speed[: count * s], 1.0, work.change)
            return True
        share = line_search(world, state, size, count, s, k)
        add_multiple(v, share, step)
        before = worst
        worst = open_balance(world, state, size, count, s, k)
        if share == 1.0 and worst <= GOOD and worst > 0.5 * before:
            return True
    return worst <= GOOD


@kernel
def is_quadratic(world, state, size, count, s, k):
    """Return whether the same contacts push at the end of the Newton step as before, and all with
    friction stick; joints with friction stick, or slide on in their direction."""
    work = state.rest_work
    for i in range(size if world.switches.joint_friction else 0):
        speed = work.v[i]
        after = speed + work.step[i]
        slides = max(abs(speed), abs(after)) > STICKING
        slides_on = min(abs(speed), abs(after)) > STICKING and speed * after > 0.0
        if work.dry[i] > 0.0 and slides and not slides_on:
            return False
    for r in range(count):
        j = r * s
        if (work.p[j] > 0.0) != (push(state, r, s, k, 1.0) > 0.0):
            return False
        if (
            work.limit[r] > 0.0
            and max(slide_speed(work, r, s, 0.0), slide_speed(work, r, s, 1.0)) > STICKING
        ):
            return False
    return True


@kernel
def line_search(world, state, size, count, s, k):
    """Return the share of the Newton step at which the slope vanishes, 1 if it is still negative
    there."""
    work = state.rest_work
    linear = mass_form(world, state, size, work.change_of_v, work.step)
    quadratic = mass_form(world, state, size, work.step, work.step)
    low = 0.0
    high = 1.0
    at_low = slope(world, state, size, count, s, k, 0.0, linear, quadratic)
    at_high = slope(world, state, size, count, s, k, 1.0, linear, quadratic)
    start = 1e-3 * abs(at_low)
    if at_low >= 0.0 or not at_high > start:
        return 1.0
    for _ in range(SEARCHES):
        share = low + (high - low) * at_low / (at_low - at_high)
        found = slope(world, state, size, count, s, k, share, linear, quadratic)
        if abs(found) <= start:
            return share
        if found > 0.0:
            high = share
            at_high = found
            at_low = 0.5 * at_low
        else:
            low = share
            at_low = found
            at_high = 0.5 * at_high
    return low if low > 0.0 else high


@kernel
def follow_limits(world, state, count, s, share):
    """Move the limits of friction by a share towards those of the present impulses; False: none
    changed noticeably."""
    work = state.rest_work
    changed = False
    largest = 0.0
    for r in range(count):
        largest = max(largest, work.p[r * s])
    for r in range(count):
        limit = friction_of(world, state.contacts, work.contact[r]) * work.p[r * s]
        most = max(limit, work.limit[r])
        changed = (
            changed
            or abs(limit - work.limit[r]) > SETTLED * most
            and most > SETTLED * SETTLED * largest
        )
        work.limit[r] += share * (limit - work.limit[r])
    return changed


@kernel
def spring_energy(state, count, s, share):
    """Return Φ [J] at the gaps that the velocity `share` v would lead to."""
    work = state.rest_work
    total = 0.0
    for r in range(count):
        gap = min(0.0, state.contacts.gap[work.contact[r]] + share * state.h[0] * work.speed[r * s])
        total += 0.5 * work.stiffness[0] * gap * gap
    return total


@kernel
def guard(world, state, size, count, s):
    """Shorten a solution that would make energy: with share 0, everything stands still and Φ stays
    as it is."""
    work = state.rest_work
    share = 1.0
    after = 0.5 * mass_form(world, state, size, work.v, work.v)
    allowed = (free_energy(world, state, size) + spring_energy(state, count, s, 0.0)) * (1.0 + GAIN)
    while share > 0.0 and after * share * share + spring_energy(state, count, s, share) > allowed:
        share = 0.5 * share if share > 1e-3 else 0.0
    if share < 1.0:
        work.shortened[0] += 1
        multiply_by(work.v[:size], share)


@kernel
def remember_points(world, state, r, s):
    """Write what `moved_aside` needs of contact r: both points, Δt J v and the angle of rolling."""
    work = state.rest_work
    contacts = state.contacts
    i = work.contact[r]
    x = load(contacts.point, i)
    n = load(contacts.normal, i)
    store(contacts.point_a, i, material_point(state, contacts.body_a[i], x))
    store(contacts.point_b, i, material_point(state, contacts.body_b[i], x))
    _, _, omega_a = twist(world, state, contacts.body_a[i])
    _, _, omega_b = twist(world, state, contacts.body_b[i])
    store(contacts.rolled, i, scale(state.h[0], cross(subtract(omega_a, omega_b), n)))
    slid = ZERO
    for j in range(r * s, (r + 1) * s):
        slid = add(slid, scale(state.h[0] * work.speed[j], load(work.direction, j)))
    store(contacts.slid, i, slid)


@kernel
def give_back(world, state, size, count, s):
    """Write the group's velocity to v, and the forces to the contacts and the generalized
    forces."""
    work = state.rest_work
    contacts = state.contacts
    pushed = work.given[:size]
    rubbed = work.step[:size]
    for i in range(size):
        pushed[i] = rubbed[i] = 0.0
        if world.switches.joint_friction:
            rubbed[i] = -dry_impulse(work, i, work.v[i]) / state.h[0]
        state.v[work.dof[i]] = work.v[i]
    for r in range(count):
        i = work.contact[r]
        force = ZERO
        contacts.normal_force[i] = work.p[r * s] / state.h[0]
        contacts.span[i] = state.h[0]
        contacts.expected[i] = contacts.gap[i] + state.h[0] * work.speed[r * s]
        add_along_row(work, r, r * s, contacts.normal_force[i], pushed)
        contacts.sticks[i] = (
            s > 1
            and contacts.normal_force[i] > 0.0
            and slide_speed(work, r, s, 0.0) <= 10.0 * STICKING
        )
        if s > 1 and contacts.normal_force[i] > 0.0:
            remember_points(world, state, r, s)
        if s > 1 and work.limit[r] > 0.0:
            for j in range(r * s + 1, (r + 1) * s):
                size_of_force = work.p[j] / state.h[0]
                force = add(force, scale(size_of_force, load(work.direction, j)))
                add_along_row(work, r, j, size_of_force, rubbed)
            store(contacts.friction_force, i, force)
    for i in range(size):
        k = work.dof[i]
        state.penalty_force[k] += pushed[i]
        state.friction_force[k] += rubbed[i]
