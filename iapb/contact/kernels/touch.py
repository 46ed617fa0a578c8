"""Impacts at the moment of touch: a step is cut where bodies meet (the effect `touch`).

At the end of a step the engine looks for new contacts. Where some have come up, it takes the step of
the bodies involved back, and does it in parts:

1. All bodies have moved freely for a step. New contacts that overlap now link their groups to
   components; every other group keeps its step.
2. A component moves again from the start of the step, until the first new contact touches: the gap
   is zero there, found by Newton's method along the motion of the step, within a bracket.
3. The impact is resolved there. Contacts within CLOSE of touching collide together, as (15) says.
   What an impact has separated flies on freely.
4. The component moves on for the rest of the step, and so on with what it touches next.
5. After MOST impacts, contacts that have struck hold for the rest of the step: a ball comes to rest.
   What still overlaps at the end strikes at the start of the next step.

The group of a tool that a coupling moves is not cut: its device takes the impulse of a whole step.
A component that reaches another tree in the rest of the step is joined with it, and both start again.
Each impact is passive, and so is each part of the motion; so the step is passive.
"""

from __future__ import annotations

from math import ceil, inf

from iapb.contact.kernels.collide import contacts_moving_now, resolve_collisions
from iapb.contact.kernels.contact_set import (
    CLOSE,
    LEFT,
    TOUCHING,
    classify,
    contact_before,
    group_of_contact,
    mark_new,
    same_name,
    trees_of,
    trees_of_bodies,
)
from iapb.contact.kernels.finding import present_contacts
from iapb.contact.kernels.joint_stops import add_stops, is_stop
from iapb.contact.kernels.motion import (
    NOT_POSITIVE_DEFINITE,
    OK,
    TOO_MANY_CONTACTS,
    locate,
    move,
    place_bodies,
)
from iapb.contact.kernels.narrow_phase import detect
from iapb.contact.kernels.rows import contact_velocities, twist
from iapb.contact.kernels.shape_frames import copy_contact, copy_contacts
from iapb.contact.kernels.world import StepEnd, StepStart
from iapb.numerics.compiled import copy_into, kernel
from iapb.numerics.copying import copier
from iapb.numerics.linalg import (
    ZERO,
    add_multiple,
    dot,
    load,
    norm,
    placed,
    store,
    subtract,
)
from iapb.numerics.schema import quantities
from iapb.run import COLLIDING

MOST = 8  # parts after which a component is cut no more in this step
SAG = 0.01  # share of the deepest overlap of a group: a new overlap below it is no touch to find
MOST_SAMPLES = 64.0  # moments of a step at which fast bodies are looked at
SEARCHES = 16  # motions tried to find a touch; every fourth one halves the bracket
copy_changes = copier(quantities(StepStart))
copy_end = copier(quantities(StepEnd))
MET = -1  # status: the component reaches a tree outside, and both are cut together


@kernel
def cut_at_touch(world, state, applied):
    """Do the step again in parts where it has brought new contacts; return a status."""
    cut = state.cut
    count = contacts_at_end(world, state)
    if count >= 0 and gather_components(world, state, count):
        status = MET
        keep_start(state)
        while status == MET:  # each time, two components have become one
            status = OK
            back_to_start(world, state)
            for t in range(world.trees):
                if status == OK and cut.component[t] == t and cut.touches[t]:
                    status = cut_component(world, state, applied, t)
        end_step(world, state)
        if status != OK:
            return status
        count = contacts_at_end(world, state)
    if count < 0:
        return TOO_MANY_CONTACTS
    cut.arriving[0] = count
    copy_into(cut.end.q, state.q)
    copy_into(cut.end.v, state.v)
    return OK


@kernel
def contacts_at_end(world, state):
    """Write the contacts of the present q and v to `arriving`; return how many, -1: too many."""
    place_bodies(world, state)
    return present_contacts(world, state, state.arriving, state.contacts, state.contact_count[0])


