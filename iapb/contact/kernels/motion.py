"""The motion of one step, or of a part of it: forces at its start give the new velocity, and the
bodies move with it.

The scene's `integrator` says how:

- ``momentum``, the default, moves the bodies freely (`iapb.mechanics.kernels.free_motion`): linear
  and angular momentum are kept to rounding in the world's axes. Trees without contact get half of
  gravity before and half after they move, so they move with order 2 under gravity, and a free rigid
  body with order 4. With contact, or under forces of a hand or device, the order is 1.
- ``semi_implicit_euler``, the paper's, has order 1: Coriolis terms are forces at the start of the
  step.

On quaternions and other groups q moves by integrate(q, v, h), never by addition.
"""

from __future__ import annotations

from iapb.contact.kernels.contact_set import group_of_contact
from iapb.contact.kernels.implicit import is_dry, rest_implicitly
from iapb.contact.kernels.resting import resting_force
from iapb.mechanics.joints import SPHERICAL
from iapb.mechanics.kernels.configuration import integrate, integrate_body
from iapb.mechanics.kernels.dynamics import bias, gravity, mass_matrix
from iapb.mechanics.kernels.free_motion import (
    LINKAGE,
    base_momentum,
    center_of,
    keep_momentum_and_energy,
    linear_momentum,
    move_simple_trees,
    parts_of_linkages,
    shift_root,
    to_fixed_axes,
)
from iapb.mechanics.kernels.kinematics import forward_kinematics
from iapb.numerics.compiled import copy_into, kernel
from iapb.numerics.linalg import (
    ZERO,
    add,
    add_multiple,
    cholesky,
    cholesky_tree_blocks,
    equal,
    scale,
    solve_mass,
    store,
    subtract,
)
from iapb.run import COLLIDING

# Above this speed [m/s, rad/s] products of masses, stiffnesses, displacements and speeds may
# overflow: the motion has diverged. (Scenes hold numbers up to 1e9.)
LARGEST_SPEED = 1e100

OK, NOT_POSITIVE_DEFINITE, TOO_MANY_CONTACTS, NOT_FINITE = range(4)
STATUS_TEXT = {
    NOT_POSITIVE_DEFINITE: "the mass matrix is not positive definite in this configuration",
    TOO_MANY_CONTACTS: "more contacts at once than the scene's shapes can give: a fault of the "
    "engine",
    NOT_FINITE: "the motion left the range of numbers: the step is too long for this stiffness "
    "and mass",
}


@kernel
def place_bodies(world, state):
    """Place all bodies at q."""
    forward_kinematics(world.mechanism, state.q, state.body)


@kernel
def locate(world, state):
    """Place all bodies at q; update M and its factor if they depend on q. Return False if M is not
    definite."""
    place_bodies(world, state)
    stale = world.switches.varying_inertia
    if world.conserving and stale:
        stale = not equal(state.q, state.located_q)
        copy_into(state.located_q, state.q)
    if not stale:
        return True
    mass_matrix(world.mechanism, state.body, state.mass_matrix)
    return (
        cholesky_tree_blocks(state.mass_matrix, world.tree_start, world.tree_stop, state.lower) == 0
    )


@kernel
def divide_by_mass(world, state, vector):
    """Do vector <- M⁻¹ vector, tree by tree, for M is block diagonal: linear in their number."""
    for t in range(world.trees):
        i = world.tree_start[t]
        j = world.tree_stop[t]
        solve_mass(state.lower[i:j, i:j], vector[i:j], vector[i:j])


@kernel
def move(world, state, applied):
    """Integrate (7) over h, a step or a part of it: forces, new velocity, new configuration."""
    copy_into(state.start_v, state.v)
    accelerate(world, state, applied)
    add_multiple(state.v, state.h[0], state.acceleration)
    touches = world.switches.contacts and world.switches.implicit_contact
    implicit = touches or world.switches.joint_damping or world.switches.joint_friction
    if implicit and not implicit_forces(world, state, touches):
        return NOT_POSITIVE_DEFINITE
    finite = True
    for k in range(len(state.v)):
        finite = finite and abs(state.v[k]) < LARGEST_SPEED  # False for NaN too
    if not finite:
        return NOT_FINITE
    if world.conserving:
        return OK if drift(world, state, applied) else NOT_POSITIVE_DEFINITE
    integrate(world.mechanism, state.q, state.v, state.h[0], state.q)
    return OK


