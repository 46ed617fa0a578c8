"""The scenes that come with the project: each says and does what its opening comment promises."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene, scene_names
from iapb.scene.mechanism import mechanism_of, start_of
from iapb.simulation import simulate
from iapb.system import System


def contacts_at(scene: Scene, q: np.ndarray) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """Return point, normal and gap of every contact of a configuration."""
    found = System(scene).contacts_at(q)
    return list(zip(found.point, found.normal, found.gap.tolist(), strict=True))


@pytest.mark.parametrize("name", scene_names())
def test_every_scene_loads_under_its_file_name_and_starts_without_deep_overlap(name: str) -> None:
    scene = load_scene(find_scene(name))
    assert scene.name == name and scene.title and scene.source
    q, _ = start_of(scene)
    assert all(gap > -1e-3 for _, _, gap in contacts_at(scene, q))
    assert np.linalg.eigvalsh(mechanism_of(scene).mass_matrix(q)).min() > 0.0


@pytest.mark.parametrize("depth", [1e-6, 1e-5, 7e-5])
def test_peg_meets_the_tight_hole_at_six_points_in_the_same_instant(depth: float) -> None:
    """Six contacts approach at once wherever in the step the peg arrives; their rows have rank
    3."""
    scene = load_scene(find_scene("peg_hole"))
    mechanism = mechanism_of(scene)
    seated = np.array([0.0, 0.0105, 0.0])
    assert not contacts_at(scene, seated + [0.0, 1e-9, 0.0])
    q = seated - [0.0, depth, 0.0]
    inward = np.array([0.0, -0.04, 0.0])
    found = contacts_at(scene, q)
    rows = np.array([normal @ mechanism.point_jacobian(q, 0, point) for point, normal, _ in found])
    assert rows.shape == (6, 3) and (rows @ inward < -10.0 * scene.contact.approach_velocity).all()
    assert np.linalg.matrix_rank(rows, tol=1e-4) == 3


@pytest.fixture(scope="module")
def peg() -> Run:
    return simulate(load_scene(find_scene("peg_hole_space")))


def test_peg_ends_in_the_hole_and_normals_are_unit_and_finite(peg: Run) -> None:
    assert -0.001 < peg.q[-1, 2] < 0.01  # its middle, 3 cm above its front: a good 2.5 cm deep
    assert np.abs(peg.q[-1, :2]).max() < 1e-3
    np.testing.assert_allclose(np.linalg.norm(peg.contacts.normal, axis=1), 1.0, atol=1e-12)
    assert peg.contacts.gap.min() > -4e-3
