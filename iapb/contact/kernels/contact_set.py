"""The contact set of a step (paper section III): clusters, new contacts, groups, states, colliding rows."""

from __future__ import annotations

from iapb.compiled import kernel
from iapb.contact.kernels.joint_stops import is_stop
from iapb.contact.kernels.shape_frames import copy_contact
from iapb.linalg import dot, load, subtract
from iapb.run import COLLIDING, FREE, RESTING

# Two normals are aligned, and may belong to one surface, when the cosine of their angle is at least this: 31.8
# degrees. The facets of a 12-sided socket (30 degrees apart) then count as one round surface; a floor and a
# wall, or two sides of a triangle, do not.
ALIGNED_COSINE = 0.85

# An overlap up to this [m] counts as touching: rounding of positions causes it, and its penalty force is negligible.
TOUCHING = 1e-12

_UNDECIDED, _KEPT, _DROPPED = 0, 1, 2  # marks while contacts are clustered

# Marks in an impact under implicit contact: it strikes, it carries a load, it would strike but the log is full.
STRIKES, HOLDS, LEFT = 1, 2, 3


@kernel
def squared_distance(first, i, second, j):
    """Return the squared distance of the points of two contacts [m²]."""
    apart = subtract(load(first.point, i), load(second.point, j))
    return dot(apart, apart)


@kernel
def same_surface(first, i, second, j, cosine):
    """Return whether both contacts have the same two bodies, in either order, and aligned normals."""
    aligned = dot(load(first.normal, i), load(second.normal, j))
    a, b = first.body_a[i], first.body_b[i]
    if a == second.body_a[j] and b == second.body_b[j]:
        return aligned >= cosine
    return a == second.body_b[j] and b == second.body_a[j] and -aligned >= cosine


@kernel
def cluster(contacts, count, distance, cosine=ALIGNED_COSINE):
    """Collapse contacts of one surface closer than `distance` [m] into the deepest; return how many stay.

    Contacts are visited deepest first. A contact is kept unless a deeper kept contact of its surface is closer than
    `distance`. So kept contacts of a surface are at least `distance` apart; they keep their order.
    """
    if not _any_near(contacts, count, distance, cosine):
        return count
    contacts.mark[:count] = _UNDECIDED
    kept = 0
    while True:
        deepest = -1
        for i in range(count):
            if contacts.mark[i] == _UNDECIDED and (deepest < 0 or contacts.gap[i] < contacts.gap[deepest]):
                deepest = i
        if deepest < 0:
            break
        contacts.mark[deepest] = _KEPT
        kept += 1
        for i in range(count):
            if contacts.mark[i] == _UNDECIDED and _is_near(contacts, deepest, i, distance, cosine):
                contacts.mark[i] = _DROPPED
    if kept < count:
        _close_ranks(contacts, count)
    return kept


@kernel
def _is_near(contacts, i, j, distance, cosine):
    """Return whether two contacts are on one surface and closer than `distance`."""
    near = squared_distance(contacts, i, contacts, j) < distance * distance
    return near and same_surface(contacts, i, contacts, j, cosine)


@kernel
def _any_near(contacts, count, distance, cosine):
    """Return whether any two contacts collapse; usually none do, and this test is cheaper than the clustering."""
    for i in range(count):
        for j in range(i):
            if _is_near(contacts, i, j, distance, cosine):
                return True
    return False


@kernel
def _close_ranks(contacts, count):
    """Move the kept contacts to the front; only their geometry, as nothing else is computed before clustering."""
    row = 0
    for i in range(count):
        if contacts.mark[i] != _KEPT:
            continue
        if row < i:
            copy_contact(contacts, row, contacts, i)
        row += 1


@kernel
def mark_new(contacts, count, previous, previous_count, distance, cosine=ALIGNED_COSINE):
    """Write is_new from temporal coherence: by position, or by shapes and feature alone if `distance` is 0.

    A contact is old if the step before had a contact (overlap beyond TOUCHING) with the same shapes and feature, or
    one within `distance` [m] on the same surface. The distance must exceed (largest speed) × (step). One previous
    contact may match several: a facet's edge that appears beside the facet is the same contact (paper III).
    A corner that slides along the floor into a wall is new, since the normals differ at the same point.
    A contact that only touched in the step before is new, since no force has acted at it yet (balls of a cradle).

    Contacts keep their order from step to step, so the search begins after the last match. The cost is linear in
    the contacts that last.
    """
    begin = 0
    for i in range(count):
        contacts.is_new[i] = True
        for k in range(previous_count):
            j = begin + k if begin + k < previous_count else begin + k - previous_count
            if previous.gap[j] < -TOUCHING and _is_same(contacts, i, previous, j, distance, cosine):
                contacts.is_new[i] = False
                begin = j + 1 if j + 1 < previous_count else 0
                break


