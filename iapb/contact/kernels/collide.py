"""Collisions of one step, group by group: paper section V on the state of a world."""

from __future__ import annotations

from iapb.compiled import kernel
from iapb.contact.kernels.device_limit import largest_share
from iapb.contact.kernels.impact import factored_impact, rank_tolerance
from iapb.contact.kernels.minimum_norm import minimum_norm_impulses
from iapb.contact.kernels.rows import body_row, contact_row
from iapb.run import COLLIDING


@kernel
def gather_dofs(world, state, group):
    """List the coordinates of a contact group (2)-(3); return how many."""
    size = 0
    for t in range(world.tree_start.shape[0]):
        if state.group_of_tree[t] == group:
            for k in range(world.tree_start[t], world.tree_stop[t]):
                state.dofs[size] = k
                size += 1
    return size


@kernel
def gather_group(world, state, size):
    """Copy the group's blocks of M, L and v: M is block diagonal, so its factor is too."""
    for i in range(size):
        state.group_v[i] = state.v[state.dofs[i]]
        for j in range(size):
            state.group_mass[i, j] = state.mass_matrix[state.dofs[i], state.dofs[j]]
            state.group_lower[i, j] = state.lower[state.dofs[i], state.dofs[j]]


@kernel
def _store_row(state, size, contact, count):
    for k in range(size):
        state.work.columns[k, count] = state.row[state.dofs[k]]
    state.rows[count] = contact


@kernel
def gather_rows(world, state, group, size):
    """Rows of J_c: (11) against the static world; (12), or the two of (13)-(14), at a self-collision."""
    contacts = state.contacts
    count = 0
    for i in range(state.contact_count[0]):
        if not contacts.collides[i] or state.group_of_tree[world.tree_of_body[contacts.body_a[i]]] != group:
            continue
        if world.per_body_rows and contacts.body_b[i] >= 0:
            for body in (contacts.body_a[i], contacts.body_b[i]):
                body_row(world.mechanism, state.body, body, contacts.point[i], contacts.normal[i], state.row)
                _store_row(state, size, i, count)
                count += 1
        else:
            contact_row(world.mechanism, state.body, contacts, i, state.row)
            _store_row(state, size, i, count)
            count += 1
    return count


@kernel
def apply_group(world, state, size, share):
    """Write the group's new velocity and impulse back; return the kinetic energy it lost [J].

    With Δv = v⁺ − v⁻ and M Δv = Jᵀp the loss is −(v⁻ + Δv/2)·Jᵀp.
    """
    lost = 0.0
    for i in range(size):
        k = state.dofs[i]
        change = share * (state.group_v_plus[i] - state.group_v[i])
        impulse = share * state.group_impulse[i]
        lost -= (state.group_v[i] + 0.5 * change) * impulse
        state.v[k] = state.group_v[i] + change
        state.impulse[k] = impulse
    return lost


@kernel
def log_impact(state, group, rows, rank, share, clamp, lost, size):
    """Append one line to the step's impacts."""
    log = state.impacts
    n = log.logged[0]
    log.group[n], log.rows[n], log.rank[n] = group, rows, rank
    log.scale[n], log.clamp[n], log.energy_lost[n] = share, clamp, lost
    for k in range(state.v.shape[0]):
        log.v_minus[n, k] = state.v[k]
        log.v_plus[n, k] = state.v[k]
        log.impulse[n, k] = 0.0
    for i in range(size):
        k = state.dofs[i]
        log.v_minus[n, k] = state.group_v[i]
        log.impulse[n, k] = state.impulse[k]
    log.logged[0] = n + 1


@kernel
def resolve_group(world, state, group):
    """Equations (20)-(21) for one colliding group, scaled to the device where the scene has limits."""
    size = gather_dofs(world, state, group)
    gather_group(world, state, size)
    count = gather_rows(world, state, group, size)
    mass, lower = state.group_mass[:size, :size], state.group_lower[:size, :size]
    v, v_plus, impulse = state.group_v[:size], state.group_v_plus[:size], state.group_impulse[:size]
    work = state.work
    rank, clamp = factored_impact(mass, lower, v, world.restitution, count, rank_tolerance(lower), size, True,
                                  work, v_plus, impulse)
    share = 1.0
    if world.switches.impulse_limit:
        share = largest_share(state.group_impulse, state.dofs, size, world.dt, world.impulse_limit)
    if world.switches.spreading:
        for t in range(world.tree_start.shape[0]):
            if state.group_of_tree[t] == group:
                state.spreading[t] = share < 1.0
    lost = apply_group(world, state, size, share)
    minimum_norm_impulses(work.rows, work.length, count, work.basis, rank, work.change[:size], state.row_impulse,
                          work.columns, state.triangle, state.target)
    for r in range(count):
        if r == 0 or state.rows[r] != state.rows[r - 1]:  # of two per-body rows the first is the one on body a
            state.contact_impulse[state.rows[r]] = share * state.row_impulse[r]
    log_impact(state, group, count, rank, share, clamp, lost, size)


@kernel
def resolve_collisions(world, state):
    """Give every colliding group its impulse; velocities change, configurations do not."""
    for t in range(world.tree_start.shape[0]):
        if state.group_of_tree[t] == t and state.state_of_tree[t] == COLLIDING:
            resolve_group(world, state, t)
