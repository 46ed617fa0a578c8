"""Free motion over a step: it keeps momentum in the world's axes and makes no kinetic energy.

A step applies forces and impulses at its start (the kick); free motion then moves each tree for Δt
(the drift).

STRAIGHT  M is constant and B = 0, such as a body in the plane or a slide: q moves with v.
RIGID     one rigid body that turns freely or about a fixed point. Its angular momentum l in body
          axes turns against the body, so R l is constant. With the principal moments I_1 <= I_2 <=
          I_3 the energy |l|²/2I_2 turns the body about l, exactly; the rest, ½(1/I_1 − 1/I_2) l_1²
          + ½(1/I_3 − 1/I_2) l_3², is split into turns about the axes 1, 3, 1 (Dullweber, Leimkuhler
          and McLachlan, J. Chem. Phys. 107, 1997), three times with the steps of Yoshida (Phys.
          Lett. A 150, 1990). The motion is exact for a ball and for a body with two equal moments,
          and of fourth order otherwise. The centre of mass moves straight.
LINKAGE   velocity Verlet: q moves with v + Δt a/2, and v changes by the mean of a = −M⁻¹B at both
          ends. The velocity of a root that moves freely then follows from the conserved momentum,
          its position from the straight path of the centre of mass, and the rates of the joints are
          scaled so that the kinetic energy is that before. Second order.
"""

from __future__ import annotations

from math import ceil, sqrt
from typing import Annotated, NamedTuple

from iapb.mechanics.joints import FREE_FLYER, PLANAR, SPHERICAL
from iapb.mechanics.kernels.configuration import (
    integrate_body,
    turn_quaternion,
    turn_vector,
    turn_vector_back,
)
from iapb.numerics.compiled import kernel
from iapb.numerics.elementary import sine_cosine
from iapb.numerics.linalg import (
    ZERO,
    accumulate,
    add,
    cross,
    dot,
    load,
    multiply_by,
    norm,
    put,
    scale,
    solve_mass,
    subtract,
    three,
    transform,
    transform_back,
)
from iapb.numerics.schema import Floats, NumberPerTree

STRAIGHT, RIGID, LINKAGE = range(3)
# rad in a step: below the first, one turn of second order is exact to rounding; beyond the others,
# several parts
SLOW_ANGLE = 1e-4
RIGID_ANGLE = 0.1
LINKAGE_ANGLE = 0.02
MOST_PARTS = 100
YOSHIDA = 1.3512071919596578  # 1/(2 − 2^(1/3)), twice a step, with 1 − 2 × it in between
# largest factor on the rates of joints; a larger one would mean that the step is far too long
STRETCH = 1.1


class FreeMotion(NamedTuple):
    """What free motion needs to know of each of t trees (constant)."""

    kind: NumberPerTree  # STRAIGHT, RIGID or LINKAGE
    root: NumberPerTree  # first body that moves, −1 = none
    base: NumberPerTree  # number of root velocities with a conserved momentum
    # centre of mass of a RIGID tree [m]; zero if it turns about its origin
    center: Annotated[Floats, "tree 3"]
    axes: Annotated[Floats, "tree 3 3"]  # its principal axes as rows, both in the root's axes
    moments: Annotated[Floats, "tree 3"]  # [kg m²] about centre or origin, ascending
    turning: bool = False  # whether any tree is RIGID or a LINKAGE
    linked: bool = False  # whether any tree is a LINKAGE


