"""Rotations as quaternions, against scipy's, in all four branches and on their edges."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from iapb.mechanics.kernels.evaluation import quaternion_of


def rotations() -> np.ndarray:
    """Random ones, those near each half turn (w near 0), near none, and quaternions with two like components."""
    rng = np.random.default_rng(0)
    quaternions = [rng.normal(size=(200, 4))]
    for axis in range(4):
        near = rng.normal(scale=0.05, size=(40, 4))
        near[:, axis] += np.where(rng.random(40) < 0.5, 1.0, -1.0)
        quaternions.append(near)
    for first in range(4):
        for second in range(first):
            alike = rng.normal(scale=0.3, size=(20, 4))
            alike[:, first] += 1.0
            alike[:, second] = alike[:, first] * rng.choice([-1.0, 1.0], 20) * (1.0 + rng.normal(scale=0.01, size=20))
            quaternions.append(alike)
    given = np.concatenate(quaternions)
    return given / np.linalg.norm(given, axis=1)[:, None]


def test_a_quaternion_is_that_of_its_rotation_with_a_scalar_part_that_is_not_negative() -> None:
    largest = set()
    for given in rotations():
        found = np.array(quaternion_of(Rotation.from_quat(given).as_matrix()))
        largest.add(int(np.argmax(np.abs(given))))
        assert found[3] >= 0.0
        # 1e-15: the component divided by is at least ½, so that nothing is amplified
        np.testing.assert_allclose(found, given if given[3] >= 0.0 else -given, rtol=0.0, atol=1e-15)
    assert largest == {0, 1, 2, 3}


@pytest.mark.parametrize("axis", range(3))
def test_half_turns(axis: int) -> None:
    turned = -np.eye(3)
    turned[axis, axis] = 1.0
    assert np.array_equal(quaternion_of(turned), np.eye(4)[axis])


def test_the_component_divided_by_is_the_largest_one() -> None:
    """A rotation with errors of 1e-9 in its entries gives a quaternion off by as much, in every direction."""
    rng = np.random.default_rng(1)
    for given in rotations():
        error = 1e-9 * rng.uniform(-1.0, 1.0, (3, 3))
        found = np.array(quaternion_of(Rotation.from_quat(given).as_matrix() + error))
        # Near w = 0 the sign is that of an error
        off = min(np.abs(found - given).max(), np.abs(found + given).max())
        assert off <= 1.6e-9
