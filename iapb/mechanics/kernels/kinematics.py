"""Where every body is, and the world axis of every degree of freedom."""

from math import cos, sin

from numba import njit

from iapb.mechanics.kernels.arrays import (
    CONTINUOUS,
    FIXED,
    FREE_FLYER,
    PLANAR,
    PLANAR_SE2,
    PRISMATIC,
    REVOLUTE,
    SPHERICAL,
)
from iapb.mechanics.kernels.vectors import add, columns_times, load, scale, store, transform


@njit(cache=True, fastmath=False)
def place_joint_frame(m, w, b):
    """Body b's frame <- its joint frame: R = R_parent R_placement, p = p_parent + R_parent p_placement."""
    parent = m.parent[b]
    if parent < 0:
        w.rotation[b] = m.placement_rotation[b]
        store(w.position, b, load(m.placement_position, b))
        return
    w.rotation[b] = w.rotation[parent]
    f = m.placement_rotation[b]
    columns_times(
        w.rotation, b, (f[0, 0], f[1, 0], f[2, 0]), (f[0, 1], f[1, 1], f[2, 1]), (f[0, 2], f[1, 2], f[2, 2])
    )
    offset = transform(w.rotation, parent, load(m.placement_position, b))
    store(w.position, b, add(load(w.position, parent), offset))


@njit(cache=True, fastmath=False)
def turn_about_axis(w, b, a, c, s):
    """Rodrigues: R <- R (c 1 + (1 - c) a a^T + s [a]x), angle with cosine c and sine s."""
    x, y, z = a
    u = 1.0 - c
    columns_times(
        w.rotation,
        b,
        (c + u * x * x, u * x * y + s * z, u * x * z - s * y),
        (u * x * y - s * z, c + u * y * y, u * y * z + s * x),
        (u * x * z + s * y, u * y * z - s * x, c + u * z * z),
    )


@njit(cache=True, fastmath=False)
def turn_by_quaternion(w, b, x, y, z, s):
    """R <- R R(x, y, z, s), unit quaternion with scalar part s."""
    columns_times(
        w.rotation,
        b,
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + s * z), 2.0 * (x * z - s * y)),
        (2.0 * (x * y - s * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + s * x)),
        (2.0 * (x * z + s * y), 2.0 * (y * z - s * x), 1.0 - 2.0 * (x * x + y * y)),
    )


@njit(cache=True, fastmath=False)
def store_columns(w, b, first):
    """Axes of three dofs <- the columns of body b's rotation."""
    f = w.rotation[b]
    for k in range(3):
        store(w.axis, first + k, (f[0, k], f[1, k], f[2, k]))


@njit(cache=True, fastmath=False)
def move_joint(m, q, w, b):
    """Carry body b from its joint frame to its place; write the axes of the joint's dofs."""
    kind, i, k = m.kind[b], m.q_start[b], m.v_start[b]
    if kind == PLANAR:  # axes of the joint frame: they do not turn with the body
        store_columns(w, b, k)
        shift = transform(w.rotation, b, (q[i], q[i + 1], 0.0))
        turn_about_axis(w, b, (0.0, 0.0, 1.0), cos(q[i + 2]), sin(q[i + 2]))
        store(w.position, b, add(load(w.position, b), shift))
    elif kind in (REVOLUTE, CONTINUOUS):
        a = load(m.joint_axis, b)
        store(w.axis, k, transform(w.rotation, b, a))
        if kind == REVOLUTE:
            turn_about_axis(w, b, a, cos(q[i]), sin(q[i]))
        else:
            turn_about_axis(w, b, a, q[i], q[i + 1])
    elif kind == PRISMATIC:
        store(w.axis, k, transform(w.rotation, b, load(m.joint_axis, b)))
        store(w.position, b, add(load(w.position, b), scale(q[i], load(w.axis, k))))
    elif kind == SPHERICAL:
        turn_by_quaternion(w, b, q[i], q[i + 1], q[i + 2], q[i + 3])
        store_columns(w, b, k)
    elif kind == FREE_FLYER:
        shift = transform(w.rotation, b, (q[i], q[i + 1], q[i + 2]))
        turn_by_quaternion(w, b, q[i + 3], q[i + 4], q[i + 5], q[i + 6])
        store(w.position, b, add(load(w.position, b), shift))
        store_columns(w, b, k)
        store_columns(w, b, k + 3)
    elif kind == PLANAR_SE2:
        shift = transform(w.rotation, b, (q[i], q[i + 1], 0.0))
        turn_about_axis(w, b, (0.0, 0.0, 1.0), q[i + 2], q[i + 3])
        store(w.position, b, add(load(w.position, b), shift))
        store_columns(w, b, k)


@njit(cache=True, fastmath=False)
def forward_kinematics(m, q, w):
    """Fill rotation, position, center and axis of the workspace w for the configuration q.

    Quaternions and (cos, sin) pairs must have length one; kernels do not check.
    """
    for b in range(m.kind.shape[0]):
        place_joint_frame(m, w, b)
        if m.kind[b] != FIXED:
            move_joint(m, q, w, b)
        store(w.center, b, add(load(w.position, b), transform(w.rotation, b, load(m.center_of_mass, b))))