@kernel
def implicit_forces(world, state, touches):
    """Apply joint damping, joint friction and contact, from the state at the start of the step.
    Return False if M is not definite."""
    damped = world.switches.joint_damping
    if damped and not damp_joints(world, state):
        return False
    if touches or world.switches.joint_friction:
        rest_implicitly(world, state, touches, touches and world.switches.friction)
        for k in range(len(state.v) if damped else 0):
            state.acceleration[k] = -world.joint_damping[k] * state.v[k]
    if damped:
        add_multiple(state.friction_force, 1.0, state.acceleration)
    return True


@kernel
def drift(world, state, applied):
    """Move all trees freely for h, then apply the second half of gravity to falling trees. False:
    M not definite."""
    m = world.mechanism
    free = world.free
    h = state.h[0]
    if not (free.turning and world.switches.velocity_terms):
        integrate(m, state.q, state.v, h, state.q)
    else:
        parts = 0
        if free.linked:
            parts = parts_of_linkages(m, free, world.tree_start, world.tree_stop, state.v, h)
            coriolis(world, state)
        move_simple_trees(m, free, world.tree_of_body, state.q, state.v, h)
        for part in range(parts):
            if part > 0:
                coriolis(world, state)
            if not swing(world, state, h / parts):
                return False
    if world.switches.gravity:
        pull_falling_trees(world, state, applied)
    return True


@kernel
def coriolis(world, state):
    """acceleration <- −M⁻¹ B at the present state."""
    bias(world.mechanism, state.body, state.v, state.bias)
    for k in range(len(state.v)):
        state.acceleration[k] = -state.bias[k]
    divide_by_mass(world, state, state.acceleration)


@kernel
def swing(world, state, h):
    """Move the linkages by h [s]: velocity Verlet, then the root's momentum and the energy are
    those before."""
    m = world.mechanism
    free = world.free
    a = state.acceleration
    for t in range(len(free.kind)):
        if free.kind[t] == LINKAGE:
            note_momentum(world, state, t, h)
    for b in range(m.bodies):
        if free.kind[world.tree_of_body[b]] == LINKAGE:
            start = m.v_start[b]
            stop = start + m.v_count[b]
            add_multiple(state.v[start:stop], 0.5 * h, a[start:stop])
            integrate_body(m, b, state.q, state.v, h, state.q)
            add_multiple(state.v[start:stop], 0.5 * h, a[start:stop])
    if not locate(world, state):
        return False
    for t in range(len(free.kind)):
        if moves_freely(world, t):
            p = state.root_momentum[t]
            center, _ = center_of(m, state.body, world.tree_of_body, t)
            missed = subtract((p[6], p[7], p[8]), center)
            shift_root(m, free, state.body, world.tree_of_body, state.q, t, missed)
    copy_into(state.located_q, state.q)
    copy_into(state.body.placed_q[: len(state.q)], state.q)
    copy_into(state.acceleration_before, a)
    coriolis(world, state)
    for t in range(len(free.kind)):
        if free.kind[t] == LINKAGE:
            end_swing(world, state, t, h)
    return True


@kernel
def moves_freely(world, t):
    """Return whether the root of linkage t moves without a hold, so that its centre of mass moves
    straight."""
    free = world.free
    return free.base[t] > 0 and world.mechanism.kind[free.root[t]] != SPHERICAL


@kernel
def note_momentum(world, state, t, h):
    """Note the root's momentum and the energy of linkage t, and where its centre of mass will be
    after h seconds."""
    m = world.mechanism
    free = world.free
    start = world.tree_start[t]
    stop = world.tree_stop[t]
    p = state.root_momentum[t]
    state.tree_energy[t] = base_momentum(
        m, free, state.body, state.q, state.mass_matrix, start, stop, t, state.v, p
    )
    if moves_freely(world, t):
        center, mass = center_of(m, state.body, world.tree_of_body, t)
        momentum = linear_momentum(m, free, state.body, t, p)
        path = scale(h / mass if mass > 0.0 else 0.0, momentum)
        p[6], p[7], p[8] = add(center, path)


