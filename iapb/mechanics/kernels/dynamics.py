"""Equations of motion M dv/dt + B + G = tau (paper (1)) by composite bodies and by Newton-Euler.

Sources: Walker and Orin 1982 (composite rigid bodies), Luh, Walker and Paul 1980 (Newton-Euler),
both as in Featherstone, Rigid Body Dynamics Algorithms, 2008, here in world axes. Composite
inertias are kept about the composite's own centre of mass, where merging two bodies only adds
positive terms.
"""

from iapb.mechanics.joints import FREE_FLYER
from iapb.numerics.compiled import kernel
from iapb.numerics.linalg import (
    ZERO,
    accumulate,
    add,
    cross,
    dot,
    load,
    scale,
    store,
    subtract,
    three,
    transform,
    transform_back,
)


@kernel
def arm_of_center(w, b):
    """Return the way from the origin of body b to its centre of mass."""
    return subtract(load(w.center, b), load(w.position, b))


@kernel
def turned_inertia(m, w, b, omega):
    """Return R I R^T omega of body b alone."""
    return transform(w.rotation, b, transform(m.inertia, b, transform_back(w.rotation, b, omega)))


@kernel
def composite_bodies(m, w):
    """Write, for each body, mass, centre and inertia of the body and all bodies that it carries.

    Two bodies together have the inertia I1 + I2 + mu (|r|^2 1 - r r^T), mu = m1 m2 / (m1 + m2).
    """
    for b in range(m.bodies):
        w.composite_mass[b] = m.mass[b]
        store(w.composite_center, b, load(w.center, b))
        rotation = w.rotation[b]  # the inertia in world axes is R I R^T
        own = w.composite_inertia[b]
        for j in range(3):
            image = transform(m.inertia, b, load(rotation, j))
            for i in range(j + 1):
                own[i, j] = own[j, i] = dot(load(rotation, i), image)
    for b in range(m.bodies - 1, -1, -1):
        into = m.parent[b]
        if into >= 0:
            m1 = w.composite_mass[into]
            m2 = w.composite_mass[b]
            total = m1 + m2
            center = load(w.composite_center, into)
            r = subtract(load(w.composite_center, b), center)
            share = m2 / total if total > 0.0 else 0.0
            mu = m1 * share
            square = dot(r, r)
            inertia = w.composite_inertia[into]
            own = w.composite_inertia[b]
            xy = -mu * (r[0] * r[1])
            xz = -mu * (r[0] * r[2])
            yz = -mu * (r[1] * r[2])
            accumulate(inertia, 0, add(load(own, 0), (mu * (square - r[0] * r[0]), xy, xz)))
            accumulate(inertia, 1, add(load(own, 1), (xy, mu * (square - r[1] * r[1]), yz)))
            accumulate(inertia, 2, add(load(own, 2), (xz, yz, mu * (square - r[2] * r[2]))))
            w.composite_mass[into] = total
            store(w.composite_center, into, add(center, scale(share, r)))


@kernel
def mass_matrix(m, w, out):
    """out (d, d) <- M(q), symmetric; entries of two dofs on different branches are zero.

    Column j: a unit velocity of dof j gives its composite the linear momentum l and the angular
    momentum h about the composite centre c; its entry with dof i before it is a_i . l or a_i . (h +
    (c - o_i) x l).
    """
    composite_bodies(m, w)
    out[:] = 0.0
    alone = m.motions == len(out)
    for j in range(m.motions):
        b = m.dof_body[j]
        a = load(w.axis, j)
        c = load(w.composite_center, b)
        if m.dof_rotates[j]:
            linear = scale(w.composite_mass[b], cross(a, subtract(c, load(w.position, b))))
            angular = transform(w.composite_inertia, b, a)
        else:
            linear = scale(w.composite_mass[b], a)
            angular = ZERO
        i = j
        while i >= 0:
            if m.dof_rotates[i]:
                lever = subtract(c, load(w.position, m.dof_body[i]))
                entry = dot(load(w.axis, i), add(angular, cross(lever, linear)))
            else:
                entry = dot(load(w.axis, i), linear)
            if alone:
                out[i, j] = entry
                out[j, i] = entry
            else:
                add_to_leaders(m, i, j, entry, out)
            i = m.dof_parent[i]


@kernel
def add_to_leaders(m, i, j, entry, out):
    """Add an entry of two motions to that of the velocities which they follow: Gᵀ M G."""
    k = m.dof_leader[i]
    l = m.dof_leader[j]
    share = m.dof_ratio[i] * m.dof_ratio[j] * entry
    out[k, l] += share
    if i != j:
        out[l, k] += share


@kernel
def gravity(m, w, g, out):
    """out (d,) <- G(q) = d(potential energy)/dq for the gravity field g (3,) [m/s^2], world
    axes."""
    for b in range(m.bodies):
        store(w.force, b, scale(-m.mass[b], three(g, 0)))
        store(w.moment, b, cross(arm_of_center(w, b), load(w.force, b)))
    project_forces(m, w, out)


