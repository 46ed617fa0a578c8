"""Resting contact, implicit in the velocity: the forces of a step act at its end, so no stiffness makes energy.

v* is the velocity after impulses and applied forces. Over the contacts of a group, with γ = J v and gap φ <= 0,

    v⁺ = argmin ½ (v − v*)ᵀ M (v − v*) + Σ Δt f(γ)²/2k + Σ c h(|w|),   f = max(0, −K φ − k γ),   k = K Δt + B,

w the tangential velocities, c = μ Δt f the limit of friction, and h(|w|) = |w|, rounded below the speed STICKING so
that it has a derivative: a contact that sticks creeps more slowly than that. The function is strictly convex: one
answer, also where contacts are redundant. M contains Δt D of damped joints. Newton's method with a line search solves
it, from the velocity before the step's forces, which at rest is the answer.
The limits of friction follow from the forces, so both are solved in turns; any limit c >= 0 dissipates.

Where a gap is linear over the step, KE⁺ + Φ⁺ <= KE* + Φ with Φ = Σ ½ K min(φ, 0)², for every K, B >= 0 and Δt > 0
(`verification.proofs`). A solution that is not accurate enough to show this in numbers is shortened until it does.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from iapb.compiled import kernel
from iapb.contact.kernels.contact_set import LEFT, contact_before, group_of_contact, moving_tree
from iapb.contact.kernels.rows import friction_of, tangent_of, write_pair_row
from iapb.linalg import add, load, scale, store

STICKING = 1e-10  # m/s: a contact that slips more slowly sticks, with a friction in proportion to its slip
EXACT = 1e-20  # share of the energy of a step that the open balance of momentum may give the bodies
GOOD = 1e-14  # the same, where rounding allows no better
ITERATIONS = 60  # of Newton's method for given limits of friction
TURNS = 12  # of the limits of friction in a step; the next step goes on from the last ones
FREE_TURNS = 3  # of these take the new limits whole; the others half, for limits that swing to and fro
SETTLED = 1e-3  # share of a limit of friction whose change ends the turns
SEARCHES = 40  # evaluations of a line search
GAIN = 1e-11  # share of the energy of a step that rounding may seem to create


class RestWork(NamedTuple):
    """Scratch of a group's resting contacts: c contacts with s rows each (normal, tangents), d coordinates, t trees."""

    first: np.ndarray  # (t,) int64 first contact of each group, by its first tree, −1 = none
    next: np.ndarray  # (c,) int64 contact of the same group that follows, −1 = none
    next_tree: np.ndarray  # (t,) int64 tree of the same group that follows, −1 = none
    trees: np.ndarray  # (t,) int64 trees of the group
    offset: np.ndarray  # (t,) int64 first local coordinate of each tree
    contact: np.ndarray  # (c,) int64 contacts of the group
    tree: np.ndarray  # (c, 2) int64 their two trees, −1 = none or the same
    rows: np.ndarray  # (c s, 2 w) rows of J: w entries for each of the two trees
    speed: np.ndarray  # (c s,) J v [m/s]
    change: np.ndarray  # (c s,) J Δv of a Newton step
    p: np.ndarray  # (c s,) impulses of the step [N s]
    limit: np.ndarray  # (c,) limits c of friction [N s]
    envelope: np.ndarray  # (d,) int64 first nonzero column of each row of the Newton matrix
    v: np.ndarray  # (d,) local velocities
    free: np.ndarray  # (d,) v*
    balance: np.ndarray  # (d,) M (v − v*) − Jᵀ p
    change_of_v: np.ndarray  # (d,) v − v*
    step: np.ndarray  # (d,) Newton step
    given: np.ndarray  # (d,) M times a vector, or L⁻¹ of one
    energy: np.ndarray  # (1,) ½ v*ᵀ M v* [J]
    counts: np.ndarray  # (2,) int64 trees of the group; solutions that were shortened, since the start


def make_rest_work(coordinates: int, contacts: int, rows: int, tree_size: int, trees: int) -> RestWork:
    """Allocate the scratch; `rows`: of each contact, `tree_size`: coordinates of the largest tree."""
    c, d = contacts, coordinates
    whole = {"first": trees, "next": c, "next_tree": trees, "trees": trees, "offset": trees, "contact": c,
             "envelope": d, "counts": 2}
    vectors = {"speed": c * rows, "change": c * rows, "p": c * rows, "limit": c, "v": d, "free": d,
               "balance": d, "change_of_v": d, "step": d, "given": d, "energy": 1}
    return RestWork(tree=np.zeros((c, 2), np.int64), rows=np.zeros((c * rows, 2 * tree_size)),
                    **{name: np.zeros(size, np.int64) for name, size in whole.items()},
                    **{name: np.zeros(size) for name, size in vectors.items()})


