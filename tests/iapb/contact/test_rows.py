"""Contact rows (11)-(14): rate of the gap, action and reaction, and exact zeros where there is only rounding."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.compiled import block
from iapb.contact.contacts import contact_rows, find_contacts
from iapb.contact.geometry import Circle, HalfPlane, box, make_contact_buffer, make_shapes
from iapb.contact.kernels import rows
from iapb.errors import ArgumentError
from iapb.mechanics.kernels import forward_kinematics, make_workspace
from iapb.mechanics.mechanism import Body, Joint, Mechanism

coordinate = st.floats(-1.0, 1.0)


def free_body(name="peg"):
    return Body(name, None, Joint("planar"), (np.eye(3), np.zeros(3)), 2.0, np.zeros(3), 0.005 * np.eye(3))


def free_bodies(count):
    return Mechanism([free_body(f"body {k}") for k in range(count)])


def arm(links=2):
    """A planar arm of unit rods that starts at (0.3, -0.2)."""
    bodies, parent, place = [], None, np.array([0.3, -0.2, 0.0])
    for k in range(links):
        bodies.append(
            Body(f"link {k}", parent, Joint("revolute"), (np.eye(3), place), 1.0, np.array([0.5, 0, 0]), np.eye(3) / 12)
        )
        parent, place = f"link {k}", np.array([1.0, 0.0, 0.0])
    return Mechanism(bodies)


@given(st.tuples(*[coordinate] * 6), st.tuples(*[coordinate] * 6), coordinate)
def test_rows_give_the_normal_velocity_and_the_rate_of_the_gap(q, v, turn):
    mechanism = free_bodies(2)
    shapes = make_shapes([box((1.0, 0.7), body=0), Circle(0.4, (0.1, 0.2), body=1), HalfPlane((0, turn), (0.3, 1.0))])
    found = find_contacts(mechanism, shapes, q, v, margin=10.0)
    jacobian, owner = contact_rows(mechanism, found, q)
    assert jacobian @ v == pytest.approx(found.normal_velocity[owner], abs=1e-12)
    assert np.sum(found.tangential_velocity * found.normal, axis=1) == pytest.approx(0.0, abs=1e-12)
    step = 1e-7
    later = find_contacts(mechanism, shapes, np.add(q, step * np.array(v)), v, margin=10.0)
    if np.array_equal(found.feature, later.feature) and np.array_equal(found.shape_a, later.shape_a):
        assert (later.gap - found.gap) / step == pytest.approx(found.normal_velocity, abs=1e-4)


@given(coordinate, coordinate, st.floats(-math.pi, math.pi))
def test_equal_and_opposite_rows_at_a_self_collision_conserve_momentum(x, y, angle):
    mechanism = free_bodies(2)
    shapes = make_shapes([box((1.0, 1.0), body=0), box((0.5, 0.5), body=1)])
    q = [x, y, angle, 0.0, 0.0, 0.0]
    found = find_contacts(mechanism, shapes, q, np.zeros(6), margin=5.0)
    relative, _ = contact_rows(mechanism, found, q)
    assert relative[:, :2] == pytest.approx(-relative[:, 3:5], abs=0.0)  # linear momentum
    separate, owner = contact_rows(mechanism, found, q, self_collision_rows="per_body")
    assert len(separate) == 2 * len(found)
    assert np.array_equal(separate[0::2] - separate[1::2], relative) and np.array_equal(owner[::2], owner[1::2])


@given(st.floats(-math.pi, math.pi), st.floats(0.05, 0.95))
def test_an_arm_struck_along_itself_has_an_exact_zero_row(angle, share):
    """Both sides of the tolerance: rounding of the kinematics vanishes, a tilt of 1e-9 rad stays."""
    mechanism = arm()
    q = np.array([angle, 0.0])
    arrays, workspace, row = block(mechanism.arrays), block(make_workspace(2, 2)), np.zeros(2)
    forward_kinematics(arrays, q, workspace)
    along = np.array([math.cos(angle), math.sin(angle), 0.0])
    point = workspace.position[1] + share * along
    rows.body_row(arrays, workspace, 1, point, along, row)
    assert np.array_equal(row, [0.0, 0.0])
    tilted = along + 1e-9 * np.array([-along[1], along[0], 0.0])
    rows.body_row(arrays, workspace, 1, point, tilted, row)
    assert row == pytest.approx([1e-9 * (1.0 + share), 1e-9 * share], rel=1e-5)


@given(st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi))
def test_a_blow_at_the_joint_itself_has_no_lever(angle, direction):
    mechanism = arm()
    arrays, workspace, row = block(mechanism.arrays), block(make_workspace(2, 2)), np.zeros(2)
    forward_kinematics(arrays, np.array([angle, 0.3]), workspace)
    normal = np.array([math.cos(direction), math.sin(direction), 0.0])
    rounding = 1e-16 * np.array([-normal[1], normal[0], 0.0])
    rows.body_row(arrays, workspace, 0, workspace.position[0] + rounding, normal, row)
    assert np.array_equal(row, [0.0, 0.0])
    beside = workspace.position[0] + 1e-9 * np.array([-normal[1], normal[0], 0.0])
    rows.body_row(arrays, workspace, 0, beside, normal, row)
    assert abs(row[0]) == pytest.approx(1e-9, rel=1e-5)


def test_a_dof_that_carries_both_bodies_has_an_exact_zero_entry():
    mechanism = arm(3)
    contact = block(make_contact_buffer(1))
    contact.point[0, :2], contact.normal[0, :2] = (0.7, 0.4), (0.6, 0.8)
    contact.body_a[0], contact.body_b[0] = 2, 0
    arrays, workspace, row = block(mechanism.arrays), block(make_workspace(3, 3)), np.zeros(3)
    forward_kinematics(arrays, np.array([0.3, 0.5, -0.7]), workspace)
    rows.contact_row(arrays, workspace, contact, 0, row)
    assert row[0] == 0.0 and row[1] != 0.0 and row[2] != 0.0


def test_a_wrong_choice_of_rows_is_named():
    mechanism, shapes = free_bodies(1), make_shapes([Circle(0.1, body=0)])
    found = find_contacts(mechanism, shapes, np.zeros(3), np.zeros(3))
    with pytest.raises(ArgumentError, match="self_collision_rows"):
        contact_rows(mechanism, found, np.zeros(3), self_collision_rows="both")


TINY = 1e-200  # its square is no number any more


@pytest.mark.parametrize("small", [0.0, TINY, 1e-9, 0.3])
@pytest.mark.parametrize("order", [(0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)])
def test_tangents_of_every_normal_are_orthonormal_to_it(small, order):
    normal = np.array([0.0, small, 1.0])[list(order)]
    normal /= np.linalg.norm(normal)
    frame = np.array([normal, *(rows.tangent_of(tuple(normal), which, 2) for which in range(2))])
    assert frame @ frame.T == pytest.approx(np.eye(3), abs=1e-15)
    flat = np.array([normal[0], -normal[1] - normal[2], 0.0])
    in_plane = rows.tangent_of(tuple(flat), 0, 1)
    assert in_plane == pytest.approx(np.cross([0.0, 0.0, 1.0], flat), abs=0.0)  # a quarter turn to the left
