"""Moving on the configuration manifold: integrate and difference."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.mechanics.joints import KINDS
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from reference.random_mechanisms import random_mechanism, random_state

moving_kinds = tuple(kind for kind in KINDS if kind != "fixed")
seeds = st.integers(0, 2**32 - 1)


def alone(kind):
    return Mechanism([Body("body", None, Joint(kind), mass=1.0, inertia=np.eye(3))])


@given(seeds, st.floats(1e-12, 3.0))
def test_difference_undoes_integrate(seed, size):
    rng = np.random.default_rng(seed)
    mechanism = random_mechanism(rng, 5, moving_kinds)
    q, v = random_state(rng, mechanism)
    v *= size / np.sqrt(3.0) / np.abs(v).max()  # turns below pi: the shortest way is the way taken
    error = mechanism.difference(q, mechanism.integrate(q, v)) - v
    assert np.abs(error).max() <= 1e-14 * (1.0 + np.abs(q).max()) + 1e-13 * size


@given(seeds, st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_a_constant_velocity_is_a_one_parameter_group(seed, first, second):
    rng = np.random.default_rng(seed)
    mechanism = random_mechanism(rng, 4, moving_kinds)
    q, v = random_state(rng, mechanism)
    halfway = mechanism.integrate(mechanism.integrate(q, v, first), v, second)
    whole = mechanism.integrate(q, v, first + second)
    assert np.abs(mechanism.difference(halfway, whole)).max() <= 1e-12


@pytest.mark.parametrize("kind", ["continuous", "spherical", "free_flyer", "planar_se2"])
def test_the_unit_length_survives_a_million_radians(kind):
    mechanism = alone(kind)
    q = mechanism.neutral()
    for _ in range(1000):
        q = mechanism.integrate(q, np.full(mechanism.nv, 1e3))
    unit = [i for i, u in enumerate(mechanism.coordinate_units) if u == "1"]
    assert abs(np.linalg.norm(q[unit]) - 1.0) <= 1e-15


def test_quaternions_move_continuously_through_whole_turns():
    mechanism = alone("spherical")
    q = mechanism.neutral()
    for _ in range(100):
        there = mechanism.integrate(q, np.array([0.0, 0.2, 0.0]))
        assert there @ q > 0.9  # no jump to -q
        q = there


@pytest.mark.parametrize("angle", [0.0, 1e-12, 0.99e-4, 1.01e-4, 1.0, 3.0])
def test_a_turning_flyer_follows_its_circle(angle):
    """Velocity u along x and omega about z, in body axes: an arc of radius u / omega."""
    for kind, v in (("free_flyer", [1, 0, 0, 0, 0, angle]), ("planar_se2", [1, 0, angle])):
        mechanism = alone(kind)
        q = mechanism.integrate(mechanism.neutral(), np.array(v, dtype=float))
        half = 0.5 * angle
        expected = [np.sinc(angle / np.pi), np.sin(half) * np.sinc(half / np.pi)]
        np.testing.assert_allclose(q[:2], expected, atol=2e-16)
