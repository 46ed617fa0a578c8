"""C18: what each filter does to the false collisions of a ball in a faceted socket."""

from __future__ import annotations

from verification.studies.false_collisions import FalseCollisions, study_false_collisions


def by_filters(damping: float) -> dict[tuple[bool, bool], FalseCollisions]:
    return {(f.clustering, f.coherence): f for f in study_false_collisions((damping,))}


def test_coherence_removes_every_false_collision_and_clustering_the_doubled_contacts() -> None:
    found = by_filters(40.0)
    assert found[False, False].collisions >= 10
    assert found[False, False].energy_lost > 0.2 * found[False, False].potential_drop
    assert found[True, True].collisions == found[False, True].collisions == 0
    assert found[True, True].doubled == found[True, False].doubled == 0 < found[False, True].doubled


def test_clustering_alone_removes_no_false_collision() -> None:
    """The one contact left at an edge jumps from facet to facet: new each time."""
    found = by_filters(40.0)
    assert found[True, False].collisions >= found[False, False].collisions


def test_a_ball_that_bounces_off_the_edges_comes_back_as_new() -> None:
    """Coherence looks one step back: it cannot know a contact that was away."""
    assert by_filters(10.0)[True, True].collisions > 0