@kernel(needs="implicit")
def rest_implicitly(world, state, rubs):
    """Give v the forces of all resting contacts; write them to the contacts, to penalty_force and friction_force."""
    if not list_groups(world, state):
        return
    for group in range(world.tree_start.shape[0]):
        if state.rest_work.first[group] >= 0:
            rest_group(world, state, group, 1 + world.tangents if rubs else 1)


@kernel
def list_groups(world, state):
    """Chain the contacts of each group; return whether there is any."""
    work, contacts, some = state.rest_work, state.contacts, False
    work.first[:] = -1
    for i in range(state.contact_count[0] - 1, -1, -1):
        contacts.normal_force[i] = 0.0
        store(contacts.friction_force, i, (0.0, 0.0, 0.0))
        group = group_of_contact(world, contacts, i, state.group_of_tree)
        if group >= 0 and contacts.gap[i] <= 0.0 and contacts.mark[i] != LEFT:
            work.next[i], work.first[group], some = work.first[group], i, True
    if some:
        work.next_tree[:] = -1
        for t in range(world.tree_start.shape[0] - 1, -1, -1):
            group = state.group_of_tree[t]
            if group != t:  # its first tree is the group's number
                work.next_tree[t], work.next_tree[group] = work.next_tree[group], t
    return some


@kernel
def rest_group(world, state, group, s):
    """Solve one group, with s rows a contact, and give its trees their new velocity."""
    size = place_trees(world, state, group)
    count = gather_contacts(world, state, group, s)
    k = world.stiffness * world.dt + world.damping
    solved = solve(world, state, size, count, s, k)
    for turn in range(TURNS if s > 1 else 0):
        if not follow_limits(world, state, count, s, 1.0 if turn < FREE_TURNS else 0.5):
            break
        solved = solve(world, state, size, count, s, k)
    guard(world, state, size, count, s, solved)
    give_back(world, state, count, s)


@kernel
def place_trees(world, state, group):
    """Number the coordinates of the group; copy v* and the first guess, the velocity before the forces of the step."""
    work, size, many, t = state.rest_work, 0, 0, group
    while t >= 0:
        work.trees[many], work.offset[t] = t, size
        for k in range(world.tree_start[t], world.tree_stop[t]):
            work.free[size], work.v[size] = state.v[k], state.start_v[k]
            work.envelope[size] = work.offset[t]
            size += 1
        many, t = many + 1, work.next_tree[t]
    work.counts[0], work.energy[0] = many, 0.0
    times_mass(world, state, work.free, work.given)
    for i in range(size):
        work.energy[0] += 0.5 * work.free[i] * work.given[i]
    return size


@kernel
def gather_contacts(world, state, group, s):
    """Write rows, limits and softness of the group's contacts; return their number."""
    work, contacts, count, begin, i = state.rest_work, state.contacts, 0, 0, state.rest_work.first[group]
    while i >= 0:
        work.contact[count] = i
        a = moving_tree(world, contacts.body_a[i])
        b = moving_tree(world, contacts.body_b[i])
        if a < 0:
            a, b = b, -1
        work.tree[count, 0], work.tree[count, 1] = a, -1 if b == a else b
        if b >= 0 and b != a:
            low, high = min(a, b), max(a, b)
            for k in range(world.tree_stop[high] - world.tree_start[high]):
                at = work.offset[high] + k
                work.envelope[at] = min(work.envelope[at], work.offset[low])
        n = load(contacts.normal, i)
        for j in range(s):
            direction = n if j == 0 else tangent_of(n, j - 1, s - 1)
            write_pair_row(world, state, work.tree[count], i, direction, work.rows[count * s + j])
        work.limit[count] = 0.0
        if s > 1:
            before = contact_before(state, i, begin)
            if before >= 0:
                begin = before + 1
                work.limit[count] = (friction_of(world, contacts, i) * state.previous.normal_force[before]
                                     * world.dt)
        count += 1
        i = work.next[i]
    return count


