"""Jacobians of points and frames, and forces at points, from the axes of the dofs (paper (1), J_i and J_h).

Dof k moves point x of every body it carries with velocity a_k (translation) or a_k x (x - o_k) (rotation),
where o_k is the origin of the body that the dof moves.
"""

from iapb.compiled import kernel
from iapb.mechanics.kernels.vectors import add, cross, dot, load, scale, subtract


@kernel
def motion_at(m, w, k, x):
    """Velocity of the point x per unit velocity of dof k."""
    a = load(w.axis, k)
    return cross(a, subtract(x, load(w.position, m.dof_body[k]))) if m.dof_rotates[k] else a


@kernel
def point_jacobian(m, w, body, point, out):
    """out (3, d) <- Jacobian of the velocity of the world point, taken as fixed to the body."""
    out[:] = 0.0
    x = (point[0], point[1], point[2])
    k = m.last_dof[body]
    while k >= 0:
        out[0, k], out[1, k], out[2, k] = motion_at(m, w, k, x)
        k = m.dof_parent[k]


@kernel
def frame_jacobian(m, w, body, out):
    """out (6, d) <- Jacobian of the body's origin (rows 0 to 2) and angular velocity (3 to 5), world axes."""
    out[:] = 0.0
    x = load(w.position, body)
    k = m.last_dof[body]
    while k >= 0:
        out[0, k], out[1, k], out[2, k] = motion_at(m, w, k, x)
        if m.dof_rotates[k]:
            out[3, k], out[4, k], out[5, k] = load(w.axis, k)
        k = m.dof_parent[k]


@kernel
def add_point_force(m, w, body, point, force, out):
    """out (d,) += J^T force: force [N], world axes, on the body at the world point.

    With a unit normal as force this adds the contact row n^T J. A body of -1, the static world, adds nothing.
    """
    if body < 0:
        return
    x, f = (point[0], point[1], point[2]), (force[0], force[1], force[2])
    k = m.last_dof[body]
    while k >= 0:
        out[k] += dot(motion_at(m, w, k, x), f)
        k = m.dof_parent[k]


@kernel
def point_velocity(m, w, body, point, v, out):
    """out (3,) <- velocity J v of the world point as fixed to the body; zero for body -1."""
    total = (0.0, 0.0, 0.0)
    if body >= 0:
        x = (point[0], point[1], point[2])
        k = m.last_dof[body]
        while k >= 0:
            total = add(total, scale(v[k], motion_at(m, w, k, x)))
            k = m.dof_parent[k]
    out[0], out[1], out[2] = total
