"""The ledger closes up to the integrator's order, and blames the right account."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.errors import ArgumentError
from iapb.mechanics.energy import energy_ledger, last_of
from iapb.mechanics.integrators import INTEGRATORS
from iapb.mechanics.mechanism import Body, Joint, Mechanism

FIELD = np.array([0.0, -9.81, 0.0])
DURATION = 0.25  # [s]
NAMES = ("hand", "coupling", "penalty", "friction")


def arm():
    rod = np.diag([0.0, 1 / 12, 1 / 12])
    upper = Body("upper", None, Joint("revolute"), mass=1.0, center_of_mass=(0.5, 0, 0), inertia=rod)
    lower = Body("lower", "upper", Joint("revolute"), (np.eye(3), (1.0, 0, 0)), 1.0, (0.5, 0, 0), rod)
    return Mechanism([upper, lower])


def driven(mechanism, method, steps, impulse_at=None):
    """A run of `steps` under four constant forces, with one impulse; forces act over whole steps."""
    dt = DURATION / steps
    force = dict(zip(NAMES, np.array([[1.0, 0.2], [-0.3, 0.5], [0.4, 0.4], [-0.1, -0.7]]), strict=True))
    total = sum(force.values())
    q, v = np.array([0.3, 0.5]), np.array([1.0, -2.0])
    states, impulses = [(q, v)], np.zeros((steps, 2))

    def acceleration(q, v):
        free = total - mechanism.bias(q, v) - mechanism.gravity(q, FIELD)
        return np.linalg.solve(mechanism.mass_matrix(q), free)

    for k in range(steps):
        if impulse_at is not None and k == int(impulse_at * steps):
            impulses[k] = [0.3, -0.2]
        v = v + np.linalg.solve(mechanism.mass_matrix(q), impulses[k])
        q, v = method.step(mechanism.integrate, acceleration, q, v, dt)
        states.append((q, v))
    qs, vs = (np.array(rows) for rows in zip(*states, strict=True))
    return qs, vs, {name: np.tile(f, (steps, 1)) for name, f in force.items()}, impulses


def test_a_forgotten_force_does_not_vanish_with_the_step():
    mechanism = arm()
    q, v, forces, impulse = driven(mechanism, INTEGRATORS["runge_kutta_4"], 64)
    complete = energy_ledger(mechanism, FIELD, q, v, forces, impulse)
    del forces["friction"]
    missing = energy_ledger(mechanism, FIELD, q, v, forces, impulse)
    assert np.abs(complete["integration_residual"]).max() < 1e-7
    np.testing.assert_allclose(missing["integration_residual"], complete["friction_work"], atol=1e-6)


def test_semi_implicit_euler_loses_what_the_docstring_says():
    mass = Mechanism([Body("mass", None, Joint("prismatic", (1, 0, 0)), mass=2.0)])
    dt, force = 0.01, 3.0
    q, v = np.zeros((2, 1)), np.array([[0.5], [0.5 + dt * force / 2.0]])
    q[1] = dt * v[1]
    ledger = energy_ledger(mass, FIELD, q, v, {"hand": np.array([[force]])}, np.zeros((1, 1)))
    assert ledger["integration_residual"][0] == pytest.approx(-force * force / 2.0 * dt**2 / 2.0, rel=1e-10)


def test_work_on_a_quaternion_is_force_times_the_turn():
    ball = Mechanism([Body("ball", None, Joint("spherical"), mass=1.0, inertia=np.eye(3))])
    v = np.array([0.0, 0.0, 0.7])
    q = np.array([ball.neutral(), ball.integrate(ball.neutral(), v)])
    force = np.array([[0.0, 0.0, 2.0]])
    ledger = energy_ledger(ball, FIELD, q, np.array([v, v]), {"hand": force}, np.zeros((1, 3)))
    assert ledger["hand_work"][0] == pytest.approx(1.4, rel=1e-14)


def test_shapes_that_do_not_belong_together_are_named():
    mechanism = arm()
    q, v, forces, impulse = driven(mechanism, INTEGRATORS["midpoint"], 4)
    with pytest.raises(ArgumentError, match="hand"):
        energy_ledger(mechanism, FIELD, q, v, forces | {"hand": np.zeros((3, 2))}, impulse)
    with pytest.raises(ArgumentError, match="qs of shape"):
        energy_ledger(mechanism, FIELD, q[:, :1], v, forces, impulse)


def test_a_run_summed_in_parts_has_the_bits_of_the_whole():
    mechanism, steps = arm(), 24
    q, v, forces, impulses = driven(mechanism, INTEGRATORS["midpoint"], steps, 0.5)
    impulses[3] = [-0.1, 0.4]
    whole, before = energy_ledger(mechanism, FIELD, q, v, forces, impulses), None
    for start, stop in ((0, 9), (9, 10), (10, steps)):
        part = energy_ledger(mechanism, FIELD, q[start:stop + 1], v[start:stop + 1],
                             {name: force[start:stop] for name, force in forces.items()}, impulses[start:stop], before)
        assert set(part) == set(whole)
        for name, values in part.items():
            extra = 1 if name in ("kinetic", "potential") else 0
            np.testing.assert_array_equal(values, whole[name][start:stop + extra], err_msg=name)
        before = last_of(part, before)
    assert {name: before[name] for name in whole} == {name: values[-1] for name, values in whole.items()}
