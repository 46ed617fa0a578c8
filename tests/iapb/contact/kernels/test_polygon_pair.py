"""Two polygons against the same construction written out with numpy: best axis, clipped edge, closest corners."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.compiled import block
from iapb.contact.geometry import Polygon, make_contact_buffer, make_shapes
from iapb.contact.kernels.narrow_phase import detect, height_at

ROUNDING = 1e-12  # shapes and positions are of size 1
Corners = np.ndarray  # (n, 2) counter-clockwise


def random_polygon(rng: np.random.Generator) -> Corners:
    """Corners on an ellipse, at angles that leave no edge shorter than a few percent of it."""
    n = int(rng.integers(3, 7))
    angles = 2.0 * np.pi * (np.arange(n) + rng.uniform(0.0, 0.7, n)) / n
    return np.column_stack([rng.uniform(0.3, 1.0) * np.cos(angles), rng.uniform(0.3, 1.0) * np.sin(angles)])


def random_pose(rng: np.random.Generator, spread: float) -> tuple[np.ndarray, np.ndarray]:
    cos, sin = np.cos(angle := rng.uniform(-np.pi, np.pi)), np.sin(angle)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]), np.array([*rng.normal(size=2) * spread, 0.0])


def edges_of(corners: Corners) -> tuple[Corners, np.ndarray, np.ndarray]:
    """Direction, outward normal and length of each edge."""
    along = np.roll(corners, -1, axis=0) - corners
    length = np.linalg.norm(along, axis=1)
    direction = along / length[:, None]
    return direction, np.column_stack([direction[:, 1], -direction[:, 0]]), length


def separations(ref: Corners, other: Corners) -> np.ndarray:
    """Of each edge of `ref`: how far the nearest corner of `other` lies in front of it."""
    _, normals, _ = edges_of(ref)
    return np.array([((other - start) @ n).min() for start, n in zip(ref, normals, strict=True)])


def clipped(ref: Corners, other: Corners) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """(point, normal out of `ref`, gap) of both ends of the incident edge over the reference edge."""
    directions, normals, lengths = edges_of(ref)
    edge = int(np.argmax(separations(ref, other)))
    u, n, length = directions[edge], normals[edge], lengths[edge]
    incident = int(np.argmin(edges_of(other)[1] @ n))
    ends = np.array([other[incident], other[(incident + 1) % len(other)]]) - ref[edge]
    s, h = ends @ u, ends @ n
    if s[1] > length or s[0] < 0.0:
        return []
    inside = np.clip(s, 0.0, length)
    heights = [h[k] if s[k] == inside[k] else np.interp(inside[k], s[::-1], h[::-1]) for k in range(2)]
    return [(ref[edge] + place * u + 0.5 * high * n, n, high) for place, high in zip(inside, heights, strict=True)]


def closest_corners(ref: Corners, other: Corners) -> tuple[np.ndarray, np.ndarray, float]:
    apart = other[None, :] - ref[:, None]
    i, j = np.unravel_index(np.argmin(np.linalg.norm(apart, axis=2)), apart.shape[:2])
    gap = float(np.linalg.norm(apart[i, j]))
    return 0.5 * (ref[i] + other[j]), apart[i, j] / gap, gap


def expected(a: Corners, b: Corners, margin: float) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """(point, normal from b into a, gap) of each contact."""
    best_a, best_b = separations(a, b).max(), separations(b, a).max()
    (ref, other, sign) = (b, a, 1.0) if best_b >= best_a else (a, b, -1.0)
    found = clipped(ref, other)
    if not found or min(gap for *_, gap in found) - max(best_a, best_b) > 1e-10:
        found = [closest_corners(ref, other)]
    return [(point, sign * normal, gap) for point, normal, gap in found if gap <= margin]


def scene(seed: int, spread: float, margin: float) -> tuple[list[Corners], Any, int]:
    """World corners of two polygons on two bodies, and their contacts."""
    rng = np.random.default_rng(seed)
    local, poses = [random_polygon(rng) for _ in range(2)], [random_pose(rng, spread) for _ in range(2)]
    shapes = block(make_shapes([Polygon(corners, body) for body, corners in enumerate(local)]))
    buffer: Any = block(make_contact_buffer(4))
    R, p = np.array([pose[0] for pose in poses]), np.array([pose[1] for pose in poses])
    count = detect(shapes, np.array([[0, 1]], np.int32), R, p, margin, buffer)
    return [corners @ R[k, :2, :2].T + p[k, :2] for k, corners in enumerate(local)], buffer, count


@pytest.mark.parametrize(("spread", "margin"), [(0.4, 0.0), (0.8, 0.2), (0.8, 5.0)])
def test_contacts_are_the_ends_of_the_clipped_edge_or_the_closest_corners(spread: float, margin: float) -> None:
    kinds = []
    for seed in range(120):
        (a, b), buffer, count = scene(seed, spread, margin)
        wanted = expected(a, b, margin)
        assert count == len(wanted)
        for i, (point, normal, gap) in enumerate(wanted):
            assert buffer.gap[i] == pytest.approx(gap, abs=ROUNDING)
            assert buffer.point[i] == pytest.approx([*point, 0.0], abs=ROUNDING)
            assert buffer.normal[i] == pytest.approx([*normal, 0.0], abs=ROUNDING)
            assert (buffer.shape_a[i], buffer.shape_b[i], buffer.body_a[i], buffer.body_b[i]) == (0, 1, 0, 1)
        kinds += [len(wanted)]
    assert {1, 2} <= set(kinds)


@pytest.mark.parametrize(("spread", "margin"), [(0.4, 0.0), (0.8, 5.0)])
def test_a_feature_names_the_corner_and_the_edge_that_the_contact_lies_between(spread: float, margin: float) -> None:
    """Kind 0: corner of a, edge of b; 1: corner of b, edge of a; 2: two corners. a is ½ gap along the normal away."""
    kinds = set()
    for seed in range(120):
        corners, buffer, count = scene(seed, spread, margin)
        features = [int(feature) for feature in buffer.feature[:count]]
        assert len(set(features)) == count
        for i, feature in enumerate(features):
            kind, corner, edge = feature >> 40, feature >> 20 & 0xFFFFF, feature & 0xFFFFF
            half = 0.5 * buffer.gap[i] * buffer.normal[i, :2]
            sides = [buffer.point[i, :2] + half, buffer.point[i, :2] - half]  # on a, on b
            vertex_of, edge_of = (1, 0) if kind == 1 else (0, 1)
            assert corners[vertex_of][corner] == pytest.approx(sides[vertex_of], abs=ROUNDING)
            if kind == 2:
                assert corners[1][edge] == pytest.approx(sides[1], abs=ROUNDING)
            else:
                start, n = corners[edge_of][edge], edges_of(corners[edge_of])[1][edge]
                assert (sides[edge_of] - start) @ n == pytest.approx(0.0, abs=ROUNDING)
            kinds.add(kind)
    assert kinds == ({0, 1} if margin == 0.0 else {0, 1, 2})


coordinate = st.floats(-3.0, 3.0)


@given(coordinate, coordinate, coordinate, coordinate)
def test_heights_lie_on_the_line_through_both_ends(s0: float, h0: float, s1: float, h1: float) -> None:
    assert height_at(s0, s0, h0, s1, h1) == h0
    if abs(s1 - s0) > 1e-3:
        middle = height_at(0.5 * (s0 + s1), s0, h0, s1, h1)
        assert middle == pytest.approx(0.5 * (h0 + h1), abs=1e-12)
        assert math.isclose(height_at(s1, s0, h0, s1, h1), h1, abs_tol=1e-12)
    assert height_at(s0 + 1.0, s0, h0, s0, h1) == h0  # upright
