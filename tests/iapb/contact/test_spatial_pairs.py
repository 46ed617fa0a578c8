"""Contacts of spheres, boxes and half-spaces: laws, and agreement with coal at random poses."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest

from iapb.compiled import block
from iapb.contact.geometry import (
    ContactBuffer,
    HalfSpace,
    SpatialBox,
    SpatialShape,
    Sphere,
    candidate_pairs,
    contact_capacity,
    make_contact_buffer,
    make_spatial_shapes,
)
from iapb.contact.kernels.narrow_phase import detect
from iapb.contact.kernels.spatial_pairs import EDGE_SHARE, MOST_POINTS, keep_widest

coal = pytest.importorskip("coal")
Pose = tuple[np.ndarray, np.ndarray]
KINDS = ("sphere", "box")


def random_pose(rng: np.random.Generator, spread: float) -> Pose:
    axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return axes * np.sign(np.linalg.det(axes)), rng.uniform(-spread, spread, 3)


def contacts_of(shapes: list[SpatialShape], poses: list[Pose], margin: float = 0.0) -> ContactBuffer:
    """Contacts of shapes on bodies 0, 1, ... (or the world) at these poses, cut to the rows in use."""
    arrays = make_spatial_shapes(shapes)
    pairs = candidate_pairs(arrays)
    buffer: Any = block(make_contact_buffer(contact_capacity(arrays, pairs)))
    R, p = np.array([pose[0] for pose in poses]), np.array([pose[1] for pose in poses])
    count = detect(block(arrays), pairs, np.ascontiguousarray(R), np.ascontiguousarray(p), margin, buffer)
    assert count >= 0
    return ContactBuffer(*(getattr(buffer, name)[:count].copy() for name in ContactBuffer._fields))


def make(kind: str, rng: np.random.Generator, body: int) -> tuple[SpatialShape, Any]:
    """A random shape about its body's origin, ours and coal's."""
    if kind == "sphere":
        radius = rng.uniform(0.05, 0.2)
        return Sphere(radius, body=body), coal.Sphere(radius)
    size = rng.uniform(0.1, 0.4, 3)
    return SpatialBox(size, body=body), coal.Box(*size)


class Patch(NamedTuple):
    """The unit normal from b into a, and the gap [m] (negative: overlap)."""

    normal: np.ndarray
    gap: float


def patch_of(shape_a: Any, pose_a: Pose, shape_b: Any, pose_b: Pose) -> Patch | None:
    """Return coal's contact with our normal, from b into a; None where the shapes do not touch."""
    result = coal.CollisionResult()
    poses = [coal.Transform3s(*pose) for pose in (pose_a, pose_b)]
    if not coal.collide(shape_a, poses[0], shape_b, poses[1], coal.CollisionRequest(), result):
        return None
    contact = result.getContact(0)
    return Patch(-np.array(contact.normal), float(contact.penetration_depth))


def random_pairs(kind_a: str, kind_b: str, trials: int) -> Any:
    """Yield (contacts, coal's patch or None) of overlapping and of separate random pairs."""
    rng = np.random.default_rng(KINDS.index(kind_a) * 2 + KINDS.index(kind_b))
    for _ in range(trials):
        (ours_a, coal_a), (ours_b, coal_b) = make(kind_a, rng, 0), make(kind_b, rng, 1)
        poses = [random_pose(rng, 0.15), random_pose(rng, 0.15)]
        yield contacts_of([ours_a, ours_b], poses), patch_of(coal_a, poses[0], coal_b, poses[1])