@kernel
def turn_freely(free, t, q, i, v, k, dt):
    """Turn the quaternion at q[i] and the spin at v[k] of the RIGID tree t for dt [s]; R l stays as
    it is."""
    axes = free.axes
    I = load(free.moments, t)
    omega = transform(axes, t, three(v, k))
    l0 = I[0] * omega[0]
    l1 = I[1] * omega[1]
    l2 = I[2] * omega[2]
    turned = (dt * l0 / I[1], dt * l1 / I[1], dt * l2 / I[1])
    turn_quaternion(q, i, transform_back(axes, t, turned), q)
    first = 1.0 / I[0] - 1.0 / I[1]
    third = 1.0 / I[2] - 1.0 / I[1]
    if first != 0.0 or third != 0.0:
        turn = dt * norm(omega)
        single = turn < SLOW_ANGLE or first == 0.0 or third == 0.0
        parts = 1 if single else max(1, min(MOST_PARTS, ceil(turn / RIGID_ANGLE)))
        for part in range(parts if single else 3 * parts):
            h = dt if single else dt / parts * (1.0 - 2.0 * YOSHIDA if part % 3 == 1 else YOSHIDA)
            for half in range(2):
                angle = 0.5 * h * first * l0
                turn_quaternion(q, i, scale(angle, load(axes[t], 0)), q)
                l1, l2 = turned_back(angle, l1, l2)
                if half == 0:
                    angle = h * third * l2
                    turn_quaternion(q, i, scale(angle, load(axes[t], 2)), q)
                    l0, l1 = turned_back(angle, l0, l1)
    put(v, k, transform_back(axes, t, (l0 / I[0], l1 / I[1], l2 / I[2])))


@kernel
def turned_back(angle, x, y):
    """Return (x, y) in axes that have turned by the angle [rad]; the length stays as it is."""
    s, c = sine_cosine(angle)
    return c * x + s * y, c * y - s * x


@kernel
def fly(m, free, t, q, v, dt):
    """Move a RIGID free flyer: its centre of mass goes straight, and the body turns freely."""
    b = free.root[t]
    i = m.q_start[b]
    k = m.v_start[b]
    c = load(free.center, t)
    omega = three(v, k + 3)
    velocity = turn_vector(q, i + 3, add(three(v, k), cross(omega, c)))
    path = scale(dt, velocity)
    if dot(omega, omega) > 0.0:
        center = turn_vector(q, i + 3, c)
        turn_freely(free, t, q, i + 3, v, k + 3, dt)
        path = add(path, subtract(center, turn_vector(q, i + 3, c)))
        u = turn_vector_back(q, i + 3, velocity)
        put(v, k, subtract(u, cross(three(v, k + 3), c)))
    put(q, i, add(three(q, i), path))


@kernel
def move_simple_trees(m, free, tree_of_body, q, v, dt):
    """Move all trees but linkages for dt [s]."""
    for b in range(m.bodies):
        if free.kind[tree_of_body[b]] == STRAIGHT:
            integrate_body(m, b, q, v, dt, q)
    for t in range(len(free.kind)):
        if free.kind[t] == RIGID:
            b = free.root[t]
            if m.kind[b] == FREE_FLYER:
                fly(m, free, t, q, v, dt)
            else:
                turn_freely(free, t, q, m.q_start[b], v, m.v_start[b], dt)


@kernel
def parts_of_linkages(m, free, start, stop, v, dt):
    """Return the number of equal parts in which linkages move over the step, by their fastest
    rotating joint."""
    fastest = 0.0
    for t in range(len(free.kind)):
        if free.kind[t] == LINKAGE:
            for k in range(start[t], stop[t]):
                if m.dof_rotates[k]:
                    fastest = max(fastest, abs(v[k]))
    for k in range(len(v), m.motions):
        if m.dof_rotates[k]:
            fastest = max(fastest, abs(m.dof_ratio[k] * v[m.dof_leader[k]]))
    return max(1, min(MOST_PARTS, ceil(dt * fastest / LINKAGE_ANGLE)))


@kernel
def base_momentum(m, free, w, q, mass, start, stop, t, v, out):
    """out (6,) <- momentum of the root's own dofs in axes that do not move; return the kinetic
    energy [J] of tree t."""
    energy = 0.0
    for i in range(start, stop):
        total = 0.0
        for j in range(start, stop):
            total += mass[i, j] * v[j]
        energy += 0.5 * v[i] * total
        if i - start < free.base[t]:
            out[i - start] = total
    to_fixed_axes(m, free, w, q, t, out, 1.0)
    return energy


