"""Each integrator shows the order it declares, on vector coordinates and on quaternions."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.mechanics.integrators import INTEGRATORS, Integrator
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from verification.mechanics.tumbling import COMMUTATOR_FREE_4

FIELD = np.array([0.0, -9.81, 0.0])
DURATION = 0.5  # [s]
STEPS = 20  # of the coarsest run: small enough a step for the leading error term to rule
ORDER_TOLERANCE = 0.15  # next error term at these steps
ROD = np.diag([0.0, 1 / 12, 1 / 12])
# `momentum` has its Coriolis terms in compiled kernels: see tests of free motion
METHODS = [method for method in (*INTEGRATORS.values(), COMMUTATOR_FREE_4) if not method.conserving]


def double_pendulum():
    upper = Body("upper", None, Joint("revolute"), mass=1.0, center_of_mass=(0.5, 0, 0), inertia=ROD)
    placement = (np.eye(3), (1.0, 0, 0))
    lower = Body("lower", "upper", Joint("revolute"), placement, 1.0, (0.5, 0, 0), ROD)
    return Mechanism([upper, lower]), np.array([0.3, 0.5]), np.array([1.0, -2.0])


def tumbling_body():
    inertia = np.diag([0.1, 0.2, 0.35])
    mechanism = Mechanism([Body("body", None, Joint("free_flyer"), mass=1.3, center_of_mass=(0.1, 0.2, -0.1),
                                inertia=inertia)])
    return mechanism, mechanism.neutral(), np.array([0.1, 0.2, 0.3, 1.0, 2.0, -1.0])


def state_after(problem, method, steps):
    mechanism, q, v = problem

    def acceleration(q, v):
        return np.linalg.solve(mechanism.mass_matrix(q), -mechanism.bias(q, v) - mechanism.gravity(q, FIELD))

    for _ in range(steps):
        q, v = method.step(mechanism.integrate, acceleration, q, v, DURATION / steps)
    return q, v


def measured_order(problem, method):
    truth_q, truth_v = state_after(problem, COMMUTATOR_FREE_4, 8 * STEPS)
    errors = []
    for steps in (STEPS, 2 * STEPS):
        q, v = state_after(problem, method, steps)
        errors.append(np.linalg.norm(np.concatenate([problem[0].difference(q, truth_q), v - truth_v])))
    return np.log2(errors[0] / errors[1])


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
def test_measured_order_is_the_declared_one(method):
    assert measured_order(double_pendulum(), method) == pytest.approx(method.order, abs=ORDER_TOLERANCE)
    assert measured_order(tumbling_body(), method) == pytest.approx(method.group_order, abs=ORDER_TOLERANCE)


POLYNOMIALS = {  # of h A in q' = v, v' = K q: one step is exp(h A) up to the method's order
    "midpoint": lambda a: np.eye(6) + a + a @ a / 2.0,
    "runge_kutta_4": lambda a: np.eye(6) + a + a @ a / 2.0 + a @ a @ a / 6.0 + a @ a @ a @ a / 24.0,
    "semi_implicit_euler": lambda a: (np.eye(6) + np.pad(a[:3, 3:], ((0, 3), (3, 0)))) @ (
        np.eye(6) + np.pad(a[3:], ((3, 0), (0, 0)))),
}
POLYNOMIALS["commutator_free_4"] = POLYNOMIALS["runge_kutta_4"]


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
def test_a_step_of_a_linear_system_is_the_methods_polynomial(method):
    """Damped springs, q'' = K q + D v: the stability function as a matrix."""
    rng = np.random.default_rng(0)
    stiffness, damping = rng.normal(size=(2, 3, 3))
    q, v, h = rng.normal(size=3), rng.normal(size=3), 0.3
    a = h * np.block([[np.zeros((3, 3)), np.eye(3)], [stiffness, damping]])
    found = method.step(lambda q, v, dt: q + dt * v, lambda q, v: stiffness @ q + damping @ v, q, v, h)
    expected = POLYNOMIALS[method.name](a) @ np.concatenate((q, v))
    np.testing.assert_allclose(np.concatenate(found), expected, rtol=0.0, atol=1e-14)


def test_a_wrong_weight_is_seen_as_a_lower_order():
    wrong = Integrator("wrong midpoint", 2, 2, (0.0, 0.5), (0.1, 0.9))
    assert measured_order(double_pendulum(), wrong) < 2.0 - 3.0 * ORDER_TOLERANCE
