"""C18: what each filter does to the false collisions of a ball in a faceted socket, and the step of
its scene."""

from __future__ import annotations

from reference.worlds import run_world
from verification.claims.socket import count_false, socket

UNFILTERED = {"cluster_distance": 0.0, "coherence_distance": 0.0}


def counted(**contact: float) -> int:
    """Count the false collisions at the rate of the scene."""
    return count_false(run_world(socket(contact, 4000.0, 9), "IAPB"))


def test_coherence_removes_every_false_collision_and_clustering_alone_none() -> None:
    neither = counted(**UNFILTERED)
    assert neither >= 10
    assert counted() == counted(cluster_distance=0.0) == 0
    # with clustering alone the one contact left at an edge jumps from facet to facet: new each time
    assert counted(coherence_distance=0.0) >= neither
    # a ball that bounces off the edges comes back as new, because coherence looks one step back
    assert counted(damping=10.0) > 0
