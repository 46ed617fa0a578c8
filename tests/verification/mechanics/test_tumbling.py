"""The closed form solves Euler's equations, and the study tells a wrong order and a wrong body."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from iapb.mechanics.integrators import INTEGRATORS
from verification.mechanics import tumbling

H = 1e-4  # [s] of central differences: their error is about H^2
BODIES = tumbling.MOTIONS.values()


@pytest.mark.parametrize("body", BODIES, ids=tumbling.MOTIONS)
@pytest.mark.parametrize("time", [0.0, 0.31, 2.0, 40.0])
def test_the_closed_form_solves_the_equations(body, time):
    moments, rate = np.array(body.moments), body.rates(time)
    change = (body.rates(time + H) - body.rates(time - H)) / (2 * H)
    torque = moments * change + np.cross(rate, moments * rate)
    assert np.abs(torque).max() <= 1e-6 * np.abs(moments * change).max() + 1e-9
    spin = body.axes(time).T @ (body.axes(time + H) - body.axes(time - H)) / (2 * H)
    np.testing.assert_allclose([spin[2, 1], spin[0, 2], spin[1, 0]], rate, atol=1e-5)
    np.testing.assert_allclose(body.axes(time) @ (moments * rate), [0, 0, body.momentum], atol=1e-14)
    assert 0.5 * moments @ rate**2 == pytest.approx(body.energy, rel=1e-12)


@pytest.mark.parametrize("method", INTEGRATORS.values(), ids=INTEGRATORS)
def test_every_integrator_keeps_its_order_on_rotations(method):
    rows = list(tumbling._halved(tumbling.MOTIONS["turning over"], method, tumbling.path_compiled, 2))
    assert rows[-1]["order"] == pytest.approx(method.group_order, abs=tumbling.ORDER_TOLERANCE)
    assert min(rows[-1][name] or np.inf for name in tumbling.DRIFT_ORDERS) > (
        method.group_order - tumbling.ORDER_TOLERANCE)


def test_a_body_of_another_shape_does_not_converge():
    body, method = tumbling.MOTIONS["wobbling"], INTEGRATORS["midpoint"]
    other = replace(body, moments=(1e-3, 2e-3, 2.8001e-3))

    def path(_, method, steps):
        return tumbling.path_compiled(other, method, steps)

    rows = list(tumbling._halved(body, method, path, 3))
    assert rows[-1]["order"] < 2 - tumbling.ORDER_TOLERANCE


@pytest.mark.parametrize(
    ("orders", "holds"),
    [
        ({"order": 2.0}, True),
        ({"order": 2.0, "energy order": 3.9, "momentum order": 2.0}, True),
        ({"order": 1.0}, False),
        ({"order": 3.0}, False),
        ({"order": 2.0, "energy order": 1.0}, False),
        ({"order": 2.0, "momentum order": 0.0}, False),
    ],
)
def test_an_order_that_is_not_the_declared_one_fails_the_finding(orders, holds):
    common = dict.fromkeys(tumbling.ORDERS) | {"declared order": 2}
    rows = tumbling.judged([dict(common), common | orders])
    assert [row.get("holds") for row in rows] == [None, holds]
