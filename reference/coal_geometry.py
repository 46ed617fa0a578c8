"""Contact patches by coal, for general convex shapes and as a cross-check of the compiled narrow phase.

The only file that imports coal, and only when it is used. What was seen of coal 3, and is dealt with here:

- its normals point from shape 1 into shape 2, ours from b into a: with a as shape 1 they are turned round;
- `collide` of two boxes gives one point of a whole face, `computeContactPatch` gives the face;
- a normal may come out not finite where shapes coincide: such a contact is refused, not passed on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.errors import ArgumentError, MissingDependencyError, SolverError

Floats = NDArray[np.float64]
# A unit normal of coal carries the rounding of its iterations; anything worse is no direction.
UNIT_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Patch:
    """Contact of two convex shapes that overlap.

    Attributes
    ----------
    normal : (3,) unit, from b into a
    gap : float [m], negative: the depth along the normal by which they must part
    points : (k, 3) [m] corners of the patch, world, on the plane midway between the surfaces
    """

    normal: Floats
    gap: float
    points: Floats


def _coal() -> Any:
    try:
        import coal
    except ImportError as error:
        raise MissingDependencyError("coal", "contact patches of convex shapes", "pip install pin") from error
    return coal


def coal_box(size: ArrayLike) -> Any:
    """A cuboid of full side lengths (3,) [m] about its origin."""
    return _coal().Box(*np.asarray(size, np.float64))


def coal_sphere(radius: float) -> Any:
    """A ball about its origin [m]."""
    return _coal().Sphere(float(radius))


def coal_half_space(normal: ArrayLike, offset: float) -> Any:
    """The half-space n·x <= offset [m]."""
    direction = np.asarray(normal, np.float64)
    return _coal().Halfspace(direction / np.linalg.norm(direction), float(offset))


def coal_convex(vertices: ArrayLike) -> Any:
    """The convex hull of points (k, 3) [m]."""
    coal = _coal()
    points = coal.StdVec_Vec3s()
    for vertex in np.asarray(vertices, np.float64):
        points.append(vertex)
    return coal.Convex.convexHull(points, True, "Qt")


def patch(shape_a: Any, pose_a: tuple[Floats, Floats], shape_b: Any, pose_b: tuple[Floats, Floats]) -> Patch | None:
    """Return the contact patch of two convex shapes, None where they do not touch.

    Parameters
    ----------
    shape_a, shape_b : coal shapes, for instance from the functions above
    pose_a, pose_b : (R (3, 3), p (3,) [m]) their frames in the world

    Raises
    ------
    MissingDependencyError
        coal is not installed.
    ArgumentError
        A pose of the wrong shape or not finite.
    SolverError
        coal returned a contact that is not finite, or a normal that is not of unit length.
    """
    coal = _coal()
    frames = [_frame(coal, *pose) for pose in (pose_a, pose_b)]
    request, result = coal.CollisionRequest(), coal.CollisionResult()
    if not coal.collide(shape_a, frames[0], shape_b, frames[1], request, result):
        return None
    patches = coal.ContactPatchResult()
    coal.computeContactPatch(shape_a, frames[0], shape_b, frames[1], result, coal.ContactPatchRequest(), patches)
    contact = result.getContact(0)
    normal, gap = -np.array(contact.normal, np.float64), float(contact.penetration_depth)
    points = [np.array(contact.pos, np.float64)]
    if patches.numContactPatches():
        found = patches.getContactPatch(0)
        points = [np.array(found.getPoint(i), np.float64) for i in range(found.size())] or points
    return _checked(Patch(normal, gap, np.array(points).reshape(-1, 3)))


def _frame(coal: Any, rotation: ArrayLike, position: ArrayLike) -> Any:
    R, p = np.asarray(rotation, np.float64), np.asarray(position, np.float64)
    if R.shape != (3, 3) or p.shape != (3,) or not (np.isfinite(R).all() and np.isfinite(p).all()):
        raise ArgumentError("pose", (rotation, position), "a finite rotation (3, 3) and position (3,)")
    return coal.Transform3s(R, p)


def _checked(found: Patch) -> Patch:
    finite = np.isfinite(found.normal).all() and np.isfinite(found.gap) and np.isfinite(found.points).all()
    if not finite or abs(np.linalg.norm(found.normal) - 1.0) > UNIT_TOLERANCE:
        raise SolverError(f"coal: normal {found.normal.tolist()}, gap {found.gap!r}: not a contact")
    return found
