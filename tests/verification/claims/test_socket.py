"""C18: what each filter does to the false collisions of a ball in a faceted socket, and the step of
its scene."""

from __future__ import annotations

import numpy as np
import pytest

from reference.worlds import run_world
from verification.claims.socket import count_false, socket
from verification.scenes.books import OPEN, open_row

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


def explicit_rates(contact: dict[str, float], rate: float) -> tuple[float, float]:
    """B T / m, and μ F_n T / (v_threshold m_t) with the largest F_n of the run: what a held force
    may reach."""
    scene = socket(contact, rate, 9)
    run = run_world(scene, "IAPB")
    ball = scene.bodies[0]
    felt = 1.0 / (1.0 / ball.mass + ball.shapes[0].radius ** 2 / ball.inertia)
    pressed = float(np.max(run.contacts.normal_force))
    slope = scene.contact.friction * pressed / scene.contact.friction_velocity
    return scene.contact.damping * run.dt / ball.mass, slope * run.dt / felt


def test_the_scene_is_slow_enough_for_its_step_and_its_books_show_it() -> None:
    damper, friction = explicit_rates({}, 4000.0)
    assert damper < 0.2 and friction < 1.0
    row = open_row(socket({}, 4000.0, 9), lambda scene: run_world(scene, "IAPB"), (1, 2))
    assert row[f"{OPEN} [%]"] < 5.0
    assert row["order measured"] == pytest.approx(
        1.0, abs=0.15
    )  # semi-implicit Euler's, as declared


def test_at_a_haptic_step_and_a_sharp_threshold_friction_chatters_and_a_quarter_is_left_open() -> (
    None
):
    sharp = {"friction_velocity": 1e-2}
    damper, friction = explicit_rates(sharp, 1000.0)
    assert damper == pytest.approx(0.4) and friction > 2.0
    row = open_row(socket(sharp, 1000.0, 9), lambda scene: run_world(scene, "IAPB"), (1,))
    assert row[f"{OPEN} [%]"] > 20.0
