"""A moving body: its joint, its inertia, its shapes, and how it starts."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator

from iapb.scene.parts import (
    SMALLEST_POSITIVE,
    Name,
    NonNegative,
    Number,
    OwnRestitution,
    Part,
    Vector2,
    expectation,
)
from iapb.scene.shapes import Shape, checked_direction

JOINT_COORDINATES = {"fixed": 0, "revolute": 1, "prismatic": 1, "planar": 3}
WORLD = "world"  # the parent of a body that hangs on nothing
MAX_SHAPES_OF_BODY = 64


class Body(Part):
    """A rigid body of a tree.

    The joint frame lies at `origin`, turned by `angle`, in the parent body's frame; the joint moves the body
    frame away from it. Every moving body carries what its own joint accelerates, so that the mass matrix is
    positive definite in every configuration.
    """

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
    inertia: NonNegative = Field(0.0, description="moment of inertia about the centre of mass [kg m2]")
    shapes: Annotated[tuple[Shape, ...], Field(max_length=MAX_SHAPES_OF_BODY)] = Field(
        (), description="what can touch; none: the body passes through everything"
    )
    position: tuple[Number, ...] = Field(
        (), description="joint coordinates at the start [m, rad]; default: zeros"
    )
    velocity: tuple[Number, ...] = Field(
        (), description="joint velocities at the start [m/s, rad/s]; default: zeros"
    )

    restitution: OwnRestitution = None

    @field_validator("axis")
    @classmethod
    def _axis_of_prismatic(cls, axis: Vector2 | None, info: ValidationInfo) -> Vector2 | None:
        joint = info.data.get("joint")
        if joint == "prismatic" and axis is None:
            raise expectation("the direction of the prismatic joint, such as [1, 0]")
        if joint in ("fixed", "revolute", "planar") and axis is not None:
            raise expectation(f"no axis: only a prismatic joint has one, this joint is {joint}")
        return None if axis is None else checked_direction(axis)

    @field_validator("mass")
    @classmethod
    def _mass_that_joint_moves(cls, mass: float, info: ValidationInfo) -> float:
        if info.data.get("joint") in ("prismatic", "planar") and mass < SMALLEST_POSITIVE:
            raise expectation(f"a mass >= {SMALLEST_POSITIVE} kg: the {info.data['joint']} joint moves it")
        return mass

    @field_validator("inertia")
    @classmethod
    def _inertia_that_joint_turns(cls, inertia: float, info: ValidationInfo) -> float:
        known = info.data
        if known.get("joint") == "planar" and inertia < SMALLEST_POSITIVE:
            raise expectation(f"a moment of inertia >= {SMALLEST_POSITIVE} kg m2: the planar joint turns it")
        if known.get("joint") == "revolute" and "mass" in known and "center_of_mass" in known:
            about_axis = inertia + known["mass"] * sum(c * c for c in known["center_of_mass"])
            if about_axis < SMALLEST_POSITIVE:
                raise expectation(
                    "a moment of inertia > 0, or a mass whose centre is off the revolute joint's axis"
                )
        return inertia

    @field_validator("position", "velocity")
    @classmethod
    def _one_number_per_coordinate(cls, given: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
        joint: Any = info.data.get("joint")
        if joint is None:
            return given
        count = JOINT_COORDINATES[joint]
        if given and len(given) != count:
            raise expectation(
                f"{count} number{'' if count == 1 else 's'}, one per coordinate of a {joint} joint"
            )
        return given or (0.0,) * count
