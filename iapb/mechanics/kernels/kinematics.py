"""Forward kinematics: the pose of every body, and the world axis of every degree of freedom."""

from iapb.mechanics.joints import CONTINUOUS, FIXED, FREE_FLYER, PLANAR, PRISMATIC, REVOLUTE
from iapb.numerics.compiled import kernel
from iapb.numerics.elementary import sine_cosine
from iapb.numerics.linalg import (
    accumulate,
    add,
    column,
    cross,
    dot,
    load,
    placed,
    put,
    scale,
    store,
    store_columns,
    subtract,
    three,
    transform,
    turn_frame,
)


@kernel
def turn_about_axis(w, b, a, c, s):
    """Rodrigues: R <- R (c 1 + (1 - c) a a^T + s [a]x), angle with cosine c and sine s."""
    x, y, z = a
    u = 1.0 - c
    turn_frame(
        w.rotation,
        b,
        (c + u * x * x, u * x * y + s * z, u * x * z - s * y),
        (u * x * y - s * z, c + u * y * y, u * y * z + s * x),
        (u * x * z + s * y, u * y * z - s * x, c + u * z * z),
    )


@kernel
def body_axes_to_dofs(w, b, first):
    """Axes of three dofs <- the axes of body b."""
    for k in range(3):
        store(w.axis, first + k, column(w.rotation, b, k))


@kernel
def joint_position(m, q, b):
    """Return the position of a revolute or prismatic joint, its own or what it follows."""
    k = m.v_start[b]
    x = q[m.q_start[b]]
    return x if m.dof_leader[k] == k else m.dof_ratio[k] * x + m.dof_offset[k]


@kernel
def move_joint(m, q, w, b):
    """Move body b from its joint frame to its pose; write the axes of the joint's dofs."""
    kind = m.kind[b]
    i = m.q_start[b]
    k = m.v_start[b]
    if kind == PLANAR:  # axes of the joint frame: they do not turn with the body
        body_axes_to_dofs(w, b, k)
        store(w.position, b, placed(w, b, (q[i], q[i + 1], 0.0)))
        s, c = sine_cosine(q[i + 2])
        turn_about_axis(w, b, (0.0, 0.0, 1.0), c, s)
    elif kind == PRISMATIC:
        store(w.axis, k, transform(w.rotation, b, load(m.joint_axis, b)))
        accumulate(w.position, b, scale(joint_position(m, q, b), load(w.axis, k)))
    elif kind in (REVOLUTE, CONTINUOUS):
        a = load(m.joint_axis, b)
        store(w.axis, k, transform(w.rotation, b, a))
        s, c = sine_cosine(joint_position(m, q, b)) if kind == REVOLUTE else (q[i + 1], q[i])
        turn_about_axis(w, b, a, c, s)
    elif kind != FIXED:  # a unit quaternion, after the position of a free flyer
        if kind == FREE_FLYER:
            store(w.position, b, placed(w, b, three(q, i)))
            i += 3
        x, y, z = three(q, i)
        s = q[i + 3]
        turn_frame(
            w.rotation,
            b,
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + s * z), 2.0 * (x * z - s * y)),
            (2.0 * (x * y - s * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + s * x)),
            (2.0 * (x * z + s * y), 2.0 * (y * z - s * x), 1.0 - 2.0 * (x * x + y * y)),
        )
        for first in range(k, k + m.v_count[b], 3):
            body_axes_to_dofs(w, b, first)


@kernel
def forward_kinematics(m, q, w):
    """Fill rotation, position, center and axis of the workspace w for the configuration q, unless w
    holds q already.

    Quaternions and (cos, sin) pairs must have length one; kernels do not check. A joint frame has
    R = R_parent R_placement, p = p_parent + R_parent p_placement.
    """
    n = len(q)
    same = 0
    while same < n and q[same] == w.placed_q[same]:
        same += 1
    if 0 < n == same:
        return
    for k in range(same, n):
        w.placed_q[k] = q[k]
    R = w.rotation
    fixed = m.placement_rotation
    for b in range(m.bodies):
        parent = m.parent[b]
        offset = load(m.placement_position, b)
        x = column(fixed, b, 0)
        y = column(fixed, b, 1)
        z = column(fixed, b, 2)
        if parent >= 0:
            x = transform(R, parent, x)
            y = transform(R, parent, y)
            z = transform(R, parent, z)
            offset = placed(w, parent, offset)
        store_columns(R, b, x, y, z)
        store(w.position, b, offset)
        move_joint(m, q, w, b)
        store(w.center, b, placed(w, b, load(m.center_of_mass, b)))


# Jacobians of points and frames, and forces at points, from the axes of the dofs (paper (1), J_i
# and J_h).
#
# Dof k moves point x of every body it carries with velocity a_k (translation) or a_k x (x - o_k)
# (rotation), where o_k is the origin of the body that the dof moves.


@kernel
def motion_at(m, w, k, x):
    """Return the velocity of the point x per unit velocity of dof k."""
    a = scale(m.dof_ratio[k], load(w.axis, k))
    return cross(a, subtract(x, load(w.position, m.dof_body[k]))) if m.dof_rotates[k] else a


@kernel
def frame_jacobian(m, w, body, point, out):
    """out (6, d) <- Jacobian of the velocity of the world point, fixed to the body, and of the
    angular velocity."""
    out[:] = 0.0
    k = m.last_dof[body]
    while k >= 0:
        column = out[:, m.dof_leader[k]]
        put(column, 0, add(three(column, 0), motion_at(m, w, k, three(point, 0))))
        if m.dof_rotates[k]:
            put(column, 3, add(three(column, 3), scale(m.dof_ratio[k], load(w.axis, k))))
        k = m.dof_parent[k]


@kernel
def add_point_force(m, w, body, point, force, out):
    """out (d,) += J^T force: force [N], world axes, on the body at the world point.

    With a unit normal as force this adds the contact row n^T J. A body of -1, the static world,
    adds nothing.
    """
    if body < 0:
        return
    place = (point[0], point[1], point[2])
    k = m.last_dof[body]
    while k >= 0:
        out[m.dof_leader[k]] += dot(motion_at(m, w, k, place), force)
        k = m.dof_parent[k]
