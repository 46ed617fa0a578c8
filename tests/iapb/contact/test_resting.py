"""Resting forces (5), (6): sign, clamp, friction cone, action and reaction, and the energy they take."""

from __future__ import annotations

from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.contact.contacts import contact_rows, find_contacts
from iapb.contact.geometry import HalfPlane, box, make_shapes
from iapb.contact.kernels import resting as kernels
from iapb.contact.resting import resting_forces
from iapb.errors import ArgumentError
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from iapb.scene import Scene

STIFFNESS, DAMPING = 1000.0, 50.0  # the paper's walls


def boxes(count):
    inertia = 0.005 * np.eye(3)
    return Mechanism(
        [
            Body(f"box {k}", None, Joint("planar"), (np.eye(3), np.zeros(3)), 2.0, np.zeros(3), inertia)
            for k in range(count)
        ]
    )


MECHANISM = boxes(2)
SHAPES = make_shapes([box((1.0, 0.6), body=0), box((0.5, 0.5), body=1), HalfPlane((0.0, 0.0), (0.2, 1.0))])
number = st.floats(-0.5, 0.5)
state = st.tuples(st.tuples(*[number] * 6), st.tuples(*[number] * 6))


@given(state, st.booleans(), st.floats(0.0, 1.0))
def test_force_is_the_printed_law_at_every_contact(state, clamped, friction):
    q, v = state
    found = find_contacts(MECHANISM, SHAPES, q, v, margin=0.05)
    forces = resting_forces(MECHANISM, found, q, STIFFNESS, DAMPING, clamped=clamped, friction=friction)
    touching = found.gap <= 0.0
    printed = np.where(touching, -STIFFNESS * found.gap - DAMPING * found.normal_velocity, 0.0)
    expected = np.maximum(printed, 0.0) if clamped else printed
    assert forces.normal_force == pytest.approx(expected, abs=1e-12)
    jacobian, _ = contact_rows(MECHANISM, found, q)
    assert forces.penalty_force == pytest.approx(jacobian.T @ forces.normal_force, abs=1e-11)


@given(state, st.floats(0.0, 1.0), st.booleans())
def test_friction_stays_in_its_cone_opposes_sliding_and_never_adds_energy(state, friction, clamped):
    q, v = state
    found = find_contacts(MECHANISM, SHAPES, q, v)
    forces = resting_forces(
        MECHANISM, found, q, STIFFNESS, DAMPING, clamped=clamped, friction=friction, friction_velocity=1e-2
    )
    size = np.linalg.norm(forces.friction_force, axis=1)
    pressing = np.maximum(forces.normal_force, 0.0)
    assert np.all(size <= friction * pressing * (1.0 + 1e-14))
    assert np.sum(forces.friction_force * found.normal, axis=1) == pytest.approx(0.0, abs=1e-9)
    speed = np.linalg.norm(found.tangential_velocity, axis=1)
    assert size == pytest.approx(friction * pressing * np.minimum(speed / 1e-2, 1.0), abs=1e-9)
    assert forces.generalized_friction @ v <= 1e-9
    at_contacts = np.sum(forces.friction_force * found.tangential_velocity)
    assert forces.generalized_friction @ v == pytest.approx(at_contacts, abs=1e-9)


@given(state, st.floats(0.0, 1.0))
def test_forces_between_two_boxes_cancel_in_sum(state, friction):
    q, v = state
    found = find_contacts(MECHANISM, SHAPES, q, v, pairs=np.array([[0, 1]], np.int32))
    forces = resting_forces(MECHANISM, found, q, STIFFNESS, DAMPING, friction=friction)
    total = forces.penalty_force + forces.generalized_friction
    assert total[:2] == pytest.approx(-total[3:5], abs=1e-10)
    moment = total[2] + total[5] + q[0] * total[1] - q[1] * total[0] + q[3] * total[4] - q[4] * total[3]
    assert moment == pytest.approx(0.0, abs=1e-9)  # angular momentum about the world origin


def test_the_clamp_cuts_only_what_pulls():
    assert kernels.normal_force(-1e-3, 0.1, STIFFNESS, DAMPING, False) == pytest.approx(-4.0)
    assert kernels.normal_force(-1e-3, 0.1, STIFFNESS, DAMPING, True) == 0.0
    assert kernels.normal_force(-1e-3, -0.1, STIFFNESS, DAMPING, True) == pytest.approx(6.0)


def test_a_pulling_contact_gets_no_friction_and_a_negative_share_would_drive_it():
    assert kernels.friction_share(-4.0, 0.1, 0.5, 1e-3) == 0.0
    assert kernels.friction_share(4.0, 0.1, 0.5, 1e-3) < 0.0  # the sign that (6) gives a pulling contact is opposite


def test_without_friction_its_code_is_not_entered(monkeypatch):
    entered = []
    monkeypatch.setattr(kernels, "add_friction", lambda *arguments: entered.append(arguments))
    monkeypatch.setattr(kernels, "resting_force", kernels.resting_force.py_func)
    q = np.array([0.0, 0.29, 0.1, 5.0, 5.0, 0.0])
    found = find_contacts(MECHANISM, SHAPES, q, np.ones(6))
    workspace = MECHANISM.workspace()
    from iapb.mechanics.kernels import forward_kinematics

    forward_kinematics(MECHANISM.arrays, q, workspace)
    for friction, entries in ((0.0, 0), (0.3, len(found))):
        kernels.resting_forces.py_func(
            MECHANISM.arrays, workspace, found._buffer, len(found), STIFFNESS, DAMPING, True, friction, 1e-3,
            np.zeros(6), np.zeros(6),
        )
        assert len(entered) == entries and len(found) > 0


def test_wrong_constants_are_named():
    q = np.zeros(6)
    found = find_contacts(MECHANISM, SHAPES, q, q)
    for wrong in ({"stiffness": -1.0}, {"damping": -1.0}, {"friction": np.nan}):
        with pytest.raises(ArgumentError) as caught:
            resting_forces(MECHANISM, found, q, **{"stiffness": STIFFNESS, **wrong})
        assert caught.value.argument in wrong
    with pytest.raises(ArgumentError, match="friction_velocity"):
        resting_forces(MECHANISM, found, q, STIFFNESS, friction=0.5, friction_velocity=0.0)


def test_what_is_found_cannot_be_replaced() -> None:
    q = np.zeros(6)
    found = find_contacts(MECHANISM, SHAPES, q, q)
    forces = resting_forces(MECHANISM, found, q, STIFFNESS, DAMPING)
    for answer in (found, forces):
        with pytest.raises(FrozenInstanceError):
            setattr(answer, next(iter(answer.__dataclass_fields__)), None)


def test_the_threshold_that_is_not_said_is_that_of_a_scene() -> None:
    q, v = np.zeros(6), np.array([0.3, -0.2, 0.1, 0.0, 0.0, 0.0])
    threshold = Scene.model_fields["contact"].get_default(call_default_factory=True).friction_velocity
    found = find_contacts(MECHANISM, SHAPES, q, v)
    said = resting_forces(MECHANISM, found, q, STIFFNESS, friction=0.3, friction_velocity=threshold)
    assert len(found) > 0 and np.any(said.friction_force != 0.0)
    left_out = resting_forces(MECHANISM, found, q, STIFFNESS, friction=0.3)
    np.testing.assert_array_equal(left_out.friction_force, said.friction_force)
