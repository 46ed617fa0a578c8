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
    HalfSpace,
    Shapes,
    SpatialBox,
    Sphere,
    box,
    make_shapes,
    make_spatial_shapes,
)
from iapb.contact.kernels.broadphase import LARGEST_CELL, cell_number, make_broad_phase, near_pairs, sort_keys
from iapb.scene import Scene, scene_from_text
from iapb.simulation import simulate


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


@pytest.mark.parametrize("count", [0, 1, 2, 3, 4, 7, 50])
def test_keys_are_sorted_and_what_lies_behind_them_is_left_alone(count: int) -> None:
    rng = np.random.default_rng(count)
    for _ in range(10):
        keys = rng.integers(0, 60, count + 3)
        expected = np.concatenate([np.sort(keys[:count]), keys[count:]])
        sort_keys(keys, count)
        np.testing.assert_array_equal(keys, expected)


def test_a_cell_is_as_wide_as_told_and_the_last_one_holds_what_is_out_of_range() -> None:
    assert [cell_number(value, 0.5) for value in (-0.51, -0.5, -0.1, 0.0, 0.49, 0.5)] == [-2, -1, -1, 0, 0, 1]
    assert cell_number(float(LARGEST_CELL - 1), 1.0) == LARGEST_CELL - 1
    assert cell_number(1.0 - LARGEST_CELL, 1.0) == 1 - LARGEST_CELL
    for far in (2.0**40, -(2.0**40), 2.0**50, -(2.0**50)):
        assert cell_number(far, 1.0) == LARGEST_CELL


def crowd(rng: np.random.Generator, n: int, spatial: bool) -> Shapes:
    """Shapes off their bodies' origins; two of them on body 0; a static one and an endless one."""
    body = [0, *range(n - 1)]
    if not spatial:
        moving = [box(rng.uniform(0.05, 0.3, 2), rng.uniform(-0.2, 0.2, 2), 0.4, k) for k in body]
        return make_shapes([*moving[:2], Circle(0.2, (0.1, 0.3)), *moving[2:]])
    balls = [Sphere(rng.uniform(0.05, 0.2), rng.uniform(-0.2, 0.2, 3), k) for k in body]
    return make_spatial_shapes([
        *balls[:2], SpatialBox([0.3, 0.2, 0.4], [0.1, 0.0, -0.2]), HalfSpace([0, 0, -1], [0, 0, 1]), *balls[2:]
    ])


def meeting(broad: Any, R: np.ndarray, p: np.ndarray, pairs: np.ndarray, margin: float) -> list[list[int]]:
    """Pairs whose bounding spheres come as near as the margin, asked one by one."""
    center = broad.local_center.copy()
    for i, body in enumerate(broad.body):
        if body >= 0:
            center[i] = R[body] @ center[i] + p[body]
    found = []
    for a, b in pairs:
        apart = float(np.linalg.norm(center[a] - center[b]))
        if apart <= broad.radius[a] + broad.radius[b] + margin:
            found.append([int(a), int(b)])
    return sorted(found, key=sorted)


@pytest.mark.parametrize("spatial", [False, True])
@pytest.mark.parametrize("margin", [0.0, 0.3])
@pytest.mark.parametrize("spread", [0.3, 1.5, 1e9])
def test_near_pairs_of_turned_bodies_in_either_order_and_exact_capacity(
    spatial: bool, margin: float, spread: float
) -> None:
    rng = np.random.default_rng(7)
    for n in (2, 3, 9, 20):
        shapes = crowd(rng, n, spatial)
        total = len(shapes.kind)
        pairs = np.array([(i, j) if rng.random() < 0.5 else (j, i) for i in range(total) for j in range(i)
                          if shapes.body[i] != shapes.body[j] and rng.random() < 0.9], np.int32)
        made = make_broad_phase(shapes, pairs)
        R = np.array([np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(n)])
        p = rng.uniform(-spread, spread, (n, 3))
        if not spatial:
            cos, sin = np.cos(angles := rng.uniform(-3.0, 3.0, n)), np.sin(angles)
            R[:] = np.eye(3)
            R[:, :2, :2] = np.array([[cos, -sin], [sin, cos]]).transpose(2, 0, 1)
            p[:, 2] = 0.0
        broad: Any = block(made)
        expected = meeting(broad, R, p, pairs, margin)
        count = near_pairs(broad, R, p, margin)
        assert broad.pairs[:count].tolist() == expected
        for room in {max(count - 1, 0), count // 2}:
            small: Any = block(made._replace(key=np.zeros(room, np.int64)))
            assert near_pairs(small, R, p, margin) == (-1 if room < count else count)
        exact: Any = block(made._replace(key=np.zeros(count, np.int64)))
        assert near_pairs(exact, R, p, margin) == count


def test_spheres_that_just_touch_are_near() -> None:
    """Table that are exact: radii 0.25 and 0.5, centres 0.75 + 0.25 apart in each direction of space."""
    shapes = make_spatial_shapes([Sphere(0.25, body=0), Sphere(0.5, body=1)])
    broad: Any = block(make_broad_phase(shapes, np.array([[1, 0]], np.int32)))
    R, p = np.array([np.eye(3)] * 2), np.zeros((2, 3))
    for axis in range(3):
        for side in (-1.0, 1.0):
            p[:] = 0.0
            p[1, axis] = side
            assert near_pairs(broad, R, p, 0.25) == 1
            assert broad.pairs[0].tolist() == [1, 0]
            assert near_pairs(broad, R, p, 0.25 - 1e-12) == 0
