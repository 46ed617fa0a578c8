"""Steps on the configuration manifold: q (+) v dt and its inverse, joint by joint.

Coordinates of vector joints are added. (cos, sin) pairs and quaternions turn by the group
exponential and are normalized to length one. Velocities in body axes (free flyer) follow the screw
motion of SE(3), as in Pinocchio.
"""

from math import sqrt

from iapb.mechanics.joints import CONTINUOUS, FREE_FLYER, SPHERICAL
from iapb.numerics.compiled import kernel
from iapb.numerics.elementary import arc_tangent, sine_cosine
from iapb.numerics.linalg import add, cross, dot, norm, put, scale, subtract, three

# Below this angle [rad] the series of the screw coefficients (two terms kept) is exact to 1e-17,
# while the closed forms lose digits: 1 - cos keeps eps / angle^2.
SMALL_ANGLE = 1e-4


@kernel
def turn_vector(q, i, a):
    """Rotate a by the unit quaternion at q[i]."""
    axis = three(q, i)
    twice = scale(2.0, cross(axis, a))
    return add(a, add(scale(q[i + 3], twice), cross(axis, twice)))


@kernel
def turn_vector_back(q, i, a):
    """Rotate a by the inverse of the unit quaternion at q[i]."""
    axis = scale(-1.0, three(q, i))
    twice = scale(2.0, cross(axis, a))
    return add(a, add(scale(q[i + 3], twice), cross(axis, twice)))


@kernel
def multiply(a, s, b, t):
    """Return the product of two quaternions, given as vector and scalar."""
    return add(add(scale(s, b), scale(t, a)), cross(a, b)), s * t - dot(a, b)


@kernel
def turn_quaternion(q, i, phi, out):
    """Quaternion at i <- q * exp(phi / 2), phi [rad] a rotation vector in body axes."""
    angle = norm(phi)
    sin, t = sine_cosine(0.5 * angle)
    factor = 0.5 - angle * angle / 48.0 if angle < SMALL_ANGLE else sin / angle
    vector, scalar = multiply(three(q, i), q[i + 3], scale(factor, phi), t)
    length = sqrt(dot(vector, vector) + scalar * scalar)
    if t < 0.0:  # of the two quaternions of this rotation, the one nearer to the old one
        length = -length
    put(out, i, scale(1.0 / length, vector))
    out[i + 3] = scalar / length


@kernel
def integrate_in_space(m, b, q, v, dt, out):
    """Turn a spherical joint; a free flyer moves as p += R (1 + A [phi]x + B [phi]x^2) u, and R
    turns by phi.

    u = v_linear dt, phi = v_angular dt, t = |phi|, A = (1 - cos t) / t^2, B = (t - sin t) / t^3.
    """
    i = m.q_start[b]
    k = m.v_start[b]
    u = scale(dt, three(v, k))
    if m.kind[b] == SPHERICAL:
        turn_quaternion(q, i, u, out)
        return
    phi = scale(dt, three(v, k + 3))
    angle = norm(phi)
    square = angle * angle
    if angle < SMALL_ANGLE:
        first = 0.5 - square / 24.0
        second = 1.0 / 6.0 - square / 120.0
    else:
        half = sine_cosine(0.5 * angle)[0]
        whole = sine_cosine(angle)[0]
        first = 2.0 * half * half / square
        second = (angle - whole) / (square * angle)
    turned = cross(phi, u)
    path = add(u, add(scale(first, turned), scale(second, cross(phi, turned))))
    put(out, i, add(three(q, i), turn_vector(q, i + 3, path)))
    turn_quaternion(q, i + 3, phi, out)


@kernel
def is_vector(kind):
    """Return whether the coordinates of a joint are a vector, with one entry for each velocity."""
    return kind != CONTINUOUS and kind != SPHERICAL and kind != FREE_FLYER


@kernel
def own_count(m, b):
    """Return the number of a joint's own velocities: none if it follows another joint."""
    k = m.v_start[b]
    count = m.v_count[b]
    return count if count == 0 or m.dof_leader[k] == k else 0


@kernel
def integrate_body(m, b, q, v, dt, out):
    """Coordinates of body b in out (nq,) <- those in q moved for dt with the constant velocity
    v."""
    kind = m.kind[b]
    i = m.q_start[b]
    k = m.v_start[b]
    if kind == CONTINUOUS:
        sin, cos = sine_cosine(v[k] * dt)
        c = q[i] * cos - q[i + 1] * sin
        s = q[i + 1] * cos + q[i] * sin
        length = sqrt(c * c + s * s)
        out[i] = c / length
        out[i + 1] = s / length
    elif kind in (SPHERICAL, FREE_FLYER):
        integrate_in_space(m, b, q, v, dt, out)
    else:
        for j in range(own_count(m, b)):
            out[i + j] = q[i + j] + dt * v[k + j]


@kernel
def integrate(m, q, v, dt, out):
    """out (nq,) <- q moved for dt with the constant velocity v; out may be q itself."""
    for b in range(m.bodies):
        integrate_body(m, b, q, v, dt, out)


@kernel
def quaternion_difference(q0, q1, i):
    """Return the rotation vector phi, in the body axes of q0, with q1 = q0 * exp(phi / 2) and |phi|
    <= pi."""
    vector, scalar = multiply(scale(-1.0, three(q0, i)), q0[i + 3], three(q1, i), q1[i + 3])
    if scalar < 0.0:  # q and -q are the same rotation: take the shorter way
        vector = scale(-1.0, vector)
        scalar = -scalar
    length = norm(vector)
    factor = 2.0 if length == 0.0 else 2.0 * arc_tangent(length, scalar) / length
    return scale(factor, vector)


@kernel
def difference_in_space(m, b, q0, q1, out):
    """Write the velocity of body b, which has a quaternion, from q0 to q1.

    A free flyer's u solves (1 + A [phi]x + B [phi]x^2) u = path: u = path - phi x path / 2 + C phi
    x (phi x path).
    """
    i = m.q_start[b]
    k = m.v_start[b]
    if m.kind[b] == SPHERICAL:
        put(out, k, quaternion_difference(q0, q1, i))
        return
    phi = quaternion_difference(q0, q1, i + 3)
    path = turn_vector_back(q0, i + 3, subtract(three(q1, i), three(q0, i)))
    angle = norm(phi)
    square = angle * angle
    if angle < SMALL_ANGLE:
        factor = 1.0 / 12.0 + square / 720.0
    else:
        sin, cos = sine_cosine(0.5 * angle)
        factor = (1.0 - 0.5 * angle * cos / sin) / square
    turned = cross(phi, path)
    path = add(path, add(scale(-0.5, turned), scale(factor, cross(phi, turned))))
    put(out, k, path)
    put(out, k + 3, phi)


@kernel
def difference(m, q0, q1, out):
    """out (d,) <- the v with integrate(q0, v, 1) = q1, by the shortest rotations."""
    for b in range(m.bodies):
        kind = m.kind[b]
        i = m.q_start[b]
        k = m.v_start[b]
        if kind == CONTINUOUS:
            out[k] = arc_tangent(
                q0[i] * q1[i + 1] - q0[i + 1] * q1[i], q0[i] * q1[i] + q0[i + 1] * q1[i + 1]
            )
        elif kind in (SPHERICAL, FREE_FLYER):
            difference_in_space(m, b, q0, q1, out)
        else:
            for j in range(own_count(m, b)):
                out[k + j] = q1[i + j] - q0[i + j]