@kernel
def to_fixed_axes(m, free, w, q, t, p, way):
    """Turn the momentum p of a root into fixed axes and about the origin (way 1), or back to the
    root (way −1)."""
    b = free.root[t]
    if free.base[t] == 0:
        return
    if m.kind[b] == PLANAR:
        i = m.q_start[b]
        p[2] += way * (q[i] * p[1] - q[i + 1] * p[0])
    elif m.kind[b] == SPHERICAL:
        l = three(p, 0)
        put(p, 0, transform(w.rotation, b, l) if way > 0.0 else transform_back(w.rotation, b, l))
    else:
        place = load(w.position, b)
        linear = three(p, 0)
        angular = three(p, 3)
        if way > 0.0:
            linear = transform(w.rotation, b, linear)
            angular = transform(w.rotation, b, angular)
            angular = add(angular, cross(place, linear))
        else:
            angular = transform_back(w.rotation, b, subtract(angular, cross(place, linear)))
            linear = transform_back(w.rotation, b, linear)
        put(p, 0, linear)
        put(p, 3, angular)


@kernel
def linear_momentum(m, free, w, t, p):
    """Return the linear momentum [N s], in world axes, of a root's momentum in fixed axes; zero if
    it cannot move."""
    if free.base[t] == 0 or m.kind[free.root[t]] == SPHERICAL:
        return ZERO
    if m.kind[free.root[t]] == PLANAR:
        k = m.v_start[free.root[t]]
        return add(scale(p[0], load(w.axis, k)), scale(p[1], load(w.axis, k + 1)))
    return three(p, 0)


@kernel
def center_of(m, w, tree_of_body, t):
    """Return the centre of mass of tree t [m] and its mass [kg]."""
    mass = 0.0
    moment = ZERO
    for b in range(m.bodies):
        if tree_of_body[b] == t:
            mass += m.mass[b]
            moment = add(moment, scale(m.mass[b], load(w.center, b)))
    return scale(1.0 / mass if mass > 0.0 else 0.0, moment), mass


@kernel
def shift_root(m, free, w, tree_of_body, q, t, shift):
    """Move tree t by a vector [m] in world axes: the root's coordinates and the placements in the
    workspace."""
    root = free.root[t]
    i = m.q_start[root]
    if m.kind[root] == PLANAR:
        k = m.v_start[root]
        local = (dot(load(w.axis, k), shift), dot(load(w.axis, k + 1), shift), 0.0)
    else:
        local = turn_vector(q, i + 3, transform_back(w.rotation, root, shift))
    q[i], q[i + 1] = q[i] + local[0], q[i + 1] + local[1]
    if m.kind[root] != PLANAR:
        q[i + 2] += local[2]
    for b in range(m.bodies):
        if tree_of_body[b] == t:
            accumulate(w.position, b, shift)
            accumulate(w.center, b, shift)


@kernel
def keep_momentum_and_energy(mass, lower, start, stop, base, p, energy, v, scratch):
    """Give the root the velocity of its momentum p and scale the other rates so that the kinetic
    energy is `energy`.

    With the root's momentum fixed, KE = ½ pᵀ M_bb⁻¹ p + ½ v_jᵀ S v_j: the second part is scaled.
    scratch : (d,)
    """
    block = lower[start : start + base, start : start + base]
    solve_mass(block, p[:base], scratch[:base])
    carried = 0.0
    for i in range(base):
        carried += 0.5 * p[i] * scratch[i]
    solve_root(mass, block, start, stop, base, p, v)
    own = -carried
    for i in range(start, stop):
        for j in range(start, stop):
            own += 0.5 * v[i] * mass[i, j] * v[j]
    if not own > 1e-12 * (carried + abs(energy)):
        return
    factor = min(STRETCH, sqrt(max(0.0, energy - carried) / own))
    multiply_by(v[start + base : stop], factor)
    solve_root(mass, block, start, stop, base, p, v)


@kernel
def solve_root(mass, block, start, stop, base, p, v):
    """Solve M_bb v_b = p − M_bj v_j for the root's velocities."""
    for i in range(base):
        total = p[i]
        for j in range(start + base, stop):
            total -= mass[start + i, j] * v[j]
        v[start + i] = total
    solve_mass(block, v[start : start + base], v[start : start + base])
