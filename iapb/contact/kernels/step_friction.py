"""Coulomb friction of a step, implicit in the velocity: it dissipates in every step and does not reverse a slip.

The other forces of the step lead to v. Friction adds Δv = M⁻¹ Jᵀ p with the tangential impulses p that minimize
½ Δvᵀ M Δv + p · J v in the discs |p_i| ≤ μ F_n,i Δt, where F_n are the normal forces (5) of the step. Each contact
stops, or slides against p_i at the limit. The sweeps over the contacts start at a p where this function is not above
zero, and each sweep lowers it, so friction takes kinetic energy after any number of sweeps. A last factor
keeps the work of friction over the step from being positive.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from iapb.compiled import kernel
from iapb.contact.kernels.contact_set import contact_before
from iapb.contact.kernels.impact_friction import along_row, combine, friction_sweeps, set_inertia
from iapb.contact.kernels.rows import friction_of, tangent_of, write_pair_row
from iapb.linalg import add, add_multiple, dot, dot_of, load, scale, solve_tree_blocks, store
from iapb.mechanics.kernels.kinematics import add_point_force
from iapb.schema import Floats, Integers

SWEEPS = 30  # at most in a step: what a pile has not settled by then it slips, and the next step goes on from there
STILL = 1e-6  # share of the fastest slip: a sweep that changes velocities by less is the last one


class RestWork(NamedTuple):
    """Scratch of resting contact, implicit in the velocity: of one group (`rest_group`), or friction of all contacts.

    Each contact has a row for the normal and for each tangent, or only for the tangents. Local coordinates number those
    of the group, or of all. `width` is twice the number of coordinates of the largest tree.
    """

    contact: Annotated[Integers, "contact"]  # contacts that carry a force in this step
    at: Annotated[Integers, "contact 2"]  # first local coordinate of each of their two trees
    size: Annotated[Integers, "contact 2"]  # number of coordinates of these; 0 = no tree, or the first one again
    rows: Annotated[Floats, "row width"]  # rows of J, for friction alone J L⁻ᵀ: one half for each of the two trees
    speed: Annotated[Floats, "row"]  # J v [m/s]; for friction alone that without friction
    p: Annotated[Floats, "row"]  # impulses of the step [N s]
    limit: Annotated[Floats, "contact"]  # limits c = μ F_n Δt of friction [N s]
    bend: Annotated[Floats, "contact"]  # what the gap closed or opened more than Δt J v in the step before, by Δt [m/s]
    # Of friction alone
    block: Annotated[Floats, "contact 3"]  # entries xx, xy, yy of the contact's own block of J M⁻¹ Jᵀ [1/kg]
    inertia: Annotated[Floats, "contact"]  # its largest eigenvalue
    moved: Annotated[Floats, "velocity"]  # Lᵀ Δv
    velocity: Annotated[Floats, "direction"]
    # Of a group
    first: Annotated[Integers, "tree"]  # first contact of each group, by its first tree, −1 = none
    next: Annotated[Integers, "contact"]  # contact of the same group that follows, −1 = none
    next_tree: Annotated[Integers, "tree"]  # tree of the same group that follows, −1 = none
    offset: Annotated[Integers, "tree"]  # first local coordinate of each tree
    dof: Annotated[Integers, "velocity"]  # the coordinate v[dof] of each local one
    begin: Annotated[Integers, "velocity"]  # first local coordinate of its tree
    end: Annotated[Integers, "velocity"]  # and the one after the last
    envelope: Annotated[Integers, "velocity"]  # first nonzero column of each row of the Newton matrix
    change: Annotated[Floats, "row"]  # J Δv of a Newton step
    v: Annotated[Floats, "velocity"]  # local velocities
    free: Annotated[Floats, "velocity"]  # v*
    balance: Annotated[Floats, "velocity"]  # M (v − v*) − Jᵀ p
    change_of_v: Annotated[Floats, "velocity"]  # v − v*
    step: Annotated[Floats, "velocity"]  # Newton step
    given: Annotated[Floats, "velocity"]  # M times a vector, or L⁻¹ of one
    energy: Annotated[Floats, "1"]  # ½ v*ᵀ M v* [J]
    shortened: Annotated[Integers, "1"]  # solutions that were shortened, since the start


@kernel
def trees_of_contact(world, contacts, i, start, at, size):
    """Return the two trees of a contact, the second −1: none, or the same; write their first coordinates and sizes."""
    a, b = world.tree_of_body[contacts.body_a[i]], contacts.body_b[i]
    trees = (a, -1 if b < 0 or world.tree_of_body[b] == a else world.tree_of_body[b])
    for side in range(2):
        t = trees[side]
        at[side] = start[t] if t >= 0 else 0
        size[side] = world.tree_stop[t] - world.tree_start[t] if t >= 0 else 0
    return trees


@kernel(needs="coulomb")
def add_step_friction(world, state):
    """Add the friction of the step to v; write friction_force (d,) and that of each contact.

    Poses and factor of M are those at the start of the step; v is the velocity that the other forces lead to. Trees
    with friction move with the new velocity under every integrator, so the work of friction is p · J v⁺.
    """
    f, dt, size = state.rest_work, world.dt, state.rest_work.velocity.shape[0]
    count = _gather(world, state)
    if count == 0:
        return
    fastest = 0.0
    for j in range(count * size):
        fastest = max(fastest, abs(f.speed[j]))
    combine(count, f)
    # The start: the impulses of the step before if they take energy, else zero.
    if dot_of(f.speed, f.p[: count * size]) + 0.5 * dot_of(f.moved, f.moved) > 0.0:
        f.p[: count * size] = 0.0
        f.moved[:] = 0.0
    friction_sweeps(count, f, SWEEPS, STILL * fastest, False)
    # The largest factor with which friction does no positive work in the step: α p · slip + α² |moved|² ≤ 0.
    given, square = dot_of(f.speed, f.p[: count * size]), dot_of(f.moved, f.moved)
    factor = 0.0 if given >= 0.0 else 1.0 if square <= -given else -given / square
    for r in range(count):
        i, force = f.contact[r], (0.0, 0.0, 0.0)
        n, x = load(state.contacts.normal, i), load(state.contacts.point, i)
        for a in range(size):
            force = add(force, scale(factor * f.p[r * size + a] / dt, tangent_of(n, a, size)))
        store(state.contacts.friction_force, i, force)
        add_point_force(world.mechanism, state.body, state.contacts.body_a[i], x, force, state.friction_force)
        add_point_force(world.mechanism, state.body, state.contacts.body_b[i], x, scale(-1.0, force),
                        state.friction_force)
    solve_tree_blocks(state.lower, world.tree_start, world.tree_stop, state.friction_force, f.moved)
    add_multiple(state.v, dt, f.moved)
    for r in range(count):
        for side in range(2):
            for k in range(f.at[r, side], f.at[r, side] + f.size[r, side]):
                state.mean_v[k] = state.v[k]


@kernel
def _gather(world, state):
    """Write rows, slips, limits and starting impulses of the contacts with F_n > 0; return their number."""
    f, contacts, size = state.rest_work, state.contacts, state.rest_work.velocity.shape[0]
    count = begin = 0
    for i in range(state.contact_count[0]):
        if not contacts.normal_force[i] > 0.0:
            continue
        f.contact[count] = i
        f.limit[count] = friction_of(world, contacts, i) * contacts.normal_force[i] * world.dt
        trees = trees_of_contact(world, contacts, i, world.tree_start, f.at[count], f.size[count])
        before = contact_before(state, i, begin)
        n, held, square = load(contacts.normal, i), (0.0, 0.0, 0.0), 0.0
        if before >= 0:
            begin, held = before + 1, scale(world.dt, load(state.previous.friction_force, before))
        for a in range(size):
            j, tangent = count * size + a, tangent_of(n, a, size)
            f.rows[j] = 0.0
            write_pair_row(world, state, trees, i, tangent, f.rows[j])
            f.speed[j] = along_row(f, count, j, state.v)
            for side in range(2):  # L x = row, tree by tree
                at, own = f.at[count, side], f.rows[j, side * (f.rows.shape[1] // 2) :]
                for k in range(f.size[count, side]):
                    for h in range(k):
                        own[k] -= state.lower[at + k, at + h] * own[h]
                    own[k] /= state.lower[at + k, at + k]
            f.p[j] = dot(held, tangent)
            square += f.p[j] * f.p[j]
        if square > f.limit[count] * f.limit[count]:
            for j in range(count * size, (count + 1) * size):
                f.p[j] *= f.limit[count] / math.sqrt(square)
        set_inertia(f, count, f.rows.shape[1])
        count += 1
    return count