@kernel
def _is_same(contacts, i, previous, j, distance, cosine):
    if (
        contacts.shape_a[i] == previous.shape_a[j]
        and contacts.shape_b[i] == previous.shape_b[j]
        and contacts.feature[i] == previous.feature[j]
    ):
        return True
    if distance == 0.0 or is_stop(contacts, i) or is_stop(previous, j):
        return False
    if not same_surface(contacts, i, previous, j, cosine):
        return False
    return squared_distance(contacts, i, previous, j) <= distance * distance


@kernel
def contact_before(state, i, begin):
    """Return the previous contact with shapes and feature of contact i, −1 = none; the search begins at `begin`."""
    now, before, total = state.contacts, state.previous, state.contact_count[1]
    for k in range(total):
        j = begin + k if begin + k < total else begin + k - total
        if (now.shape_a[i] == before.shape_a[j] and now.shape_b[i] == before.shape_b[j]
                and now.feature[i] == before.feature[j]):
            return j
    return -1


@kernel
def moving_tree(body, tree_of_body, tree_start, tree_stop):
    """Return the tree of a body that can move, else -1: the static world and bodies fixed to it do not link groups."""
    if body < 0:
        return -1
    tree = tree_of_body[body]
    return tree if tree_stop[tree] > tree_start[tree] else -1


@kernel
def join(group_of_tree, a, b):
    """Merge the groups of two trees; the root of a group is its smallest tree."""
    while group_of_tree[a] != a:
        a = group_of_tree[a]
    while group_of_tree[b] != b:
        b = group_of_tree[b]
    group_of_tree[max(a, b)] = min(a, b)


@kernel
def link_groups(contacts, count, tree_of_body, tree_start, tree_stop, group_of_tree):
    """Write group_of_tree, the first tree of each tree's group; contacts between moving trees link groups."""
    for t in range(group_of_tree.shape[0]):
        group_of_tree[t] = t
    for i in range(count):
        if contacts.body_b[i] < 0 or not contacts.gap[i] <= 0.0:
            continue
        a = moving_tree(contacts.body_a[i], tree_of_body, tree_start, tree_stop)
        b = moving_tree(contacts.body_b[i], tree_of_body, tree_start, tree_stop)
        if a >= 0 and b >= 0:
            join(group_of_tree, a, b)
    for t in range(group_of_tree.shape[0]):
        group_of_tree[t] = group_of_tree[group_of_tree[t]]  # smaller trees are settled already


@kernel
def group_of_contact(contacts, i, tree_of_body, tree_start, tree_stop, group_of_tree):
    """Return the group of a contact, -1 if neither of its bodies can move."""
    tree = moving_tree(contacts.body_a[i], tree_of_body, tree_start, tree_stop)
    if tree < 0:
        tree = moving_tree(contacts.body_b[i], tree_of_body, tree_start, tree_stop)
    return group_of_tree[tree] if tree >= 0 else -1


