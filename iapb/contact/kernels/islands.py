"""Islands of a colliding group: trees that contacts *of this collision* link.

M is block diagonal in the trees and a row has entries for the trees of its contact only, so (21) falls apart into
its islands: what lies still among the touching is neither copied nor factored.
"""

from __future__ import annotations

from iapb.compiled import kernel
from iapb.contact.kernels.contact_set import group_of_contact, join, moving_tree
from iapb.run import COLLIDING


@kernel
def find_islands(world, state):
    """Write island_of_tree, the first tree of each one's island, and collides_of_tree for these; False if none does.

    Where impulses are scaled to the device, islands are the groups: the paper's factor is one for a group.
    """
    any_collides = False
    for t in range(world.tree_start.shape[0]):
        any_collides = any_collides or state.state_of_tree[t] == COLLIDING
        state.island_of_tree[t] = state.group_of_tree[t] if world.switches.impulse_limit else t
        state.collides_of_tree[t] = False
    if not any_collides:
        return False
    contacts, start, stop = state.contacts, world.tree_start, world.tree_stop
    for i in range(state.contact_count[0]):
        a = moving_tree(contacts.body_a[i], world.tree_of_body, start, stop)
        b = moving_tree(contacts.body_b[i], world.tree_of_body, start, stop)
        if contacts.collides[i] and a >= 0 and b >= 0:
            join(state.island_of_tree, a, b)
    for t in range(start.shape[0]):
        state.island_of_tree[t] = state.island_of_tree[state.island_of_tree[t]]  # smaller trees are settled already
    for i in range(state.contact_count[0]):
        if contacts.collides[i]:
            state.collides_of_tree[
                group_of_contact(contacts, i, world.tree_of_body, start, stop, state.island_of_tree)
            ] = True
    return True