@kernel
def along_rows(world, work, count, s, v, out):
    """out <- J v of local velocities."""
    rows, tree, offset, start, stop = work.rows, work.tree, work.offset, world.tree_start, world.tree_stop
    width = rows.shape[1] // 2
    for r in range(count):
        a, b = tree[r, 0], tree[r, 1]
        for j in range(r * s, (r + 1) * s):
            total, row = 0.0, rows[j]
            for k in range(stop[a] - start[a]):
                total += row[k] * v[offset[a] + k]
            if b >= 0:
                for k in range(stop[b] - start[b]):
                    total += row[width + k] * v[offset[b] + k]
            out[j] = total


@kernel
def times_mass(world, state, v, out):
    """out <- M v of local velocities, with Δt D of damped joints."""
    work, mass, damped = state.rest_work, state.mass_matrix, world.switches.joint_damping
    for h in range(work.counts[0]):
        t = work.trees[h]
        start, at, size = world.tree_start[t], work.offset[t], world.tree_stop[t] - world.tree_start[t]
        for i in range(size):
            total, row = 0.0, mass[start + i]
            for j in range(size):
                total += row[start + j] * v[at + j]
            if damped:
                total += world.dt * world.joint_damping[start + i] * v[at + i]
            out[at + i] = total


@kernel
def push(world, state, r, k, gamma):
    """Return the normal impulse Δt f of contact r at the normal velocity γ."""
    return world.dt * max(0.0, -world.stiffness * state.contacts.gap[state.rest_work.contact[r]] - k * gamma)


@kernel
def slide_length(work, r, s, share):
    """Return |w| at `share` of the present step, and the divisor of w that gives −p: max(|w|, STICKING)/c."""
    square = 0.0
    for j in range(r * s + 1, (r + 1) * s):
        w = work.speed[j] + share * work.change[j]
        square += w * w
    size = math.sqrt(square)
    return size, max(size, STICKING) / work.limit[r]


@kernel
def slope(world, state, count, s, k, share, linear, quadratic):
    """Return the derivative of the minimised function along the Newton step, at `share` of it."""
    work, total = state.rest_work, linear + share * quadratic
    for r in range(count):
        j = r * s
        total -= push(world, state, r, k, work.speed[j] + share * work.change[j]) * work.change[j]
        if s > 1 and work.limit[r] > 0.0:
            _, divisor = slide_length(work, r, s, share)
            for j in range(r * s + 1, (r + 1) * s):
                total += (work.speed[j] + share * work.change[j]) / divisor * work.change[j]
    return total


@kernel
def set_impulses(world, state, count, s, k):
    """Write the impulses of the present speeds."""
    work = state.rest_work
    for r in range(count):
        work.p[r * s] = push(world, state, r, k, work.speed[r * s])
        if s > 1:
            rubs, divisor = work.limit[r] > 0.0, 1.0
            if rubs:
                _, divisor = slide_length(work, r, s, 0.0)
            for j in range(r * s + 1, (r + 1) * s):
                work.p[j] = -work.speed[j] / divisor if rubs else 0.0


@kernel
def open_balance(world, state, size, count, s, k):
    """Write impulses and balance M (v − v*) − Jᵀ p at v; return the energy that the balance would give the bodies.

    It is a share of the energy of the step, that of v* and of the springs.
    """
    work, energy = state.rest_work, state.rest_work.energy[0]
    width = work.rows.shape[1] // 2
    along_rows(world, work, count, s, work.v, work.speed)
    for i in range(size):
        work.change_of_v[i] = work.v[i] - work.free[i]
    times_mass(world, state, work.change_of_v, work.balance)
    set_impulses(world, state, count, s, k)
    for r in range(count):
        for j in range(r * s, (r + 1) * s):
            for side in range(2):
                t = work.tree[r, side]
                if t < 0 or work.p[j] == 0.0:
                    continue
                at = work.offset[t]
                for i in range(world.tree_stop[t] - world.tree_start[t]):
                    work.balance[at + i] -= work.rows[j, side * width + i] * work.p[j]
    for r in range(count):
        if work.p[r * s] > 0.0:
            energy += 0.5 * work.p[r * s] * work.p[r * s] / (world.dt * k)
    wrong = 0.0
    for h in range(work.counts[0]):
        t = work.trees[h]
        start, stop, at = world.tree_start[t], world.tree_stop[t], work.offset[t]
        for i in range(start, stop):  # |L⁻¹ r|² = rᵀ M⁻¹ r
            entry = work.balance[at + i - start]
            for j in range(start, i):
                entry -= state.lower[i, j] * work.given[at + j - start]
            work.given[at + i - start] = entry / state.lower[i, i]
            wrong += 0.5 * work.given[at + i - start] * work.given[at + i - start]
    return wrong / energy if energy > 0.0 else wrong


