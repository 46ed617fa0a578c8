"""Rotations as quaternions, against scipy's, in all four branches and on their edges."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from iapb.mechanics.kernels.evaluation import write_quaternion


def quaternion_of(rotation):
    found = np.empty(4)
    write_quaternion(rotation, found)
    return found


@given(st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4), st.integers(0, 3), st.sampled_from([-1.0, 1.0]))
def test_a_quaternion_is_that_of_its_rotation_divided_by_its_largest_component(small, largest, sign) -> None:
    """Errors of 1e-9 in the entries of the rotation give a quaternion off by as much, in every direction."""
    q = np.array(small)
    q[largest] = sign
    q /= np.linalg.norm(q)
    rotation = Rotation.from_quat(q).as_matrix()
    found = quaternion_of(rotation)
    assert found[3] >= 0.0
    assert min(np.abs(found - q).max(), np.abs(found + q).max()) <= 2e-15
    found = quaternion_of(rotation + 1e-9 * np.random.default_rng(1).uniform(-1.0, 1.0, (3, 3)))
    assert min(np.abs(found - q).max(), np.abs(found + q).max()) <= 1.6e-9


@pytest.mark.parametrize("axis", range(3))
def test_half_turns(axis: int) -> None:
    turned = -np.eye(3)
    turned[axis, axis] = 1.0
    assert np.array_equal(quaternion_of(turned), np.eye(4)[axis])
