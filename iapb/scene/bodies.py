"""Shapes, walls and moving bodies of a scene, in the plane and in space. Lengths are in metres,
angles in radians.

In space, placements have the angles roll, pitch and yaw about the fixed x, y and z axes, in this
order, as in URDF. Quaternions are written x, y, z, w.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    BeforeValidator,
    Field,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    field_validator,
    model_validator,
)

from iapb.errors import counted
from iapb.mechanics.joints import KINDS
from iapb.scene.parts import (
    Name,
    NonNegative,
    Number,
    OwnFriction,
    OwnRestitution,
    Positive,
    ScenePart,
    Vector2,
    Vector3,
    expectation,
    require,
)

INERTIAL = ("mass", "center_of_mass", "inertia")  # fields that a density replaces
WORLD = "world"  # the parent of a root body
ORIGIN = (0.0, 0.0, 0.0)
MAX_SHAPES_OF_BODY = 64
MAX_VERTICES = 256  # use a circle for more
UNIT_TOLERANCE = 1e-6  # error of a written quaternion's length: six digits are enough
# sine of the smallest turn at a corner; below it, rounding errors would decide convexity
_STRAIGHT = 1e-9

V = TypeVar("V")  # Vector2 or Vector3
Center = Annotated[V, Field(description="its centre [m], in body axes (walls: world axes)")]
Surface = Annotated[V, Field(description="a point of the surface [m], world axes")]
Outwards = Annotated[
    V, Field(description="direction out of the wall, any length but zero, world axes")
]


def with_direction(vector: tuple[float, ...]) -> tuple[float, ...]:
    """Return the vector unchanged if its length is at least 1e-9, so that it has a direction."""
    # the direction of a shorter one would be rounding error
    require(math.hypot(*vector) >= 1e-9, "a vector with a direction (length at least 1e-9)")
    return vector


class Box(ScenePart):
    """A rectangle."""

    kind: Literal["box"] = Field(description="a rectangle")
    size: tuple[Positive, Positive] = Field(
        description="full width and height [m], along its own axes"
    )
    center: Center[Vector2] = (0.0, 0.0)
    angle: Number = Field(0.0, description="its rotation about the centre [rad], counter-clockwise")


class Circle(ScenePart):
    """A disc."""

    kind: Literal["circle"] = Field(description="a disc")
    radius: Positive = Field(description="radius [m]")
    center: Center[Vector2] = (0.0, 0.0)


class Polygon(ScenePart):
    """A convex polygon; its vertices are stored counter-clockwise."""

    kind: Literal["polygon"] = Field(description="a convex polygon")
    vertices: Annotated[tuple[Vector2, ...], Field(min_length=3, max_length=MAX_VERTICES)] = Field(
        description="corners in order [m], around the shape in either direction, relative to center"
    )
    center: Vector2 = Field(
        (0.0, 0.0), description="where its origin lies [m], in body axes (walls: world axes)"
    )
    angle: Number = Field(0.0, description="its rotation about its origin [rad], counter-clockwise")

    @field_validator("vertices")
    @classmethod
    def _convex(cls, vertices: tuple[Vector2, ...]) -> tuple[Vector2, ...]:
        corners = [complex(*vertex) for vertex in vertices]
        edges = [after - at for at, after in zip(corners, corners[1:] + corners[:1], strict=True)]
        turns = [cmath.phase(edges[i] * edges[i - 1].conjugate()) for i in range(len(edges))]
        if sum(turns) < 0.0:
            vertices = vertices[::-1]
            turns = [-turn for turn in turns]
        once_around = abs(sum(turns) - 2.0 * math.pi) < 1.0  # the sum is a multiple of 2 pi
        require(
            once_around and all(math.sin(turn) > _STRAIGHT for turn in turns),
            "the corners of a convex polygon in order, none twice, no three on one line",
        )
        return vertices


class Cuboid(ScenePart):
    """A box in space."""

    kind: Literal["box"] = Field(description="a cuboid")
    size: tuple[Positive, Positive, Positive] = Field(
        description="full side lengths [m], along its own axes"
    )
    center: Center[Vector3] = ORIGIN
    rpy: Vector3 = Field(
        ORIGIN, description="its rotation about the centre: roll, pitch, yaw [rad]"
    )


class Ball(ScenePart):
    """A sphere."""

    kind: Literal["sphere"] = Field(description="a ball")
    radius: Positive = Field(description="radius [m]")
    center: Center[Vector3] = ORIGIN


class _OfWall(ScenePart):
    name: Name = Field(description="the wall's name")
    restitution: OwnRestitution = None
    friction: OwnFriction = None

    _direction = field_validator("normal", check_fields=False)(with_direction)


class HalfPlaneWall(_OfWall):
    """An infinite straight wall; the side opposite to the normal is solid."""

    kind: Literal["half_plane"] = Field(description="everything behind a straight line")
    point: Surface[Vector2]
    normal: Outwards[Vector2]


class HalfSpaceWall(_OfWall):
    """An infinite flat wall; the side opposite to the normal is solid."""

    kind: Literal["half_space"] = Field(description="everything behind a plane")
    point: Surface[Vector3]
    normal: Outwards[Vector3]


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

Axis = Annotated[
    V | None, Field(description="direction of the joint if it has one, any length, joint frame")
]
Origin = Annotated[V, Field(description="where the joint lies [m], parent's axes")]
CenterOfMass = Annotated[V, Field(description="centre of mass [m], body axes")]
Shapes = Annotated[
    tuple[V, ...],
    Field(
        max_length=MAX_SHAPES_OF_BODY,
        description="what can touch; none: the body passes through everything",
    ),
]
PerVelocity = Annotated[
    tuple[NonNegative, ...],
    BeforeValidator(
        lambda given: (given,) if isinstance(given, int | float) else given,
        json_schema_input_type=NonNegative | tuple[NonNegative, ...],
    ),
]
JointDamping = Annotated[
    PerVelocity,
    Field(
        description="viscous damping of its joint [N s/m, N m s/rad], one number per velocity; default: none"
    ),
]
JointFriction = Annotated[
    PerVelocity,
    Field(
        description="Coulomb's dry friction of its joint [N, N m], one number per velocity; default: none"
    ),
]


class JointMimic(ScenePart):
    """What a joint follows: position = multiplier × position of a body's joint + offset."""

    body: Name = Field(
        description="the body whose joint it follows, revolute or prismatic, in the same tree"
    )
    multiplier: Number = Field(1.0, description="of its position [1, rad/m, m/rad]; default 1")
    offset: Number = Field(0.0, description="added to it [m, rad]; default 0")


