"""The integrators turn a tumbling body with their orders. That it is the right body:
verification/ordinary, by DOP853."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from iapb.contact.laws import Penalty
from iapb.scene import find_scene, load_scene
from iapb.scene.mechanism import mechanism_of
from iapb.simulation import simulate


@cache
def attitude(integrator: str, steps: int) -> np.ndarray:
    """Axes (3, 3) of a body near its unstable middle axis after 2 s: it flips again and again."""
    scene = load_scene(find_scene("tumbling_body")).with_values(
        {
            "rate": steps / 2.0,
            "bodies.tennis_racket.inertia": [1e-3, 2e-3, 2.8e-3],
            "bodies.tennis_racket.velocity": [0.0, 0.0, 0.0, 4.0, 0.0, 2.8],
        }
    )
    run = simulate(scene, Penalty(integrator))
    return np.asarray(mechanism_of(scene).placements(run.q[-1])[0][0])


@pytest.mark.parametrize(
    ("integrator", "steps", "order"), [("momentum", 200, 4), ("semi_implicit_euler", 1600, 1)]
)
def test_the_attitude_has_the_order_of_the_integrator(
    integrator: str, steps: int, order: int
) -> None:
    truth = attitude("momentum", 6400)
    errors = [np.linalg.norm(attitude(integrator, n) - truth) for n in (steps, 2 * steps)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.15)
