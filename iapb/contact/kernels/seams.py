"""Seams: contacts that a rigid body would not have, since only its overlap with a support reaches
them.

A body that slides from one flush wall to the next overlaps the second one as it does the first: by
its sag, or by the step in which it landed. The narrow phase then finds the side or the corner of
this wall, and an impact there would stop the body.
"""

from __future__ import annotations

from iapb.contact.kernels.joint_stops import is_stop
from iapb.contact.kernels.narrow_phase import detect
from iapb.contact.kernels.shape_frames import copy_found
from iapb.numerics.compiled import kernel
from iapb.numerics.linalg import add, dot, load, scale, store

# [m] what must be left without the sag; above the rounding of positions, below a sag that matters
_OVERLAPS = 1e-9
_SAME_NORMAL = 1.0 - 5e-7  # cosine of 1e-3 rad: such a contact carries the body, too


@kernel
def leave_out_seams(world, state, contacts, count):
    """Drop new contacts of pairs that the sag of a resting contact explains; return how many
    contacts stay."""
    kept = i = 0
    while i < count:
        stop = i
        strikes = old = False
        while (
            stop < count
            and contacts.shape_a[stop] == contacts.shape_a[i]
            and contacts.shape_b[stop] == contacts.shape_b[i]
        ):
            strikes = strikes or contacts.normal_velocity[stop] < -world.approach_velocity
            old = old or not contacts.is_new[stop]
            stop += 1
        if (
            not strikes
            or old
            or is_stop(contacts, i)
            or not explained(world, state, contacts, i, count)
        ):
            for k in range(i, stop):
                if kept < k:
                    copy_found(contacts, kept, contacts, k)
                kept += 1
        i = stop
    return kept


@kernel
def explained(world, state, contacts, i, count):
    """Whether the pair of contact i does not overlap once one of its bodies is lifted out of
    another contact of the same two bodies."""
    n = load(contacts.normal, i)
    for j in range(count):
        normal = load(contacts.normal, j)
        sag = 0.0
        if is_stop(contacts, j) or dot(n, normal) > _SAME_NORMAL:
            continue
        for k in range(count):  # the deepest contact of this surface
            if (
                contacts.body_a[k] == contacts.body_a[j]
                and contacts.body_b[k] == contacts.body_b[j]
                and dot(load(contacts.normal, k), normal) > _SAME_NORMAL
            ):
                sag = max(sag, -contacts.gap[k])
        arrives = contacts.is_new[j] and contacts.normal_velocity[j] < -world.approach_velocity
        if sag <= _OVERLAPS and arrives:  # a corner that is met at once is no seam
            continue
        for body, other, sign in (
            (contacts.body_a[j], contacts.body_b[j], 1.0),
            (contacts.body_b[j], contacts.body_a[j], -1.0),
        ):
            if body >= 0 and joins(contacts, i, body, other):
                here = load(state.body.position, body)
                store(state.body.position, body, add(here, scale(sign * sag, normal)))
                apart = is_apart(world, state, contacts.shape_a[i], contacts.shape_b[i])
                store(state.body.position, body, here)
                if apart:
                    return True
    return False


@kernel
def joins(contacts, i, body, other):
    """Whether contact i is one of these two bodies: walls that join are all the world."""
    a = contacts.body_a[i]
    b = contacts.body_b[i]
    return (a == body and b == other) or (a == other and b == body)


@kernel
def is_apart(world, state, a, b):
    """Whether a pair of shapes does not overlap."""
    for k in range(len(world.pairs)):
        if world.pairs[k, 0] == a and world.pairs[k, 1] == b:
            return (
                detect(
                    world.shapes,
                    world.pairs[k : k + 1],
                    state.body,
                    -_OVERLAPS,
                    state.scratch_contacts,
                )
                == 0
            )
    return False