@pytest.mark.parametrize("kind_a", KINDS)
@pytest.mark.parametrize("kind_b", KINDS)
def test_contacts_agree_with_coal_at_random_poses(kind_a: str, kind_b: str) -> None:
    touching = same_axis = 0
    for found, patch in random_pairs(kind_a, kind_b, 400):
        if patch is None or patch.gap > -1e-6:
            assert patch is not None or len(found.gap) == 0 or found.gap.min() > -1e-6
            continue
        touching += 1
        assert len(found.gap) >= 1
        np.testing.assert_allclose(np.linalg.norm(found.normal, axis=1), 1.0, atol=1e-12)
        depth, true_depth = -found.gap.min(), -patch.gap
        # coal iterates to about 1e-6 of the size; of two boxes a face may be taken that is EDGE_SHARE deeper
        allowed = EDGE_SHARE * true_depth if kind_a == kind_b == "box" else 0.0
        assert true_depth - 2e-6 <= depth <= (true_depth + allowed) / (1.0 - EDGE_SHARE * (allowed > 0)) + 2e-6
        if depth - true_depth < 1e-8:  # else an axis of nearly equal depth was taken
            same_axis += 1
            np.testing.assert_allclose(found.normal[0], patch.normal, atol=1e-4)
    assert touching > 100
    assert same_axis > 0.6 * touching


def test_half_space_contacts_agree_with_coal() -> None:
    rng = np.random.default_rng(5)
    for kind in KINDS:
        for _ in range(100):
            ours, other = make(kind, rng, 0)
            normal, offset = rng.normal(size=3), rng.uniform(-0.1, 0.1)
            unit = normal / np.linalg.norm(normal)
            pose = random_pose(rng, 0.15)
            found = contacts_of([ours, HalfSpace(offset * unit, normal)], [pose])
            ground = coal.Halfspace(unit, float(offset))
            patch = patch_of(other, pose, ground, (np.eye(3), np.zeros(3)))
            assert (patch is None) == (len(found.gap) == 0)
            if patch is not None:
                assert found.gap.min() == pytest.approx(patch.gap, abs=1e-9)
                np.testing.assert_allclose(found.normal[0], patch.normal, atol=1e-9)


@pytest.mark.parametrize("turn", [0.0, 0.3, np.pi / 4])
def test_face_on_face_keeps_four_points_that_span_the_overlap(turn: float) -> None:
    cos, sin = np.cos(turn), np.sin(turn)
    upper = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    shapes = [SpatialBox([0.2, 0.2, 0.1], body=0), SpatialBox([0.2, 0.2, 0.1])]
    found = contacts_of(shapes, [(upper, np.array([0.0, 0.0, 0.0999]))])
    assert len(found.gap) == 4
    np.testing.assert_allclose(found.gap, -1e-4, atol=1e-12)
    np.testing.assert_allclose(found.normal, np.tile([0.0, 0.0, 1.0], (4, 1)), atol=1e-12)
    np.testing.assert_allclose(found.point[:, 2], 0.04995, atol=1e-12)
    middle = found.point[:, :2].mean(axis=0)
    assert np.linalg.norm(middle) < 0.03  # the load through the middle lies inside the four


def test_swapping_the_shapes_turns_the_normal_round_and_changes_nothing_else() -> None:
    rng = np.random.default_rng(2)
    compared = 0
    for _ in range(200):
        (first, _), (second, _) = make("box", rng, 0), make("sphere", rng, 1)
        poses = [random_pose(rng, 0.12), random_pose(rng, 0.12)]
        found = contacts_of([first, second], poses)
        swapped = contacts_of(
            [Sphere(second.radius, body=0), SpatialBox(first.size, body=1)], poses[::-1]  # type: ignore[union-attr]
        )
        assert len(found.gap) == len(swapped.gap)
        if len(found.gap):
            compared += 1
            np.testing.assert_array_equal(found.normal, -swapped.normal)
            np.testing.assert_array_equal(found.point, swapped.point)
            np.testing.assert_array_equal(found.gap, swapped.gap)
    assert compared > 30


@pytest.mark.parametrize(
    "shapes",
    [
        [Sphere(0.1, body=0), Sphere(0.1, body=1)],
        [Sphere(0.1, body=0), SpatialBox([0.1, 0.1, 0.1], body=1)],
        [SpatialBox([0.1, 0.1, 0.1], body=0), SpatialBox([0.1, 0.1, 0.1], body=1)],
    ],
)
def test_coincident_shapes_have_finite_unit_normals(shapes: list[SpatialShape]) -> None:
    found = contacts_of(shapes, [(np.eye(3), np.zeros(3))] * 2)
    assert len(found.gap) >= 1
    np.testing.assert_allclose(np.linalg.norm(found.normal, axis=1), 1.0, atol=1e-15)
    assert np.isfinite(found.gap).all() and np.isfinite(found.point).all()