@kernel
def arrives(world, state, i):
    """Return whether contact i of `arriving` has come up in the motion: it is new and overlaps.

    Two bodies that are in contact may show an old overlap under a new name: a seam, or another
    edge. Its depth is more than its speed explains.
    """
    found = state.arriving
    if not found.is_new[i] or found.gap[i] >= -max(CLOSE, SAG * deepest_of_groups(world, state, i)):
        return False
    if is_whole(world, state, found.body_a[i], found.body_b[i]):
        return False
    if not met_before(state, i):
        return True
    speed = -found.normal_velocity[i]
    return speed > world.approach_velocity and -found.gap[i] <= 4.0 * world.dt * speed + CLOSE


@kernel
def is_whole(world, state, body, other):
    """Return whether one of two bodies is in the group that is never cut."""
    whole = state.cut.whole[0]
    group = state.group_of_tree
    a, b = trees_of_bodies(world, body, other)
    return whole >= 0 and group[whole] in (group[a], group[b])


@kernel
def deepest_of_groups(world, state, i):
    """Return the deepest overlap [m] in the groups of the two bodies of contact i of `arriving`."""
    now = state.contacts
    deepest = 0.0
    groups = state.group_of_tree
    a, b = trees_of(world, state.arriving, i)
    for k in range(state.contact_count[0]):
        group = group_of_contact(world, now, k, groups)
        if group in (groups[a], groups[b]) and not now.idle[k]:
            deepest = max(deepest, -now.gap[k])
    return deepest


@kernel
def met_before(state, i):
    """Return whether the two bodies of contact i of `arriving` have been in contact already."""
    found = state.arriving
    now = state.contacts
    for k in range(state.contact_count[0]):
        acts = now.gap[k] < -TOUCHING or now.normal_force[k] > 0.0
        if (
            acts
            and not now.idle[k]
            and now.body_a[k] == found.body_a[i]
            and now.body_b[k] == found.body_b[i]
        ):
            return True
    return False


@kernel
def gather_components(world, state, count):
    """Write the components of groups that new contacts link; return whether there are any."""
    cut = state.cut
    some = False
    for t in range(world.trees):
        cut.component[t] = state.group_of_tree[t]
        cut.touches[t] = False
    for i in range(count):
        if arrives(world, state, i):
            link(world, state, state.arriving.body_a[i], state.arriving.body_b[i])
            some = True
    return find_fast_pairs(world, state) or some


@kernel
def find_fast_pairs(world, state):
    """List pairs that may have passed through each other in the step, and link their bodies;
    return whether there are any.

    Their relative way exceeds half of the thinner one, and they are no farther apart than this way.
    """
    cut = state.cut
    sweep = world.sweep
    shapes = world.shapes
    count = 0
    cut.fast_count[0] = 0
    quick = False
    fastest = 0.0
    for k in range(len(state.v)):
        fastest = max(fastest, abs(state.v[k]))
    if world.dt * fastest * sweep.lever <= 0.5 * sweep.thinnest:
        return False
    for i in range(len(shapes.kind)):
        quick = quick or way_of(world, state, i) > 0.5 * sweep.thinnest
    for k in range(len(world.pairs) if quick else 0):
        a = world.pairs[k, 0]
        b = world.pairs[k, 1]
        way = way_of(world, state, a) + way_of(world, state, b)
        if not way > 0.5 * min(sweep.thin[a], sweep.thin[b]):
            continue
        if is_whole(world, state, shapes.body[a], shapes.body[b]):
            continue
        apart = subtract(middle_of(world, state, a), middle_of(world, state, b))
        near = sweep.radius[a] + sweep.radius[b] + way
        if dot(apart, apart) <= near * near and count < len(cut.fast):
            cut.fast[count] = k
            count += 1
            link(world, state, shapes.body[a], shapes.body[b])
    cut.fast_count[0] = count
    return count > 0


@kernel
def middle_of(world, state, i):
    """Return the middle of shape i in the world."""
    return placed(state.body, world.shapes.body[i], load(world.sweep.middle, i))


