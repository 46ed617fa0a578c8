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


@pytest.fixture(scope="module")
def peg() -> Run:
    return simulate(load_scene(find_scene("peg_hole_space")))


def test_peg_ends_in_the_hole_and_normals_are_unit_and_finite(peg: Run) -> None:
    assert -0.001 < peg.q[-1, 2] < 0.01  # its middle, 3 cm above its front: a good 2.5 cm deep
    assert np.abs(peg.q[-1, :2]).max() < 1e-3
    np.testing.assert_allclose(np.linalg.norm(peg.contacts.normal, axis=1), 1.0, atol=1e-12)
    assert peg.contacts.gap.min() > -4e-3
