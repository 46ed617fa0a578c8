"""C18: a ball rolls in a faceted socket; its false collisions, with and without the two filters.

In the round socket that the facets stand for, the ball would touch once and never collide again. So every collision
after the first contact is false, and every contact beyond one per step is doubled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

DAMPINGS = (10.0, 40.0, 60.0)  # B of (5) [N s/m]: from a ball that bounces at edges to one that does not


@dataclass(frozen=True)
class FalseCollisions:
    """One run of the socket.

    clustering, coherence : whether the filter is on; damping : B [N s/m]
    collisions : impacts after the first contact; new_contacts : contacts taken as new, the first left out
    doubled : contacts beyond one per step
    energy_lost : [J] in those collisions; potential_drop : [J] from the start to the lowest point, to compare with
    """

    clustering: bool
    coherence: bool
    damping: float
    steps: int
    collisions: int
    new_contacts: int
    doubled: int
    energy_lost: float
    potential_drop: float


def study_false_collisions(dampings: Sequence[float] = DAMPINGS) -> tuple[FalseCollisions, ...]:
    """Return the counts for each damping and each of the four settings of the filters."""
    return tuple(
        _count(damping, clustering, coherence)
        for damping in dampings
        for clustering in (False, True)
        for coherence in (False, True)
    )


def _count(damping: float, clustering: bool, coherence: bool) -> FalseCollisions:
    from iapb.scene import load_scene
    from iapb.scene_files import find_scene
    from iapb.simulation import simulate

    scene = load_scene(find_scene("faceted_socket"))
    off = {"cluster_distance": clustering, "coherence_distance": coherence}
    values = {f"contact.{name}": 0.0 for name, kept in off.items() if not kept}
    run = simulate(scene.with_values(values | {"contact.damping": damping}))
    per_step = np.diff(run.contacts.offsets)
    first = int(np.flatnonzero(per_step)[0])
    later = run.impacts.step > first
    potential = run.energy["potential"]
    return FalseCollisions(
        clustering, coherence, damping, run.steps,
        collisions=int(later.sum()),
        new_contacts=int(run.contacts.is_new.sum() - run.contacts.is_new[: per_step[first]].sum()),
        doubled=int(np.maximum(per_step - 1, 0).sum()),
        energy_lost=float(run.impacts.energy_lost[later].sum()),
        potential_drop=float(potential[0] - potential.min()),
    )  # fmt: skip