def _in_one_form(given: Any, validate: ValidatorFunctionWrapHandler) -> Any:
    """Refuse what has no form of an inertia once, not once for each form."""
    try:
        return validate(given)
    except ValidationError:
        raise expectation(
            "three finite numbers xx, yy, zz; six with xy, xz, yz; or a matrix of three rows"
        ) from None


Inertia = Annotated[
    Vector3
    | tuple[Number, Number, Number, Number, Number, Number]
    | tuple[Vector3, Vector3, Vector3],
    WrapValidator(_in_one_form),
]


class AnyBody(ScenePart):
    """A rigid body of a tree.

    The joint frame has the position `origin` and the rotation `angle` or `rpy` in the parent body's
    frame. The joint moves the body frame relative to the joint frame. A body may be massless if
    those that it carries give its joint mass to move (`iapb.scene.mechanism.joint_fault`).
    """

    center_of_mass: Any
    mass: NonNegative = Field(0.0, description="mass [kg]")
    density: Positive | None = Field(
        None,
        description="in place of mass, center_of_mass and inertia: mass per area of "
        "the shapes [kg/m2], in space per volume [kg/m3]",
    )
    inertia: Any
    shapes: tuple[Any, ...]
    joint_mimic: JointMimic | None = Field(
        None,
        description="what its revolute or prismatic joint follows; it has no position, velocity or "
        "coordinate of its own then; default: nothing",
    )
    position: tuple[Number, ...] = Field(
        (), description="joint coordinates at the start [m, rad]; default: at rest"
    )
    velocity: tuple[Number, ...] = Field(
        (),
        description="joint velocities at the start [m/s, rad/s]; free_flyer: "
        "linear, angular, body axes; default: zeros",
    )
    restitution: OwnRestitution = None
    friction: OwnFriction = None
    joint_damping: JointDamping = ()
    joint_friction: JointFriction = ()
    joint_limits: tuple[Number, Number] | None = Field(
        None,
        description="least and largest position of its revolute or prismatic joint [rad, m]; default: no limits",
    )

    with_axis: ClassVar[tuple[str, ...]]  # joints that have an axis

    @model_validator(mode="before")
    @classmethod
    def _filled(cls, given: Any) -> Any:
        """Replace a density by mass, centre of mass and inertia; one that stays is reported
        below."""
        if (
            not isinstance(given, dict)
            or given.get("density") is None
            or any(given.get(x) for x in INERTIAL)
        ):
            return given
        kinds: dict[str, Any] = {
            "shapes": cls.model_fields["shapes"].annotation,
            "density": Positive,
        }
        try:
            inertial = filled_with(
                *(TypeAdapter(kind).validate_python(given[name]) for name, kind in kinds.items())
            )
        except (
            LookupError,
            ValidationError,
            ArithmeticError,
        ):  # no or wrong shapes, or a mass that rounds to zero
            return given
        return {
            name: value for name, value in given.items() if name not in ("density", *INERTIAL)
        } | inertial

    @field_validator("density")
    @classmethod
    def _replaced(cls, density: float | None) -> None:
        require(
            density is None,
            "shapes that it fills, and no mass, center_of_mass or inertia beside it",
        )

    @field_validator(
        "axis",
        "joint_mimic",
        "position",
        "velocity",
        "joint_damping",
        "joint_friction",
        "joint_limits",
        check_fields=False,
    )
    @classmethod
    def _fits_the_joint(cls, given: Any, info: ValidationInfo) -> Any:
        """Check a field whose values depend on the kind of joint, and fill in the start."""
        field = info.field_name
        joint = info.data.get("joint")
        if joint is None:
            return given
        kind = KINDS[joint]
        if field == "axis":
            require(given is None or joint in cls.with_axis, f"no axis: a {joint} joint has none")
            require(
                given is not None or joint not in cls.with_axis,
                f"the direction of the {joint} joint",
            )
            return given and with_direction(given)
        follows = info.data.get("joint_mimic")
        if field == "joint_mimic":
            require(
                given is None or joint in ("revolute", "prismatic"),
                f"no mimic: a {joint} joint follows none",
            )
        elif follows and field in ("position", "velocity"):
            require(not given, f"no {field}: the joint follows that of {follows.body}")
        elif field == "joint_limits" and given is not None:
            start = (info.data.get("position") or given)[0]
            require(joint in ("revolute", "prismatic"), f"no limits: a {joint} joint has none")
            require(given[0] < given[1], "two numbers, the smaller one first")
            require(given[0] <= start <= given[1], f"limits around the start, position = {start:g}")
        elif field == "position":
            require(
                len(given) in (0, kind.nq),
                f"{counted(kind.nq, 'number')}, one per coordinate of a {joint} joint",
            )
            turn = {"continuous": given, "spherical": given, "free_flyer": given[3:]}.get(joint)
            unit = not turn or abs(math.hypot(*turn) - 1.0) <= UNIT_TOLERANCE
            require(unit, "a rotation of length one: cos, sin or quaternion x, y, z, w")
            return given or kind.neutral
        elif field != "joint_limits":
            require(
                len(given) in (0, kind.nv),
                f"{counted(kind.nv, 'number')}, one per velocity of a {joint} joint",
            )
            return given or (0.0,) * kind.nv * (field == "velocity")
        return given