@kernel
def end_swing(world, state, t, h):
    """Do the second half of the velocity's step of linkage t; keep momentum and energy."""
    free = world.free
    start = world.tree_start[t]
    stop = world.tree_stop[t]
    for k in range(start, stop):
        state.v[k] += 0.5 * h * (state.acceleration[k] - state.acceleration_before[k])
    p = state.root_momentum[t]
    to_fixed_axes(world.mechanism, free, state.body, state.q, t, p, -1.0)
    keep_momentum_and_energy(
        state.mass_matrix,
        state.lower,
        start,
        stop,
        free.base[t],
        p,
        state.tree_energy[t],
        state.v,
        state.bias,
    )


@kernel
def falls(world, state, applied, t):
    """Return whether tree t is free of contact forces and joint friction and, with implicit contact, of
    the hand and the coupling.

    Only where gravity acts alone is it split in halves: a force that holds a weight would move it
    by half a step.
    """
    alone = not state.rests[t]
    for k in range(
        world.tree_start[t], world.tree_stop[t] if world.switches.implicit_contact else 0
    ):
        alone = alone and applied[k] == 0.0
    return alone and not (world.switches.joint_friction and is_dry(world, t))


@kernel
def pull_falling_trees(world, state, applied):
    """Add half a step of gravity to the velocity of falling trees; the other half acted before they
    moved."""
    some = False
    for t in range(world.trees):
        some = some or falls(world, state, applied, t)
    if not some:
        return
    place_bodies(world, state)
    gravity(world.mechanism, state.body, world.gravity, state.bias)
    divide_by_mass(world, state, state.bias)
    add_to_falling_trees(world, state, applied, state.v, -0.5 * state.h[0])


@kernel
def add_to_falling_trees(world, state, applied, vector, factor):
    """Do vector += factor · `bias` for the falling trees."""
    for t in range(world.trees):
        if falls(world, state, applied, t):
            start = world.tree_start[t]
            stop = world.tree_stop[t]
            add_multiple(vector[start:stop], factor, state.bias[start:stop])


@kernel
def damp_joints(world, state):
    """Solve (M + h D) v⁺ = M v for damped trees, D diagonal; −D v⁺ into `acceleration`. False: not
    definite.

    v⁺ minimizes ½|v⁺ − v|²_M + ½ h v⁺ᵀ D v⁺, so that ½|v⁺|²_M ≤ ½|v|²_M for every D ≥ 0 and every
    h: the step is passive, and the loss is h v⁺ᵀ D v⁺ + ½|v⁺ − v|²_M.
    """
    a = state.acceleration
    mass = state.work.mass
    lower = state.work.lower
    for t in range(world.trees):
        start = world.tree_start[t]
        stop = world.tree_stop[t]
        damped = False
        for k in range(start, stop):
            a[k] = 0.0
            damped = damped or world.joint_damping[k] > 0.0
        if not damped:
            continue
        for i in range(start, stop):
            for j in range(start, stop):
                mass[i, j] = state.mass_matrix[i, j]
                a[i] += state.mass_matrix[i, j] * state.v[j]
            mass[i, i] += state.h[0] * world.joint_damping[i]
        if cholesky(mass[start:stop, start:stop], lower[start:stop, start:stop]) != 0:
            return False
        solve_mass(lower[start:stop, start:stop], a[start:stop], a[start:stop])
        for k in range(start, stop):
            state.v[k] = a[k]
            a[k] *= -world.joint_damping[k]
    return True


@kernel
def accelerate(world, state, applied):
    """Solve (7), M a = applied + penalty + friction − B − G.

    The forces (4)-(6) act at the contacts of groups that do not collide; in a collision the impulse
    acts.
    """
    a = state.acceleration
    contacts = state.contacts
    if not world.switches.implicit_contact:
        for i in range(state.contact_count[0]):
            contacts.normal_force[i] = 0.0
            store(contacts.friction_force, i, ZERO)
            if (
                state.state_of_tree[group_of_contact(world, contacts, i, state.group_of_tree)]
                != COLLIDING
            ):
                resting_force(world, state, contacts, i)
    for k in range(len(a)):
        a[k] = applied[k] + state.penalty_force[k] + state.friction_force[k]
    if world.switches.gravity:
        gravity(world.mechanism, state.body, world.gravity, state.bias)
        add_multiple(a, -1.0, state.bias)
        if world.conserving:
            add_to_falling_trees(world, state, applied, a, 0.5)
    if world.switches.velocity_terms and not world.conserving:
        bias(world.mechanism, state.body, state.v, state.bias)
        add_multiple(a, -1.0, state.bias)
    divide_by_mass(world, state, a)
