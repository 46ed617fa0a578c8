"""The contacts of the present configuration (paper section III): found, clustered, marked and
grouped."""

from __future__ import annotations

from iapb.contact.kernels.broadphase import near_pairs
from iapb.contact.kernels.contact_set import (
    CLOSE,
    TOUCHING,
    classify,
    cluster,
    mark_new,
    same_name,
)
from iapb.contact.kernels.joint_stops import add_stops
from iapb.contact.kernels.narrow_phase import detect
from iapb.contact.kernels.rows import contact_velocities
from iapb.contact.kernels.seams import leave_out_seams
from iapb.contact.kernels.shape_frames import (
    copy_found,
    copy_geometry,
    copy_past,
    copy_slip,
)
from iapb.numerics.compiled import kernel
from iapb.numerics.linalg import equal

# share of what a contact bent off its support in a step by which the next step may differ
BENDS = 0.5


@kernel
def find_contacts(world, state):
    """Find the contacts at the start of a step and classify groups; return how many, -1: too many.

    Those found at the end of the step before are taken, unless somebody has moved the bodies since.
    """
    now = state.contacts
    before = state.previous
    # `mark_new` and friction compare with those of the last step
    for i in range(state.contact_count[0]):
        copy_past(before, i, now, i)
        if world.switches.implicit_contact and world.switches.friction:
            copy_slip(before, i, now, i)
    state.contact_count[1] = state.contact_count[0]
    end = state.cut.end
    found = state.cut.arriving[0] >= 0 and equal(state.q, end.q) and equal(state.v, end.v)
    if world.switches.touch and found:
        count = state.cut.arriving[0]
        for i in range(count):
            copy_found(now, i, state.arriving, i)
    else:
        count = present_contacts(world, state, now, before, state.contact_count[1])
    if count < 0:
        return count
    state.contact_count[0] = count
    state.contact_impulse[:count] = 0.0
    classify(world, state, count)
    return count


@kernel
def present_contacts(world, state, contacts, before, count_before):
    """Write the contacts of the present configuration, new ones marked, with their velocities;
    return how many, -1: too many.

    before : those of the step before, or of the part of a step before.
    """
    count = detect_contacts(world, state, contacts, before, count_before)
    if count >= 0:
        contact_velocities(world, state, contacts, count)
        mark_new(world, contacts, count, before, count_before)
        contacts.idle[:count] = False
        contacts.moved[:count] = False
        contacts.lift[:count] = 0.0
        if world.switches.supports:
            count = leave_out_seams(world, state, contacts, count)
    return count


@kernel
def detect_contacts(world, state, contacts, before, count_before):
    """Find, cluster and complete the contacts of the present configuration; return how many, -1:
    too many."""
    pairs = world.pairs
    # all corners of a face that touches, whatever its rounding, or the bend of a rigid contact
    margin = TOUCHING if world.switches.implicit_contact else 0.0
    if world.rigid:
        margin = CLOSE
        for i in range(count_before):
            margin = max(margin, may_lift(before, i))
    if world.broad_phase.used:
        near = near_pairs(world.broad_phase, state.body, margin)
        if near < 0:
            return -1
        pairs = world.broad_phase.pairs[:near]
    count = detect(world.shapes, pairs, state.body, margin, contacts)
    if margin > CLOSE:
        count = leave_out_apart(contacts, count, before, count_before)
    else:
        for i in range(count):
            contacts.gap[i] = min(contacts.gap[i], 0.0)
    if world.switches.clustering:
        count = cluster(world, contacts, count)
    if world.switches.joint_limits and count >= 0:
        margin = CLOSE if world.switches.touch else 0.0
        first = count
        count = add_stops(world, state, contacts, first, margin)
        for i in range(first, count):
            contacts.gap[i] = min(contacts.gap[i], 0.0)
    return count


@kernel
def may_lift(before, i):
    """Return the gap [m] up to which contact i of the step before still counts as closed.

    A corner about which a body turns lifts on its arc. The step allows for the arc of the step
    before; what is left is a small share of it.
    """
    if before.normal_force[i] <= 0.0:
        return 0.0
    return CLOSE + BENDS * abs(before.expected[i] - before.gap[i])


@kernel
def leave_out_apart(contacts, count, before, count_before):
    """Drop contacts that are apart, and keep the gap of those that only bend off their support;
    return how many stay."""
    kept = 0
    for i in range(count):
        allowed = 0.0
        gap = contacts.gap[i]
        for k in range(count_before if gap > 0.0 else 0):
            if same_name(contacts, i, before, k):
                allowed = may_lift(before, k)
        if gap <= max(allowed, CLOSE):
            if kept < i:
                copy_geometry(contacts, kept, contacts, i)
            contacts.gap[kept] = gap if allowed > CLOSE else min(gap, 0.0)
            kept += 1
    return kept