def test_motion_along_the_normal_by_the_depth_parts_two_boxes() -> None:
    """The gap is the distance to part along the normal: exact for the axis that was taken."""
    rng = np.random.default_rng(11)
    for _ in range(200):
        shapes = [make("box", rng, 0)[0], make("box", rng, 1)[0]]
        poses = [random_pose(rng, 0.12), random_pose(rng, 0.12)]
        found = contacts_of(shapes, poses)
        if len(found.gap):
            step = -found.gap.min() * (1.0 + 1e-9) + 1e-12
            moved = (poses[0][0], poses[0][1] + step * found.normal[0])
            assert len(contacts_of(shapes, [moved, poses[1]]).gap) == 0


def test_a_corner_and_the_plane_meet_midway_between_the_two() -> None:
    rng = np.random.default_rng(3)
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
    for _ in range(20):
        size, (R, p) = rng.uniform(0.1, 0.4, 3), random_pose(rng, 0.1)
        normal, origin = rng.normal(size=3), rng.uniform(-0.1, 0.1, 3)
        normal /= np.linalg.norm(normal)
        found = contacts_of([SpatialBox(size, body=0), HalfSpace(origin, normal)], [(R, p)])
        corners = p + signs * (0.5 * size) @ R.T
        heights = (corners - origin) @ normal
        np.testing.assert_allclose(np.sort(found.gap), np.sort(heights[heights <= 0.0]), atol=1e-14)
        np.testing.assert_allclose((found.point - origin) @ normal, 0.5 * found.gap, atol=1e-14)
        to_corners = found.point[:, None] + 0.5 * (found.gap[:, None] * found.normal)[:, None] - corners
        assert np.linalg.norm(to_corners, axis=2).min(axis=1, initial=np.inf) == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_boxes_in_line_touch_in_the_rectangle_that_they_share(axis: int, side: float) -> None:
    """Boxes of six different sizes, one upon the other, turned together and pushed sideways."""
    rng = np.random.default_rng(axis)
    half_a, half_b = np.array([0.11, 0.23, 0.17]), np.array([0.19, 0.13, 0.29])
    R, p = random_pose(rng, 1.0)
    depth, shift = 1e-3, rng.uniform(-0.05, 0.05, 3)
    shift[axis] = side * (half_a[axis] + half_b[axis] - depth)
    shapes: list[SpatialShape] = [SpatialBox(2.0 * half_a, body=0), SpatialBox(2.0 * half_b, body=1)]
    found = contacts_of(shapes, [(R, p), (R, p + R @ shift)])
    np.testing.assert_allclose(found.gap, -depth, atol=1e-12)
    np.testing.assert_allclose(found.normal, np.tile(-side * R[:, axis], (4, 1)), atol=1e-12)  # from b to a
    local = (found.point - p) @ R
    low, high = np.maximum(-half_a, shift - half_b), np.minimum(half_a, shift + half_b)
    low[axis] = high[axis] = side * (half_a[axis] - 0.5 * depth)
    np.testing.assert_allclose(local.min(axis=0), low, atol=1e-12)
    np.testing.assert_allclose(local.max(axis=0), high, atol=1e-12)


def test_of_many_points_the_deepest_the_farthest_and_the_widest_are_kept() -> None:
    rng = np.random.default_rng(4)
    m = np.array([0.0, 0.0, 1.0])
    for count in range(5, 9):
        buffer: Any = block(make_contact_buffer(count + 1))
        points = np.column_stack([rng.uniform(-0.3, 0.3, (count, 2)), np.zeros(count)])
        buffer.point[1 : count + 1], buffer.gap[1 : count + 1] = points, rng.uniform(-1e-3, 0.0, count)
        first = points[np.argmin(buffer.gap[1 : count + 1])]
        second = points[np.argmax(np.linalg.norm(points - first, axis=1))]
        beside = (points - first) @ np.cross(m, second - first)  # the area spanned with both, signed
        assert keep_widest(buffer, 1, count + 1, tuple(m)) == 1 + MOST_POINTS
        expected = [first, second, points[np.argmax(beside)], points[np.argmin(beside)]]
        if beside.min() < 0.0 < beside.max():
            np.testing.assert_array_equal(buffer.point[1:5], expected)


