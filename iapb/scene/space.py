"""Scenes in space: ``dimensions: 3`` at the top of the file, and vectors have three numbers.

Everything else is as in the plane. Angles of placements are roll, pitch and yaw [rad] about the fixed x, y and z axes,
in this order, as in URDF. Quaternions are x, y, z, w.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator

from iapb.scene.bodies import MAX_SHAPES_OF_BODY, WORLD
from iapb.scene.model import MAX_BODIES, MAX_WALLS, Scene
from iapb.scene.parts import (
    SMALLEST_POSITIVE,
    Name,
    NonNegative,
    Number,
    OwnRestitution,
    Part,
    Positive,
    expectation,
)
from iapb.scene.sections import Hand

Vector3 = tuple[Number, Number, Number]
Inertia = Vector3 | tuple[Number, Number, Number, Number, Number, Number] | tuple[Vector3, Vector3, Vector3]
ORIGIN = (0.0, 0.0, 0.0)
UNIT_TOLERANCE = 1e-6  # length of a quaternion as written: six digits are enough

# entries of position and of velocity, and the position at rest
JOINTS: dict[str, tuple[int, int, tuple[float, ...]]] = {
    "fixed": (0, 0, ()),
    "revolute": (1, 1, (0.0,)),
    "continuous": (2, 1, (1.0, 0.0)),
    "prismatic": (1, 1, (0.0,)),
    "spherical": (4, 3, (0.0, 0.0, 0.0, 1.0)),
    "free_flyer": (7, 6, (0.0,) * 6 + (1.0,)),
}
WITH_AXIS = ("revolute", "continuous", "prismatic")


class Cuboid(Part):
    """A box."""

    kind: Literal["box"] = Field(description="a cuboid")
    size: tuple[Positive, Positive, Positive] = Field(description="full side lengths [m], along its own axes")
    center: Vector3 = Field(ORIGIN, description="its centre [m], in body axes (walls: world axes)")
    rpy: Vector3 = Field(ORIGIN, description="its rotation about the centre: roll, pitch, yaw [rad]")


class Ball(Part):
    """A sphere."""

    kind: Literal["sphere"] = Field(description="a ball")
    radius: Positive = Field(description="radius [m]")
    center: Vector3 = Field(ORIGIN, description="its centre [m], in body axes (walls: world axes)")


class HalfSpaceWall(Part):
    """A flat wall without end; solid on the side that the normal points away from."""

    name: Name = Field(description="the wall's name")
    restitution: OwnRestitution = None
    kind: Literal["half_space"] = Field(description="everything behind a plane")
    point: Vector3 = Field(description="a point of the surface [m], world axes")
    normal: Vector3 = Field(description="direction out of the wall, any length but zero, world axes")

    @field_validator("normal")
    @classmethod
    def _direction(cls, normal: Vector3) -> Vector3:
        return with_direction(normal)


class CuboidWall(Cuboid):
    """A static box."""

    name: Name = Field(description="the wall's name")
    restitution: OwnRestitution = None


class BallWall(Ball):
    """A static sphere."""

    name: Name = Field(description="the wall's name")
    restitution: OwnRestitution = None


SpatialShape = Annotated[Cuboid | Ball, Field(discriminator="kind")]
SpatialWall = Annotated[HalfSpaceWall | CuboidWall | BallWall, Field(discriminator="kind")]


def with_direction(vector: Vector3) -> Vector3:
    """Return the vector if it has a direction."""
    if math.hypot(*vector) < 1e-9:  # shorter, its direction would be decided by rounding of its parts
        raise expectation("a vector with a direction (length at least 1e-9)")
    return vector


class SpatialBody(Part):
    """A rigid body of a tree in space."""

    name: Name = Field(description="the body's name")
    parent: Name = Field(WORLD, description="the body it is jointed to; default: world")
    joint: Literal["fixed", "revolute", "continuous", "prismatic", "spherical", "free_flyer"] = Field(
        description="how it moves; position: revolute [rad], continuous cos, sin, prismatic [m], spherical "
        "quaternion x, y, z, w, free_flyer x, y, z [m] and quaternion"
    )
    axis: Vector3 | None = Field(None, description="direction of a revolute, continuous or prismatic joint")
    origin: Vector3 = Field(ORIGIN, description="where the joint lies [m], parent's axes")
    rpy: Vector3 = Field(ORIGIN, description="rotation of the joint frame in the parent: roll, pitch, yaw [rad]")
    center_of_mass: Vector3 = Field(ORIGIN, description="centre of mass [m], body axes")
    mass: NonNegative = Field(0.0, description="mass [kg]")
    inertia: Inertia = Field(
        ORIGIN,
        description="about the centre of mass, body axes [kg m2]: xx, yy, zz; or xx, yy, zz, xy, xz, yz; or a matrix",
    )
    shapes: Annotated[tuple[SpatialShape, ...], Field(max_length=MAX_SHAPES_OF_BODY)] = Field(
        (), description="what can touch; none: the body passes through everything"
    )
    position: tuple[Number, ...] = Field((), description="joint coordinates at the start; default: at rest")
    velocity: tuple[Number, ...] = Field(
        (), description="joint velocities [m/s, rad/s]; free_flyer: linear, angular, body axes; default: zeros"
    )

    restitution: OwnRestitution = None

    @field_validator("axis")
    @classmethod
    def _axis_where_needed(cls, axis: Vector3 | None, info: ValidationInfo) -> Vector3 | None:
        joint = info.data.get("joint")
        if joint in WITH_AXIS and axis is None:
            raise expectation(f"the direction of the {joint} joint, such as [0, 0, 1]")
        if joint is not None and joint not in WITH_AXIS and axis is not None:
            raise expectation(f"no axis: a {joint} joint has none")
        return None if axis is None else with_direction(axis)

    @field_validator("mass")
    @classmethod
    def _mass_that_joint_moves(cls, mass: float, info: ValidationInfo) -> float:
        if info.data.get("joint") in ("prismatic", "free_flyer") and mass < SMALLEST_POSITIVE:
            raise expectation(f"a mass >= {SMALLEST_POSITIVE} kg: the {info.data['joint']} joint moves it")
        return mass

    @field_validator("inertia")
    @classmethod
    def _inertia_of_a_body(cls, inertia: Any, info: ValidationInfo) -> Any:
        import numpy as np

        matrix = np.array(inertia_matrix(inertia))
        if np.abs(matrix - matrix.T).max() > 0.0:
            raise expectation("a symmetric matrix")
        turned = info.data.get("joint") in ("spherical", "free_flyer")
        if turned and np.linalg.eigvalsh(matrix).min() < SMALLEST_POSITIVE:
            raise expectation(f"principal moments >= {SMALLEST_POSITIVE} kg m2: the joint turns about all axes")
        return inertia

    @field_validator("position", "velocity")
    @classmethod
    def _one_number_per_coordinate(cls, given: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
        joint = info.data.get("joint")
        if joint is None:
            return given
        coordinates, velocities, neutral = JOINTS[joint]
        if info.field_name == "velocity":
            if given and len(given) != velocities:
                raise expectation(f"{velocities} numbers, one per velocity of a {joint} joint")
            return given or (0.0,) * velocities
        if given and len(given) != coordinates:
            raise expectation(f"{coordinates} numbers, one per coordinate of a {joint} joint")
        turn = {"continuous": given, "spherical": given, "free_flyer": given[3:]}.get(joint, ())
        if given and turn and abs(math.hypot(*turn) - 1.0) > UNIT_TOLERANCE:
            raise expectation("a rotation of length one: cos, sin or quaternion x, y, z, w")
        return given or neutral


def inertia_matrix(inertia: Any) -> list[list[float]]:
    """Return the (3, 3) matrix that three, six or nine numbers stand for."""
    if isinstance(inertia[0], (tuple, list)):
        return [list(row) for row in inertia]
    xx, yy, zz, xy, xz, yz = inertia if len(inertia) == 6 else (*inertia, 0.0, 0.0, 0.0)
    return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]


class SpatialHand(Hand):
    """The hand in space."""

    point: Vector3 = Field(ORIGIN, description="where it holds the body [m], body axes")  # type: ignore[assignment]
    force: tuple[Number, Number, Number, Number, Number, Number] = Field(  # type: ignore[assignment]
        (0.0,) * 6, description="constant force and torque [N, N, N, N m, N m, N m], world axes; default: none"
    )


class SpatialScene(Scene):
    """A world in space: as `Scene`, with three numbers for vectors."""

    dimensions: Literal[3] = Field(description="3: a scene in space; a scene without this field is planar")
    gravity: Vector3 | None = Field(None, description="acceleration [m/s2], world axes; default: none")  # type: ignore[assignment]
    bodies: Annotated[tuple[SpatialBody, ...], Field(min_length=1, max_length=MAX_BODIES)] = Field(  # type: ignore[assignment]
        description="what can move, each after its parent"
    )
    walls: Annotated[tuple[SpatialWall, ...], Field(max_length=MAX_WALLS)] = Field(  # type: ignore[assignment]
        (), description="the static world"
    )
    hand: SpatialHand | None = Field(None, description="the hand that holds the tool; default: nobody")


def scene_kind(given: Any) -> type[Scene]:
    """Return which kind of scene plain values describe."""
    return SpatialScene if isinstance(given, dict) and "dimensions" in given else Scene
