"""Contacts of the references in closed form, against coal."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.contact.geometry import SpatialBox, candidate_pairs, make_spatial_shapes
from reference import contact_finding
from reference.contact_finding import find_contacts


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
