"""Moving on the configuration manifold: integrate and difference, and joints against the matrix exponential."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from iapb.mechanics.joints import KINDS
from iapb.mechanics.kernels.configuration import (
    SMALL_ANGLE,
    inverse_screw,
    quaternion_difference,
    screw_coefficients,
    turn_pair,
    turn_quaternion,
    turn_vector,
)
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


ANGLES = [0.0, 1e-9, 0.6 * SMALL_ANGLE, 0.99 * SMALL_ANGLE, 1.01 * SMALL_ANGLE, 0.01, 1.0, 3.0, 3.5, 6.0]


def skew(a: np.ndarray) -> np.ndarray:
    return np.cross(np.eye(3), a)


def directions(count: int) -> np.ndarray:
    axes = np.random.default_rng(0).normal(size=(count, 3))
    return axes / np.linalg.norm(axes, axis=1)[:, None]


@pytest.mark.parametrize("angle", ANGLES)
def test_screw_coefficients_are_those_of_the_power_series(angle: float) -> None:
    """Σ (−1)ᵏ t²ᵏ / (2k + 2)! and / (2k + 3)!, to 1e-15: beyond SMALL_ANGLE the second loses digits as ε / t."""
    terms = np.array([(-1.0) ** k * angle ** (2 * k) for k in range(30)])
    factorials = np.cumprod(np.arange(1.0, 64.0))
    first, second = screw_coefficients(angle)
    assert first == pytest.approx(float(np.sum(terms / factorials[1:61:2])), abs=2e-15)
    lost = 4e-16 / angle**2 if angle >= SMALL_ANGLE else 0.0
    assert second == pytest.approx(float(np.sum(terms / factorials[2:62:2])), abs=2e-15 + lost)


@pytest.mark.parametrize("angle", ANGLES)
def test_a_free_flyer_moves_by_the_exponential_of_its_twist_and_back(angle: float) -> None:
    flyer = Mechanism([Body("b", None, Joint("free_flyer"), mass=1.0, inertia=np.eye(3))])
    for k, axis in enumerate(directions(4)):
        rng = np.random.default_rng(k)
        start, u = Rotation.from_rotvec(rng.normal(size=3)), rng.normal(size=3)
        twist = np.zeros((4, 4))
        twist[:3, :3], twist[:3, 3] = skew(angle * axis), u
        moved = expm(twist)
        q = np.array([*rng.normal(size=3), *start.as_quat()])
        there = flyer.integrate(q, np.array([*u, *(angle * axis)]))
        assert there[:3] == pytest.approx(q[:3] + start.as_matrix() @ moved[:3, 3], abs=1e-13)
        assert Rotation.from_quat(there[3:]).as_matrix() == pytest.approx(start.as_matrix() @ moved[:3, :3], abs=1e-13)
        assert there[3:] @ q[3:] == pytest.approx(abs(np.cos(0.5 * angle)), abs=1e-13)  # of q and −q the nearer one
        if angle < np.pi:
            assert flyer.difference(q, there) == pytest.approx([*u, *(angle * axis)], abs=1e-11)
        for sign in (1.0, -1.0):  # both quaternions of a rotation are the same place
            other = np.array([*there[:3], *(sign * there[3:])])
            assert flyer.difference(q, other) == pytest.approx(flyer.difference(q, there), abs=1e-13)


@pytest.mark.parametrize("angle", ANGLES)
def test_a_vector_a_pair_and_a_quaternion_turn_by_the_angle(angle: float) -> None:
    for axis in directions(3):
        turn, start = Rotation.from_rotvec(angle * axis), Rotation.from_rotvec([0.3, -0.5, 1.1])
        assert turn_vector(*turn.as_quat(), tuple(axis[::-1])) == pytest.approx(turn.apply(axis[::-1]), abs=1e-14)
        q, out = np.array([9.0, *(1.0 + 1e-9) * start.as_quat()]), np.full(5, 7.0)
        turn_quaternion(q, 1, tuple(angle * axis), out)
        assert out[0] == 7.0 and np.linalg.norm(out[1:]) == pytest.approx(1.0, abs=1e-15)
        assert Rotation.from_quat(out[1:]).as_matrix() == pytest.approx((start * turn).as_matrix(), abs=1e-14)
        back = quaternion_difference(q, out, 1)
        assert Rotation.from_rotvec(back).as_matrix() == pytest.approx(turn.as_matrix(), abs=1e-8)
        assert np.linalg.norm(back) <= np.pi + 1e-9
        pair = np.array([9.0, np.cos(0.4), np.sin(0.4)])
        turn_pair(pair, 1, angle, pair)
        assert pair == pytest.approx([9.0, np.cos(0.4 + angle), np.sin(0.4 + angle)], abs=1e-15)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.9 * SMALL_ANGLE, 1.1 * SMALL_ANGLE, 1e-2, 1.0, 3.0])
def test_the_inverse_screw_undoes_the_path_of_the_screw(angle: float) -> None:
    """u with (1 + A [φ]× + B [φ]×²) u = path."""
    for axis in directions(4):
        turn = skew(angle * axis)
        series = sum(np.linalg.matrix_power(turn, k) / np.prod(np.arange(1.0, k + 2.0)) for k in range(40))
        path = np.array([0.3, -1.0, 2.0])
        # The third coefficient loses digits as ε / t² above SMALL_ANGLE; t² multiplies it again.
        u = np.linalg.solve(series, path)
        assert inverse_screw(tuple(path), tuple(angle * axis)) == pytest.approx(u, abs=1e-14)