@pytest.mark.parametrize("sides", [(1, 1, 1), (-1, 1, 1), (1, -1, -1), (-1, -1, -1)])
def test_boxes_apart_in_all_three_directions_meet_between_their_corners(sides: tuple[int, int, int]) -> None:
    """Within the margin, but no corner of one over a face of the other."""
    half_a, half_b = np.array([0.1, 0.2, 0.3]), np.array([0.3, 0.1, 0.2])
    apart = np.array(sides) * (half_a + half_b + [0.03, 0.02, 0.01])
    shapes: list[SpatialShape] = [SpatialBox(2.0 * half_a, body=0), SpatialBox(2.0 * half_b, body=1)]
    poses = [(np.eye(3), np.zeros(3)), (np.eye(3), apart)]
    assert len(contacts_of(shapes, poses).gap) == 0
    found = contacts_of(shapes, poses, margin=0.05)
    assert found.gap == pytest.approx([0.03])  # of the direction that separates most
    np.testing.assert_allclose(found.normal, [[-sides[0], 0.0, 0.0]], atol=1e-15)
    corner_a, corner_b = np.array(sides) * half_a, apart - np.array(sides) * half_b
    low, high = np.minimum(corner_a, corner_b) - 1e-15, np.maximum(corner_a, corner_b) + 1e-15
    assert np.all((low <= found.point) & (found.point <= high))
    assert found.point[0, 0] == pytest.approx(0.5 * (corner_a + corner_b)[0])


@pytest.mark.parametrize("small_first", [False, True])
@pytest.mark.parametrize("tilted", [False, True])
@pytest.mark.parametrize("turn", [0.0, 0.4, -1.1])
@pytest.mark.parametrize("place", [(0.07, -0.11), (0.14, 0.2), (-0.14, 0.2), (0.14, -0.2)])
def test_a_small_face_within_a_large_one_touches_at_its_own_corners(
    small_first: bool, turn: float, place: tuple[float, float], tilted: bool
) -> None:
    """Upright and with binary heights both faces separate alike to the bit: then the first box clips the other."""
    small, large, depth = np.array([0.05, 0.08, 0.125]), np.array([0.4, 0.5, 0.25]), 2.0**-10
    cos, sin = np.cos(turn), np.sin(turn)
    yaw = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    R, p = random_pose(np.random.default_rng(6), 1.0) if tilted else (np.eye(3), np.zeros(3))
    above = (R @ yaw, p + R @ [*place, 0.5 * (small[2] + large[2]) - depth])
    pair: list[Any] = [(small, above), (large, (R, p))]
    pair = pair if small_first else pair[::-1]
    found = contacts_of([SpatialBox(size, body=k) for k, (size, _) in enumerate(pair)], [pose for _, pose in pair])
    local = (found.point - above[1]) @ above[0]
    order = np.lexsort(local.T[:2].round(6))
    corners = np.array([[-0.025, -0.04], [0.025, -0.04], [-0.025, 0.04], [0.025, 0.04]])
    np.testing.assert_allclose(local[order, :2], corners, atol=1e-12)
    np.testing.assert_allclose(found.gap, -depth, atol=1e-12)


def test_a_sphere_leaves_a_box_through_the_nearest_face_and_each_face_is_a_feature_of_its_own() -> None:
    shapes: list[SpatialShape] = [Sphere(0.05, body=0), SpatialBox([0.4, 0.4, 0.4])]
    features = set()
    for axis in range(3):
        for side in (-1.0, 1.0):
            found = contacts_of(shapes, [(np.eye(3), side * 0.15 * np.eye(3)[axis])])
            np.testing.assert_allclose(found.normal, side * np.eye(3)[[axis]], atol=1e-15)
            assert found.gap == pytest.approx([-0.1])
            features.add(int(found.feature[0]))
    assert len(features) == 6
