"""C06 on an arm: outcomes agree where they must; the two arms written independently are one; a wrong map is seen."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from verification.check import Study
from verification.mechanics import coordinate_invariance as study

angles = st.tuples(*[st.floats(-3.0, 3.0)] * 3)


@given(angles, st.integers(0, 2), st.floats(0.0, 1.0), st.floats(-3.0, 3.0))
def test_the_arm_in_absolute_angles_is_the_engines_arm(q, link, distance, normal):
    mechanism, q, contact = study.arm(), np.array(q), study.Contact(link, distance, normal)
    r, turn = np.cumsum(q), np.tril(np.ones((3, 3)))  # dr/dq
    np.testing.assert_allclose(turn.T @ study.absolute_mass_matrix(r) @ turn, mechanism.mass_matrix(q), atol=1e-14)
    row = study.absolute_row(r, contact) @ turn
    np.testing.assert_allclose(row, study.joint_rows(mechanism, q, (contact,))[0], atol=1e-14)


@pytest.fixture(scope="module")
def finding():
    return study.COORDINATES.table(Study())


def test_every_impact_is_within_its_tolerance_and_many_are_moderate(finding):
    moderate = [row for row in finding.records() if row["tolerance"] == study.AGREEMENT]
    assert finding.passed and finding.that(False).rows == () and len(moderate) > 50
    assert {row["coordinates"] for row in moderate} == {study.ABSOLUTE, study.HAND}


def test_angles_go_through_the_singular_pose_where_the_hands_place_cannot(finding):
    straight = [row for row in finding.records() if row["elbow"] == 0.0]
    assert {row["coordinates"] for row in straight} == {study.ABSOLUTE}
    assert max(row["error"] for row in straight if row["contacts"] in study.CONTACTS) <= 1e-14
    near = finding.where(coordinates=study.HAND, elbow=1e-12)
    assert min(near.column("κ(∂f/∂r)²")) > 1e20 and set(near.holds) == {None}


def test_a_map_that_is_not_the_derivative_is_seen(monkeypatch):
    original = study._transformed

    def bent(*given):
        mass, rows, change = original(*given)
        return mass, rows, change @ np.diag([1.0, 1.0 + 1e-8, 1.0])

    monkeypatch.setattr(study, "_transformed", bent)
    monkeypatch.setattr(study, "ELBOWS", (1.0, 0.0))
    assert study.COORDINATES.table(Study()).passed is False
