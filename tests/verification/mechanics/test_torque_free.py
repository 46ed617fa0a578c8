"""The closed form of a torque-free body solves Euler's equations, and the conserving integrator
meets it."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.contact.laws import Penalty
from iapb.mechanics.mechanism import Mechanism
from iapb.scene import find_scene, load_scene
from iapb.scene.mechanism import mechanism_of
from iapb.simulation import simulate
from tests.reference.torque_free import TorqueFreeBody

H = 1e-4  # [s] of central differences: their error is about H^2
# A gentle wobble, and a rotation close to the unstable middle axis, in which the body flips
# periodically.
BODIES = {
    "wobbling": TorqueFreeBody((1e-3, 2e-3, 2.8e-3), 1.0, 3.0),
    "turning over": TorqueFreeBody((1e-3, 2e-3, 2.8e-3), 4.0, 2.8),
}


@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
@pytest.mark.parametrize("time", [0.0, 0.31, 2.0, 40.0])
def test_the_closed_form_solves_the_equations(body: TorqueFreeBody, time: float) -> None:
    moments, rate = np.array(body.moments), body.rates(time)
    change = (body.rates(time + H) - body.rates(time - H)) / (2 * H)
    torque = moments * change + np.cross(rate, moments * rate)
    assert np.abs(torque).max() <= 1e-6 * np.abs(moments * change).max() + 1e-9
    spin = body.axes(time).T @ (body.axes(time + H) - body.axes(time - H)) / (2 * H)
    np.testing.assert_allclose([spin[2, 1], spin[0, 2], spin[1, 0]], rate, atol=1e-5)
    np.testing.assert_allclose(
        body.axes(time) @ (moments * rate), [0, 0, body.momentum], atol=1e-14
    )
    assert 0.5 * moments @ rate**2 == pytest.approx(body.energy, rel=1e-12)


def attitude_error(body: TorqueFreeBody, integrator: str, steps: int) -> float:
    """Return the error of the attitude after 2 s, as an angle [rad]."""
    scene = load_scene(find_scene("tumbling_body")).with_values(
        {
            "rate": steps / 2.0,
            "bodies.tennis_racket.inertia": list(body.moments),
            "bodies.tennis_racket.velocity": [0.0, 0.0, 0.0, *body.rates(0.0).tolist()],
        }
    )
    mechanism: Mechanism = mechanism_of(scene)
    axes, _ = mechanism.placements(simulate(scene, Penalty(integrator)).q[-1])
    exact = body.axes(0.0).T @ body.axes(2.0)
    return float(np.linalg.norm(axes[0] - exact) / np.sqrt(2.0))


@pytest.mark.parametrize(
    ("integrator", "steps", "order"), [("momentum", 200, 4), ("semi_implicit_euler", 1600, 1)]
)
def test_the_attitude_has_the_order_of_the_integrator(
    integrator: str, steps: int, order: int
) -> None:
    errors = [attitude_error(BODIES["turning over"], integrator, n) for n in (steps, 2 * steps)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.15)


def test_a_body_of_another_shape_does_not_meet_the_closed_form() -> None:
    body = BODIES["wobbling"]
    other = TorqueFreeBody((1e-3, 2e-3, 2.8001e-3), body.first_rate, body.third_rate)
    assert attitude_error(body, "momentum", 1600) < 1e-7
    wrong = np.linalg.norm(other.axes(0.0).T @ other.axes(2.0) - body.axes(0.0).T @ body.axes(2.0))
    assert wrong > 1e-6
