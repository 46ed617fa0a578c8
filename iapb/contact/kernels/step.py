"""One step of the paper's algorithm, compiled: one function per effect, behind one `if` each.

`advance` is the whole contact law: contacts (III), collisions (V), resting forces (IV), integration
by Δt. The Penalty law is the same algorithm with the impulses switched off (e = −1, claim C09).
Where impacts happen at the moment of touch, a step that brings new contacts is done in parts.
"""

from __future__ import annotations

from iapb.contact.kernels.collide import resolve_collisions
from iapb.contact.kernels.finding import find_contacts
from iapb.contact.kernels.motion import NOT_POSITIVE_DEFINITE, OK, TOO_MANY_CONTACTS, locate, move
from iapb.contact.kernels.touch import cut_at_touch, let_go
from iapb.numerics.compiled import copy_into, kernel
from iapb.run import COLLIDING, FREE


@kernel
def advance(world, state, applied):
    """Advance (q, v) by one step under the generalized force `applied` (d,); return a status."""
    for k in range(len(state.v)):  # forces and impulses of the step before
        state.penalty_force[k] = state.friction_force[k] = state.impulse[k] = 0.0
    state.impacts.logged[0] = 0
    state.h[0] = world.dt
    if not locate(world, state):
        return NOT_POSITIVE_DEFINITE
    if world.switches.contacts:
        if find_contacts(world, state) < 0:
            return TOO_MANY_CONTACTS
        if world.switches.impulses:
            resolve_collisions(world, state)
    if not world.switches.touch:
        return move(world, state, applied)
    let_go(world, state)
    copy_into(state.cut.start_q, state.q)
    status = move(world, state, applied)
    return cut_at_touch(world, state, applied) if status == OK else status


@kernel
def contact_state(state, tool_tree):
    """Return the state of the tool's group; without a tool: COLLIDING if any tree collides, RESTING
    if any rests."""
    found = FREE
    for t in range(len(state.state_of_tree)):
        if tool_tree in (-1, t) and (found == FREE or state.state_of_tree[t] == COLLIDING):
            found = state.state_of_tree[t]
    return found