@kernel
def add_square(world, state, r, one, other, factor):
    """Add factor · J_oneᵀ J_other of contact r to the lower triangle of the Newton matrix."""
    work, matrix = state.rest_work, state.group_lower
    width = work.rows.shape[1] // 2
    for side in range(2):
        t = work.tree[r, side]
        if t < 0:
            continue
        at = work.offset[t]
        for i in range(world.tree_stop[t] - world.tree_start[t]):
            left = factor * work.rows[one, side * width + i]
            if left == 0.0:
                continue
            for second in range(2):
                u = work.tree[r, second]
                if u < 0 or work.offset[u] > at:
                    continue
                to = work.offset[u]
                for j in range(world.tree_stop[u] - world.tree_start[u]):
                    if to + j <= at + i:
                        matrix[at + i, to + j] += left * work.rows[other, second * width + j]


@kernel
def newton_matrix(world, state, size, count, s, k):
    """Write M + Jᵀ (∂p/∂γ) J to the lower triangle of group_lower, within the envelope."""
    work, matrix = state.rest_work, state.group_lower
    for i in range(size):
        for j in range(work.envelope[i], i + 1):
            matrix[i, j] = 0.0
    for h in range(work.counts[0]):
        t = work.trees[h]
        start, at = world.tree_start[t], work.offset[t]
        for i in range(world.tree_stop[t] - start):
            for j in range(i + 1):
                matrix[at + i, at + j] = state.mass_matrix[start + i, start + j]
            if world.switches.joint_damping:
                matrix[at + i, at + i] += world.dt * world.joint_damping[start + i]
    for r in range(count):
        n = r * s
        if work.p[n] > 0.0:
            add_square(world, state, r, n, n, world.dt * k)
        if s == 1 or not work.limit[r] > 0.0:
            continue
        size_of_slip, divisor = slide_length(work, r, s, 0.0)
        sticks = size_of_slip <= STICKING
        for j in range(n + 1, n + s):
            for h in range(n + 1, n + s):
                factor = 1.0 / divisor if j == h else 0.0
                if not sticks:
                    factor -= (work.speed[j] / size_of_slip) * (work.speed[h] / size_of_slip) / divisor
                if factor != 0.0:
                    add_square(world, state, r, j, h, factor)


@kernel
def factor_envelope(matrix, envelope, size):
    """Overwrite the lower triangle by its Cholesky factor, inverse diagonal; False: a pivot is not positive."""
    for i in range(size):
        row = matrix[i]
        for j in range(envelope[i], i):
            total, other = row[j], matrix[j]
            for k in range(max(envelope[i], envelope[j]), j):
                total -= row[k] * other[k]
            row[j] = total * other[j]
        pivot = row[i]
        for k in range(envelope[i], i):
            pivot -= row[k] * row[k]
        if not pivot > 0.0:
            return False
        row[i] = 1.0 / math.sqrt(pivot)
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
    """Minimise for the present limits of friction, from work.v; return whether the balance is solved."""
    work = state.rest_work
    worst = open_balance(world, state, size, count, s, k)
    for _ in range(ITERATIONS):
        if worst <= EXACT:
            return True
        newton_matrix(world, state, size, count, s, k)
        if not factor_envelope(state.group_lower, work.envelope, size):
            return worst <= GOOD
        for i in range(size):
            work.step[i] = -work.balance[i]
        solve_envelope(state.group_lower, work.envelope, size, work.step)
        along_rows(world, work, count, s, work.step, work.change)
        if is_quadratic(world, state, count, s, k):  # the step is exact
            for i in range(size):
                work.v[i] += work.step[i]
            for j in range(count * s):
                work.speed[j] += work.change[j]
            set_impulses(world, state, count, s, k)
            return True
        share = line_search(world, state, size, count, s, k)
        for i in range(size):
            work.v[i] += share * work.step[i]
        before, worst = worst, open_balance(world, state, size, count, s, k)
        if share == 1.0 and worst <= GOOD and worst > 0.5 * before:
            return True
    return worst <= GOOD


@kernel
def is_quadratic(world, state, count, s, k):
    """Return whether the same contacts push at the end of the Newton step as before, and all with friction stick."""
    work = state.rest_work
    for r in range(count):
        j = r * s
        if (work.p[j] > 0.0) != (push(world, state, r, k, work.speed[j] + work.change[j]) > 0.0):
            return False
        if s > 1 and work.limit[r] > 0.0:
            before, _ = slide_length(work, r, s, 0.0)
            after, _ = slide_length(work, r, s, 1.0)
            if before > STICKING or after > STICKING:
                return False
    return True


