"""Collisions of one step, island by island: paper section V on the state of a world."""

from __future__ import annotations

from iapb.compiled import kernel
from iapb.contact.kernels.device_limit import largest_share
from iapb.contact.kernels.gather import (
    gather_dofs,
    gather_group,
    gather_restitution,
    gather_rows,
    gather_tangents,
)
from iapb.contact.kernels.impact import factored_impact, project_impact, rank_tolerance
from iapb.contact.kernels.impact_friction import add_impact_friction
from iapb.contact.kernels.impact_unequal import poisson_impact
from iapb.contact.kernels.islands import find_islands
from iapb.contact.kernels.minimum_norm import minimum_norm_impulses
from iapb.contact.kernels.projector import orthonormal_basis


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
def count_approaching(world, work, size, count, share):
    """Rows of the impact that approach still after it: what a clamp, a scale or a lost rank leaves."""
    approaching = 0
    for i in range(count):
        gamma = 0.0
        for k in range(size):
            gamma += work.rows[k, i] * (work.u[k] + share * work.change[k])
        approaching += work.length[i] * gamma < -world.approach_velocity
    return approaching


@kernel
def log_impact(state, island, rows, rank, share, clamp, friction_share, solved, approaching, lost, size):
    """Append one line to the step's impacts."""
    log = state.impacts
    n = log.logged[0]
    log.group[n], log.rows[n], log.rank[n] = island, rows, rank
    log.scale[n], log.clamp[n], log.energy_lost[n] = share, clamp, lost
    log.friction_share[n], log.solved[n], log.approaching[n] = friction_share, solved, approaching
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
def resolve_unequal(world, state, size, count, smallest):
    """Poisson's law for rows that differ in e; where it fails the scalar rule with the smallest e, passive for all."""
    mass, lower, v = state.group_mass[:size, :size], state.group_lower[:size, :size], state.group_v[:size]
    v_plus, impulse, work = state.group_v_plus[:size], state.group_impulse[:size], state.work
    rank, clamp = poisson_impact(mass, lower, v, state.row_restitution, count, True, work, state.push_work,
                                 state.row_impulse, v_plus, impulse)
    if rank >= 0:
        return rank, clamp, True
    rank, clamp = project_impact(mass, lower, v, smallest, count, rank_tolerance(lower), size, True, work, v_plus,
                                 impulse)
    return rank, clamp, False


@kernel
def add_friction_to_impact(world, state, size, count, rank):
    """Friction on top of the normal impact; return (share kept, clamp, whether Coulomb's law is met)."""
    gather_tangents(world, state, size, count)
    state.friction_work.coefficient[:count] = world.friction
    return add_impact_friction(
        state.group_mass[:size, :size], state.group_lower[:size, :size], state.group_v[:size], count, rank,
        state.work, state.push_work, state.friction_work, state.row_impulse, state.group_v_plus[:size],
        state.group_impulse[:size])


@kernel
def resolve_rows(world, state, size, count):
    """(20)-(21), or what the scene and the law ask for beyond; return (rank, clamp, share of friction, solved)."""
    mass, lower, v = state.group_mass[:size, :size], state.group_lower[:size, :size], state.group_v[:size]
    work, e, unequal, solved, friction_share = state.work, world.restitution, False, True, 1.0
    if world.switches.unequal_restitution:
        e, unequal = gather_restitution(world, state, count)
    if unequal:
        rank, clamp, solved = resolve_unequal(world, state, size, count, e)
    else:
        budget = min(size, state.row_budget[0])
        rank, clamp = factored_impact(mass, lower, v, e, count, rank_tolerance(lower), budget, True, work,
                                      state.group_v_plus[:size], state.group_impulse[:size])
    if world.switches.impact_friction:
        span = rank
        if unequal and solved:  # Poisson's law needs no basis of the rows, friction does
            span = orthonormal_basis(work.columns[:size], count, work.u[:size], rank_tolerance(lower), size,
                                     work.basis, work.closing, work.size, work.overlap)
        friction_share, factor, met = add_friction_to_impact(world, state, size, count, span)
        return rank, clamp * factor, friction_share, solved and met
    if not (unequal and solved):
        minimum_norm_impulses(work.rows, work.length, count, work.basis, rank, work.change[:size],
                              state.row_impulse, work.columns, state.triangle, state.target)
    return rank, clamp, friction_share, solved


@kernel
def resolve_island(world, state, island):
    """One simultaneous impact, scaled to the device where the scene has limits."""
    size = gather_dofs(world, state, island)
    gather_group(world, state, size)
    count = gather_rows(world, state, island, size)
    rank, clamp, friction_share, solved = resolve_rows(world, state, size, count)
    share = 1.0
    if world.switches.impulse_limit:
        share = largest_share(state.group_impulse, state.dofs, size, world.dt, world.impulse_limit)
    if world.switches.spreading:
        for t in range(world.tree_start.shape[0]):
            if state.island_of_tree[t] == island:
                state.spreading[t] = share < 1.0
    lost = apply_group(world, state, size, share)
    approaching = count_approaching(world, state.work, size, count, share)
    for r in range(count):
        if r == 0 or state.rows[r] != state.rows[r - 1]:  # of two per-body rows the first is the one on body a
            state.contact_impulse[state.rows[r]] = share * state.row_impulse[r]
    log_impact(state, island, count, rank, share, clamp, friction_share, solved, approaching, lost, size)


@kernel
def resolve_collisions(world, state):
    """Give every colliding group its impulse, island by island; velocities change, configurations do not."""
    if not find_islands(world, state):
        return
    for t in range(world.tree_start.shape[0]):
        if state.collides_of_tree[t]:
            resolve_island(world, state, t)
