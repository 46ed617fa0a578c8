"""The sections of a scene beside bodies and walls: contact, hand, device, couplings."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from iapb.scene.parts import Fraction, Name, NonNegative, Number, Part, Positive, Vector2

MAX_DELAY = 1000  # steps; a longer delay is a broken line
PerCoordinate = tuple[NonNegative, ...]


class Contact(Part):
    """How contacts behave. The defaults are the paper's where it gives a number, ours where it does not."""

    stiffness: NonNegative = Field(1000.0, description="K of (5) [N/m]; default 1000, the paper's walls")
    damping: NonNegative = Field(50.0, description="B of (5) [N s/m]; default 50, the paper's walls")
    penalty: Literal["clamped", "printed"] = Field(
        "clamped", description="clamped (default): never pulls; printed: (5) to the letter, may pull"
    )
    friction: NonNegative = Field(0.0, description="coefficient mu of (6) [1]; default 0 = no friction")
    friction_velocity: Positive = Field(
        1e-3, description="v_threshold of (6) [m/s]: below it friction grows linearly; default 1e-3, ours"
    )
    restitution: Fraction = Field(
        0.0, description="coefficient e of (10) [1], 0 plastic to 1 elastic; default 0"
    )
    approach_velocity: NonNegative = Field(
        1e-6, description="v_approach [m/s]: contacts that approach faster collide; default 1e-6, ours"
    )
    cluster_distance: NonNegative = Field(
        0.0, description="contacts closer than this [m] become one; default 0 = no clustering"
    )
    coherence_distance: NonNegative = Field(
        0.0,
        description="a contact this close [m] to one of the step before is not new; must exceed the largest "
        "speed times the step; default 0 = no such filter",
    )
    self_collision_rows: Literal["relative", "per_body"] = Field(
        "relative",
        description="rows of a collision of two moving bodies: relative (12), default; per_body (13)-(14)",
    )
    self_collisions: Annotated[bool, Field(strict=True)] = Field(
        False, description="whether bodies of one tree, not neighbours in it, can touch; default false"
    )


class Hand(Part):
    """The hand: a constant force on one body, the worst case for stability (paper, section VI)."""

    body: Name = Field(description="the body that the hand holds")
    point: Vector2 = Field(
        (0.0, 0.0), description="where it holds it [m], body axes; default: the body's origin"
    )
    force: tuple[Number, Number, Number] = Field(
        (0.0, 0.0, 0.0), description="constant force and torque [N, N, N m], world axes; default: none"
    )


Waveform = Literal["step", "brake", "ring-rubber", "ring-wood", "ring-aluminium"]


class Device(Part):
    """The haptic device: kinematically the tool's equal, so its lists have one number per tool coordinate."""

    force_limit: tuple[Positive, ...] | None = Field(
        None, description="largest force per coordinate [N, N m]; default: no limit"
    )
    delay: Annotated[int, Field(strict=True, ge=0, le=MAX_DELAY)] = Field(
        0, description="steps between the device and the world, each way; default 0"
    )
    position_resolution: PerCoordinate | None = Field(
        None, description="smallest step that its sensors see, per coordinate [m, rad]; default: exact"
    )
    damping: PerCoordinate | None = Field(
        None, description="physical damping per coordinate [N s/m, N m s/rad]; default: none"
    )
    waveform: Waveform = Field(
        "step", description="how an impulse reaches the hand: in one step, as a brake, or ringing; default step"
    )


class Gains(Part):
    """A spring and damper per coordinate of the tool (Table I)."""

    stiffness: PerCoordinate = Field(description="one per tool coordinate [N/m, N m/rad]")
    damping: PerCoordinate = Field(description="one per tool coordinate [N s/m, N m s/rad]")


class Couplings(Part):
    """Gains of the couplings that the scene can be held with; which one is used, the caller says."""

    four_channel: Gains | None = Field(None, description="K_coord and B_coord of Table I")
    unilateral: Gains | None = Field(None, description="K_cpl and B_cpl of Table I")
