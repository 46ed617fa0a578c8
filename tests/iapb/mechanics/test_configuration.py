"""Moving on the configuration manifold: integrate and difference, and joints against Pinocchio."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from iapb.mechanics.joints import KINDS
from iapb.mechanics.kernels.configuration import SMALL_ANGLE
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from reference.random_mechanisms import random_mechanism, random_state
from reference.rigid_body import model_of

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
def test_a_free_flyer_moves_as_in_pinocchio_and_back(angle: float) -> None:
    flyer = alone("free_flyer")
    theirs = model_of(flyer)
    for seed in range(4):
        rng = np.random.default_rng(seed)
        axis = rng.normal(size=3)
        twist = np.array([*rng.normal(size=3), *(angle * axis / np.linalg.norm(axis))])
        q = np.array([*rng.normal(size=3), *Rotation.random(random_state=seed).as_quat()])
        there = flyer.integrate(q, twist)
        assert there == pytest.approx(theirs.integrate(q, twist, 1.0), abs=1e-13)
        # of q and −q the nearer one
        assert there[3:] @ q[3:] == pytest.approx(abs(np.cos(0.5 * angle)), abs=1e-13)
        straight = flyer.difference(q, there)
        assert angle > np.pi or straight == pytest.approx(twist, abs=1e-11)
        other = there * [1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0]  # the same place
        assert flyer.difference(q, other) == pytest.approx(straight, abs=1e-13)
