"""What one impact is about: coordinates, masses, velocities, contact rows, tangents and restitution of an island."""

from __future__ import annotations

from iapb.compiled import kernel
from iapb.contact.kernels.rows import body_row, contact_row, direction_row, tangent_of
from iapb.mechanics.kernels.vectors import load


@kernel
def gather_dofs(world, state, island):
    """List the coordinates of an island, of a contact group (2)-(3) or a part of one; return how many."""
    size = 0
    for t in range(world.tree_start.shape[0]):
        if state.island_of_tree[t] == island:
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
def gather_rows(world, state, island, size):
    """Rows of J_c: (11) against the static world; (12), or the two of (13)-(14), at a self-collision."""
    contacts = state.contacts
    count = 0
    for i in range(state.contact_count[0]):
        if not contacts.collides[i] or state.island_of_tree[world.tree_of_body[contacts.body_a[i]]] != island:
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
def gather_tangents(world, state, size, count):
    """Rows of the tangents of each contact, into the friction's scratch."""
    contacts, free = state.contacts, state.friction_work.free
    tangents = state.friction_work.velocity.shape[0]
    for r in range(count):
        i = state.rows[r]
        for a in range(tangents):
            tangent = tangent_of(load(contacts.normal, i), a, tangents)
            direction_row(world.mechanism, state.body, contacts, i, tangent, state.row)
            for k in range(size):
                free[r * tangents + a, k] = state.row[state.dofs[k]]


@kernel
def pair_restitution(own, a, b, otherwise):
    """e of two shapes: the smaller of those they give; `otherwise` where neither gives one (above 1)."""
    e = min(own[a], own[b])
    return otherwise if e > 1.0 else e


@kernel
def gather_restitution(world, state, count):
    """Write the rows' restitution; return the smallest, and whether they differ."""
    contacts, smallest, largest = state.contacts, 1.0, 0.0
    for r in range(count):
        i = state.rows[r]
        e = pair_restitution(world.own_restitution, contacts.shape_a[i], contacts.shape_b[i], world.restitution)
        state.row_restitution[r] = e
        smallest, largest = min(smallest, e), max(largest, e)
    return smallest, smallest < largest
