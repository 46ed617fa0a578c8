"""C06 on an arm: outcomes agree where they must; the two arms written independently are one; a wrong map is seen."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from verification.check import Study
from verification.mechanics import coordinate_invariance as study
from verification.mechanics.planar_arm import Contact

angles = st.tuples(*[st.floats(-3.0, 3.0)] * 3)


@given(angles, st.integers(0, 2), st.floats(0.0, 1.0), st.floats(-3.0, 3.0))
def test_the_arm_in_absolute_angles_is_the_engines_arm(q, link, distance, normal):
    q = np.array(q)
    mechanism, r = study.ARM.mechanism(), np.cumsum(q)
    turn = np.tril(np.ones((3, 3)))  # dr/dq
    mass = turn.T @ study.ARM.absolute_mass_matrix(r) @ turn
    np.testing.assert_allclose(mass, mechanism.mass_matrix(q), atol=1e-14)
    contact = Contact(link, distance, normal)
    row = study.ARM.absolute_row(r, contact) @ turn
    np.testing.assert_allclose(row, study.ARM.joint_rows(mechanism, q, (contact,))[0], atol=1e-14)


def test_the_hands_jacobian_is_the_derivative_of_its_place():
    mechanism, q, step = study.ARM.mechanism(), np.array([0.3, 1.1, -0.4]), 1e-6

    def place(q):
        rotations, positions = mechanism.placements(q)
        return np.append((positions[1] + study.ARM.lengths[1] * rotations[1][:, 0])[:2], q.sum())

    steps = step * np.eye(3)
    slopes = np.array([(place(q + h) - place(q - h)) / (2 * step) for h in steps]).T
    np.testing.assert_allclose(study.ARM.hand_jacobian(mechanism, q), slopes, atol=1e-9)


@pytest.fixture(scope="module")
def finding():
    return study.COORDINATES.table(Study())


def test_every_impact_is_within_its_tolerance(finding):
    assert finding.passed and finding.that(False).rows == ()


def test_moderate_conditions_agree_to_1e_10_and_are_many(finding):
    moderate = [row for row in finding.records() if row["tolerance"] == study.AGREEMENT]
    assert len(moderate) > 50 and max(row["error"] for row in moderate) <= 1e-10
    assert {row["coordinates"] for row in moderate} == {study.ABSOLUTE, study.HAND}


def test_angles_go_through_the_singular_pose_where_the_hands_place_cannot(finding):
    straight = [row for row in finding.records() if row["elbow"] == 0.0]
    assert {row["coordinates"] for row in straight} == {study.ABSOLUTE}
    assert max(row["error"] for row in straight if row["contacts"] in study.CONTACTS) <= 1e-14
    near = finding.where(coordinates=study.HAND, elbow=1e-12)
    assert min(row["κ(∂f/∂r)²"] for row in near.records()) > 1e20
    assert set(near.holds) == {None}


def test_a_map_that_is_not_the_derivative_is_seen(monkeypatch):
    original = study._transformed

    def bent(mechanism, impact, coordinates):
        mass, rows, change = original(mechanism, impact, coordinates)
        return mass, rows, change @ np.diag([1.0, 1.0 + 1e-8, 1.0])

    monkeypatch.setattr(study, "_transformed", bent)
    monkeypatch.setattr(study, "ELBOWS", (1.0, 0.0))
    assert study.COORDINATES.table(Study()).passed is False
