"""The rank decision, from both sides: noise is not a contact, and a contact is not noise."""

from __future__ import annotations

import numpy as np
import pytest

from iapb import resolve_impact


def face_rows(angle: float, lever_arms: tuple[float, ...] = (-0.5, 0.1, 0.5)) -> np.ndarray:
    """Three points of a box face on a wall turned by `angle`: rows (n, (r × n)_z), exactly of rank two."""
    normal = np.array([-np.sin(angle), np.cos(angle)])
    tangent = np.array([np.cos(angle), np.sin(angle)])
    points = [0.3 * -normal + arm * tangent for arm in lever_arms]
    return np.array([[*normal, r[0] * normal[1] - r[1] * normal[0]] for r in points])


@pytest.mark.parametrize("angle", np.linspace(0.1, 6.2, 37))
def test_a_face_struck_at_three_points_keeps_its_tangential_speed(angle: float) -> None:
    mass, rows = np.diag([2.0, 2.0, 0.1]), face_rows(angle)
    tangent = np.array([np.cos(angle), np.sin(angle), 0.0])
    normal = np.array([-np.sin(angle), np.cos(angle), 0.0])
    impact = resolve_impact(mass, rows, 3.0 * tangent - normal, 0.5)
    assert impact.rank == 2
    np.testing.assert_allclose(impact.velocity, 3.0 * tangent + 0.5 * normal, atol=1e-14)


def test_too_tight_a_tolerance_would_brake_the_face() -> None:
    """The other side: with noise taken for a row the tangential speed is lost, so the test above can fail."""
    mass, angle = np.diag([2.0, 2.0, 0.1]), 0.7
    tangent = np.array([np.cos(angle), np.sin(angle), 0.0])
    lost = []
    for angle in np.linspace(0.1, 6.2, 37):
        tangent = np.array([np.cos(angle), np.sin(angle), 0.0])
        impact = resolve_impact(mass, face_rows(angle), 3.0 * tangent, 0.0, rank_tolerance=1e-18)
        lost.append(abs(impact.velocity @ tangent - 3.0))
    assert max(lost) > 1.0


@pytest.mark.parametrize("difference", [1e-3, 1e-6, 1e-9])
def test_rows_that_differ_are_two(difference: float) -> None:
    rows = np.array([[1.0, 0.0, 0.0], [1.0, difference, 0.0]])
    impact = resolve_impact(np.eye(3), rows, [-1.0, 2.0, 1.0], 0.0)
    assert impact.rank == 2
    assert impact.velocity[1] == pytest.approx(0.0, abs=1e-15 / difference)
    assert impact.velocity[2] == 1.0


@pytest.mark.parametrize("difference", [1e-11, 1e-13, 1e-16])
def test_rows_within_the_tolerance_are_one_and_restitution_is_met_to_it(difference: float) -> None:
    rows = np.array([[1.0, 0.0, 0.0], [1.0, difference, 0.0]])
    impact = resolve_impact(np.eye(3), rows, [-1.0, 2.0, 1.0], 0.0)
    assert impact.rank == 1
    assert impact.velocity[1] == pytest.approx(2.0, abs=1e-9)
    assert np.abs(rows @ impact.velocity).max() <= 4.0 * difference + 1e-15


def test_the_stated_tolerance_can_be_moved() -> None:
    rows = np.array([[1.0, 0.0], [1.0, 1e-6]])
    assert resolve_impact(np.eye(2), rows, [-1.0, 1.0], 0.0, rank_tolerance=1e-5).rank == 1
    assert resolve_impact(np.eye(2), rows, [-1.0, 1.0], 0.0, rank_tolerance=1e-7).rank == 2


@pytest.mark.parametrize("seed", range(20))
def test_rounding_of_an_ill_conditioned_mass_matrix_is_not_taken_for_contacts(seed: int) -> None:
    """Rank three by construction, κ(M) = 1e12: whitening leaves noise of about ε κ(L) in dependent rows."""
    rng = np.random.default_rng(seed)
    d = 10
    basis = np.linalg.qr(rng.normal(size=(d, d)))[0]
    mass = basis * np.logspace(0, -12, d) @ basis.T
    rows = rng.normal(size=(40, 3)) @ rng.normal(size=(3, d))
    assert resolve_impact(0.5 * (mass + mass.T), rows, rng.normal(size=d), 0.5).rank == 3
