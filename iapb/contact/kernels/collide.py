"""Collisions of one step, island by island (paper section V)."""

from __future__ import annotations

import numpy as np

from iapb.contact.kernels.contact_set import (
    LEFT,
    STRIKES,
    add_supports,
    find_islands,
    group_of_contact,
)
from iapb.contact.kernels.impact import factored_impact, rank_tolerance, whiten_impact
from iapb.contact.kernels.impact_friction import add_impact_friction, sweep_impact
from iapb.contact.kernels.joint_stops import is_stop
from iapb.contact.kernels.passive import passive_step, write_step
from iapb.contact.kernels.row_basis import minimum_norm_impulses, orthonormal_basis
from iapb.contact.kernels.rows import (
    contact_velocities,
    friction_of,
    restitution_of,
    tangent_of,
    write_row,
)
from iapb.contact.kernels.shape_frames import copy_geometry
from iapb.contact.kernels.unilateral import poisson_impact
from iapb.numerics.compiled import copy_into, kernel
from iapb.numerics.linalg import equal, load, norm_of, write_difference
from iapb.run import COLLIDING

# share of |u|, and of the largest impulse, above which a contact opens or pulls: far above rounding
OPENS = 1e-9


@kernel
def gather_group(world, state, island):
    """List the coordinates of an island, a contact group (2)-(3) or a part of one; copy v, M and L;
    return its size.

    M is block diagonal, so its factor is too.
    """
    size = 0
    dofs = state.dofs
    work = state.work
    for t in range(world.trees):
        if state.island_of_tree[t] == island:
            for k in range(world.tree_start[t], world.tree_stop[t]):
                dofs[size] = k
                size += 1
    for i in range(size):
        work.v[i] = state.v[dofs[i]]
        for j in range(size):
            work.mass[i, j] = state.mass_matrix[dofs[i], dofs[j]]
            work.lower[i, j] = state.lower[dofs[i], dofs[j]]
    return size


@kernel
def gather_rows(world, state, island, size):
    """Write the rows of J_c, return how many: (11) against the world; (12), or both of (13)-(14),
    for two bodies."""
    contacts = state.contacts
    count = 0
    for i in range(state.contact_count[0]):
        if (
            not contacts.collides[i]
            or state.island_of_tree[world.tree_of_body[contacts.body_a[i]]] != island
        ):
            continue
        both = world.per_body_rows and contacts.body_b[i] >= 0 and not is_stop(contacts, i)
        for side in range(2 if both else 1):
            if both:
                write_row(world, state, i, load(contacts.normal, i), 1.0 - side, 1.0 * side)
            else:
                write_row(world, state, i, load(contacts.normal, i), 1.0, -1.0)
            for k in range(size):
                state.work.columns[k, count] = state.row[state.dofs[k]]
            state.rows[count] = i
            count += 1
    return count


@kernel
def largest_share(impulse, dofs, size, dt, force_limit):
    """Return the largest share in [0, 1] with |share · p_i / Δt| <= the limit of each dof, in
    floating point too.

    impulse (size,) [N s, N m s] of a group; dofs (size,) its coordinates; force_limit (d,) [N, N
    m], inf = none
    """
    share = 1.0
    for i in range(size):
        force = abs(impulse[i]) / dt
        limit = force_limit[dofs[i]]
        if share * force > limit:
            share = limit / force
    for i in range(size):
        # the division rounded up: one step back
        while share * abs(impulse[i]) / dt > force_limit[dofs[i]]:
            share = np.nextafter(share, 0.0)
    return share


@kernel
def apply_group(state, size, share):
    """Write the group's new velocity and impulse back; return the kinetic energy it lost [J] and
    the share applied.

    The applied share is `share` unless rounding of the velocity would gain energy
    (`iapb.contact.kernels.passive`). With Δv = v⁺ − v⁻ and M Δv = Jᵀp the loss is −(v⁻ + Δv/2)·Jᵀp.
    """
    work = state.work
    v = work.v[:size]
    change = work.v_change[:size]
    after = work.shifted[:size]
    write_difference(change, work.v_plus, v)
    write_step(v, change, share, after)
    # else it is the velocity that the resolver has accepted
    if share != 1.0 or not equal(after, work.v_plus):
        share = passive_step(work.mass, v, change, share, after)
    lost = 0.0
    for i in range(size):
        k = state.dofs[i]
        impulse = share * work.momentum[i]
        lost -= (v[i] + 0.5 * (share * change[i])) * impulse
        state.v[k] = after[i]
        state.impulse[k] = impulse if state.impulse[k] == 0.0 else state.impulse[k] + impulse
    return lost, share


