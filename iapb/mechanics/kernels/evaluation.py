"""Kernels that compute a quantity from q, for one state or for many, in one call from Python.

Their configurations come from the user, so these kernels check them; all other kernels do not check their input.
"""

from math import isfinite, sqrt

from iapb.compiled import kernel
from iapb.elementary import arc_tangent
from iapb.linalg import add, cholesky, cross, dot, load, scale, solve_mass, subtract
from iapb.mechanics.joints import CONTINUOUS, FREE_FLYER, PLANAR_SE2, SPHERICAL
from iapb.mechanics.kernels.configuration import difference, turn_vector
from iapb.mechanics.kernels.dynamics import bias, body_velocities, mass_matrix, turned_inertia
from iapb.mechanics.kernels.kinematics import forward_kinematics, motion_at

# Tolerance on the length of a given quaternion or (cos, sin) pair: single precision input passes.
UNIT_TOLERANCE = 1e-6


@kernel
def all_finite(values):
    """Return whether a vector has no NaN and no infinity."""
    for k in range(values.shape[0]):  # noqa: SIM110 - a kernel has no generators
        if not isfinite(values[k]):
            return False
    return True


@kernel
def is_unit(q, first, count):
    """Return whether the `count` entries of q from `first` on have total length one."""
    square = 0.0
    for i in range(first, first + count):
        square += q[i] * q[i]
    return abs(sqrt(square) - 1.0) <= UNIT_TOLERANCE


@kernel
def misplaced_body(m, q):
    """Return the first body whose quaternion or (cos, sin) pair has not length one, -1 if there is none."""
    for b in range(m.kind.shape[0]):
        kind, i = m.kind[b], m.q_start[b]
        if kind == CONTINUOUS and not is_unit(q, i, 2):
            return b
        if kind == PLANAR_SE2 and not is_unit(q, i + 2, 2):
            return b
        if kind == SPHERICAL and not is_unit(q, i, 4):
            return b
        if kind == FREE_FLYER and not is_unit(q, i + 3, 4):
            return b
    return -1


@kernel
def is_configuration(m, q):
    """Return whether q is finite and its quaternions and (cos, sin) pairs have length one."""
    return all_finite(q) and misplaced_body(m, q) < 0


@kernel
def mass_matrix_at(at, q, out):
    """out (d, d) <- M(q); return False if q is not a valid configuration."""
    if not is_configuration(at.mechanism, q):
        return False
    forward_kinematics(at.mechanism, q, at.workspace)
    mass_matrix(at.mechanism, at.workspace, out)
    return True


@kernel
def bias_at(at, q, v, out):
    """out (d,) <- B(q, v); return False if q is not a valid configuration or v not finite."""
    if not (is_configuration(at.mechanism, q) and all_finite(v)):
        return False
    forward_kinematics(at.mechanism, q, at.workspace)
    bias(at.mechanism, at.workspace, v, out)
    return True


@kernel
def mass_matrices_at(at, q, out):
    """out (n, d, d) <- M at each row of q (n, nq); return the number of rows done: fewer than n if one is invalid."""
    for k in range(q.shape[0]):
        if not mass_matrix_at(at, q[k], out[k]):
            return k
    return q.shape[0]


@kernel
def biases_at(at, q, v, out):
    """out (n, d) <- B at each row of q (n, nq) and v (n, d); return the number of rows done."""
    for k in range(q.shape[0]):
        if not bias_at(at, q[k], v[k], out[k]):
            return k
    return q.shape[0]


@kernel
def rows_along(m, w, q, body, point, direction, out):
    """out (n, d) <- Jacobian rows of n world points, each fixed to a body, along directions; return the rows done.

    Row i belongs to the configuration q[i], q (n, nq). Body -1 is the world, which does not move.
    """
    for i in range(q.shape[0]):
        if not is_configuration(m, q[i]):
            return i
        forward_kinematics(m, q[i], w)
        x, along = load(point, i), load(direction, i)
        out[i] = 0.0
        k = m.last_dof[body[i]] if body[i] >= 0 else -1
        while k >= 0:
            out[i, k] = dot(along, motion_at(m, w, k, x))
            k = m.dof_parent[k]
    return q.shape[0]


# Energies and momentum as sums over bodies: no cancellation between large entries of M.


@kernel
def center_velocity(w, b):
    """Return the velocity of body b's centre of mass: v_o + omega x (c - o)."""
    lever = subtract(load(w.center, b), load(w.position, b))
    return add(load(w.linear_velocity, b), cross(load(w.angular_velocity, b), lever))


@kernel
def kinetic_energy(m, w, v):
    """Return sum of (m |v_c|^2 + omega . I omega) / 2 [J]."""
    body_velocities(m, w, v)
    total = 0.0
    for b in range(m.kind.shape[0]):
        u, omega = center_velocity(w, b), load(w.angular_velocity, b)
        total += 0.5 * (m.mass[b] * dot(u, u) + dot(omega, turned_inertia(m, w, b, omega)))
    return total


@kernel
def potential_energy(m, w, g):
    """Return -sum of m g . c [J] over the bodies that can move; zero if every centre of mass is at the world origin."""
    total = 0.0
    for b in range(m.kind.shape[0]):
        if m.last_dof[b] >= 0:
            total -= m.mass[b] * dot((g[0], g[1], g[2]), load(w.center, b))
    return total


