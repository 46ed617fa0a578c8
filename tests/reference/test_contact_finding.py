"""Contacts of the references in closed form, against the engine's narrow phase and against coal."""

from __future__ import annotations

from dataclasses import astuple

import numpy as np
import pytest

from iapb.contact.geometry import SpatialBox, candidate_pairs, make_spatial_shapes
from iapb.scene import find_scene, load_scene, scene_names
from reference import contact_finding, engine_differences
from reference.contact_finding import find_contacts
from reference.engine_differences import scene_difference


@pytest.mark.parametrize("name", scene_names())
def test_engine_and_reference_find_the_same_contacts(name: str) -> None:
    """Two codes of other operations agree to rounding on all but a few configurations."""
    found = scene_difference(load_scene(find_scene(name)), configurations=30)
    assert found.apart <= 3
    assert max(astuple(found)[3:7]) <= 1e-13 and max(astuple(found)[8:]) <= 1e-12


def test_a_contact_that_is_off_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    def shifted(*arguments: object) -> contact_finding.Contacts:
        found = find_contacts(*arguments)  # type: ignore[arg-type]
        return found._replace(gap=found.gap + 1e-10)

    monkeypatch.setattr(engine_differences, "find_contacts", shifted)
    assert scene_difference(load_scene(find_scene("peg_corner")), configurations=3).gap >= 0.99e-10


def test_boxes_in_space_overlap_as_coal_says() -> None:
    """Normal and depth of two boxes at random, where a face decides and where edges do."""
    coal, rng, compared = pytest.importorskip("coal"), np.random.default_rng(0), 0
    for _ in range(200):
        sizes = rng.uniform(0.5, 1.5, size=(2, 3))
        axes = np.array([np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2)] + [np.eye(3)])
        axes[:2] *= np.sign(np.linalg.det(axes[:2]))[:, None, None]
        origins = np.array([np.zeros(3), rng.normal(scale=0.6, size=3), np.zeros(3)])
        shapes = make_spatial_shapes([SpatialBox(size, body=k) for k, size in enumerate(sizes)])
        found = find_contacts(shapes, candidate_pairs(shapes), axes, origins, 0.0)
        result = coal.CollisionResult()
        poses = [coal.Transform3s(axes[k], origins[k]) for k in range(2)]
        boxes = [coal.Box(*size) for size in sizes]
        touches = coal.collide(boxes[0], poses[0], boxes[1], poses[1], coal.CollisionRequest(), result)
        if not touches:
            assert not len(found.gap) or found.gap.min() > -1e-6
            continue
        depth = result.getContact(0).penetration_depth
        assert found.gap.min() == pytest.approx(depth, abs=1e-6 + contact_finding.EDGE_SHARE * abs(depth))
        compared += 1
    assert compared > 50
