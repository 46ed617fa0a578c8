"""Ends of the joints' ranges as contacts: a joint at its limit is held, and stopped, like any other contact.

A point on an arm of length r that a revolute joint turns about its axis a moves with a × r, so that its contact with
the joint's parent along n = ± a × r/|r| has the row nᵀJ = ± r e_k: the joint's own velocity, and no other. A prismatic
joint slides along its axis, and the row is ± e_k. Impulses, springs and records then need no more than contacts do.
"""

from __future__ import annotations

from iapb.compiled import kernel
from iapb.contact.kernels.rows import tangent_of
from iapb.mechanics.kernels.vectors import add, cross, load, scale, store


@kernel
def is_stop(contacts, i):
    """Whether contact i is the end of a joint's range: it has one number for both of its shapes."""
    return contacts.shape_a[i] == contacts.shape_b[i]


@kernel
def add_stops(mechanism, stops, w, q, margin, contacts, count):
    """Append the stops with gap <= margin [m] behind `count` contacts; return how many there are, −1: too many."""
    for i in range(stops.bound.shape[0]):
        gap = stops.arm[i] * stops.sign[i] * (q[stops.coordinate[i]] - stops.bound[i])
        if gap > margin:
            continue
        if count >= contacts.gap.shape[0]:
            return -1
        k, body = stops.dof[i], stops.body[i]
        point, normal = load(w.position, body), load(w.axis, k)
        if mechanism.dof_rotates[k]:
            lever = tangent_of(normal, 0, 2)
            point = add(point, scale(stops.arm[i], lever))
            normal = cross(normal, lever)
        store(contacts.point, count, point)
        store(contacts.normal, count, scale(stops.sign[i], normal))
        contacts.shape_a[count] = contacts.shape_b[count] = stops.shape[i]
        contacts.body_a[count], contacts.body_b[count] = body, stops.parent[i]
        contacts.feature[count], contacts.gap[count] = 0, gap
        count += 1
    return count