@kernel
def way_of(world, state, i):
    """Return a bound of how far a point of shape i moves in a step at its present velocity [m]."""
    body = world.shapes.body[i]
    if body < 0 or world.sweep.radius[i] == inf:
        return 0.0
    p, u, omega = twist(world, state, body)
    arm = subtract(middle_of(world, state, i), p)
    reach = norm(arm) + world.sweep.radius[i]
    return world.dt * (norm(u) + norm(omega) * reach)


@kernel
def link(world, state, body, other):
    """Join the components of two bodies, the second −1 for the world; they are to be cut."""
    cut = state.cut
    one, two = trees_of_bodies(world, body, other)
    first = min(cut.component[one], cut.component[two])
    last = max(cut.component[one], cut.component[two])
    for t in range(world.trees):
        if cut.component[t] == last:
            cut.component[t] = first
    cut.touches[first] = True


@kernel
def keep_start(state):
    """Keep the start of the step, after its impacts, and the end of the whole step."""
    cut = state.cut
    copy_start(cut.start, state)
    copy_into(cut.start_v, state.start_v)
    copy_end(cut.end, state)
    cut.logged[0] = state.impacts.logged[0]
    copy_contacts(cut.start.previous, state.previous, state.contact_count[1])


@kernel
def back_to_start(world, state):
    """Take back what parts of the step have changed, but for q and v."""
    copy_start(state, state.cut.start)
    state.impacts.logged[0] = state.cut.logged[0]
    for t in range(world.trees):
        state.cut.struck[t] = state.state_of_tree[t] == COLLIDING


@kernel
def copy_start(to, given):
    """Copy what a part of a step changes."""
    copy_changes(to, given)
    copy_contacts(to.contacts, given.contacts, given.contact_count[0])


@kernel
def cut_component(world, state, applied, root):
    """Do the step of one component in parts; return a status."""
    cut = state.cut
    left = world.dt
    parts = 0
    size = begin_component(world, state, root)
    while True:
        status = move_part(world, state, applied, left)
        if status != OK:
            return status
        some, outside = reached(world, state)
        if outside:
            return MET
        full = state.impacts.logged[0] + size > len(state.impacts.group)
        if parts == MOST or full:  # what is left strikes in the next step
            break
        end = left
        if cut.fast_count[0] > 0:
            end, status = move_to_overlap(world, state, applied, left)
            if status != OK:
                return status
        if not some and end == left:
            break
        h, status = move_to_touch(world, state, applied, end)
        if status != OK:
            return status
        if h >= left:  # at the very end: it strikes in the next step
            break
        add_part(state, h)
        left -= h
        cut.elapsed[0] += h
        parts += 1
        if not take_contacts(world, state):
            return TOO_MANY_CONTACTS
        if not strike(world, state, parts < MOST):
            return NOT_POSITIVE_DEFINITE
        copy_into(cut.part_q, state.q)
        copy_into(cut.part_v, state.v)
    if parts > 0 and lifts(world, state):
        status = move_part(world, state, applied, left)
        if status != OK:
            return status
    add_part(state, left)
    copy_into(cut.end.q, state.q)
    copy_into(cut.end.v, state.v)
    for k in range(len(state.v)):
        if state.moving[world.tree_of_dof[k]]:
            cut.end.penalty_force[k] = cut.penalty[k] / world.dt
            cut.end.friction_force[k] = cut.friction[k] / world.dt
    return OK


@kernel
def begin_component(world, state, root):
    """Choose the trees that move and the contacts that take part; return the number of trees."""
    cut = state.cut
    size = 0
    for t in range(world.trees):
        state.moving[t] = cut.component[t] == root
        size += state.moving[t]
    for i in range(state.contact_count[0]):
        state.contacts.idle[i] = not takes_part(world, state, state.contacts, i)
    state.contact_count[1] = cut.start.contact_count[1]
    copy_contacts(state.previous, cut.start.previous, state.contact_count[1])
    copy_into(cut.part_q, cut.start_q)
    copy_into(cut.part_v, cut.start_v)
    cut.elapsed[0] = 0.0
    cut.penalty[:] = cut.friction[:] = 0.0
    return size