@kernel
def classify(
    contacts, count, tree_of_body, tree_start, tree_stop, approach_velocity, spreading, group_of_tree, state_of_tree
):
    """Write the groups, the state of each (free, colliding, resting) and the contacts that collide.

    Only contacts with gap <= 0 count. A contact approaches if v_n < −approach_velocity [m/s]. A group collides if one
    of its *new* contacts approaches, or if any contact approaches while an impulse is still being spread. Then every
    approaching contact of the group, new or old, enters the impact.

    contacts : is_new and normal_velocity up to date; collides is written
    spreading (t,) bool : trees with an unfinished impulse; cleared if the group no longer collides
    group_of_tree (t,), state_of_tree (t,) : written, the state for every tree of the group
    """
    link_groups(contacts, count, tree_of_body, tree_start, tree_stop, group_of_tree)
    trees = group_of_tree.shape[0]
    for t in range(trees):
        state_of_tree[t] = FREE
        if spreading[t]:
            spreading[group_of_tree[t]] = True
    approaching = False
    for i in range(count):
        group = group_of_contact(contacts, i, tree_of_body, tree_start, tree_stop, group_of_tree)
        collides = contacts.gap[i] <= 0.0 and contacts.normal_velocity[i] < -approach_velocity
        contacts.collides[i] = collides
        approaching = approaching or collides
        if contacts.gap[i] > 0.0 or group < 0:
            continue
        if collides and (contacts.is_new[i] or spreading[group]):
            state_of_tree[group] = COLLIDING
        elif state_of_tree[group] == FREE:
            state_of_tree[group] = RESTING
    for i in range(count if approaching else 0):
        group = group_of_contact(contacts, i, tree_of_body, tree_start, tree_stop, group_of_tree)
        if group < 0 or state_of_tree[group] != COLLIDING:
            contacts.collides[i] = False
    for t in range(trees):
        state_of_tree[t] = state_of_tree[group_of_tree[t]]
        if state_of_tree[t] != COLLIDING:
            spreading[t] = False


# Islands of a colliding group: trees that contacts *of this collision* link.
#
# M is block diagonal in the trees, and a row has entries only for the trees of its contact, so (21) separates into the
# islands. Touching trees outside the islands are neither copied nor factored.


@kernel
def find_islands(world, state):
    """Write island_of_tree, the first tree of each tree's island, and collides_of_tree; return False if none collides.

    With an impulse limit islands are the groups, since the paper scales all impulses of a group by one factor.
    """
    any_collides = False
    for t in range(world.tree_start.shape[0]):
        any_collides = any_collides or state.state_of_tree[t] == COLLIDING
        state.island_of_tree[t] = state.group_of_tree[t] if world.switches.impulse_limit else t
        state.collides_of_tree[t] = False
    if not any_collides:
        return False
    contacts, start, stop = state.contacts, world.tree_start, world.tree_stop
    for i in range(state.contact_count[0]):
        a = moving_tree(contacts.body_a[i], world.tree_of_body, start, stop)
        b = moving_tree(contacts.body_b[i], world.tree_of_body, start, stop)
        if contacts.collides[i] and a >= 0 and b >= 0:
            join(state.island_of_tree, a, b)
    for t in range(start.shape[0]):
        state.island_of_tree[t] = state.island_of_tree[state.island_of_tree[t]]  # smaller trees are settled already
    for i in range(state.contact_count[0]):
        if contacts.collides[i] and (not world.implicit or contacts.mark[i] == STRIKES):
            state.collides_of_tree[
                group_of_contact(contacts, i, world.tree_of_body, start, stop, state.island_of_tree)
            ] = True
    return True


@kernel
def pair_restitution(own, a, b, otherwise):
    """Return e of two shapes: the smaller of their values; `otherwise` if neither has one (both are above 1)."""
    e = min(own[a], own[b])
    return otherwise if e > 1.0 else e


@kernel(needs="implicit")
def add_supports(world, state):
    """Mark what strikes; of a colliding group, contacts that carry a load enter the impact, too.

    Without them the body struck would move into its support, and resting contact would stop it: a ball would hardly
    bounce on a book that lies on the floor. Where nothing bounces, resting contact stops all, with friction.
    """
    contacts, begin, bounces = state.contacts, 0, False
    for i in range(state.contact_count[0] if world.implicit else 0):
        contacts.mark[i] = STRIKES if contacts.collides[i] else 0
        bounces = bounces or contacts.collides[i] and pair_restitution(
            world.own_restitution, contacts.shape_a[i], contacts.shape_b[i], world.restitution) > 0.0
    for i in range(state.contact_count[0] if bounces else 0):
        group = group_of_contact(contacts, i, world.tree_of_body, world.tree_start, world.tree_stop,
                                 state.group_of_tree)
        if group < 0 or state.state_of_tree[group] != COLLIDING or contacts.collides[i] or contacts.gap[i] > 0.0:
            continue
        before = contact_before(state, i, begin)
        if before >= 0:
            begin = before + 1
            if state.previous.normal_force[before] > 0.0:
                contacts.mark[i], contacts.collides[i] = HOLDS, True