@kernel
def resolve_unequal(state, size, count, smallest, tolerance):
    """Apply Poisson's law to rows of unequal e; if it fails, the scalar rule with the smallest e,
    which is passive."""
    work = state.work
    rank, clamp = poisson_impact(
        size,
        count,
        state.row_restitution,
        tolerance,
        True,
        work,
        state.push_work,
        state.share_work,
        state.row_impulse,
    )
    solved = rank >= 0
    if not solved:
        rank, clamp = factored_impact(size, count, smallest, tolerance, size, True, work)
    return rank, clamp, solved


@kernel
def add_friction_to_impact(world, state, size, count, rank, only_push):
    """Add friction to the normal impact; return (share kept, clamp, whether Coulomb's law is
    met)."""
    gather_tangents(world, state, size, count)
    return add_impact_friction(
        size,
        count,
        rank,
        state.work,
        state.push_work,
        state.friction_work,
        only_push,
        state.row_impulse,
    )


@kernel
def gather_tangents(world, state, size, count):
    """Write μ of each contact and the tangents' rows of J."""
    contacts = state.contacts
    f = state.friction_work
    tangents = len(f.velocity)
    for r in range(count):
        i = state.rows[r]
        f.coefficient[r] = friction_of(world, contacts, i)
        for a in range(tangents):
            tangent = tangent_of(load(contacts.normal, i), a, tangents)
            write_row(world, state, i, tangent, 1.0, -1.0)
            for k in range(size):
                f.rows[r * tangents + a, k] = state.row[state.dofs[k]]


@kernel
def keep_together(state, size, count):
    """Put the rows first that push, or that meet −e γ⁻ after Poisson's law; return how many. The
    others open.

    Writes the least velocity of each along unit rows: −e γ⁻ or zero where it opens, else that after
    Poisson's law.
    """
    work = state.work
    least = state.friction_work.least
    kept = 0
    opens = OPENS * norm_of(work.u[:size])
    for r in range(count):
        before = after = 0.0
        for k in range(size):
            before += work.rows[k, r] * work.u[k]
            after += work.rows[k, r] * (work.u[k] + work.change[k])
        due = -state.row_restitution[r] * before
        least[r] = min(after, max(due, 0.0))
        if state.row_impulse[r] > 0.0 or after - due <= opens:
            for k in range(size):
                work.rows[k, kept], work.rows[k, r] = work.rows[k, r], work.rows[k, kept]
            for each in (work.length, state.row_restitution, state.row_impulse, least):
                each[kept], each[r] = each[r], each[kept]
            state.rows[kept], state.rows[r] = state.rows[r], state.rows[kept]
            kept += 1
    for k in range(size):
        for r in range(kept):
            work.columns[k, r] = work.rows[k, r]
    return kept


@kernel
def push_with_friction(world, state, size, count, smallest, tolerance):
    """Resolve contacts that only push, with friction; return (rank, clamp, share of friction,
    solved).

    Friction acts where contacts stay together. Where it would make one of them pull, sweeps over
    all contacts decide which open: a tall box that lands flat and slides tips over its leading
    edge, a disc climbs the wall it rolls into.
    """
    work = state.work
    f = state.friction_work
    together = count
    rank, clamp, solved = resolve_unequal(state, size, count, smallest, tolerance)
    if solved:
        together = keep_together(state, size, count)
        rank = orthonormal_basis(size, together, tolerance, size, work)
    share, factor, met = add_friction_to_impact(world, state, size, together, rank, solved)
    state.row_impulse[together:count] = 0.0
    if solved and not met:
        f.p[together * len(f.velocity) : count * len(f.velocity)] = 0.0
        gather_tangents(world, state, size, count)
        swept, met = sweep_impact(size, count, work, f, state.row_impulse)
        if met:
            factor = swept
            share = 1.0
    return rank, clamp * factor, share, solved and met


@kernel
def resolve_rows(world, state, size, count):
    """Resolve by (20)-(21) or by the scene's extensions of them; return (rank, clamp, share of
    friction, solved)."""
    work = state.work
    e = restitution_of(world, state.contacts, state.rows[0])
    largest = e
    solved = True
    friction_share = 1.0
    tolerance = rank_tolerance(work.lower[:size, :size])
    pushing = world.switches.pushing or world.switches.implicit_contact and count > 1
    if pushing or world.switches.unequal_restitution:
        for r in range(count):
            own = restitution_of(world, state.contacts, state.rows[r])
            state.row_restitution[r] = own
            e = min(e, own)
            largest = max(largest, own)
    unequal = pushing or e < largest
    whiten_impact(size, count, unequal or world.switches.impact_friction, work)
    if (
        unequal
        and world.switches.implicit_contact
        and world.switches.impact_friction
        and not world.per_body_rows
    ):
        return push_with_friction(world, state, size, count, e, tolerance)
    if unequal:
        rank, clamp, solved = resolve_unequal(state, size, count, e, tolerance)
    else:
        rank, clamp = factored_impact(size, count, e, tolerance, size, True, work)
    if world.switches.impact_friction:
        span = rank
        if unequal and solved:  # Poisson's law needs no basis of the rows, friction does
            span = orthonormal_basis(size, count, tolerance, size, work)
        friction_share, factor, met = add_friction_to_impact(world, state, size, count, span, False)
        clamp = clamp * factor
        solved = solved and met
    elif not (unequal and solved):
        minimum_norm_impulses(
            size, count, rank, work.length, work.change[:size], state.row_impulse, work
        )
    return rank, clamp, friction_share, solved


