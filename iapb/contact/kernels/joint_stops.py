"""Ends of the joints' ranges as contacts: impulses and penalty forces act at a joint's limit as at
any contact.

A revolute joint with axis a moves a point on an arm of length r with a × r. The contact of this
point with the joint's parent along n = ± a × r/|r| has the row nᵀJ = ± r e_k: the velocity of this
joint alone. A prismatic joint slides along its axis, and the row is ± e_k. Impulses, penalty forces
and records then treat a limit as a contact.
"""

from __future__ import annotations

from iapb.contact.kernels.rows import tangent_of
from iapb.numerics.compiled import kernel
from iapb.numerics.linalg import add, cross, load, scale, store


@kernel
def is_stop(contacts, i):
    """Return whether contact i is the end of a joint's range: both of its shapes have the same
    number."""
    return contacts.shape_a[i] == contacts.shape_b[i]


@kernel
def add_stops(world, state, contacts, count, margin):
    """Append the stops with gap <= margin [m] after `count` contacts; return the new count, −1 if there
    is no room."""
    stops = world.stops
    w = state.body
    for i in range(len(stops.bound)):
        gap = stops.arm[i] * stops.sign[i] * (state.q[stops.coordinate[i]] - stops.bound[i])
        if gap > margin:
            continue
        if count >= len(contacts.gap):
            return -1
        k = stops.dof[i]
        body = stops.body[i]
        point = load(w.position, body)
        normal = load(w.axis, k)
        if world.mechanism.dof_rotates[k]:
            lever = tangent_of(normal, 0, 2)
            point = add(point, scale(stops.arm[i], lever))
            normal = cross(normal, lever)
        store(contacts.point, count, point)
        store(contacts.normal, count, scale(stops.sign[i], normal))
        contacts.shape_a[count] = contacts.shape_b[count] = stops.shape[i]
        contacts.body_a[count] = body
        contacts.body_b[count] = stops.parent[i]
        contacts.feature[count] = 0
        contacts.gap[count] = gap
        count += 1
    return count