@kernel
def takes_part(world, state, contacts, i):
    """Return whether both bodies of a contact move now; the world takes part in everything."""
    a, b = trees_of(world, contacts, i)
    return state.moving[a] and state.moving[b]


@kernel
def move_part(world, state, applied, h):
    """Move the component from the start of the part by h [s]; all others are at the end of the
    step. Return a status."""
    move_others_to_end(world, state, state.cut.part_q, state.cut.part_v)
    state.penalty_force[:] = state.friction_force[:] = 0.0
    if not locate(world, state):
        return NOT_POSITIVE_DEFINITE
    state.h[0] = h
    status = move(world, state, applied)
    state.h[0] = world.dt
    move_others_to_end(world, state, state.q, state.v)
    return status


@kernel
def move_others_to_end(world, state, q, v):
    """Write q and v of the trees that move now; put all others at the end of the step."""
    end = state.cut.end
    for i in range(len(q)):
        state.q[i] = q[i] if state.moving[world.tree_of_coordinate[i]] else end.q[i]
    for k in range(len(v)):
        state.v[k] = v[k] if state.moving[world.tree_of_dof[k]] else end.v[k]


@kernel
def reached(world, state):
    """Return whether the component has new contacts at the end of the step, and whether with a tree
    outside, which then is linked to it."""
    some = False
    found = state.arriving
    count = contacts_at_end(world, state)
    for i in range(count):
        a, b = trees_of(world, found, i)
        if (state.moving[a] or state.moving[b]) and arrives(world, state, i):
            some = True
            if state.moving[a] != state.moving[b]:
                link(world, state, found.body_a[i], found.body_b[i])
                return True, True
    return some, False


@kernel
def move_to_overlap(world, state, applied, left):
    """Move the component to the first moment of the `left` seconds that finds a fast pair in
    overlap, or to their end; return the moment and a status."""
    cut = state.cut
    samples = 1.0
    status = OK
    for j in range(cut.fast_count[0]):
        a, b, moves = fast_pair(world, state, j)
        if moves:
            way = way_of(world, state, a) + way_of(world, state, b)
            thin = min(world.sweep.thin[a], world.sweep.thin[b])
            samples = max(samples, ceil(left / world.dt * way / (0.5 * thin)))
    samples = min(samples, MOST_SAMPLES)
    for n in range(1, int(samples)):
        h = left * (n / samples)
        status = move_part(world, state, applied, h)
        if status != OK:
            return h, status
        for j in range(cut.fast_count[0]):
            a, b, moves = fast_pair(world, state, j)
            if moves:
                if overlap_now(world, state, a, b):
                    return h, OK
    return left, move_part(world, state, applied, left)


@kernel
def fast_pair(world, state, j):
    """Return the shapes of fast pair j, and whether they move now."""
    pair = world.pairs[state.cut.fast[j]]
    return pair[0], pair[1], state.moving[world.tree_of_body[world.shapes.body[pair[0]]]]


@kernel
def overlap_now(world, state, a, b):
    """Return whether a new contact of two shapes overlaps."""
    found = state.arriving
    count = gaps_of_pair(world, state, a, b)
    overlaps = False
    velocities_and_marks(world, state, count)
    for i in range(count):
        overlaps = overlaps or found.gap[i] < -CLOSE and found.is_new[i]
    return overlaps


@kernel
def velocities_and_marks(world, state, count):
    """Complete the contacts of `arriving`: their velocities, and whether they are new."""
    contact_velocities(world, state, state.arriving, count)
    mark_new(world, state.arriving, count, state.contacts, state.contact_count[0])


@kernel
def move_to_touch(world, state, applied, left):
    """Move the component to its first touch in the `left` seconds at whose end bodies overlap;
    return after how long it comes, and a status."""
    pairs, stops = pairs_that_touch(world, state)
    low = 0.0
    high = left
    _, _, guess = next_touch(world, state, pairs, stops, left)
    expected = inf  # when the touch comes, as seen from `low`
    for turn in range(SEARCHES):
        if not low < guess < high:
            guess = expected
        if turn % 4 == 3 or not low < guess < high:
            guess = 0.5 * (low + high)
        h = guess
        if not low < h < high:
            break
        status = move_part(world, state, applied, h)
        if status != OK:
            return h, status
        overlaps, touches, guess = next_touch(world, state, pairs, stops, h)
        if overlaps:
            high = h
        elif touches:
            return h, OK
        else:
            low = h
            expected = guess
    return high, move_part(world, state, applied, high)


