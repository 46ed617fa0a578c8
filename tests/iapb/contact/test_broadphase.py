"""The broad phase: no pair is lost, the order is kept, a scene runs to the same bits with and without."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import iapb.system
from iapb.compiled import block
from iapb.contact.geometry import (
    Circle,
    HalfPlane,
    HalfSpace,
    Shapes,
    SpatialBox,
    Sphere,
    box,
    candidate_pairs,
    make_shapes,
    make_spatial_shapes,
)
from iapb.contact.kernels.broadphase import make_broad_phase, near_pairs
from iapb.scene import Scene, scene_from_text
from iapb.simulation import simulate


def planar_shapes(rng: np.random.Generator, n: int) -> Shapes:
    moving = [
        Circle(rng.uniform(0.01, 0.05), rng.uniform(-0.05, 0.05, 2), k)
        if k % 2
        else box(rng.uniform(0.01, 0.08, 2), rng.uniform(-0.05, 0.05, 2), 0.3, k)
        for k in range(n)
    ]
    return make_shapes([*moving, HalfPlane([0, -0.5], [0, 1]), box([0.3, 0.1], [0.2, 0.1]), Circle(0.1)])


def spatial_shapes(rng: np.random.Generator, n: int) -> Shapes:
    moving = [
        Sphere(rng.uniform(0.01, 0.05), rng.uniform(-0.05, 0.05, 3), k)
        if k % 2
        else SpatialBox(rng.uniform(0.01, 0.08, 3), rng.uniform(-0.05, 0.05, 3), body=k)
        for k in range(n)
    ]
    return make_spatial_shapes([*moving, HalfSpace([0, 0, -0.5], [0, 0, 1]), SpatialBox([0.3, 0.1, 0.2])])


def bounding_spheres_that_meet(broad: Any, R: np.ndarray, p: np.ndarray, pairs: np.ndarray) -> list[list[int]]:
    """The same question asked pair by pair."""
    moved = broad.body >= 0
    center = broad.local_center.copy()
    center[moved] = np.einsum("nij,nj->ni", R[broad.body[moved]], center[moved]) + p[broad.body[moved]]
    reach = broad.radius[pairs[:, 0]] + broad.radius[pairs[:, 1]]
    apart = np.linalg.norm(center[pairs[:, 0]] - center[pairs[:, 1]], axis=1)
    return pairs[apart <= reach].tolist()


@pytest.mark.parametrize("make", [planar_shapes, spatial_shapes])
@pytest.mark.parametrize("spread", [0.1, 0.5, 3.0, 1e9])
def test_near_pairs_are_those_whose_bounding_spheres_meet_in_the_order_of_the_candidates(
    make: Any, spread: float
) -> None:
    rng = np.random.default_rng(3)
    for n in (1, 2, 30):
        shapes = make(rng, n)
        pairs = candidate_pairs(shapes)
        broad: Any = block(make_broad_phase(shapes, pairs))
        R = np.tile(np.eye(3), (n, 1, 1))
        p = rng.uniform(-spread, spread, (n, 3))
        if make is planar_shapes:
            p[:, 2] = 0.0
        count = near_pairs(broad, R, p, 0.0)
        expected = bounding_spheres_that_meet(broad, R, p, pairs)
        assert broad.pairs[:count].tolist() == expected


def test_a_margin_widens_the_reach_of_every_pair() -> None:
    """Two discs along many directions, a hair nearer and a hair farther than radii and margin."""
    shapes, margin = make_shapes([Circle(0.05, body=0), Circle(0.05, body=1)]), 0.04
    broad: Any = block(make_broad_phase(shapes, candidate_pairs(shapes)))
    rng = np.random.default_rng(5)
    for angle in rng.uniform(-math.pi, math.pi, 50):
        direction, start = np.array([math.cos(angle), math.sin(angle), 0.0]), np.append(rng.uniform(-1, 1, 2), 0.0)
        for share, near in ((1.0 - 1e-9, 1), (1.0 + 1e-9, 0)):
            p = np.array([start, start + share * (0.1 + margin) * direction])
            assert near_pairs(broad, np.tile(np.eye(3), (2, 1, 1)), p, margin) == near


def test_too_many_pairs_are_reported_not_dropped() -> None:
    shapes = planar_shapes(np.random.default_rng(0), 10)
    made = make_broad_phase(shapes, candidate_pairs(shapes))
    small: Any = block(made._replace(key=np.zeros(3, np.int64)))
    assert near_pairs(small, np.tile(np.eye(3), (10, 1, 1)), np.zeros((10, 3)), 0.0) == -1


def field_of_discs(n: int, pitch: float = 0.046) -> Scene:
    """n discs of radius 0.02 m on a square grid, with random velocities, over a wall."""
    rng, columns = np.random.default_rng(0), math.ceil(math.sqrt(n))
    bodies = "\n".join(
        f"  - {{name: disc_{k}, joint: planar, mass: 0.1, inertia: 2e-5, shapes: [{{kind: circle, radius: 0.02}}], "
        f"position: [{pitch * (k % columns):.6f}, {pitch * (k // columns):.6f}, 0], "
        f"velocity: [{0.3 * rng.normal():.6f}, {0.3 * rng.normal():.6f}, 0]}}"
        for k in range(n)
    )
    return scene_from_text(
        f"name: field\nrate: 1000\nduration: 0.1\nbodies:\n{bodies}\nwalls:\n"
        "  - {name: wall, kind: half_plane, point: [0, -0.03], normal: [0, 1]}\n"
        "contact: {stiffness: 500, damping: 1, restitution: 0.5, coherence_distance: 1e-3}\n"
    )


def test_a_scene_runs_to_the_same_bits_with_and_without(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = field_of_discs(40)
    monkeypatch.setattr(iapb.system, "WORTHWHILE_PAIRS", 0)
    grid = simulate(scene)
    monkeypatch.setattr(iapb.system, "WORTHWHILE_PAIRS", 10**9)
    every = simulate(scene)
    assert len(grid.impacts.step) > 0
    np.testing.assert_array_equal(grid.q, every.q)
    np.testing.assert_array_equal(grid.v, every.v)
    np.testing.assert_array_equal(grid.contacts.gap, every.contacts.gap)
