"""Planar shapes: boxes, circles, convex polygons and, for walls, half-planes. All lengths in metres."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, field_validator

from iapb.scene.parts import Name, Number, OwnRestitution, Part, Positive, Vector2, expectation

MAX_VERTICES = 256  # a polygon with more is a circle
_STRAIGHT = 1e-9  # sine of the smallest turn that counts as a corner: below it, rounding decides convexity


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
    center: Vector2 = Field(
        (0.0, 0.0), description="where its origin lies [m], in body axes (walls: world axes)"
    )
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
    """Return the angle by which the outline turns at a corner [rad]; 0 where two corners coincide."""
    ux, uy = at[0] - before[0], at[1] - before[1]
    vx, vy = after[0] - at[0], after[1] - at[1]
    return math.atan2(ux * vy - uy * vx, ux * vx + uy * vy)


class HalfPlaneWall(Part):
    """A straight wall without end; solid on the side that the normal points away from."""

    name: Name = Field(description="the wall's name")
    restitution: OwnRestitution = None
    kind: Literal["half_plane"] = Field(description="everything behind a straight line")
    point: Vector2 = Field(description="a point of the surface [m], world axes")
    normal: Vector2 = Field(description="direction out of the wall, any length but zero, world axes")

    @field_validator("normal")
    @classmethod
    def _direction(cls, normal: Vector2) -> Vector2:
        return checked_direction(normal)


def checked_direction(direction: Vector2) -> Vector2:
    """Return the vector if it has a direction; its length is left as written."""
    if math.hypot(*direction) < 1e-9:  # shorter, its direction would be decided by rounding of its parts
        raise expectation("a vector with a direction (length at least 1e-9)")
    return direction


class BoxWall(Box):
    """A static rectangle."""

    name: Name = Field(description="the wall's name")
    restitution: OwnRestitution = None


class CircleWall(Circle):
    """A static disc."""

    name: Name = Field(description="the wall's name")
    restitution: OwnRestitution = None


class PolygonWall(Polygon):
    """A static convex polygon."""

    name: Name = Field(description="the wall's name")
    restitution: OwnRestitution = None


Shape = Annotated[Box | Circle | Polygon, Field(discriminator="kind")]
Wall = Annotated[HalfPlaneWall | BoxWall | CircleWall | PolygonWall, Field(discriminator="kind")]
