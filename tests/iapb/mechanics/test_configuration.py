"""Moving on the configuration manifold: integrate and difference, and joints against the matrix
exponential."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from iapb.mechanics.joints import KINDS
from iapb.mechanics.kernels.configuration import SMALL_ANGLE
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


@pytest.mark.parametrize("kind", ["continuous", "spherical", "free_flyer"])
def test_the_unit_length_survives_a_million_radians(kind):
    mechanism = alone(kind)
    q = mechanism.neutral()
    for _ in range(1000):
        q = mechanism.integrate(q, np.full(mechanism.nv, 1e3))
    unit = [i for i, u in enumerate(mechanism.coordinate_units) if u == "1"]
    assert abs(np.linalg.norm(q[unit]) - 1.0) <= 1e-15


ANGLES = [
    0.0,
    1e-9,
    0.6 * SMALL_ANGLE,
    0.99 * SMALL_ANGLE,
    1.01 * SMALL_ANGLE,
    0.01,
    1.0,
    3.0,
    3.5,
    6.0,
]


@pytest.mark.parametrize("angle", ANGLES)
def test_a_free_flyer_moves_by_the_exponential_of_its_twist_and_back(angle: float) -> None:
    flyer = Mechanism([Body("b", None, Joint("free_flyer"), mass=1.0, inertia=np.eye(3))])
    for k in range(4):
        rng = np.random.default_rng(k)
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        start = Rotation.from_rotvec(rng.normal(size=3))
        u = rng.normal(size=3)
        twist = np.zeros((4, 4))
        twist[:3, :3] = np.cross(np.eye(3), angle * axis)
        twist[:3, 3] = u
        moved = expm(twist)
        q = np.array([*rng.normal(size=3), *start.as_quat()])
        there = flyer.integrate(q, np.array([*u, *(angle * axis)]))
        assert there[:3] == pytest.approx(q[:3] + start.as_matrix() @ moved[:3, 3], abs=1e-13)
        assert Rotation.from_quat(there[3:]).as_matrix() == pytest.approx(
            start.as_matrix() @ moved[:3, :3], abs=1e-13
        )
        assert there[3:] @ q[3:] == pytest.approx(
            abs(np.cos(0.5 * angle)), abs=1e-13
        )  # of q and −q the nearer one
        if angle < np.pi:
            assert flyer.difference(q, there) == pytest.approx([*u, *(angle * axis)], abs=1e-11)
        for sign in (1.0, -1.0):  # both quaternions of a rotation are the same place
            other = np.array([*there[:3], *(sign * there[3:])])
            assert flyer.difference(q, other) == pytest.approx(
                flyer.difference(q, there), abs=1e-13
            )
