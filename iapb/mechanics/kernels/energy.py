"""Energies and momentum as sums over bodies: no cancellation between large entries of M."""

from iapb.compiled import kernel
from iapb.mechanics.kernels.cholesky import cholesky, solve_mass
from iapb.mechanics.kernels.configuration import difference
from iapb.mechanics.kernels.dynamics import body_velocities, turned_inertia
from iapb.mechanics.kernels.kinematics import forward_kinematics
from iapb.mechanics.kernels.vectors import add, cross, dot, load, scale, subtract


@kernel
def center_velocity(w, b):
    """Velocity of body b's centre of mass: v_o + omega x (c - o)."""
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
    """Return -sum of m g . c [J] over the bodies that can move; zero with every centre at the world origin."""
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
def impact_loss(mass_matrix, lower, v, impulse, change):
    """Return -(v . P + P . M^-1 P / 2) [J], the kinetic energy that the impulse P takes; lower, change: scratch."""
    cholesky(mass_matrix, lower)
    solve_mass(lower, impulse, change)
    total = 0.0
    for k in range(v.shape[0]):
        total -= impulse[k] * (v[k] + 0.5 * change[k])
    return total


@kernel
def displacements_along(m, q, out):
    """out (n - 1, d) <- the displacement of each step of a trajectory q (n, nq), see `difference`."""
    for k in range(out.shape[0]):
        difference(m, q[k], q[k + 1], out[k])