@kernel
def centroidal_momentum(m, w, v, out):
    """out (6,) <- linear momentum [N s] and angular momentum [N m s] about the moving bodies' centre of mass."""
    body_velocities(m, w, v)
    mass, first_moment, linear, angular = 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for b in range(m.kind.shape[0]):
        if m.last_dof[b] >= 0:
            mass += m.mass[b]
            first_moment = add(first_moment, scale(m.mass[b], load(w.center, b)))
    common = scale(1.0 / mass if mass > 0.0 else 0.0, first_moment)
    for b in range(m.kind.shape[0]):
        momentum = scale(m.mass[b], center_velocity(w, b))
        spin = turned_inertia(m, w, b, load(w.angular_velocity, b))
        linear = add(linear, momentum)
        angular = add(angular, add(spin, cross(subtract(load(w.center, b), common), momentum)))
    out[0], out[1], out[2] = linear
    out[3], out[4], out[5] = angular


@kernel
def energies_along(m, w, q, v, g, kinetic, potential):
    """kinetic, potential (n,) [J] <- the energies at the n states of a trajectory q (n, nq), v (n, d)."""
    for k in range(q.shape[0]):
        forward_kinematics(m, q[k], w)
        kinetic[k] = kinetic_energy(m, w, v[k])
        potential[k] = potential_energy(m, w, g)


@kernel
def planar_poses_along(m, w, q, out):
    """out (n, bodies, 3) <- x, y [m] and angle [rad] of every body, in the plane, at each row of q (n, nq)."""
    for k in range(q.shape[0]):
        forward_kinematics(m, q[k], w)
        for b in range(out.shape[1]):
            out[k, b, 0], out[k, b, 1] = w.position[b, 0], w.position[b, 1]
            out[k, b, 2] = arc_tangent(w.rotation[b, 1, 0], w.rotation[b, 0, 0])


@kernel
def poses_along(m, w, q, out):
    """out (n, bodies, 7) <- position [m] and quaternion x, y, z, w >= 0 of every body, at each row of q (n, nq)."""
    for k in range(q.shape[0]):
        forward_kinematics(m, q[k], w)
        for b in range(out.shape[1]):
            out[k, b, 0], out[k, b, 1], out[k, b, 2] = load(w.position, b)
            out[k, b, 3], out[k, b, 4], out[k, b, 5], out[k, b, 6] = quaternion_of(w.rotation[b])


@kernel
def quaternion_of(r):
    """Quaternion x, y, z, w >= 0 of a rotation (3, 3), computed from its largest component to avoid cancellation."""
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    if trace > max(r[0, 0], r[1, 1], r[2, 2]):
        s = 2.0 * sqrt(1.0 + trace)
        return (r[2, 1] - r[1, 2]) / s, (r[0, 2] - r[2, 0]) / s, (r[1, 0] - r[0, 1]) / s, 0.25 * s
    if r[0, 0] >= r[1, 1] and r[0, 0] >= r[2, 2]:
        s = 2.0 * sqrt(1.0 + r[0, 0] - r[1, 1] - r[2, 2])
        x, y, z, w = 0.25 * s, (r[0, 1] + r[1, 0]) / s, (r[0, 2] + r[2, 0]) / s, (r[2, 1] - r[1, 2]) / s
    elif r[1, 1] >= r[2, 2]:
        s = 2.0 * sqrt(1.0 + r[1, 1] - r[0, 0] - r[2, 2])
        x, y, z, w = (r[0, 1] + r[1, 0]) / s, 0.25 * s, (r[1, 2] + r[2, 1]) / s, (r[0, 2] - r[2, 0]) / s
    else:
        s = 2.0 * sqrt(1.0 + r[2, 2] - r[0, 0] - r[1, 1])
        x, y, z, w = (r[0, 2] + r[2, 0]) / s, (r[1, 2] + r[2, 1]) / s, 0.25 * s, (r[1, 0] - r[0, 1]) / s
    sign = -1.0 if w < 0.0 else 1.0
    return sign * x, sign * y, sign * z, sign * w


@kernel
def impact_loss(mass_matrix, lower, v, impulse, change):
    """Return -(v . P + P . M^-1 P / 2) [J], the kinetic energy that the impulse P takes; lower, change: scratch."""
    cholesky(mass_matrix, lower)
    solve_mass(lower, impulse, change)
    total = 0.0
    for k in range(v.shape[0]):
        total -= impulse[k] * (v[k] + 0.5 * change[k])
    return total


@kernel
def displacements_along(m, q, straight, out):
    """out (n - 1, d) <- the displacement of each step of a trajectory q (n, nq), see `difference`.

    With `straight`, that of a free flyer is the path of its centre of mass, in body axes at the start of the step,
    minus phi x c: the work of a force that keeps its direction in the world, where `difference` gives a screw motion.
    """
    for k in range(out.shape[0]):
        difference(m, q[k], q[k + 1], out[k])
        if straight:
            for b in range(m.kind.shape[0]):
                if m.kind[b] == FREE_FLYER:
                    i, j, c = m.q_start[b], m.v_start[b], load(m.center_of_mass, b)
                    now, then = q[k, i : i + 7], q[k + 1, i : i + 7]
                    path = (then[0] - now[0], then[1] - now[1], then[2] - now[2])
                    path = add(path, turn_vector(then[3], then[4], then[5], then[6], c))
                    path = subtract(turn_vector(-now[3], -now[4], -now[5], now[6], path), c)
                    path = subtract(path, cross((out[k, j + 3], out[k, j + 4], out[k, j + 5]), c))
                    out[k, j], out[k, j + 1], out[k, j + 2] = path