@kernel
def project_forces(m, w, out):
    """Sum forces and moments (about body origins) from the leaves inwards; out (d,) <- their dof
    components."""
    for b in range(m.bodies - 1, -1, -1):
        f = load(w.force, b)
        n = load(w.moment, b)
        for k in range(m.v_start[b], m.v_start[b] + m.v_count[b]):
            if m.dof_leader[k] == k:
                out[k] = dot(load(w.axis, k), n if m.dof_rotates[k] else f)
        parent = m.parent[b]
        if parent >= 0:
            lever = subtract(load(w.position, b), load(w.position, parent))
            accumulate(w.force, parent, f)
            accumulate(w.moment, parent, add(n, cross(lever, f)))
    for k in range(len(out), m.motions):
        total = w.moment if m.dof_rotates[k] else w.force
        share = dot(load(w.axis, k), load(total, m.dof_body[k]))
        out[m.dof_leader[k]] += m.dof_ratio[k] * share


@kernel
def relative_motion(m, w, b, rates):
    """Return linear and angular part of the joint's motion, in world axes, for the given rates of
    its dofs."""
    linear = angular = ZERO
    for k in range(m.v_start[b], m.v_start[b] + m.v_count[b]):
        rate = m.dof_ratio[k] * rates[m.dof_leader[k]]
        if m.dof_rotates[k]:
            angular = add(angular, scale(rate, load(w.axis, k)))
        else:
            linear = add(linear, scale(rate, load(w.axis, k)))
    return linear, angular


@kernel
def body_velocities(m, w, v):
    """Write the angular velocity of each body and the velocity of its origin."""
    for b in range(m.bodies):
        parent = m.parent[b]
        linear, angular = relative_motion(m, w, b, v)
        omega = load(w.angular_velocity, parent) if parent >= 0 else ZERO
        origin = load(w.linear_velocity, parent) if parent >= 0 else ZERO
        r = subtract(load(w.position, b), load(w.position, parent)) if parent >= 0 else ZERO
        store(w.angular_velocity, b, add(omega, angular))
        store(w.linear_velocity, b, add(add(origin, cross(omega, r)), linear))


@kernel
def inverse_dynamics(m, w, v, dv, g, out):
    """out (d,) <- tau = M dv + B(q, v) + G(q) by Newton-Euler; an empty dv counts as zero.

    The world accelerates by -g, which includes the weight. With r = p_b - p_parent and the joint's
    motion (u, s) for v, (u', s') for dv:
    alpha = alpha_p + omega_p x s + s',
    a = a_p + alpha_p x r + omega_p x (omega_p x r + 2 u) + u' [+ s x u, velocities in body axes].
    Then, with r = c - p and the inertia I in body axes, f = m (a + alpha x r + omega x (omega x r))
    and n = R (I R^T alpha + R^T omega x I R^T omega) + r x f about p.
    """
    for b in range(m.bodies):
        parent = m.parent[b]
        u, s = relative_motion(m, w, b, v)
        omega = s
        alpha = ZERO
        a = (0.0 - g[0], 0.0 - g[1], 0.0 - g[2])
        if parent >= 0:
            carried = load(w.angular_velocity, parent)
            carried_alpha = load(w.angular_acceleration, parent)
            r = subtract(load(w.position, b), load(w.position, parent))
            omega = add(carried, s)
            alpha = add(carried_alpha, cross(carried, s))
            a = add(load(w.linear_acceleration, parent), cross(carried_alpha, r))
            a = add(a, cross(carried, add(cross(carried, r), scale(2.0, u))))
        if m.kind[b] == FREE_FLYER:
            a = add(a, cross(s, u))
        if len(dv) > 0:
            changed_u, changed_s = relative_motion(m, w, b, dv)
            alpha = add(alpha, changed_s)
            a = add(a, changed_u)
        store(w.angular_velocity, b, omega)
        store(w.angular_acceleration, b, alpha)
        store(w.linear_acceleration, b, a)
        r = arm_of_center(w, b)
        f = scale(m.mass[b], add(a, add(cross(alpha, r), cross(omega, cross(omega, r)))))
        own_omega = transform_back(w.rotation, b, omega)
        own_alpha = transform_back(w.rotation, b, alpha)
        h = transform(m.inertia, b, own_omega)
        n = transform(w.rotation, b, add(transform(m.inertia, b, own_alpha), cross(own_omega, h)))
        store(w.force, b, f)
        store(w.moment, b, add(n, cross(r, f)))
    project_forces(m, w, out)


@kernel
def bias(m, w, v, out):
    """out (d,) <- B(q, v): Coriolis and centripetal generalized forces, `inverse_dynamics` without
    dv/dt and weight."""
    inverse_dynamics(m, w, v, v[:0], ZERO, out)
