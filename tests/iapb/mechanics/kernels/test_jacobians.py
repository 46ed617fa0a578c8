"""Kernels of single points of a random tree against the sums over its dofs, and vectors against numpy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.compiled import block
from iapb.mechanics.joints import KINDS
from iapb.mechanics.kernels import add_point_force, forward_kinematics, vectors
from iapb.mechanics.kernels.kinematics import frame_jacobian, motion_at, point_jacobian, point_velocity
from iapb.mechanics.mechanism import Mechanism
from reference.random_mechanisms import random_mechanism, random_state


def placed(seed: int) -> tuple[Mechanism, Any, Any, np.ndarray, np.random.Generator]:
    rng = np.random.default_rng(seed)
    mechanism = random_mechanism(rng, 6, tuple(kind for kind in KINDS if kind != "fixed"), trees=2)
    q, v = random_state(rng, mechanism)
    arrays, workspace = block(mechanism.arrays), block(mechanism.workspace())
    forward_kinematics(arrays, q, workspace)
    return mechanism, arrays, workspace, v, rng


def carried(arrays: Any, k: int, body: int) -> bool:
    """Does dof k move the body: is its own body on the way from there to the world?"""
    while body >= 0:
        if arrays.dof_body[k] == body:
            return True
        body = int(arrays.parent[body])
    return False


@pytest.mark.parametrize("seed", range(5))
def test_points_and_frames_move_with_the_dofs_on_their_way_to_the_world(seed: int) -> None:
    """Per unit rate: the axis of a sliding dof, axis × (x − origin) of a turning one; F does the work F · velocity."""
    mechanism, arrays, w, v, rng = placed(seed)
    d = mechanism.nv
    for body in range(6):
        x, force = rng.normal(size=3), rng.normal(size=3)
        moving, turning, at_origin = np.zeros((3, d)), np.zeros((3, d)), np.zeros((3, d))
        for k in range(d):
            axis, origin = w.axis[k], w.position[arrays.dof_body[k]]
            turns = bool(arrays.dof_rotates[k])
            motion = np.cross(axis, x - origin) if turns else axis
            assert motion_at(arrays, w, k, tuple(x)) == pytest.approx(motion, abs=1e-13)
            if carried(arrays, k, body):
                moving[:, k], turning[:, k] = motion, turns * axis
                at_origin[:, k] = np.cross(axis, w.position[body] - origin) if turns else axis
        out = np.full((3, d), np.nan)
        point_jacobian(arrays, w, body, x, out)
        assert out == pytest.approx(moving, abs=1e-13)
        frame = np.full((6, d), np.nan)
        frame_jacobian(arrays, w, body, frame)
        assert frame == pytest.approx(np.vstack([at_origin, turning]), abs=1e-13)
        velocity, work = np.full(3, np.nan), np.ones(d)
        point_velocity(arrays, w, body, x, v, velocity)
        assert velocity == pytest.approx(moving @ v, abs=1e-12)
        add_point_force(arrays, w, body, x, force, work)
        assert work - 1.0 == pytest.approx(moving.T @ force, abs=1e-12)
    velocity, work = np.full(3, np.nan), np.ones(d)
    point_velocity(arrays, w, -1, x, v, velocity)
    add_point_force(arrays, w, -1, x, force, work)
    assert not velocity.any() and np.array_equal(work, np.ones(d))  # the static world


def test_vectors_are_what_numpy_says() -> None:
    rng = np.random.default_rng(0)
    for _ in range(5):
        a, b = rng.normal(size=(2, 3))
        ta, tb, s = tuple(a), tuple(b), float(rng.normal())
        rows, frames = rng.normal(size=(4, 3)), rng.normal(size=(4, 3, 3))
        assert vectors.load(rows, 2) == tuple(rows[2])
        assert vectors.add(ta, tb) == tuple(a + b) and vectors.subtract(ta, tb) == tuple(a - b)
        assert vectors.scale(s, ta) == tuple(s * a)
        assert vectors.dot(ta, tb) == pytest.approx(a @ b, abs=1e-15)
        assert vectors.cross(ta, tb) == pytest.approx(np.cross(a, b), abs=1e-15)
        assert vectors.transform(frames, 1, ta) == pytest.approx(frames[1] @ a, abs=1e-14)
        assert vectors.transform_back(frames, 1, ta) == pytest.approx(frames[1].T @ a, abs=1e-14)
        assert vectors.column(frames, 3, 1) == tuple(frames[3, :, 1])
        before, old, turned = frames[1].copy(), rows.copy(), frames.copy()
        vectors.turn_frame(turned, 1, ta, tb, (0.5, s, -1.0))
        assert turned[1] == pytest.approx(before @ np.column_stack([a, b, [0.5, s, -1.0]]), abs=1e-14)
        vectors.store_columns(frames, 1, ta, tb, (0.5, s, -1.0))
        assert np.array_equal(frames[1], np.column_stack([a, b, [0.5, s, -1.0]]))
        vectors.store(rows, 1, ta)
        vectors.accumulate(rows, 3, tb)
        assert np.array_equal(rows, [old[0], a, old[2], old[3] + b])
