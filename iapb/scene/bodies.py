"""Shapes, walls and moving bodies of a scene, in the plane and in space. Lengths are in metres, angles in radians.

In space, placements have the angles roll, pitch and yaw about the fixed x, y and z axes, in this order, as in URDF.
Quaternions are written x, y, z, w.
"""

from __future__ import annotations

import math
from fractions import Fraction as Exact
from typing import Annotated, Any, ClassVar, Literal

from pydantic import (
    BeforeValidator,
    Field,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import InitErrorDetails

from iapb.mechanics.joints import KINDS
from iapb.scene.density import filled
from iapb.scene.parts import (
    SMALLEST_POSITIVE,
    Name,
    NonNegative,
    Number,
    OwnFriction,
    OwnRestitution,
    Part,
    Positive,
    Vector2,
    Vector3,
    expectation,
    located,
)

INERTIAL = ("mass", "center_of_mass", "inertia")  # fields that a density replaces
WORLD = "world"  # the parent of a root body
ORIGIN = (0.0, 0.0, 0.0)
MAX_SHAPES_OF_BODY = 64
MAX_VERTICES = 256  # use a circle for more
UNIT_TOLERANCE = 1e-6  # error of a written quaternion's length: six digits are enough
_STRAIGHT = 1e-9  # sine of the smallest turn at a corner; below it, rounding errors would decide convexity


def with_direction(vector: tuple[float, ...]) -> tuple[float, ...]:
    """Return the vector unchanged if its length is at least 1e-9, so that it has a direction."""
    if math.hypot(*vector) < 1e-9:  # the direction of a shorter one would be rounding error
        raise expectation("a vector with a direction (length at least 1e-9)")
    return vector


# Shapes in the plane


class Box(Part):
    """A rectangle."""

    kind: Literal["box"] = Field(description="a rectangle")
    size: tuple[Positive, Positive] = Field(description="full width and height [m], along its own axes")
    center: Vector2 = Field((0.0, 0.0), description="its centre [m], in body axes (walls: world axes)")
    angle: Number = Field(0.0, description="its rotation about the centre [rad], counter-clockwise")


class Circle(Part):
    """A disc."""

    kind: Literal["circle"] = Field(description="a disc")
    radius: Positive = Field(description="radius [m]")
    center: Vector2 = Field((0.0, 0.0), description="its centre [m], in body axes (walls: world axes)")


class Polygon(Part):
    """A convex polygon; its vertices are stored counter-clockwise."""

    kind: Literal["polygon"] = Field(description="a convex polygon")
    vertices: Annotated[tuple[Vector2, ...], Field(min_length=3, max_length=MAX_VERTICES)] = Field(
        description="corners in order [m], around the shape in either direction, relative to center"
    )
    center: Vector2 = Field((0.0, 0.0), description="where its origin lies [m], in body axes (walls: world axes)")
    angle: Number = Field(0.0, description="its rotation about its origin [rad], counter-clockwise")

    @field_validator("vertices")
    @classmethod
    def _convex(cls, vertices: tuple[Vector2, ...]) -> tuple[Vector2, ...]:
        corners = zip((*vertices[-1:], *vertices), vertices, (*vertices[1:], *vertices[:1]), strict=False)
        turns = [_turn(before, at, after) for before, at, after in corners]
        if sum(turns) < 0.0:
            vertices, turns = vertices[::-1], [-turn for turn in turns]
        once_around = abs(sum(turns) - 2.0 * math.pi) < 1.0  # the sum is a multiple of 2 pi
        if not once_around or any(math.sin(turn) <= _STRAIGHT for turn in turns):
            raise expectation("the corners of a convex polygon in order, none twice, no three on one line")
        return vertices


def _turn(before: Vector2, at: Vector2, after: Vector2) -> float:
    """Return the angle by which the outline turns at a corner [rad]; 0 if two corners coincide."""
    ux, uy = at[0] - before[0], at[1] - before[1]
    vx, vy = after[0] - at[0], after[1] - at[1]
    return math.atan2(ux * vy - uy * vx, ux * vx + uy * vy)


# Shapes in space


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


# Walls: shapes of the static world, half-planes and half-spaces


class _OfWall(Part):
    name: Name = Field(description="the wall's name")
    restitution: OwnRestitution = None
    friction: OwnFriction = None


class HalfPlaneWall(_OfWall):
    """An infinite straight wall; the side opposite to the normal is solid."""

    kind: Literal["half_plane"] = Field(description="everything behind a straight line")
    point: Vector2 = Field(description="a point of the surface [m], world axes")
    normal: Vector2 = Field(description="direction out of the wall, any length but zero, world axes")

    _direction = field_validator("normal")(with_direction)


class HalfSpaceWall(_OfWall):
    """An infinite flat wall; the side opposite to the normal is solid."""

    kind: Literal["half_space"] = Field(description="everything behind a plane")
    point: Vector3 = Field(description="a point of the surface [m], world axes")
    normal: Vector3 = Field(description="direction out of the wall, any length but zero, world axes")

    _direction = field_validator("normal")(with_direction)


class BoxWall(_OfWall, Box):
    """A static rectangle."""


class CircleWall(_OfWall, Circle):
    """A static disc."""


class PolygonWall(_OfWall, Polygon):
    """A static convex polygon."""


class CuboidWall(_OfWall, Cuboid):
    """A static box."""


class BallWall(_OfWall, Ball):
    """A static sphere."""


Shape = Annotated[Box | Circle | Polygon, Field(discriminator="kind")]
Wall = Annotated[HalfPlaneWall | BoxWall | CircleWall | PolygonWall, Field(discriminator="kind")]
SpatialShape = Annotated[Cuboid | Ball, Field(discriminator="kind")]
SpatialWall = Annotated[HalfSpaceWall | CuboidWall | BallWall, Field(discriminator="kind")]


# Moving bodies

_DENSITY: TypeAdapter[float] = TypeAdapter(Positive)
LIMITED = ("revolute", "prismatic")  # joints that can have limits: their one coordinate is a length or an angle

JointDamping = Annotated[
    tuple[NonNegative, ...],
    BeforeValidator(lambda given: (given,) if isinstance(given, int | float) else given),
    Field(description="viscous damping of its joint [N s/m, N m s/rad], one number per velocity; default: none"),
]
JointLimits = Annotated[
    tuple[Number, Number] | None,
    Field(description="least and largest position of its revolute or prismatic joint [rad, m]; default: no limits"),
]


class _AnyBody(Part):
    """Checks of a body's values against its joint, in the plane and in space."""

    _shapes: ClassVar[TypeAdapter[Any]]  # parser of its shapes
    with_axis: ClassVar[tuple[str, ...]]  # joints that have an axis
    an_axis: ClassVar[str]  # an example of an axis

    @model_validator(mode="before")
    @classmethod
    def _filled(cls, given: Any) -> Any:
        """Replace a density by mass, centre of mass and inertia; `across_fields` reports an invalid one."""
        density = given.get("density") if isinstance(given, dict) else None
        if not isinstance(density, int | float) or isinstance(density, bool) or any(given.get(x) for x in INERTIAL):
            return given
        try:
            shapes, value = cls._shapes.validate_python(given.get("shapes") or ()), _DENSITY.validate_python(density)
            inertial = filled(shapes, value, spatial=cls.an_axis.count(",") == 2) if shapes else {}
        except (ValidationError, ZeroDivisionError):  # invalid shapes, or an area that rounds to zero
            return given
        plain = {name: value for name, value in given.items() if name not in ("density", *INERTIAL)}
        return plain | inertial if inertial else given

    @classmethod
    def across_fields(cls, given: Any) -> list[InitErrorDetails]:
        density = given.get("density") if isinstance(given, dict) else None
        if density is None:
            return []
        beside = [name for name in INERTIAL if given.get(name)]
        if beside:
            expected = f"no density beside {', '.join(beside)}: it gives mass, centre of mass and inertia"
            return [located(("density",), density, expected)]
        return [] if given.get("shapes") else [located(("density",), density, "shapes that it fills")]

    @field_validator("axis", check_fields=False)
    @classmethod
    def _axis_where_needed(cls, axis: Any, info: ValidationInfo) -> Any:
        joint = info.data.get("joint")
        if joint in cls.with_axis and axis is None:
            raise expectation(f"the direction of the {joint} joint, such as {cls.an_axis}")
        if joint is not None and joint not in cls.with_axis and axis is not None:
            raise expectation(f"no axis: only a {' or '.join(cls.with_axis)} joint has one, this joint is {joint}")
        return None if axis is None else with_direction(axis)

    @field_validator("mass", check_fields=False)
    @classmethod
    def _mass_that_joint_moves(cls, mass: float, info: ValidationInfo) -> float:
        joint = info.data.get("joint")
        if joint in ("prismatic", "planar", "free_flyer") and mass < SMALLEST_POSITIVE:
            raise expectation(f"a mass >= {SMALLEST_POSITIVE} kg: the {joint} joint moves it")
        return mass

    @field_validator("position", "velocity", check_fields=False)
    @classmethod
    def _one_number_per_coordinate(cls, given: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
        joint = info.data.get("joint")
        if joint is None:
            return given
        moving = info.field_name == "velocity"
        count = KINDS[joint].nv if moving else KINDS[joint].nq
        if given and len(given) != count:
            noun = "velocity" if moving else "coordinate"
            raise expectation(f"{count} number{'' if count == 1 else 's'}, one per {noun} of a {joint} joint")
        if moving:
            return given or (0.0,) * count
        turn = {"continuous": given, "spherical": given, "free_flyer": given[3:]}.get(joint)
        if turn and abs(math.hypot(*turn) - 1.0) > UNIT_TOLERANCE:
            raise expectation("a rotation of length one: cos, sin or quaternion x, y, z, w")
        return given or KINDS[joint].neutral

    @field_validator("joint_damping", check_fields=False)
    @classmethod
    def _one_damping_per_velocity(cls, given: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
        joint = info.data.get("joint")
        count = KINDS[joint].nv if joint is not None else len(given)
        if given and len(given) != count:
            raise expectation(f"{count} number{'' if count == 1 else 's'}, one per velocity of a {joint} joint")
        return given

    @field_validator("joint_limits", check_fields=False)
    @classmethod
    def _limits_around_the_start(
        cls, limits: tuple[float, float] | None, info: ValidationInfo
    ) -> tuple[float, float] | None:
        joint, position = info.data.get("joint"), info.data.get("position")
        if limits is None or joint is None:
            return limits
        if joint not in LIMITED:
            raise expectation(f"no limits: only a {' or '.join(LIMITED)} joint has them, this joint is {joint}")
        if not limits[0] < limits[1]:
            raise expectation("two numbers, the smaller one first")
        if position and not limits[0] <= position[0] <= limits[1]:
            raise expectation(f"limits around the start, position = {position[0]:g}")
        return limits


class Body(_AnyBody):
    """A rigid body of a tree.

    The joint frame has the position `origin` and the rotation `angle` in the parent body's frame. The joint moves the
    body frame relative to the joint frame. Every moving body has the mass or inertia that its joint accelerates, so the
    mass matrix is positive definite in every configuration.
    """

    _shapes = TypeAdapter(tuple[Shape, ...])
    with_axis = ("prismatic",)
    an_axis = "[1, 0]"

    name: Name = Field(description="the body's name")
    parent: Name = Field(WORLD, description="the body it is jointed to; default: world")
    joint: Literal["fixed", "revolute", "prismatic", "planar"] = Field(
        description="how it moves: fixed; revolute [rad]; prismatic along axis [m]; planar = x, y [m], theta [rad]"
    )
    axis: Vector2 | None = Field(None, description="direction of a prismatic joint, any length, joint frame")
    origin: Vector2 = Field((0.0, 0.0), description="where the joint lies [m], parent's axes")
    angle: Number = Field(0.0, description="rotation of the joint frame in the parent [rad]")
    center_of_mass: Vector2 = Field((0.0, 0.0), description="centre of mass [m], body axes")
    mass: NonNegative = Field(0.0, description="mass [kg]")
    density: Positive | None = Field(
        None, description="in place of mass, center_of_mass and inertia: mass per area of the shapes [kg/m2]"
    )
    inertia: NonNegative = Field(0.0, description="moment of inertia about the centre of mass [kg m2]")
    shapes: Annotated[tuple[Shape, ...], Field(max_length=MAX_SHAPES_OF_BODY)] = Field(
        (), description="what can touch; none: the body passes through everything"
    )
    position: tuple[Number, ...] = Field((), description="joint coordinates at the start [m, rad]; default: zeros")
    velocity: tuple[Number, ...] = Field(
        (), description="joint velocities at the start [m/s, rad/s]; default: zeros"
    )
    restitution: OwnRestitution = None
    friction: OwnFriction = None
    joint_damping: JointDamping = ()
    joint_limits: JointLimits = None

    @field_validator("inertia")
    @classmethod
    def _inertia_that_joint_turns(cls, inertia: float, info: ValidationInfo) -> float:
        known = info.data
        if known.get("joint") == "planar" and inertia < SMALLEST_POSITIVE:
            raise expectation(f"a moment of inertia >= {SMALLEST_POSITIVE} kg m2: the planar joint turns it")
        if known.get("joint") == "revolute" and "mass" in known and "center_of_mass" in known:
            about_axis = inertia + known["mass"] * sum(c * c for c in known["center_of_mass"])
            if about_axis < SMALLEST_POSITIVE:
                raise expectation("a moment of inertia > 0, or a mass whose centre is off the revolute joint's axis")
        return inertia


Inertia = Vector3 | tuple[Number, Number, Number, Number, Number, Number] | tuple[Vector3, Vector3, Vector3]


class SpatialBody(_AnyBody):
    """A rigid body of a tree in space."""

    _shapes = TypeAdapter(tuple[SpatialShape, ...])
    with_axis = ("revolute", "continuous", "prismatic")
    an_axis = "[0, 0, 1]"

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
    density: Positive | None = Field(
        None, description="in place of mass, center_of_mass and inertia: mass per volume of the shapes [kg/m3]"
    )
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
    friction: OwnFriction = None
    joint_damping: JointDamping = ()
    joint_limits: JointLimits = None

    @field_validator("inertia")
    @classmethod
    def _inertia_of_a_body(cls, inertia: Any, info: ValidationInfo) -> Any:
        matrix = inertia_matrix(inertia)
        if any(matrix[i][j] != matrix[j][i] for i, j in ((0, 1), (0, 2), (1, 2))):
            raise expectation("a symmetric matrix")
        turned = info.data.get("joint") in ("spherical", "free_flyer")
        if turned and not _least_eigenvalue_reaches(matrix, SMALLEST_POSITIVE):
            raise expectation(f"principal moments >= {SMALLEST_POSITIVE} kg m2: the joint turns about all axes")
        return inertia


def inertia_matrix(inertia: Any) -> list[list[float]]:
    """Return the inertia matrix (3, 3) given by three, six or nine numbers."""
    if isinstance(inertia[0], (tuple, list)):
        return [list(row) for row in inertia]
    xx, yy, zz, xy, xz, yz = inertia if len(inertia) == 6 else (*inertia, 0.0, 0.0, 0.0)
    return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]


def _least_eigenvalue_reaches(matrix: list[list[float]], least: float) -> bool:
    """Return whether all eigenvalues of a symmetric (3, 3) matrix are at least `least`, in exact arithmetic.

    This holds if and only if no principal minor of matrix − `least` · 1 is negative.
    """
    (a, b, c), (_, d, e), (_, _, f) = [[Exact(x) for x in row] for row in matrix]
    a, d, f = (x - Exact(least) for x in (a, d, f))
    minors = (a, d, f, a * d - b * b, a * f - c * c, d * f - e * e,
              a * (d * f - e * e) - b * (b * f - c * e) + c * (b * e - c * d))
    return min(minors) >= 0