@kernel
def pairs_that_touch(world, state):
    """Write the pairs of shapes of new contacts that take part; return their number, and whether
    ends of joints are among them."""
    found = state.arriving
    pairs = state.cut.pairs
    count = 0
    stops = False
    for i in range(contacts_at_end(world, state)):
        if not (takes_part(world, state, found, i) and arrives(world, state, i)):
            continue
        if is_stop(found, i):
            stops = True
            continue
        known = False
        for k in range(count):
            known = known or pairs[k, 0] == found.shape_a[i] and pairs[k, 1] == found.shape_b[i]
        if not known:
            pairs[count, 0] = found.shape_a[i]
            pairs[count, 1] = found.shape_b[i]
            count += 1
    return count, stops


@kernel
def next_touch(world, state, pairs, stops, h):
    """Look at the gaps of some pairs after h seconds; return whether one overlaps, whether one just
    touches, and when the first touch is by Newton's method.

    Contacts of bodies that are in contact already count as apart down to an overlap of CLOSE.
    """
    found = state.arriving
    count = gaps_of_pairs(world, state, pairs)
    if stops:
        count = add_stops(world, state, found, count, inf)
    velocities_and_marks(world, state, count)
    overlaps = touches = False
    earlier = later = inf
    for i in range(count):
        if not found.is_new[i] or not takes_part(world, state, found, i):
            continue
        gap = found.gap[i]
        speed = found.normal_velocity[i]
        if met_before(state, i):
            gap += CLOSE
        x, y, z = load(found.point, i)
        rounded = TOUCHING * (1.0 + abs(x) + abs(y) + abs(z))
        when = h - gap / speed if speed < 0.0 else inf
        if gap < -rounded:
            overlaps = True
            earlier = min(earlier, when)
        else:
            touches = touches or gap <= rounded and speed < 0.0
            later = min(later, when)
    return overlaps, touches, earlier if overlaps else later


@kernel
def lifts(world, state):
    """Write to contacts that hold for the first time how far they lift; return whether any does.

    A corner about which a body turns moves off its support on its arc. The step before would show
    how far, but there was no contact.
    """
    now = state.contacts
    found = state.arriving
    some = False
    for i in range(state.contact_count[0]):
        if now.idle[i] or now.mark[i] == LEFT or now.normal_force[i] <= 0.0 or is_stop(now, i):
            continue
        before = contact_before(state, i, 0)
        if before >= 0 and state.previous.normal_force[before] > 0.0:
            continue
        count = gaps_of_pair(world, state, now.shape_a[i], now.shape_b[i])
        for k in range(count):
            if same_name(found, k, now, i) and found.gap[k] > CLOSE:
                now.lift[i] = found.gap[k]
                some = True
    return some


@kernel
def gaps_of_pair(world, state, a, b):
    """Write the contacts of two shapes to `arriving`, also those apart; return how many."""
    state.cut.pairs[0, 0] = a
    state.cut.pairs[0, 1] = b
    return gaps_of_pairs(world, state, 1)


@kernel
def gaps_of_pairs(world, state, pairs):
    """Write the contacts of the listed pairs to `arriving`, also those apart; return how many."""
    place_bodies(world, state)
    return detect(
        world.shapes,
        state.cut.pairs[:pairs],
        state.body,
        inf,
        state.arriving,
    )


@kernel
def add_part(state, h):
    """Add the impulses of the forces of a part of h seconds."""
    add_multiple(state.cut.penalty, h, state.penalty_force)
    add_multiple(state.cut.friction, h, state.friction_force)