@kernel
def resolve_island(world, state, island):
    """Resolve one simultaneous impact; scale it to the device if the scene has limits; log it."""
    size = gather_group(world, state, island)
    work = state.work
    log = state.impacts
    count = gather_rows(world, state, island, size)
    rank, clamp, friction_share, solved = resolve_rows(world, state, size, count)
    share = 1.0
    line = log.logged[0]
    approaching = 0
    if world.switches.impulse_limit:
        share = largest_share(work.momentum, state.dofs, size, world.dt, world.impulse_limit)
    if world.switches.spreading:
        for t in range(world.trees):
            if state.island_of_tree[t] == island:
                state.spreading[t] = share < 1.0
    lost, applied = apply_group(state, size, share)
    if applied < share:
        clamp *= applied / share
    for r in range(count):
        # of two per-body rows the first is the one on body a
        if r == 0 or state.rows[r] != state.rows[r - 1]:
            i = state.rows[r]
            impulse = applied * state.row_impulse[r]
            before = state.contact_impulse[i]
            state.contact_impulse[i] = impulse if before == 0.0 else before + impulse
            if impulse != 0.0:
                state.contacts.moved[i] = False
        gamma = 0.0
        for k in range(size):
            gamma += work.rows[k, r] * (work.u[k] + applied * work.change[k])
        approaching += work.length[r] * gamma < -world.approach_velocity
    log.group[line] = island
    log.rows[line] = count
    log.rank[line] = rank
    log.scale[line] = share
    log.clamp[line] = clamp
    log.energy_lost[line] = lost
    log.friction_share[line] = friction_share
    log.solved[line] = solved and clamp > 0.0
    log.approaching[line] = approaching
    log.time[line] = state.cut.elapsed[0]
    copy_into(log.q[line], state.q)
    copy_into(log.v_minus[line], state.v)
    copy_into(log.v_plus[line], state.v)
    log.impulse[line] = 0.0
    for i in range(size):
        log.v_minus[line, state.dofs[i]] = work.v[i]
        log.impulse[line, state.dofs[i]] = applied * work.momentum[i]
    log.logged[0] = line + 1


@kernel
def resolve_collisions(world, state):
    """Give every colliding group its impulse, island by island; velocities change, configurations
    do not.

    With implicit contact, contacts that carry a load only push (Poisson's law). What approaches
    because of an impact collides in its turn, as the balls of a cradle that touch.
    """
    add_supports(world, state)
    collide = find_islands(world, state)
    while collide:
        for t in range(world.trees):
            if state.collides_of_tree[t]:
                resolve_island(world, state, t)
        collide = strike_again(world, state)


@kernel
def contacts_moving_now(world, state):
    """Return copies of the contacts of the step, with their present velocities."""
    now = state.scratch_contacts
    count = state.contact_count[0]
    for i in range(count):
        copy_geometry(now, i, state.contacts, i)
    contact_velocities(world, state, now, count)
    return now


@kernel
def strike_again(world, state):
    """Find the contacts of colliding groups that impacts have made approach; return False if there
    are none.

    The impacts of a step are at most as many as its log has lines. What is left strikes in the next
    step.
    """
    contacts = state.contacts
    count = state.contact_count[0]
    some = False
    if not world.switches.implicit_contact or world.switches.impulse_limit:
        return False
    now = contacts_moving_now(world, state)
    for i in range(count):
        group = group_of_contact(world, contacts, i, state.group_of_tree)
        e = restitution_of(world, contacts, i)
        if (
            state.state_of_tree[group] == COLLIDING
            and not contacts.idle[i]
            and e > 0.0
            and now.normal_velocity[i] < -world.approach_velocity
        ):
            contacts.mark[i] = STRIKES
            contacts.collides[i] = True
            some = True
        elif contacts.mark[i] == STRIKES and not contacts.idle[i]:
            contacts.mark[i] = 0
            contacts.collides[i] = False
    if not some:
        return False
    find_islands(world, state)
    islands = 0
    for t in range(world.trees):
        islands += state.collides_of_tree[t]
    if state.impacts.logged[0] + islands <= len(state.impacts.group):
        return True
    for i in range(count):
        if contacts.mark[i] == STRIKES and not contacts.idle[i]:
            contacts.mark[i] = LEFT
    return False
