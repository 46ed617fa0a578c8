"""Contact Jacobian rows nᵀ(J_a − J_b) and contact velocities, from the motion of single points.

A row maps generalized velocity to normal velocity [m/s]; positive separates.
"""

from __future__ import annotations

from iapb.numerics.compiled import kernel
from iapb.numerics.linalg import ZERO, add, cross, dot, load, norm, scale, store, subtract

# An entry n·j of a row (j: motion of the point per unit rate of one dof) is set to exact zero at
# and below this share of the numbers it was computed from. Kinematics round by about 2e-16 per
# joint, so n and j are known to 1e-13 for chains of some hundred joints. A true deviation of 1e-13
# rad from orthogonal cannot be distinguished from this rounding, and no geometry is that accurate.
# Without the rule, the resolver's scaling of rows to unit length would make a contact of a row of
# such entries.
ROW_NOISE = 1e-13


@kernel
def motion_and_size(world, state, k, x):
    """Return the motion of the world point x per unit rate of dof k, and the square of the numbers
    that it was computed from."""
    m = world.mechanism
    a = load(state.body.axis, k)
    if not m.dof_rotates[k]:
        return a, 1.0
    o = load(state.body.position, m.dof_body[k])
    j = cross(a, subtract(x, o))
    return j, dot(j, j) + dot(x, x) + dot(o, o)


@kernel
def add_body_row(world, state, body, x, n, factor, out):
    """out (d,) += factor · nᵀJ of the body at the world point x; the static world (-1) adds nothing.

    With j the motion of x per unit rate of a dof, the entry n·j is left out if it is only rounding.
    For a translation the bound is |n·j| <= ROW_NOISE ‖j‖. For a rotation j = a × (x − o), and the
    lever x − o has the rounding of x and o, so the bound includes the size of x and o. For a
    contact at the joint itself the lever is only rounding. Dofs that carry both bodies of a
    self-collision add and subtract the same number, which gives an exact zero.
    """
    if body < 0:
        return
    m = world.mechanism
    k = m.last_dof[body]
    while k >= 0:
        motion, square = motion_and_size(world, state, k, x)
        entry = dot(n, motion)
        if not entry * entry <= ROW_NOISE * ROW_NOISE * square:  # NaN is no noise
            out[m.dof_leader[k]] += m.dof_ratio[k] * factor * entry
        k = m.dof_parent[k]


@kernel
def write_row(world, state, i, direction, of_a, of_b):
    """Write `state.row` (d,): of_a times the velocity of body a at contact i along a unit direction,
    plus of_b times that of body b.

    Along the normal, 1 and −1 give (11) and (12); 1 and 0 give (13), 0 and 1 give (14).
    """
    contacts = state.contacts
    x = load(contacts.point, i)
    state.row[:] = 0.0
    add_body_row(world, state, contacts.body_a[i], x, direction, of_a, state.row)
    add_body_row(world, state, contacts.body_b[i], x, direction, of_b, state.row)


@kernel
def write_pair_rows(world, state, trees, i, directions, out):
    """Write the rows of contact i along s directions (s, 3) to out (s, 2 w): w entries for each of
    its two trees (−1 = none)."""
    m = world.mechanism
    half = out.shape[1] // 2
    x = load(state.contacts.point, i)
    factor = 1.0
    out[:] = 0.0
    for body in (state.contacts.body_a[i], state.contacts.body_b[i]):
        if body >= 0:
            tree = world.tree_of_body[body]
            shift = (half if tree == trees[1] else 0) - world.tree_start[tree]
            k = m.last_dof[body]
            while k >= 0:
                motion, square = motion_and_size(world, state, k, x)
                for j in range(len(directions)):
                    entry = dot(load(directions, j), motion)
                    if not entry * entry <= ROW_NOISE * ROW_NOISE * square:
                        out[j, shift + m.dof_leader[k]] += m.dof_ratio[k] * factor * entry
                k = m.dof_parent[k]
        factor = -1.0


@kernel
def friction_of(world, contacts, i):
    """Return μ of contact i."""
    return of_surfaces(world, contacts, i, world.friction)


@kernel
def of_surfaces(world, contacts, i, table):
    """Return the entry of a table for the two shapes of contact i."""
    return table[world.surface[contacts.shape_a[i]], world.surface[contacts.shape_b[i]]]


@kernel
def restitution_of(world, contacts, i):
    """Return e of contact i."""
    return of_surfaces(world, contacts, i, world.restitution)


@kernel
def tangent_of(n, which, tangents):
    """Return unit tangent number `which` of a unit normal: of one tangent, in the plane z = 0, or
    of two."""
    if tangents == 1:
        return (-n[1], n[0], 0.0)
    ax = abs(n[0])
    ay = abs(n[1])
    az = abs(n[2])
    if ax <= ay and ax <= az:  # x × n, of the axis that is farthest from n
        first = (0.0, -n[2], n[1])
    elif ay <= az:
        first = (n[2], 0.0, -n[0])
    else:
        first = (-n[1], n[0], 0.0)
    first = scale(1.0 / norm(first), first)
    return first if which == 0 else cross(n, first)


@kernel
def twist(world, state, body):
    """Return the origin p of a body, the velocity u of p and the angular velocity ω; zeros for the
    static world.

    A point x fixed to the body moves with u + ω × (x − p).
    """
    p = u = omega = ZERO
    if body < 0:
        return p, u, omega
    m = world.mechanism
    w = state.body
    p = load(w.position, body)
    k = m.last_dof[body]
    while k >= 0:
        rate = scale(m.dof_ratio[k] * state.v[m.dof_leader[k]], load(w.axis, k))
        if m.dof_rotates[k]:
            omega = add(omega, rate)
            rate = cross(rate, subtract(p, load(w.position, m.dof_body[k])))
        u = add(u, rate)
        k = m.dof_parent[k]
    return p, u, omega


@kernel
def contact_velocities(world, state, contacts, count):
    """Write normal_velocity n·(v_a − v_b) and tangential_velocity (the rest of v_a − v_b) of each
    contact."""
    points = contacts.point
    normals = contacts.normal
    a = b = -1  # bodies whose twists are computed already: contacts of one pair follow each other
    p_a, u_a, omega_a = p_b, u_b, omega_b = twist(world, state, -1)
    for i in range(count):
        if contacts.body_a[i] != a:
            a = contacts.body_a[i]
            p_a, u_a, omega_a = twist(world, state, a)
        if contacts.body_b[i] != b:
            b = contacts.body_b[i]
            p_b, u_b, omega_b = twist(world, state, b)
        x = load(points, i)
        n = load(normals, i)
        relative = add(u_a, cross(omega_a, subtract(x, p_a)))
        if b >= 0:
            relative = subtract(relative, add(u_b, cross(omega_b, subtract(x, p_b))))
        normal_velocity = dot(n, relative)
        contacts.normal_velocity[i] = normal_velocity
        store(contacts.tangential_velocity, i, subtract(relative, scale(normal_velocity, n)))
