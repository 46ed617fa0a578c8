"""C18: what each filter does to the false collisions of a ball in a faceted socket, and the step of
its scene."""

from __future__ import annotations

from reference.worlds import run_world
from verification.claims.socket import count_false, socket

UNFILTERED = {"cluster_distance": 0.0, "coherence_distance": 0.0}


def counted(**contact: float) -> dict[str, int]:
    """Count the false collisions at the rate of the scene."""
    return count_false(run_world(socket(contact, 4000.0, 9), "IAPB"))


def test_coherence_removes_every_false_collision_and_clustering_the_doubled_contacts() -> None:
    neither = counted(**UNFILTERED)
    coherence = counted(cluster_distance=0.0)
    clustering = counted(coherence_distance=0.0)
    both = counted()
    assert neither["false collisions"] >= 10
    assert both["false collisions"] == coherence["false collisions"] == 0
    assert (
        both["doubled contacts"]
        == clustering["doubled contacts"]
        == 0
        < coherence["doubled contacts"]
    )
    # with clustering alone the one contact left at an edge jumps from facet to facet: new each time
    assert clustering["false collisions"] >= neither["false collisions"]
    # a ball that bounces off the edges comes back as new, because coherence looks one step back
    bouncing = counted(damping=10.0)
    assert 0 < bouncing["on return"] <= bouncing["false collisions"]