class _PlanarJoint(ScenePart):
    name: Name = Field(description="the body's name")
    parent: Name = Field(WORLD, description="the body it is jointed to; default: world")
    joint: Literal["fixed", "revolute", "prismatic", "planar"] = Field(
        description="how it moves: fixed; revolute "
        "[rad]; prismatic along axis [m]; planar = x, y [m], theta [rad]"
    )
    axis: Axis[Vector2] = None
    origin: Origin[Vector2] = (0.0, 0.0)
    angle: Number = Field(0.0, description="rotation of the joint frame in the parent [rad]")


class Body(AnyBody, _PlanarJoint):
    """A rigid body of a tree in the plane."""

    with_axis = ("prismatic",)

    center_of_mass: CenterOfMass[Vector2] = (0.0, 0.0)
    inertia: NonNegative = Field(
        0.0, description="moment of inertia about the centre of mass [kg m2]"
    )
    shapes: Shapes[Shape] = ()


class _SpatialJoint(ScenePart):
    name: Name = Field(description="the body's name")
    parent: Name = Field(WORLD, description="the body it is jointed to; default: world")
    joint: Literal[
        "fixed", "revolute", "continuous", "prismatic", "planar", "spherical", "free_flyer"
    ] = Field(
        description="how it moves; position: revolute [rad], continuous cos, sin, prismatic [m], "
        "planar x, y [m], theta [rad], spherical quaternion x, y, z, w, free_flyer x, y, z [m] and "
        "quaternion"
    )
    axis: Axis[Vector3] = None
    origin: Origin[Vector3] = ORIGIN
    rpy: Vector3 = Field(
        ORIGIN, description="rotation of the joint frame in the parent: roll, pitch, yaw [rad]"
    )


