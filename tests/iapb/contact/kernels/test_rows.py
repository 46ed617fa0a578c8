"""Rows and velocities of contacts in space, of random trees, against Jacobians of points."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.compiled import block
from iapb.contact.geometry import make_contact_buffer
from iapb.contact.kernels.resting import resting_force
from iapb.contact.kernels.rows import (
    contact_velocities,
    direction_row,
    relative_jacobian_rows,
    tangent_of,
    twist,
)
from iapb.mechanics.joints import KINDS
from iapb.mechanics.kernels import forward_kinematics
from iapb.mechanics.mechanism import Mechanism
from reference.random_mechanisms import random_mechanism, random_state

MOVING = tuple(kind for kind in KINDS if kind != "fixed")


def touching(seed: int) -> tuple[Mechanism, Any, Any, Any, int]:
    """A random mechanism at a random state with contacts between its bodies, and with the world."""
    rng = np.random.default_rng(seed)
    mechanism = random_mechanism(rng, 5, MOVING, trees=2)
    q, v = random_state(rng, mechanism)
    count = 8
    contacts: Any = block(make_contact_buffer(count))
    contacts.point[:], contacts.normal[:] = rng.normal(size=(count, 3)), rng.normal(size=(count, 3))
    contacts.normal[:] /= np.linalg.norm(contacts.normal, axis=1)[:, None]
    contacts.body_a[:] = rng.integers(0, 5, count)
    contacts.body_b[:] = (contacts.body_a + rng.integers(1, 5, count)) % 5
    contacts.body_b[:3], contacts.gap[:] = -1, rng.uniform(-1.0, 0.0, count)
    workspace = block(mechanism.workspace())
    forward_kinematics(block(mechanism.arrays), q, workspace)
    return mechanism, workspace, contacts, (q, v), count


def relative_jacobian(mechanism: Mechanism, contacts: Any, i: int, q: np.ndarray) -> np.ndarray:
    """J_a − J_b (3, d) of the point of contact i; the world does not move."""
    x = contacts.point[i]
    both = mechanism.point_jacobian(q, int(contacts.body_a[i]), x)
    return both - mechanism.point_jacobian(q, int(contacts.body_b[i]), x) if contacts.body_b[i] >= 0 else both


@pytest.mark.parametrize("seed", range(5))
def test_a_contact_moves_as_its_points_on_both_bodies_do(seed: int) -> None:
    """Row nᵀ(J_a − J_b) (11), (12); velocity along the normal, and the rest of it."""
    mechanism, workspace, contacts, (q, v), count = touching(seed)
    arrays = block(mechanism.arrays)
    rows, row = np.full((count, mechanism.nv), np.nan), np.full(mechanism.nv, np.nan)
    relative_jacobian_rows(arrays, workspace, contacts, count, rows)
    contact_velocities(arrays, workspace, v, contacts, count)
    for i in range(count):
        J, n = relative_jacobian(mechanism, contacts, i, q), contacts.normal[i]
        relative = J @ v
        assert rows[i] == pytest.approx(n @ J, abs=1e-11)
        assert contacts.normal_velocity[i] == pytest.approx(n @ relative, abs=1e-11)
        assert contacts.tangential_velocity[i] == pytest.approx(relative - (n @ relative) * n, abs=1e-11)
        direction = np.cross(n, [0.6, 0.0, 0.8])
        direction_row(arrays, workspace, contacts, i, tuple(direction), row)
        assert row == pytest.approx(direction @ J, abs=1e-11)
        body = int(contacts.body_a[i])
        origin, velocity, spin = (np.array(vector) for vector in twist(arrays, workspace, body, v))
        at_point = velocity + np.cross(spin, contacts.point[i] - origin)
        assert at_point == pytest.approx(mechanism.point_jacobian(q, body, contacts.point[i]) @ v, abs=1e-11)
    assert twist(arrays, workspace, -1, v) == ((0.0, 0.0, 0.0),) * 3


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("clamped", [False, True])
def test_resting_forces_act_on_both_bodies_at_the_point(seed: int, clamped: bool) -> None:
    """(5) F_n = −K s − B v_n; (6) −μ F_n t above the threshold, in proportion below it; Jᵀ(F_n n + F_f)."""
    mechanism, workspace, contacts, (q, v), count = touching(seed)
    K, B, mu, threshold = 3.0, 0.7, 0.4, 1.0
    arrays, rng = block(mechanism.arrays), np.random.default_rng(seed)
    contact_velocities(arrays, workspace, v, contacts, count)
    contacts.tangential_velocity[::2] *= 0.1
    seen = set()
    for i in range(count):
        start = rng.normal(size=(2, mechanism.nv))
        penalty, drag = start.copy()
        resting_force(arrays, workspace, contacts, i, K, B, clamped, mu, threshold, penalty, drag)
        force = -K * contacts.gap[i] - B * contacts.normal_velocity[i]
        force = max(force, 0.0) if clamped else force
        tangential = contacts.tangential_velocity[i]
        friction = -mu * max(force, 0.0) * tangential / max(float(np.linalg.norm(tangential)), threshold)
        J = relative_jacobian(mechanism, contacts, i, q)
        assert contacts.normal_force[i] == pytest.approx(force, abs=1e-13)
        assert contacts.friction_force[i] == pytest.approx(friction, abs=1e-13)
        assert penalty - start[0] == pytest.approx(J.T @ contacts.normal[i] * force, abs=1e-10)
        assert drag - start[1] == pytest.approx(J.T @ friction, abs=1e-10)
        seen.add(bool(force > 0.0))
    contacts.gap[0] = 1e-3
    penalty, drag = np.zeros(mechanism.nv), np.zeros(mechanism.nv)
    resting_force(arrays, workspace, contacts, 0, K, B, clamped, mu, threshold, penalty, drag)
    assert contacts.normal_force[0] == 0.0 and not contacts.friction_force[0].any() and not penalty.any()
    assert True in seen


def test_tangents_span_what_the_normal_leaves() -> None:
    """Orthonormal to every normal; the first also to the axis that is farthest from the normal."""
    rng = np.random.default_rng(5)
    for _ in range(40):
        n = rng.normal(size=3) * rng.permutation([0.1, 1.0, 3.0])
        n /= np.linalg.norm(n)
        first, second = (np.array(tangent_of(tuple(n), which, 2)) for which in range(2))
        assert np.array([n, first, second]) @ np.array([n, first, second]).T == pytest.approx(np.eye(3), abs=1e-14)
        assert first[np.argmin(np.abs(n))] == 0.0
        assert np.cross(n, first) == pytest.approx(second, abs=1e-14)