@kernel
def line_search(world, state, size, count, s, k):
    """Return the share of the Newton step at which the slope vanishes, 1 if it is still negative there."""
    work, linear, quadratic = state.rest_work, 0.0, 0.0
    times_mass(world, state, work.change_of_v, work.given)
    for i in range(size):
        linear += work.given[i] * work.step[i]
    times_mass(world, state, work.step, work.given)
    for i in range(size):
        quadratic += work.given[i] * work.step[i]
    low, high = 0.0, 1.0
    at_low = slope(world, state, count, s, k, 0.0, linear, quadratic)
    at_high = slope(world, state, count, s, k, 1.0, linear, quadratic)
    if at_low >= 0.0 or not at_high > 1e-3 * abs(at_low):
        return 1.0
    start = abs(at_low)
    for _ in range(SEARCHES):
        share = low + (high - low) * at_low / (at_low - at_high)
        found = slope(world, state, count, s, k, share, linear, quadratic)
        if abs(found) <= 1e-3 * start:
            return share
        if found > 0.0:
            high, at_high, at_low = share, found, 0.5 * at_low
        else:
            low, at_low, at_high = share, found, 0.5 * at_high
    return low if low > 0.0 else high


@kernel
def follow_limits(world, state, count, s, share):
    """Move the limits of friction by a share towards those of the present impulses; False: none changed noticeably."""
    work, changed, largest = state.rest_work, False, 0.0
    for r in range(count):
        largest = max(largest, work.p[r * s])
    for r in range(count):
        limit = friction_of(world, state.contacts, work.contact[r]) * work.p[r * s]
        most = max(limit, work.limit[r])
        changed = changed or abs(limit - work.limit[r]) > SETTLED * most and most > SETTLED * SETTLED * largest
        work.limit[r] += share * (limit - work.limit[r])
    return changed


@kernel
def spring_energy(world, state, count, s, share):
    """Return Φ [J] at the gaps that the velocity `share` v would lead to."""
    work, total = state.rest_work, 0.0
    for r in range(count):
        gap = min(0.0, state.contacts.gap[work.contact[r]] + share * world.dt * work.speed[r * s])
        total += 0.5 * world.stiffness * gap * gap
    return total


@kernel
def guard(world, state, size, count, s, solved):
    """Shorten a solution that would make energy: with share 0, everything stands still and Φ stays as it is."""
    work, after = state.rest_work, 0.0
    if solved:
        return
    times_mass(world, state, work.v, work.balance)
    for i in range(size):
        after += 0.5 * work.v[i] * work.balance[i]
    allowed, share = (work.energy[0] + spring_energy(world, state, count, s, 0.0)) * (1.0 + GAIN), 1.0
    while after * share * share + spring_energy(world, state, count, s, share) > allowed:
        share = 0.5 * share if share > 1e-3 else 0.0
        if share == 0.0:
            break
    if share < 1.0:
        work.counts[1] += 1
        for i in range(size):
            work.v[i] *= share


@kernel
def give_back(world, state, count, s):
    """Write the group's velocity to v and mean_v, and the forces to the contacts and the generalized forces."""
    work, contacts = state.rest_work, state.contacts
    for h in range(work.counts[0]):
        t = work.trees[h]
        for k in range(world.tree_start[t], world.tree_stop[t]):
            state.v[k] = state.mean_v[k] = work.v[work.offset[t] + k - world.tree_start[t]]
    for r in range(count):
        i, force = work.contact[r], (0.0, 0.0, 0.0)
        contacts.normal_force[i] = work.p[r * s] / world.dt
        add_along_row(world, work, r, r * s, contacts.normal_force[i], state.penalty_force)
        if s == 1 or not work.limit[r] > 0.0:
            continue
        n = load(contacts.normal, i)
        for j in range(1, s):
            size = work.p[r * s + j] / world.dt
            force = add(force, scale(size, tangent_of(n, j - 1, s - 1)))
            add_along_row(world, work, r, r * s + j, size, state.friction_force)
        store(contacts.friction_force, i, force)


@kernel
def add_along_row(world, work, r, j, size, out):
    """out (d,) += size times row j, of contact r of the group."""
    width = work.rows.shape[1] // 2
    for side in range(2):
        t = work.tree[r, side]
        if t >= 0:
            for k in range(world.tree_start[t], world.tree_stop[t]):
                out[k] += work.rows[j, side * width + k - world.tree_start[t]] * size
