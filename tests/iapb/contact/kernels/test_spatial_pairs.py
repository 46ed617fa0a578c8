"""Balls, boxes and half-spaces written out with numpy, and the features of their contacts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.compiled import block
from iapb.contact.geometry import HalfSpace, SpatialBox, Sphere, make_contact_buffer, make_spatial_shapes
from iapb.contact.kernels.spatial_pairs import PARALLEL_SINE, _edge_middle, spatial_pair

SIGNS = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T


def found(a: Any, b: Any, R: np.ndarray, p: np.ndarray, margin: float, swapped: bool = False) -> Any:
    buffer: Any = block(make_contact_buffer(32))
    shapes = block(make_spatial_shapes([a, b]))
    first, second = (1, 0) if swapped else (0, 1)
    R, p = np.ascontiguousarray(R), np.ascontiguousarray(p)
    return spatial_pair(shapes, first, second, R, p, margin, buffer, 0), buffer


def random_frames(rng: np.random.Generator, count: int) -> np.ndarray:
    frames = np.array([np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(count)])
    return frames * np.sign(np.linalg.det(frames))[:, None, None]


def test_balls_meet_on_the_line_of_their_centres() -> None:
    """Gap = distance − radii; the point lies midway between the surfaces; there is one contact, feature 0."""
    rng = np.random.default_rng(1)
    for _ in range(40):
        R, p = random_frames(rng, 2), rng.uniform(-0.3, 0.3, (2, 3))
        radius, local = rng.uniform(0.05, 0.3, 2), rng.uniform(-0.2, 0.2, (2, 3))
        centers = p + np.einsum("nij,nj->ni", R, local)
        count, buffer = found(Sphere(radius[0], local[0], 0), Sphere(radius[1], local[1], 1), R, p, 5.0)
        apart = centers[0] - centers[1]
        normal = apart / np.linalg.norm(apart)
        assert count == 1 and buffer.feature[0] == 0
        assert buffer.gap[0] == pytest.approx(np.linalg.norm(apart) - radius.sum(), abs=1e-14)
        assert buffer.normal[0] == pytest.approx(normal, abs=1e-13)
        surfaces = [centers[0] - radius[0] * normal, centers[1] + radius[1] * normal]
        assert buffer.point[0] == pytest.approx(np.mean(surfaces, axis=0), abs=1e-14)


@pytest.mark.parametrize("swapped", [False, True])
def test_balls_on_one_centre_part_along_z(swapped: bool) -> None:
    """Any direction would do; it is the same to the bit whichever ball is named first, but for its sign."""
    R, p = np.array([np.eye(3)] * 2), np.zeros((2, 3))
    count, buffer = found(Sphere(0.5, body=0), Sphere(0.25, body=1), R, p, 0.0, swapped)
    assert count == 1 and buffer.gap[0] == -0.75
    assert buffer.normal[0].tolist() == [0.0, 0.0, -1.0 if swapped else 1.0]


def test_a_ball_and_a_box_on_a_half_space_touch_at_their_lowest_points() -> None:
    rng = np.random.default_rng(2)
    features = set()
    for _ in range(40):
        R, p, normal = random_frames(rng, 1), rng.uniform(-0.3, 0.3, (1, 3)), random_frames(rng, 1)[0, :, 2]
        plane, local = HalfSpace(rng.uniform(-0.2, 0.2, 3), 3.0 * normal), rng.uniform(-0.2, 0.2, 3)
        height = float((p[0] + R[0] @ local - plane.point) @ normal)
        count, buffer = found(Sphere(0.2, local, 0), plane, R, p, 5.0)
        assert count == 1 and buffer.feature[0] == 0
        assert buffer.gap[0] == pytest.approx(height - 0.2, abs=1e-14)
        assert buffer.normal[0] == pytest.approx(normal, abs=1e-14)
        assert buffer.point[0] == pytest.approx(p[0] + R[0] @ local - (0.2 + 0.5 * (height - 0.2)) * normal, abs=1e-14)
        size, turn = rng.uniform(0.1, 0.5, 3), random_frames(rng, 1)[0]
        count, buffer = found(SpatialBox(size, local, turn, 0), plane, R, p, 5.0)
        corners = p[0] + (local + (0.5 * size * SIGNS) @ turn.T) @ R[0].T
        heights = (corners - plane.point) @ normal
        assert count == 8
        for i in range(8):
            k = int(np.argmin(np.linalg.norm(corners - 0.5 * heights[:, None] * normal - buffer.point[i], axis=1)))
            assert buffer.point[i] == pytest.approx(corners[k] - 0.5 * heights[k] * normal, abs=1e-14)
            assert buffer.gap[i] == pytest.approx(heights[k], abs=1e-14)
            features.add((int(buffer.feature[i]), tuple(SIGNS[k])))  # a corner keeps its name in every pose
    assert len(features) == 8 == len({feature for feature, _ in features})
    assert {feature >> 20 for feature, _ in features} == set(range(8)) and all(f % 2**20 == 0 for f, _ in features)


def separation(n: np.ndarray, apart: np.ndarray, frames: np.ndarray, half: np.ndarray) -> float:
    """Of two boxes along a unit vector: distance of their middles less half of both shadows."""
    return float(abs(apart @ n) - sum(half[k] @ np.abs(frames[k].T @ n) for k in range(2)))


@pytest.mark.parametrize("margin", [0.0, 0.1])
def test_two_edges_meet_midway_between_their_nearest_points(margin: float) -> None:
    """The axis of largest separation decides; edges only by more than the share that faces are given."""
    rng, met = np.random.default_rng(3), set()
    for _ in range(400):
        frames, half = random_frames(rng, 2), rng.uniform(0.1, 0.4, (2, 3))
        p = rng.uniform(-0.5, 0.5, (2, 3))
        apart = p[0] - p[1]
        directions = [frames[k][:, i] for k in range(2) for i in range(3)]
        faces, face = max((separation(n, apart, frames, half), i) for i, n in enumerate(directions))
        best, pair = -np.inf, (0, 0)
        for i in range(3):
            for j in range(3):
                n = np.cross(frames[0][:, i], frames[1][:, j])
                assert np.linalg.norm(n) > PARALLEL_SINE
                value = separation(n / np.linalg.norm(n), apart, frames, half)
                best, pair = (value, (i, j)) if value > best else (best, pair)
        count, buffer = found(SpatialBox(2 * half[0], body=0), SpatialBox(2 * half[1], body=1), frames, p, margin)
        assert (count > 0) == (max(best, faces) <= margin)
        if count == 0 or best <= faces + 0.05 * abs(faces) + 1e-9:
            n = directions[face] * np.sign(directions[face] @ apart)
            np.testing.assert_allclose(buffer.normal[:count], np.tile(n, (count, 1)), atol=1e-12)
            continue
        met.add(pair)
        a, b = frames[0][:, pair[0]], frames[1][:, pair[1]]
        n = np.cross(a, b) / np.linalg.norm(np.cross(a, b))
        n *= np.sign(n @ apart)
        assert count == 1 and buffer.gap[0] == pytest.approx(best, abs=1e-12)
        assert buffer.normal[0] == pytest.approx(n, abs=1e-12)
        low, high = -np.sign(frames[0].T @ n) * half[0], np.sign(frames[1].T @ n) * half[1]
        low[pair[0]] = high[pair[1]] = 0.0
        x, y = p[0] + frames[0] @ low, p[1] + frames[1] @ high
        s, t = np.linalg.lstsq(np.column_stack([a, -b]), y - x, rcond=None)[0]
        s, t = np.clip(s, -half[0][pair[0]], half[0][pair[0]]), np.clip(t, -half[1][pair[1]], half[1][pair[1]])
        assert buffer.point[0] == pytest.approx(0.5 * (x + s * a + y + t * b), abs=1e-10)
        assert int(buffer.feature[0]) >> 40 == 5
    assert len(met) == 9


@pytest.mark.parametrize("swapped", [False, True])
def test_a_ball_and_a_box_meet_at_the_boxs_nearest_point(swapped: bool) -> None:
    """Each of the 26 regions around a box has its own feature; a centre inside leaves by the nearest face as outside.

    The normal points from the second body into the first: away from the box where that is the second.
    """
    rng, features = np.random.default_rng(4), set()
    half = np.array([0.3, 0.2, 0.4])
    for signs in np.array(np.meshgrid([-1, 0, 1], [-1, 0, 1], [-1, 0, 1])).reshape(3, 27).T:
        for depth in (0.15, -0.02) if np.count_nonzero(signs) == 1 else (0.15,):
            R, p = random_frames(rng, 2), rng.uniform(-0.3, 0.3, (2, 3))
            turn, middle = random_frames(rng, 1)[0], rng.uniform(-0.1, 0.1, 3)
            inside = rng.uniform(-0.3, 0.3, 3) * half
            local = np.where(signs != 0, signs * (half + depth), inside)
            nearest = np.clip(local, -half, half)
            if not signs.any():  # the middle, a little nearer to one face than to the others
                k = int(np.argmin(half - np.abs(local)))
                signs = np.eye(3)[k] * np.sign(local[k])
            if np.all(np.abs(local) <= half):
                nearest = np.where(signs != 0, signs * half, local)
                normal, distance = signs.astype(float), -float(np.abs(nearest - local).max())
            else:
                distance = float(np.linalg.norm(local - nearest))
                normal = (local - nearest) / distance
            place = p[1] + R[1] @ (middle + turn @ local)
            ball = Sphere(0.1, R[0].T @ (place - p[0]), 0)
            box = SpatialBox(2.0 * half, middle, turn, 1)
            count, buffer = found(ball, box, R, p, 5.0, swapped)
            assert count == 1 and buffer.gap[0] == pytest.approx(distance - 0.1, abs=1e-14)
            outward = R[1] @ turn @ normal
            assert buffer.normal[0] == pytest.approx(-outward if swapped else outward, abs=1e-13)
            assert buffer.point[0] == pytest.approx(place - (0.1 + 0.5 * (distance - 0.1)) * outward, abs=1e-13)
            assert (int(buffer.body_a[0]), int(buffer.body_b[0])) == ((1, 0) if swapped else (0, 1))
            features.add((int(buffer.feature[0]), tuple(signs.astype(int))))
            assert found(ball, box, R, p, distance - 0.1 - 1e-12, swapped)[0] == 0
            assert found(ball, box, R, p, distance - 0.1 + 1e-12, swapped)[0] == 1
    assert len(features) == 26 == len({feature for feature, _ in features})


def test_the_twelve_edges_of_a_box_have_their_middles_and_numbers() -> None:
    rng, half = np.random.default_rng(5), np.array([0.3, 0.2, 0.4])
    frame, center = random_frames(rng, 1)[0], rng.normal(size=3)
    axes, numbers = tuple(tuple(frame[:, k]) for k in range(3)), set()
    for k in range(3):
        for signs in SIGNS:
            if signs[k] < 0:
                continue
            n = frame @ (signs * rng.uniform(0.1, 1.0, 3))
            middle, number = _edge_middle(tuple(center), axes, tuple(half), k, tuple(n))
            assert middle == pytest.approx(center + frame @ np.where(np.arange(3) == k, 0.0, signs * half), abs=1e-15)
            numbers.add(number)
            assert number // 4 == k
    assert numbers == set(range(12))


def test_more_contacts_than_there_is_room_for_are_told() -> None:
    floor, box = HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), SpatialBox((1.0, 1.0, 1.0), body=0)
    frames = np.array([np.eye(3)] * 2)
    tilted = np.array([np.linalg.qr([[1.0, 0.5, 0.2], [0.1, 1.0, -0.3], [0.4, 0.2, 1.0]])[0], np.eye(3)])
    over = np.array([[0.1, 0.2, 0.99], [0.0, 0.0, 0.0]])
    cases = [(box, floor, frames[:1], np.zeros((1, 3)), 8), (box, SpatialBox((1.0, 1.0, 1.0), body=1), frames, over, 4),
             (Sphere(0.5, body=0), Sphere(0.5, body=1), frames, over, 1), (Sphere(1.0, body=0), floor, frames[:1],
             np.zeros((1, 3)), 1), (box, Sphere(0.6, body=1), tilted, over, 1)]
    for a, b, R, p, most in cases:
        shapes = block(make_spatial_shapes([a, b]))
        for room in range(1, most + 1):
            buffer: Any = block(make_contact_buffer(room))
            assert spatial_pair(shapes, 0, 1, R, p, 1.0, buffer, 0) == (-1 if room < most else most)
