"""Contact rows (11)-(14), velocities and resting forces (4)-(6): against Jacobians of points, and exact zeros."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.compiled import block
from iapb.contact.geometry import make_contact_buffer
from iapb.contact.kernels.resting import friction_share, normal_force, resting_force
from iapb.contact.kernels.rows import (
    body_row,
    contact_row,
    contact_velocities,
    direction_row,
    tangent_of,
    twist,
)
from iapb.mechanics.joints import KINDS
from iapb.mechanics.kernels.arrays import make_workspace
from iapb.mechanics.kernels.kinematics import forward_kinematics
from iapb.mechanics.mechanism import Body, Joint, Mechanism
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
    """Row nᵀ(J_a − J_b) (11), (12), the difference of (13) and (14); velocity along the normal, and the rest of it."""
    mechanism, workspace, contacts, (q, v), count = touching(seed)
    arrays = block(mechanism.arrays)
    row, ours, theirs = np.full((3, mechanism.nv), np.nan)
    contact_velocities(arrays, workspace, v, contacts, count)
    for i in range(count):
        J, n = relative_jacobian(mechanism, contacts, i, q), contacts.normal[i]
        relative = J @ v
        contact_row(arrays, workspace, contacts, i, row)
        body_row(arrays, workspace, contacts.body_a[i], contacts.point[i], n, ours)
        body_row(arrays, workspace, contacts.body_b[i], contacts.point[i], n, theirs)
        assert row == pytest.approx(n @ J, abs=1e-11)
        assert ours - theirs == pytest.approx(row, abs=1e-11)
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


def test_the_clamp_cuts_only_what_pulls_and_a_pulling_contact_gets_no_friction() -> None:
    assert normal_force(-1e-3, 0.1, 1000.0, 50.0, False) == pytest.approx(-4.0)
    assert normal_force(-1e-3, 0.1, 1000.0, 50.0, True) == 0.0
    assert normal_force(-1e-3, -0.1, 1000.0, 50.0, True) == pytest.approx(6.0)
    assert friction_share(-4.0, 0.1, 0.5, 1e-3) == 0.0
    assert friction_share(4.0, 0.1, 0.5, 1e-3) < 0.0  # the sign that (6) gives a pulling contact is opposite


def arm(links: int = 2) -> Mechanism:
    """A planar arm of unit rods that starts at (0.3, -0.2)."""
    bodies, parent, place = [], None, np.array([0.3, -0.2, 0.0])
    for k in range(links):
        bodies.append(
            Body(f"link {k}", parent, Joint("revolute"), (np.eye(3), place), 1.0, np.array([0.5, 0, 0]), np.eye(3) / 12)
        )
        parent, place = f"link {k}", np.array([1.0, 0.0, 0.0])
    return Mechanism(bodies)


@given(st.floats(-math.pi, math.pi), st.floats(0.05, 0.95))
def test_an_arm_struck_along_itself_has_an_exact_zero_row(angle: float, share: float) -> None:
    """Both sides of the tolerance: rounding of the kinematics vanishes, a tilt of 1e-9 rad stays."""
    mechanism = arm()
    q = np.array([angle, 0.0])
    arrays, workspace, row = block(mechanism.arrays), block(make_workspace(2, 2)), np.zeros(2)
    forward_kinematics(arrays, q, workspace)
    along = np.array([math.cos(angle), math.sin(angle), 0.0])
    point = workspace.position[1] + share * along
    body_row(arrays, workspace, 1, point, along, row)
    assert np.array_equal(row, [0.0, 0.0])
    tilted = along + 1e-9 * np.array([-along[1], along[0], 0.0])
    body_row(arrays, workspace, 1, point, tilted, row)
    assert row == pytest.approx([1e-9 * (1.0 + share), 1e-9 * share], rel=1e-5)


@given(st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi))
def test_a_blow_at_the_joint_itself_has_no_lever(angle: float, direction: float) -> None:
    mechanism = arm()
    arrays, workspace, row = block(mechanism.arrays), block(make_workspace(2, 2)), np.zeros(2)
    forward_kinematics(arrays, np.array([angle, 0.3]), workspace)
    normal = np.array([math.cos(direction), math.sin(direction), 0.0])
    rounding = 1e-16 * np.array([-normal[1], normal[0], 0.0])
    body_row(arrays, workspace, 0, workspace.position[0] + rounding, normal, row)
    assert np.array_equal(row, [0.0, 0.0])
    beside = workspace.position[0] + 1e-9 * np.array([-normal[1], normal[0], 0.0])
    body_row(arrays, workspace, 0, beside, normal, row)
    assert abs(row[0]) == pytest.approx(1e-9, rel=1e-5)


def test_a_dof_that_carries_both_bodies_has_an_exact_zero_entry() -> None:
    mechanism = arm(3)
    contact = block(make_contact_buffer(1))
    contact.point[0, :2], contact.normal[0, :2] = (0.7, 0.4), (0.6, 0.8)
    contact.body_a[0], contact.body_b[0] = 2, 0
    arrays, workspace, row = block(mechanism.arrays), block(make_workspace(3, 3)), np.zeros(3)
    forward_kinematics(arrays, np.array([0.3, 0.5, -0.7]), workspace)
    contact_row(arrays, workspace, contact, 0, row)
    assert row[0] == 0.0 and row[1] != 0.0 and row[2] != 0.0


TINY = 1e-200  # its square is no number any more


@pytest.mark.parametrize("small", [0.0, TINY, 1e-9, 0.3])
@pytest.mark.parametrize("order", [(0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)])
def test_tangents_of_every_normal_are_orthonormal_to_it(small: float, order: tuple[int, ...]) -> None:
    normal = np.array([0.0, small, 1.0])[list(order)]
    normal /= np.linalg.norm(normal)
    frame = np.array([normal, *(tangent_of(tuple(normal), which, 2) for which in range(2))])
    assert frame @ frame.T == pytest.approx(np.eye(3), abs=1e-15)
    flat = np.array([normal[0], -normal[1] - normal[2], 0.0])
    in_plane = tangent_of(tuple(flat), 0, 1)
    assert in_plane == pytest.approx(np.cross([0.0, 0.0, 1.0], flat), abs=0.0)  # a quarter turn to the left
