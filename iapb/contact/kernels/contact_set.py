"""The contact set of a step (paper section III): clusters, new contacts, groups, states, colliding
rows."""

from __future__ import annotations

from iapb.contact.kernels.joint_stops import is_stop
from iapb.contact.kernels.rows import restitution_of
from iapb.contact.kernels.shape_frames import copy_geometry
from iapb.numerics.compiled import kernel
from iapb.numerics.linalg import dot, load, subtract
from iapb.run import COLLIDING, FREE, RESTING

# Two normals are aligned, and may belong to one surface, when the cosine of their angle is at least
# this: 31.8 degrees. The facets of a 12-sided socket (30 degrees apart) then count as one round
# surface; a floor and a wall, or two sides of a triangle, do not.
ALIGNED_COSINE = 0.85

# An overlap up to this [m] counts as touching: rounding of positions causes it, and its penalty
# force is negligible.
TOUCHING = 1e-12

# A gap up to this [m] counts as closed where contact is rigid: a body that turns moves by less off
# its support in a step, beyond what the step before shows.
CLOSE = 1e-9

# marks while contacts are clustered
_UNDECIDED = 0
_KEPT = 1
_DROPPED = 2

# Marks in an impact under implicit contact: it strikes, it carries a load, it would strike but the
# log is full.
STRIKES = 1
HOLDS = 2
LEFT = 3


@kernel
def squared_distance(first, i, second, j):
    """Return the squared distance of the points of two contacts [m²]."""
    apart = subtract(load(first.point, i), load(second.point, j))
    return dot(apart, apart)


@kernel
def same_surface(first, i, second, j):
    """Return whether both contacts have the same two bodies, which come in one order always, and
    aligned normals."""
    return (
        first.body_a[i] == second.body_a[j]
        and first.body_b[i] == second.body_b[j]
        and dot(load(first.normal, i), load(second.normal, j)) >= ALIGNED_COSINE
    )


@kernel
def cluster(world, contacts, count):
    """Collapse contacts of one surface closer than `cluster_distance` into the deepest; return how
    many stay.

    Contacts are visited deepest first. A contact is kept unless a deeper kept contact of its
    surface is closer. So kept contacts of a surface are at least that distance apart; they keep
    their order.
    """
    # usually none are, and to see this is cheaper than the clustering
    distance = world.cluster_distance
    near = False
    for i in range(count):
        for j in range(i):
            near = near or squared_distance(contacts, i, contacts, j) < distance * distance
    if not near:
        return count
    contacts.mark[:count] = _UNDECIDED
    while True:
        deepest = -1
        for i in range(count):
            if contacts.mark[i] == _UNDECIDED and (
                deepest < 0 or contacts.gap[i] < contacts.gap[deepest]
            ):
                deepest = i
        if deepest < 0:
            break
        contacts.mark[deepest] = _KEPT
        for i in range(count):
            if (
                contacts.mark[i] == _UNDECIDED
                and same_surface(contacts, deepest, contacts, i)
                and squared_distance(contacts, deepest, contacts, i) < distance * distance
            ):
                contacts.mark[i] = _DROPPED
    kept = 0
    for i in range(count):
        if contacts.mark[i] == _KEPT:
            if kept < i:  # nothing but the geometry is computed before clustering
                copy_geometry(contacts, kept, contacts, i)
            kept += 1
    return kept


@kernel
def mark_new(world, contacts, count, previous, previous_count):
    """Write is_new from temporal coherence: by position, or by shapes and feature alone if
    `coherence_distance` is 0.

    A contact is old if the step before had a contact (overlap beyond TOUCHING) with the same shapes
    and feature, or one within `distance` [m] on the same surface. The distance must exceed (largest
    speed) × (step). One previous contact may match several: a facet's edge that appears beside the
    facet is the same contact (paper III). A corner that slides along the floor into a wall is new,
    since the normals differ at the same point. A contact that only touched in the step before is
    new, since no force has acted at it yet (balls of a cradle). A `rigid` one may carry a load
    without an overlap.

    Contacts keep their order from step to step, so the search begins after the last match. The cost
    is linear in the contacts that last.
    """
    distance = world.coherence_distance
    begin = 0
    for i in range(count):
        contacts.is_new[i] = True
        for k in range(previous_count):
            j = wrapped(begin + k, previous_count)
            acted = previous.gap[j] < -TOUCHING or world.rigid and previous.normal_force[j] > 0.0
            if acted and (
                same_name(contacts, i, previous, j)
                or (
                    distance > 0.0
                    and not is_stop(contacts, i)
                    and not is_stop(previous, j)
                    and same_surface(contacts, i, previous, j)
                    and squared_distance(contacts, i, previous, j) <= distance * distance
                )
            ):
                contacts.is_new[i] = False
                begin = wrapped(j + 1, previous_count)
                break


@kernel
def wrapped(k, count):
    """Return k, less one round of `count` if it is no smaller."""
    return k if k < count else k - count


@kernel
def same_name(first, i, second, j):
    """Return whether shapes and feature of two contacts are the same."""
    return (
        first.shape_a[i] == second.shape_a[j]
        and first.shape_b[i] == second.shape_b[j]
        and first.feature[i] == second.feature[j]
    )


@kernel
def contact_before(state, i, begin):
    """Return the previous contact with shapes and feature of contact i, −1 = none; the search
    begins at `begin`."""
    total = state.contact_count[1]
    for k in range(total):
        j = wrapped(begin + k, total)
        if same_name(state.contacts, i, state.previous, j):
            return j
    return -1


