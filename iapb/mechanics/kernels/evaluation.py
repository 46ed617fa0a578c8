"""Kernels that compute a quantity from q, for one state or for many, in one call from Python.

Some of them check configurations, which come from the user; no other kernel checks its input.
"""

from math import sqrt

from iapb.mechanics.joints import FREE_FLYER
from iapb.mechanics.kernels.configuration import (
    difference,
    is_vector,
    own_count,
    turn_vector,
    turn_vector_back,
)
from iapb.mechanics.kernels.dynamics import (
    arm_of_center,
    bias,
    body_velocities,
    mass_matrix,
    turned_inertia,
)
from iapb.mechanics.kernels.kinematics import add_point_force, forward_kinematics
from iapb.numerics.compiled import kernel
from iapb.numerics.elementary import arc_tangent
from iapb.numerics.linalg import (
    ZERO,
    add,
    all_finite,
    cholesky,
    cross,
    dot,
    load,
    put,
    scale,
    solve_mass,
    subtract,
    three,
)

# Tolerance on the length of a given quaternion or (cos, sin) pair: single precision input passes.
UNIT_TOLERANCE = 1e-6


@kernel
def misplaced_body(m, q):
    """Return the first body with an entry that is not finite, or a quaternion or pair not of length
    one; −1: none."""
    for b in range(m.bodies):
        first = m.q_start[b]
        stop = first + own_count(m, b)
        if not is_vector(m.kind[b]):
            stop += 1  # one entry more than velocities
        square = 0.0
        for i in range(first + 3 if m.kind[b] == FREE_FLYER else first, stop):
            square += q[i] * q[i]
        if not (
            all_finite(q[first:stop])
            and (is_vector(m.kind[b]) or abs(sqrt(square) - 1.0) <= UNIT_TOLERANCE)
        ):
            return b
    return -1


@kernel
def mass_matrices_at(m, w, q, out):
    """out (n, d, d) <- M at each of n configurations q (n, nq); return False at the first that is
    not valid."""
    for k in range(len(q)):
        if misplaced_body(m, q[k]) >= 0:
            return False
        forward_kinematics(m, q[k], w)
        mass_matrix(m, w, out[k])
    return True


@kernel
def biases_at(m, w, q, v, out):
    """out (n, d) <- B at each of n states, q (n, nq) and v (n, d); return False at the first that
    is not valid."""
    for k in range(len(q)):
        if misplaced_body(m, q[k]) >= 0 or not all_finite(v[k]):
            return False
        forward_kinematics(m, q[k], w)
        bias(m, w, v[k], out[k])
    return True


@kernel
def rows_along(m, w, q, body, point, direction, out):
    """out (n, d) <- Jacobian rows of n world points, each fixed to a body (-1: the world), along
    directions."""
    for i in range(len(q)):
        forward_kinematics(m, q[i], w)
        out[i] = 0.0
        add_point_force(m, w, body[i], point[i], direction[i], out[i])


# Energies and momentum as sums over bodies: no cancellation between large entries of M.


@kernel
def center_velocity(w, b):
    """Return the velocity of body b's centre of mass: v_o + omega x (c - o)."""
    turning = cross(load(w.angular_velocity, b), arm_of_center(w, b))
    return add(load(w.linear_velocity, b), turning)


@kernel
def energies_along(m, w, q, v, g, kinetic, potential):
    """kinetic, potential (n,) [J] <- the energies at the n states of a trajectory q (n, nq), v (n,
    d).

    Kinetic: the sum of (m |v_c|^2 + omega . I omega) / 2; potential: that of -m g . c over the
    bodies that can move.
    """
    for k in range(len(q)):
        forward_kinematics(m, q[k], w)
        body_velocities(m, w, v[k])
        kinetic[k] = potential[k] = 0.0
        for b in range(m.bodies):
            u = center_velocity(w, b)
            omega = load(w.angular_velocity, b)
            kinetic[k] += 0.5 * (m.mass[b] * dot(u, u) + dot(omega, turned_inertia(m, w, b, omega)))
            if m.last_dof[b] >= 0:
                potential[k] -= m.mass[b] * dot(three(g, 0), load(w.center, b))


