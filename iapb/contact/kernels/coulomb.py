"""Coulomb friction of a step, implicit in the velocity: it dissipates in every step and does not reverse a slip.

The other forces of the step lead to v. Friction adds Δv = M⁻¹ Jᵀ p with the tangential impulses p that minimize
½ Δvᵀ M Δv + p · J v in the discs |p_i| ≤ μ F_n,i Δt, where F_n are the normal forces (5) of the step. Each contact
stops, or slides against p_i at the limit. The sweeps over the contacts start at a p where this function is not above
zero, and each sweep lowers it, so friction takes kinetic energy after any number of sweeps. `passive_factor` also
keeps the work of friction over the step from being positive.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from iapb.compiled import kernel
from iapb.contact.kernels.contact_set import contact_before, moving_tree
from iapb.contact.kernels.impact_friction import slide, tangent_inertia
from iapb.contact.kernels.rows import friction_of, tangent_of, write_pair_row
from iapb.linalg import add, add_multiple, dot, dot_of, load, scale, solve_tree_blocks, store
from iapb.mechanics.kernels.kinematics import add_point_force

SWEEPS = 30  # at most in a step: what a pile has not settled by then it slips, and the next step goes on from there
STILL = 1e-6  # share of the fastest slip: a sweep that changes velocities by less is the last one


class StepFriction(NamedTuple):
    """Scratch of the friction of one step: c contacts, m tangents each (1 planar, 2 spatial), d coordinates."""

    contact: np.ndarray  # (c,) int64: contacts that carry friction in this step
    tree: np.ndarray  # (c, 2) int64: their two trees, −1 = none or the same
    rows: np.ndarray  # (c m, 2 w) tangents' rows of J L⁻ᵀ, w entries for each tree; the rest of a full row is zero
    slip: np.ndarray  # (c m,) tangential velocity without friction [m/s]
    p: np.ndarray  # (c m,) tangential impulses [N s]
    radius: np.ndarray  # (c,) limit μ F_n Δt [N s]
    inertia: np.ndarray  # (c,) largest eigenvalue of the contact's own block of J M⁻¹ Jᵀ [1/kg]
    moved: np.ndarray  # (d,) Lᵀ Δv
    local: np.ndarray  # (2 w,) entries of `moved` for the two trees of one contact
    velocity: np.ndarray  # (m,)


def make_step_friction(coordinates: int, contacts: int, tangents: int, tree_size: int) -> StepFriction:
    """Allocate the scratch; `tree_size`: coordinates of the largest tree."""
    c, m, width = contacts, tangents, 2 * tree_size
    shapes: tuple[Any, ...] = ((c * m, width), c * m, c * m, c, c, coordinates, width, m)
    return StepFriction(np.zeros(c, np.int64), np.zeros((c, 2), np.int64), *map(np.zeros, shapes))


@kernel(needs="coulomb")
def add_step_friction(world, state):
    """Add the friction of the step to v; write friction_force (d,) and that of each contact.

    Poses and factor of M are those at the start of the step; v is the velocity that the other forces lead to. Trees
    with friction move with the new velocity under every integrator, so the work of friction is p · J v⁺.
    """
    f, dt, size = state.step_friction, world.dt, state.step_friction.velocity.shape[0]
    count = _gather(world, state)
    if count == 0:
        return
    _start(world, state, count)
    _sweep(world, state, count)
    factor = passive_factor(f.p[: count * size], f.slip, f.moved)
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
    for k in range(state.v.shape[0]):
        state.v[k] += dt * f.moved[k]
    for r in range(count):
        for side in range(2):
            tree = f.tree[r, side]
            if tree >= 0:
                for k in range(world.tree_start[tree], world.tree_stop[tree]):
                    state.mean_v[k] = state.v[k]


@kernel
def passive_factor(p, slip, moved):
    """Return the largest α ≤ 1 with which friction does no positive work in the step: α p · slip + α² |moved|² ≤ 0."""
    given, square = dot_of(p, slip[: p.shape[0]]), dot_of(moved, moved)
    if given >= 0.0:
        return 0.0
    return 1.0 if square <= -given else -given / square


@kernel
def _gather(world, state):
    """Write rows, slips, limits and starting impulses of the contacts with F_n > 0; return their number."""
    f, contacts, size = state.step_friction, state.contacts, state.step_friction.velocity.shape[0]
    count = begin = 0
    for i in range(state.contact_count[0]):
        if not contacts.normal_force[i] > 0.0:
            continue
        f.contact[count] = i
        f.radius[count] = friction_of(world, contacts, i) * contacts.normal_force[i] * world.dt
        first = moving_tree(world, contacts.body_a[i])
        other = moving_tree(world, contacts.body_b[i])
        f.tree[count, 0], f.tree[count, 1] = first, -1 if other == first else other
        before = contact_before(state, i, begin)
        n, held, square = load(contacts.normal, i), (0.0, 0.0, 0.0), 0.0
        if before >= 0:
            begin, held = before + 1, scale(world.dt, load(state.previous.friction_force, before))
        for a in range(size):
            j, tangent = count * size + a, tangent_of(n, a, size)
            f.rows[j] = 0.0
            write_pair_row(world, state, f.tree[count], i, tangent, f.rows[j])
            f.slip[j] = _whiten_pair_row(world, state, f.tree[count], f.rows[j])
            f.p[j] = dot(held, tangent)
            square += f.p[j] * f.p[j]
        if square > f.radius[count] * f.radius[count]:
            for j in range(count * size, (count + 1) * size):
                f.p[j] *= f.radius[count] / math.sqrt(square)
        f.inertia[count] = tangent_inertia(f.rows, count * size, size)
        count += 1
    return count


@kernel
def _whiten_pair_row(world, state, trees, row):
    """Overwrite a row of J by that of J L⁻ᵀ; return J v."""
    speed = 0.0
    for side in range(2):
        if trees[side] >= 0:
            start, own = world.tree_start[trees[side]], row[side * (row.shape[0] // 2) :]
            for k in range(world.tree_stop[trees[side]] - start):
                speed += own[k] * state.v[start + k]
                for h in range(k):
                    own[k] -= state.lower[start + k, start + h] * own[h]
                own[k] /= state.lower[start + k, start + k]
    return speed


@kernel
def _start(world, state, count):
    """Start from the impulses of the step before if they take energy, else from zero; write `moved` for this p."""
    f, size = state.step_friction, state.step_friction.velocity.shape[0]
    f.moved[:] = 0.0
    for r in range(count):
        _carry(world, f, r, False)
        for j in range(r * size, (r + 1) * size):
            add_multiple(f.local, f.p[j], f.rows[j])
        _carry(world, f, r, True)
    if dot_of(f.p[: count * size], f.slip[: count * size]) + 0.5 * dot_of(f.moved, f.moved) > 0.0:
        f.p[: count * size] = 0.0
        f.moved[:] = 0.0


@kernel
def _carry(world, f, r, back):
    """Copy the entries of `moved` for the trees of contact r to `local`, or back."""
    if not back:
        f.local[:] = 0.0
    for side in range(2):
        tree, width = f.tree[r, side], f.local.shape[0] // 2
        if tree >= 0:
            for k in range(world.tree_stop[tree] - world.tree_start[tree]):
                if back:
                    f.moved[world.tree_start[tree] + k] = f.local[side * width + k]
                else:
                    f.local[side * width + k] = f.moved[world.tree_start[tree] + k]


@kernel
def _sweep(world, state, count):
    """Sweep p, contact by contact, until a sweep changes no velocity by more than STILL; update `moved`."""
    f, size, fastest = state.step_friction, state.step_friction.velocity.shape[0], 0.0
    for j in range(count * size):
        fastest = max(fastest, abs(f.slip[j]))
    still = STILL * fastest
    for _ in range(SWEEPS):
        fastest = 0.0
        for r in range(count):
            if f.inertia[r] > 0.0:
                _carry(world, f, r, False)
                moves = slide(f.rows, f.slip, f.radius[r], f.inertia[r], f.p, f.local, f.velocity, r * size)
                _carry(world, f, r, True)
                fastest = max(fastest, moves)
        if fastest <= still:
            break
