"""A face on a face: the corners of the overlap are those that clipping a parallelogram by a rectangle gives."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.compiled import block
from iapb.contact.geometry import SpatialBox, make_contact_buffer, make_spatial_shapes
from iapb.contact.kernels.spatial_pairs import clip_faces, keep_widest

ROOM = 30
HALF, OTHER = np.array([0.5, 0.4, 0.3]), np.array([0.35, 0.45, 0.25])


def clip(polygon: np.ndarray, normal: np.ndarray, limit: float) -> np.ndarray:
    """Sutherland and Hodgman: what of a polygon (n, 3) lies on this side of a plane, n·x <= limit."""
    kept: list[np.ndarray] = []
    for x, y in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        over_x, over_y = x @ normal - limit, y @ normal - limit
        if over_x <= 0.0:
            kept.append(x)
        if over_x * over_y < 0.0:
            kept.append(x + (y - x) * over_x / (over_x - over_y))
    return np.array(kept).reshape(-1, 3)


def face_of(center: np.ndarray, axes: np.ndarray, half: np.ndarray, k: int, side: float) -> np.ndarray:
    """Four corners of a face, in order."""
    u, v = half[(k + 1) % 3] * axes[:, (k + 1) % 3], half[(k + 2) % 3] * axes[:, (k + 2) % 3]
    middle = center + side * half[k] * axes[:, k]
    return np.array([middle + u + v, middle - u + v, middle - u - v, middle + u - v])


def incident(m: np.ndarray, turned: np.ndarray) -> tuple[int, float]:
    """Face of the other box that looks most against m: its axis and its side."""
    facing = turned.T @ m
    k = int(np.argmax(np.abs(facing)))
    return k, -float(np.sign(facing[k]))


def overlap(R: np.ndarray, face: int, polygon: np.ndarray) -> np.ndarray:
    """What of the incident face (n, 3) lies over the reference face."""
    for axis in ((face + 1) % 3, (face + 2) % 3):
        for sign in (-1.0, 1.0):
            polygon = clip(polygon, sign * R[:, axis], HALF[axis]) if len(polygon) else polygon
    return polygon


def tilt_of(rng: np.random.Generator, size: float) -> np.ndarray:
    turn, _ = np.linalg.qr(np.eye(3) + size * rng.normal(size=(3, 3)))
    return turn * np.sign(np.diag(turn))


def clipped(rng: np.random.Generator, face: int, side: float, ref_is_a: bool, margin: float) -> Any:
    """A box over a face of another, turned and tilted: normal, all corners of its face, those expected, heights."""
    R, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    R *= np.sign(np.linalg.det(R))
    shift = rng.uniform(-0.9, 0.9, 3)
    shift[face] = side * (HALF[face] + 0.3)
    place, turned = R @ shift, R @ tilt_of(rng, 0.3)[:, rng.permutation(3)]
    turned *= np.sign(np.linalg.det(turned))
    m = side * R[:, face]
    shapes = block(make_spatial_shapes([SpatialBox(2.0 * HALF, body=0), SpatialBox(2.0 * OTHER, body=1)]))
    buffer: Any = block(make_contact_buffer(ROOM))
    columns = [tuple(tuple(axes[:, k]) for k in range(3)) for axes in (R, turned)]
    count = clip_faces(shapes, 0, 1, ref_is_a, face, -0.01, (0.0, 0.0, 0.0), tuple(place), *columns, tuple(HALF),
                       tuple(OTHER), margin, buffer, 2)
    whole = face_of(place, turned, OTHER, *incident(m, turned))
    polygon = overlap(R, face, whole)
    heights = polygon @ m - HALF[face]
    low = whole[np.argmin(whole @ m)] @ R
    low[face] = side * HALF[face]
    deepest = R @ np.clip(low, -HALF, HALF) - 0.005 * m
    return m, deepest, polygon[heights <= margin], heights[heights <= margin], count - 2, buffer


@pytest.mark.parametrize("face", range(3))
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_contacts_over_a_face_are_the_corners_of_the_clipped_face(face: int, side: float) -> None:
    """Midway between both faces; of more than four, four of them; without any, one at the separation told."""
    rng, numbers = np.random.default_rng(face), set()
    for trial in range(80):
        ref_is_a = trial % 2 == 0
        m, deepest, corners, heights, count, buffer = clipped(rng, face, side, ref_is_a, 0.2)
        numbers.add(len(corners))
        np.testing.assert_allclose(buffer.normal[2 : 2 + count], np.tile(-m if ref_is_a else m, (count, 1)), atol=1e-15)
        gaps, points = buffer.gap[2 : 2 + count], buffer.point[2 : 2 + count]
        pair = (0, 1) if ref_is_a else (1, 0)
        assert set(zip(buffer.shape_a[2 : 2 + count], buffer.shape_b[2 : 2 + count], strict=True)) == {pair}
        assert len(set(buffer.feature[2 : 2 + count].tolist())) == count
        if len(corners) == 0:
            assert count == 1 and gaps[0] == -0.01
            np.testing.assert_allclose(points[0], deepest, atol=1e-12)
            continue
        assert count == min(4, len(corners))
        middles = corners - 0.5 * heights[:, None] * m
        apart = np.linalg.norm(points[:, None] - middles[None, :], axis=2)
        assert apart.min(axis=1) == pytest.approx(0.0, abs=1e-12)
        chosen = apart.argmin(axis=1)
        assert len(set(chosen.tolist())) == count
        assert gaps == pytest.approx(heights[chosen], abs=1e-12)
        if count < len(corners):
            assert gaps[0] == pytest.approx(heights.min(), abs=1e-12)
    assert {0, 4} <= numbers and max(numbers) > 4


def test_every_pair_of_faces_has_features_of_its_own() -> None:
    """2 roles, 6 faces of the one, 6 of the other: 72 sets of features without a common one."""
    owner: dict[int, tuple[bool, int, float, int, float]] = {}
    axes, shapes = np.eye(3), block(make_spatial_shapes([SpatialBox(2.0 * HALF, body=k) for k in range(2)]))
    turns = [np.roll(axes, k, axis=0) * sign for k in range(3) for sign in (1.0, -1.0)]
    for ref_is_a in (True, False):
        for face in range(3):
            for side in (-1.0, 1.0):
                for turned in turns:
                    place = tuple(side * 0.8 * axes[face] + 0.1)
                    buffer: Any = block(make_contact_buffer(ROOM))
                    columns = [tuple(tuple(frame[:, k].tolist()) for k in range(3)) for frame in (axes, turned)]
                    count = clip_faces(shapes, 0, 1, ref_is_a, face, 0.0, (0.0, 0.0, 0.0), place, *columns, tuple(HALF),
                                       tuple(HALF), 1.0, buffer, 0)
                    assert count > 0
                    for feature in buffer.feature[:count].tolist():
                        name = ref_is_a, face, side, *incident(side * axes[face], turned)
                        assert owner.setdefault(feature, name) == name
    assert len(set(owner.values())) == 72


def test_each_corner_of_the_overlap_of_two_faces_keeps_its_feature_while_they_slide() -> None:
    """Small motions change no feature: else every step of a sliding box would be a new contact."""
    for seed in range(10):
        features = []
        for shift in (0.0, 1e-9):
            shapes = block(make_spatial_shapes([SpatialBox(2.0 * HALF, body=0), SpatialBox(2.0 * OTHER, body=1)]))
            buffer: Any = block(make_contact_buffer(ROOM))
            turn = tilt_of(np.random.default_rng(seed), 0.3)
            axes = tuple(tuple(row) for row in np.eye(3)), tuple(tuple(turn[:, k]) for k in range(3))
            count = clip_faces(shapes, 0, 1, True, 2, -0.01, (0.0, 0.0, 0.0), (0.1 + shift, 0.2, 0.5), *axes,
                               tuple(HALF), tuple(OTHER), 1.0, buffer, 0)
            features.append(buffer.feature[:count].tolist())
        assert features[0] == features[1]


@pytest.mark.parametrize("seed", range(6))
def test_what_is_not_kept_of_many_points_lies_no_farther_out(seed: int) -> None:
    """The deepest; the farthest from it; on either side of the line through both the one farthest from that line.

    Whole rows move: shapes, bodies, feature, gap, point and normal of a contact stay together.
    """
    rng, count = np.random.default_rng(seed), 7
    m = rng.normal(size=3)
    m /= np.linalg.norm(m)
    points = rng.uniform(-1.0, 1.0, (count, 3))
    points -= np.outer(points @ m, m)
    buffer: Any = block(make_contact_buffer(count + 1))
    numbers = np.arange(count)
    buffer.point[1:], buffer.gap[1:], buffer.normal[1:] = points, rng.uniform(-1.0, 0.0, count), points + 10.0
    for k, name in enumerate(("shape_a", "shape_b", "body_a", "body_b", "feature")):
        getattr(buffer, name)[1:] = 100 * k + numbers
    gaps = buffer.gap[1:].copy()
    assert keep_widest(buffer, 1, count + 1, tuple(m)) == 5
    rows = [int(number) for number in buffer.shape_a[1:5]]
    assert len(set(rows)) == 4
    for k, name in enumerate(("shape_a", "shape_b", "body_a", "body_b", "feature")):
        assert [int(value) - 100 * k for value in getattr(buffer, name)[1:5]] == rows
    np.testing.assert_array_equal(buffer.point[1:5], points[rows])
    np.testing.assert_array_equal(buffer.normal[1:5], points[rows] + 10.0)
    np.testing.assert_array_equal(buffer.gap[1:5], gaps[rows])
    first, second = rows[0], rows[1]
    assert gaps[first] == gaps.min()
    lengths = np.linalg.norm(points - points[first], axis=1)
    assert lengths[second] == lengths.max()
    beside = (points - points[first]) @ np.cross(m, points[second] - points[first])
    assert beside[rows[2]] == pytest.approx(beside.max(), abs=1e-12)
    left = [k for k in range(count) if k not in rows[:3]]
    assert beside[rows[3]] == pytest.approx(min(beside[left].min(), beside[rows[3]]), abs=1e-12)