class SpatialBody(AnyBody, _SpatialJoint):
    """A rigid body of a tree in space."""

    with_axis = ("revolute", "continuous", "prismatic")

    center_of_mass: CenterOfMass[Vector3] = ORIGIN
    inertia: Inertia = Field(
        ORIGIN,
        description="about the centre of mass, body axes [kg m2]: xx, yy, zz; or xx, yy, "
        "zz, xy, xz, yz; or a matrix",
    )
    shapes: Shapes[SpatialShape] = ()

    @field_validator("inertia")
    @classmethod
    def _symmetric(cls, inertia: Any) -> Any:
        matrix = inertia_matrix(inertia)
        rounding = 1e-12 * np.abs(matrix).max()
        require(
            np.ndim(inertia[0]) == 0 or bool((abs(np.subtract(inertia, matrix)) <= rounding).all()),
            "a symmetric matrix",
        )
        return inertia


def inertia_matrix(inertia: Any) -> NDArray[np.float64]:
    """Return the inertia matrix (3, 3) given by three, six or nine numbers; of nine the symmetric
    part."""
    if len(inertia) == 3 and np.ndim(inertia[0]) == 1:
        return 0.5 * np.add(inertia, np.transpose(inertia), dtype=np.float64)
    xx, yy, zz, xy, xz, yz = (*inertia, 0.0, 0.0, 0.0)[:6]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], np.float64)


def in_space(vector: Sequence[float]) -> NDArray[np.float64]:
    """Return a vector (3,) of the plane or of space."""
    return np.array([*vector, 0.0])[:3]


@np.errstate(divide="raise", invalid="raise")
def filled_with(shapes: Sequence[Any], density: float) -> dict[str, Any]:
    """Return `mass`, `center_of_mass` and `inertia` of shapes of one density, without BLAS;
    overlaps count twice."""
    parts = [_mass_of(shape, density) for shape in shapes]
    mass = math.fsum(m for m, _, _ in parts)
    center = sum(m * c for m, c, _ in parts) / mass
    inertia: Any = 0.0
    for m, c, about in parts:
        r = c - center
        square = (r * r).sum()
        inertia = (
            inertia + about + m * (square if len(r) == 2 else square * np.eye(3) - np.outer(r, r))
        )
    return {
        "mass": mass,
        "center_of_mass": center.tolist(),
        "inertia": np.asarray(inertia).tolist(),
    }


def _mass_of(shape: Any, density: float) -> tuple[float, Any, Any]:
    """Return mass, centre of mass in body axes, and inertia about it: a number in the plane, a
    matrix in space."""
    center = np.array(shape.center)
    if shape.kind == "circle":
        mass = density * math.pi * shape.radius**2
        return mass, center, 0.5 * mass * shape.radius**2
    if shape.kind == "sphere":
        mass = density * 4.0 / 3.0 * math.pi * shape.radius**3
        return mass, center, np.eye(3) * (0.4 * mass * shape.radius**2)
    from iapb.mechanics.rotations import rotation_of  # brings numba along

    if shape.kind == "polygon":
        mass, own, about = _polygon(np.array(shape.vertices), density)
        turn = rotation_of((0.0, 0.0, shape.angle))[:2, :2]
        return mass, center + (turn * own).sum(axis=1), about
    mass = density * math.prod(shape.size)
    squares = np.array(shape.size) ** 2
    if len(center) == 2:
        return mass, center, mass * squares.sum() / 12.0
    turn = rotation_of(shape.rpy)
    principal = mass * (squares.sum() - squares) / 12.0
    return mass, center, sum(principal[k] * np.outer(turn[:, k], turn[:, k]) for k in range(3))


def _polygon(vertices: Any, density: float) -> tuple[float, Any, float]:
    """Return mass, centre and moment of inertia from the triangles between the first corner and
    each edge."""
    a = vertices[1:-1] - vertices[0]
    b = vertices[2:] - vertices[0]
    masses = 0.5 * density * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    mass = masses.sum()
    center = (masses[:, None] * (a + b)).sum(axis=0) / (3.0 * mass)
    about = (masses * (a * a + a * b + b * b).sum(axis=1)).sum() / 6.0 - mass * (
        center * center
    ).sum()
    return float(mass), center + vertices[0], about
