"""Triangles for the browser: closed, their outside out, and where the engine has the bodies."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.scene import find_scene, load_scene, scene_names
from iapb.system import System
from reports.figures.geometry import body_placements, is_spatial, solids


@pytest.mark.parametrize("name", scene_names())
def test_every_piece_is_closed_and_its_outside_is_out(name):
    scene = load_scene(find_scene(name)).resolved()
    for piece in solids(scene):
        edges = {(face[i], face[i - 2]) for face in piece.faces.tolist() for i in range(3)}
        corners = piece.vertices[piece.faces] - piece.vertices.mean(axis=0)
        volumes = np.linalg.det(corners)
        assert volumes.sum() > 0.0 and volumes.min() >= -1e-12 * volumes.sum()
        if len(piece.vertices) < 100:  # the poles of a ball are many corners in one place
            assert all((b, a) in edges for a, b in edges)


@pytest.mark.parametrize("name", scene_names())
def test_bodies_are_where_the_engine_has_them(name):
    scene = load_scene(find_scene(name))
    system, random = System(scene), np.random.default_rng(4)
    mechanism, q = system.mechanism, system.make_state().q
    q = mechanism.integrate(q, random.normal(size=mechanism.nv), 0.7)
    rotations, origins = mechanism.placements(q)
    resolved = scene.resolved()
    pose = mechanism.poses(q[None], planar=not is_spatial(resolved))[0]
    for name, place in body_placements(resolved, pose).items():
        body = mechanism.index(name)
        assert place.origin == pytest.approx(origins[body], abs=1e-12)
        assert place.rotation == pytest.approx(rotations[body], abs=1e-12)