@kernel
def centroidal_momentum(m, w, v, out):
    """out (6,) <- linear momentum [N s] and angular momentum [N m s] about the moving bodies'
    centre of mass."""
    body_velocities(m, w, v)
    mass = 0.0
    first_moment = linear = angular = ZERO
    for b in range(m.bodies):
        if m.last_dof[b] >= 0:
            mass += m.mass[b]
            first_moment = add(first_moment, scale(m.mass[b], load(w.center, b)))
    common = scale(1.0 / mass if mass > 0.0 else 0.0, first_moment)
    for b in range(m.bodies):
        momentum = scale(m.mass[b], center_velocity(w, b))
        spin = turned_inertia(m, w, b, load(w.angular_velocity, b))
        linear = add(linear, momentum)
        angular = add(angular, add(spin, cross(subtract(load(w.center, b), common), momentum)))
    put(out, 0, linear)
    put(out, 3, angular)


@kernel
def impact_loss(mass_matrix, lower, v, impulse, change):
    """Return -(v . P + P . M^-1 P / 2) [J], the kinetic energy that the impulse P takes; lower,
    change: scratch."""
    cholesky(mass_matrix, lower)
    solve_mass(lower, impulse, change)
    total = 0.0
    for k in range(len(v)):
        total -= impulse[k] * (v[k] + 0.5 * change[k])
    return total


@kernel
def poses_along(m, w, q, out):
    """out (n, bodies, 3 or 7) <- the pose of every body at each row of q (n, nq), see
    `Mechanism.poses`."""
    for k in range(len(q)):
        forward_kinematics(m, q[k], w)
        for b in range(out.shape[1]):
            x, y, z = load(w.position, b)
            out[k, b, 0] = x
            out[k, b, 1] = y
            if out.shape[2] == 3:
                out[k, b, 2] = arc_tangent(w.rotation[b, 1, 0], w.rotation[b, 0, 0])
            else:
                out[k, b, 2] = z
                write_quaternion(w.rotation[b], out[k, b, 3:])


@kernel
def write_quaternion(r, q):
    """q <- x, y, z, w >= 0 of a rotation (3, 3), computed from the largest of them to avoid
    cancellation."""
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    i = 0 if r[0, 0] >= r[1, 1] and r[0, 0] >= r[2, 2] else 1 if r[1, 1] >= r[2, 2] else 2
    j = (i + 1) % 3
    k = (i + 2) % 3
    if trace > r[i, i]:
        s = 2.0 * sqrt(1.0 + trace)
        for n in range(3):
            q[n] = skew_part(r, n) / s
        q[3] = 0.25 * s
    else:
        s = 2.0 * sqrt(1.0 + r[i, i] - r[min(j, k), min(j, k)] - r[max(j, k), max(j, k)])
        s = s if skew_part(r, i) >= 0.0 else -s
        q[i] = 0.25 * s
        for n in (j, k):
            q[n] = (r[i, n] + r[n, i]) / s
        q[3] = skew_part(r, i) / s


@kernel
def skew_part(r, i):
    """Return component i of the vector of R − Rᵀ: twice the sine of the angle, along the axis."""
    j = (i + 1) % 3
    k = (i + 2) % 3
    return r[k, j] - r[j, k]


@kernel
def displacements_along(m, q, straight, out):
    """out (n - 1, d) <- the displacement of each step of a trajectory q (n, nq), see `difference`.

    With `straight`, that of a free flyer is the path of its centre of mass, in body axes at the
    start of the step, minus phi x c: the work of a force that keeps its direction in the world,
    where `difference` gives a screw motion.
    """
    for k in range(len(out)):
        difference(m, q[k], q[k + 1], out[k])
        for b in range(m.bodies):
            if straight and m.kind[b] == FREE_FLYER:
                i = m.q_start[b]
                j = m.v_start[b]
                c = load(m.center_of_mass, b)
                path = subtract(three(q[k + 1], i), three(q[k], i))
                path = add(path, turn_vector(q[k + 1], i + 3, c))
                path = subtract(turn_vector_back(q[k], i + 3, path), c)
                put(out[k], j, subtract(path, cross(three(out[k], j + 3), c)))
