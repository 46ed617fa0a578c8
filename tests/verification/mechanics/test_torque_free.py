"""The integrators meet the closed form of a torque-free body with their orders.

`tests/reference/test_free_motion.py` compares the closed form with the worlds of the reference.
"""

from __future__ import annotations

import numpy as np
import pytest

from iapb.contact.laws import Penalty
from iapb.mechanics.mechanism import Mechanism
from iapb.scene import find_scene, load_scene
from iapb.scene.mechanism import mechanism_of
from iapb.simulation import simulate
from tests.reference.torque_free import TorqueFreeBody

# Close to the unstable middle axis: the body flips again and again.
BODY = TorqueFreeBody((1e-3, 2e-3, 2.8e-3), 4.0, 2.8)


def attitude_error(integrator: str, steps: int) -> float:
    """Return the error of the attitude after 2 s, as an angle [rad]."""
    scene = load_scene(find_scene("tumbling_body")).with_values(
        {
            "rate": steps / 2.0,
            "bodies.tennis_racket.inertia": list(BODY.moments),
            "bodies.tennis_racket.velocity": [0.0, 0.0, 0.0, *BODY.rates(0.0).tolist()],
        }
    )
    mechanism: Mechanism = mechanism_of(scene)
    axes, _ = mechanism.placements(simulate(scene, Penalty(integrator)).q[-1])
    exact = BODY.axes(0.0).T @ BODY.axes(2.0)
    return float(np.linalg.norm(axes[0] - exact) / np.sqrt(2.0))


@pytest.mark.parametrize(
    ("integrator", "steps", "order"), [("momentum", 200, 4), ("semi_implicit_euler", 1600, 1)]
)
def test_the_attitude_has_the_order_of_the_integrator(
    integrator: str, steps: int, order: int
) -> None:
    errors = [attitude_error(integrator, n) for n in (steps, 2 * steps)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.15)
