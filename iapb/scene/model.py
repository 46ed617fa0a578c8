"""Scene: everything a scene file may say. A scene never names a contact law."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, PrivateAttr, ValidationInfo, field_validator
from pydantic_core import InitErrorDetails

from iapb.scene.bodies import Body
from iapb.scene.parts import Name, Part, Positive, Text, Vector2, expectation
from iapb.scene.sections import Contact, Couplings, Device, Hand
from iapb.scene.shapes import Wall

MAX_BODIES = 2000
MAX_WALLS = 2000
MAX_RATE = 1e6  # Hz, a thousand times the haptic rate
MAX_STEPS = 10_000_000  # in one simulation: 2.7 hours at 1 kHz; more is a slip of the pen, and would not end


class Scene(Part):
    """A world to simulate: bodies, walls, how contacts behave, and the hand that moves the tool (SI units)."""

    name: Name = Field(description="the scene's name; runs are filed under it")
    title: Text = Field("", description="one line for reports")
    source: Text = Field("", description="where the scene comes from")
    rate: Annotated[Positive, Field(le=MAX_RATE)] = Field(
        description="simulation rate [Hz]; the step is 1/rate"
    )
    duration: Positive = Field(description="simulated time [s]")
    gravity: Vector2 | None = Field(None, description="acceleration [m/s2], world axes; default: none")
    bodies: Annotated[tuple[Body, ...], Field(min_length=1, max_length=MAX_BODIES)] = Field(
        description="what can move, each after its parent"
    )
    walls: Annotated[tuple[Wall, ...], Field(max_length=MAX_WALLS)] = Field(
        (), description="the static world"
    )
    contact: Contact = Field(
        default_factory=lambda: Contact.model_validate({}), description="how contacts behave"
    )
    hand: Hand | None = Field(None, description="the hand that holds the tool; default: nobody")
    device: Device | None = Field(None, description="limits of the haptic device; default: an ideal one")
    couplings: Couplings = Field(
        default_factory=lambda: Couplings.model_validate({}), description="gains between device and tool"
    )

    _source_text: str = PrivateAttr("")

    @field_validator("duration")
    @classmethod
    def _ends(cls, duration: float, info: ValidationInfo) -> float:
        rate = info.data.get("rate")
        if rate is not None and not 1.0 <= round(duration * rate, 6) <= MAX_STEPS:
            raise expectation(f"between 1 and {MAX_STEPS} steps; duration times rate is {duration * rate:g}")
        return duration

    @classmethod
    def across_fields(cls, given: Any) -> list[InitErrorDetails]:
        from iapb.scene.across import across_parts

        return across_parts(given)

    @property
    def step(self) -> float:
        """Length of one step [s]."""
        return 1.0 / self.rate

    @property
    def steps(self) -> int:
        """Number of steps in the duration."""
        return round(self.duration * self.rate)

    @property
    def source_text(self) -> str:
        """The YAML text that gives this scene."""
        return self._source_text

    def resolved(self) -> dict[str, Any]:
        """Return every field with its value, defaults included, as plain numbers, texts, lists and mappings."""
        return self.model_dump(mode="json")

    def with_values(self, values: dict[str, Any]) -> Scene:
        """Return a copy with some values changed, checked like a file.

        Parameters
        ----------
        values
            new value by dotted path; items of a list by name or by number:
            ``{"contact.friction": 0.3, "bodies.peg.position": [0, 0, 0.1], "bodies.peg.position.2": 0.1}``.

        Raises
        ------
        ArgumentError
            a path that leads nowhere.
        SceneError
            values that a scene cannot take; all of them, each with its path.
        """
        from iapb.scene.changing import changed

        return changed(self, values)