@kernel
def take_contacts(world, state):
    """Take the contacts at a touch as those of the step; return False if there are too many.

    Contacts of other components stay. So do those that have struck and are apart now, as far as there
    is room: the record shows their impulses.
    """
    now = state.contacts
    before = state.previous
    found = state.arriving
    kept = 0
    count = state.contact_count[0]
    found_count = contacts_at_end(world, state)
    if found_count < 0:
        return False
    copy_contacts(before, now, count)
    copy_into(state.row_impulse[:count], state.contact_impulse)
    state.contact_count[1] = count
    room = len(now.gap)  # for those that are apart
    for i in range(found_count):
        room -= takes_part(world, state, found, i)
    for i in range(count):
        room -= before.idle[i] and not is_over(before, i)
    for i in range(count):
        over = is_over(before, i)
        if not before.idle[i]:
            over = state.row_impulse[i] != 0.0 and not is_among(found, found_count, before, i)
            if not over:
                continue
        if over:
            room -= 1
            if room < 0:
                continue
        copy_contact(now, kept, before, i)
        if not before.idle[i]:
            now.gap[kept] = now.normal_force[kept] = 0.0
            now.idle[kept] = True
            store(now.friction_force, kept, ZERO)
        state.contact_impulse[kept] = state.row_impulse[i]
        kept += 1
    begin = 0
    for i in range(found_count):
        if not takes_part(world, state, found, i):
            continue
        if kept == len(now.gap):
            return False
        copy_contact(now, kept, found, i)
        now.mark[kept] = 0
        now.normal_force[kept] = state.contact_impulse[kept] = 0.0
        store(now.friction_force, kept, ZERO)
        state.contact_count[0] = kept + 1
        old = contact_before(state, kept, begin)
        if old >= 0:
            begin = old + 1
            state.contact_impulse[kept] = state.row_impulse[old]
            now.moved[kept] = state.row_impulse[old] != 0.0
            again = before.moved[old]
            store(now.struck_point, kept, load(before.struck_point if again else before.point, old))
            store(
                now.struck_normal, kept, load(before.struck_normal if again else before.normal, old)
            )
        kept += 1
    state.contact_count[0] = kept
    return True


@kernel
def is_over(contacts, i):
    """Return whether contact i has struck in an earlier part of the step and is apart now."""
    return contacts.idle[i] and contacts.gap[i] == 0.0 and contacts.normal_force[i] == 0.0


@kernel
def is_among(found, count, contacts, i):
    """Return whether contact i is found again, by shapes and feature."""
    again = False
    for k in range(count):
        again = again or same_name(found, k, contacts, i)
    return again


@kernel
def strike(world, state, flies):
    """Resolve the impact at a touch; return False if M is not definite."""
    if not locate(world, state):
        return False
    classify(world, state, state.contact_count[0])
    for t in range(world.trees):
        state.cut.struck[t] = state.cut.struck[t] or state.state_of_tree[t] == COLLIDING
    resolve_collisions(world, state)
    if flies:
        let_go(world, state)
    return True


@kernel
def let_go(world, state):
    """Take contacts that an impact has separated out of the forces of the rest of the step."""
    contacts = state.contacts
    some = False
    for t in range(world.trees):
        collides = state.moving[t] and state.state_of_tree[t] == COLLIDING
        some = some or collides
        state.rests[t] = state.rests[t] and not collides
    if not some:
        return
    now = contacts_moving_now(world, state)
    for i in range(state.contact_count[0]):
        a, b = trees_of(world, contacts, i)
        if contacts.idle[i] or state.state_of_tree[a] != COLLIDING:
            continue
        if now.normal_velocity[i] > world.approach_velocity and contacts.gap[i] >= -CLOSE:
            contacts.mark[i] = LEFT
        elif contacts.mark[i] != LEFT:
            state.rests[a] = state.rests[b] = True


@kernel
def end_step(world, state):
    """Write the end of the step, put together from whole and from cut steps."""
    cut = state.cut
    copy_end(state, cut.end)
    state.contacts.idle[: state.contact_count[0]] = False
    cut.elapsed[0] = 0.0
    for t in range(world.trees):
        state.moving[t] = True
        if cut.struck[t]:
            state.state_of_tree[t] = COLLIDING