@kernel
def trees_of_bodies(world, a, b):
    """Return the trees of two bodies; the world, b = −1, counts as the tree of a."""
    tree = world.tree_of_body[a]
    return tree, tree if b < 0 else world.tree_of_body[b]


@kernel
def trees_of(world, contacts, i):
    """Return the trees of the two bodies of contact i; see `trees_of_bodies`."""
    return trees_of_bodies(world, contacts.body_a[i], contacts.body_b[i])


@kernel
def join(world, contacts, i, group_of_tree):
    """Merge the groups of the two trees of contact i; the root of a group is its smallest tree."""
    a, b = trees_of(world, contacts, i)
    while group_of_tree[a] != a:
        a = group_of_tree[a]
    while group_of_tree[b] != b:
        b = group_of_tree[b]
    group_of_tree[max(a, b)] = min(a, b)


@kernel
def group_of_contact(world, contacts, i, group_of_tree):
    """Return the group of a contact, that of its body a, which can move."""
    return group_of_tree[world.tree_of_body[contacts.body_a[i]]]


@kernel
def classify(world, state, count):
    """Write the groups, the state of each (free, colliding, resting) and the contacts that collide.

    Contacts between two bodies that can move link groups. A contact approaches if v_n <
    −approach_velocity [m/s]. With impulses a group collides if one of its *new* contacts
    approaches, or if any contact approaches while an impulse is still being spread. Then every
    approaching contact of the group, new or old, enters the impact. `spreading`, trees with an
    unfinished impulse, is cleared if the group no longer collides.
    """
    contacts = state.contacts
    groups = state.group_of_tree
    states = state.state_of_tree
    spreading = state.spreading
    trees = len(groups)
    approaching = False
    for t in range(trees):
        if state.moving[t]:
            groups[t] = t
            states[t] = FREE
    for i in range(count):
        if not contacts.idle[i]:
            join(world, contacts, i, groups)
    for t in range(trees):
        groups[t] = groups[groups[t]]  # smaller trees are settled already
        if spreading[t]:
            spreading[groups[t]] = True
    for i in range(count):
        contacts.collides[i] = False
        if contacts.idle[i]:
            continue
        group = group_of_contact(world, contacts, i, groups)
        collides = contacts.normal_velocity[i] < -world.approach_velocity
        contacts.collides[i] = collides
        approaching = approaching or collides
        if world.switches.impulses and collides and (contacts.is_new[i] or spreading[group]):
            states[group] = COLLIDING
        elif states[group] == FREE:
            states[group] = RESTING
    for i in range(count if approaching else 0):
        if states[group_of_contact(world, contacts, i, groups)] != COLLIDING:
            contacts.collides[i] = False
    for t in range(trees):
        states[t] = states[groups[t]]
        state.rests[t] = states[t] != FREE if state.moving[t] else state.rests[t]
        if states[t] != COLLIDING:
            spreading[t] = False


# Islands of a colliding group: trees that contacts *of this collision* link.
#
# M is block diagonal in the trees, and a row has entries only for the trees of its contact, so (21)
# separates into the islands. Touching trees outside the islands are neither copied nor factored.


@kernel
def find_islands(world, state):
    """Write island_of_tree, the first tree of each tree's island, and collides_of_tree; return
    False if none collides.

    With an impulse limit islands are the groups, since the paper scales all impulses of a group by
    one factor.
    """
    any_collides = False
    for t in range(world.trees):
        any_collides = any_collides or state.state_of_tree[t] == COLLIDING
        state.island_of_tree[t] = state.group_of_tree[t] if world.switches.impulse_limit else t
        state.collides_of_tree[t] = False
    if not any_collides:
        return False
    contacts = state.contacts
    islands = state.island_of_tree
    for i in range(state.contact_count[0]):
        if contacts.collides[i]:
            join(world, contacts, i, islands)
    for t in range(len(islands)):
        islands[t] = islands[islands[t]]  # smaller trees are settled already
    for i in range(state.contact_count[0]):
        if contacts.collides[i] and (
            not world.switches.implicit_contact or contacts.mark[i] == STRIKES
        ):
            state.collides_of_tree[group_of_contact(world, contacts, i, islands)] = True
    return True


@kernel
def add_supports(world, state):
    """Mark what strikes; of a colliding group, contacts that carry a load enter the impact, too.

    Without them the body struck would move into its support, and resting contact would stop it: a
    ball would hardly bounce on a book that lies on the floor. Where nothing bounces, resting
    contact stops all, with friction.
    """
    contacts = state.contacts
    begin = 0
    bounces = False
    for i in range(state.contact_count[0] if world.switches.implicit_contact else 0):
        if contacts.idle[i]:
            continue
        contacts.mark[i] = STRIKES if contacts.collides[i] else 0
        bounces = bounces or contacts.collides[i] and restitution_of(world, contacts, i) > 0.0
    for i in range(state.contact_count[0] if bounces else 0):
        group = group_of_contact(world, contacts, i, state.group_of_tree)
        if state.state_of_tree[group] != COLLIDING or contacts.collides[i] or contacts.idle[i]:
            continue
        before = contact_before(state, i, begin)
        if before >= 0:
            begin = before + 1
            if state.previous.normal_force[before] > 0.0:
                contacts.mark[i] = HOLDS
                contacts.collides[i] = True
