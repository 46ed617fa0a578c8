"""Scene: the fields of a scene file, in the plane and in space. A scene never names a contact law.

A file with ``dimensions: 3`` is a scene in space. Its vectors have three numbers; everything else
is as in the plane.
"""

from __future__ import annotations

import bisect
import copy
import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Set
from typing import Annotated, Any, Literal, NamedTuple, Self

from pydantic import (
    BeforeValidator,
    Field,
    PrivateAttr,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic.json_schema import models_json_schema

from iapb.errors import ArgumentError, SceneError, counted
from iapb.mechanics.joints import KINDS
from iapb.names import one_of
from iapb.scene.bodies import (
    INERTIAL,
    ORIGIN,
    WORLD,
    Body,
    SpatialBody,
    SpatialWall,
    V,
    Wall,
)
from iapb.scene.document import Document, yaml_text
from iapb.scene.expressions import Expression, function_of
from iapb.scene.parts import (
    MISSING,
    STIFFEST,
    Fraction,
    Gain,
    Name,
    NonNegative,
    Number,
    Path,
    Positive,
    SceneName,
    ScenePart,
    Text,
    Truth,
    Vector2,
    Vector3,
    mistakes_of,
    require,
    written,
)
from iapb.scene.robots import Robot

MAX_BODIES = 2000
MAX_WALLS = 2000
MAX_SHAPES = 4000  # bodies and walls together; the number of candidate pairs grows with its square
MAX_RATE = 1e6  # Hz, a thousand times the haptic rate
MAX_STEPS = 10_000_000  # in one simulation: 2.7 hours at 1 kHz; more is a mistake
MAX_ROWS = 100_000  # rows of a hand's force over time
MAX_DELAY = 1000  # steps
RELAXATION = 0.1  # s: B/K where a scene gives K alone; an overlap fades in this time
Mistakes = Iterator[tuple[Path, Any, str]]
PerCoordinate = tuple[NonNegative, ...]
Gravity = Annotated[V | None, Field(description="acceleration [m/s2], world axes; default: none")]
Bodies = Annotated[
    tuple[V, ...],
    Field(min_length=1, max_length=MAX_BODIES, description="what can move, each after its parent"),
]
Walls = Annotated[tuple[V, ...], Field(max_length=MAX_WALLS, description="the static world")]


class Contact(ScenePart):
    """How contacts behave. The defaults are the paper's values; where it gives none, they are this
    project's."""

    forces: Literal["implicit", "paper"] = Field(
        "implicit",
        description="implicit (default): resting forces that no "
        "stiffness or step makes unstable, Coulomb's friction, also in impacts, rigid unless the "
        "scene gives a stiffness; paper: explicit (5) and (6), impacts without friction, K = 1000, B = 50; "
        "contact: paper is "
        "short for it",
    )
    stiffness: Gain | None = Field(
        default_factory=lambda given: 1000.0 if given.get("forces") == "paper" else None,
        description="K of (5) [N/m]; default with forces: paper 1000, else the contact is rigid",
    )
    damping: Gain | None = Field(
        default_factory=lambda given: _usual_damping(given),
        description="B of (5) [N s/m]; default with forces: paper 50, else 0.1 s times stiffness",
    )
    penalty: Literal["clamped", "printed"] = Field(
        "clamped",
        description="clamped (default): never pulls; printed: (5) to the letter, may pull",
    )
    friction: NonNegative = Field(0.0, description="coefficient mu [1]; default 0 = no friction")
    friction_velocity: Positive = Field(
        1e-3,
        description="v_threshold of (6) [m/s], with forces: paper: below it "
        "friction grows linearly; default 1e-3, ours",
    )
    restitution: Fraction = Field(
        0.0, description="coefficient e of (10) [1], 0 plastic to 1 elastic; default 0"
    )
    approach_velocity: NonNegative = Field(
        1e-6,
        description="v_approach [m/s]: contacts that approach faster collide; default 1e-6, ours",
    )
    cluster_distance: NonNegative = Field(
        0.0, description="contacts closer than this [m] become one; default 0 = no clustering"
    )
    coherence_distance: NonNegative = Field(
        0.0,
        description="a contact this close [m] to one of the step before is "
        "not new; must exceed the largest speed times the step; default 0 = no such filter",
    )
    self_collision_rows: Literal["relative", "per_body"] = Field(
        "relative",
        description="rows of a collision of two "
        "moving bodies: relative (12), default; per_body (13)-(14)",
    )
    self_collisions: Truth = Field(
        default_factory=lambda given: given.get("forces") != "paper",
        description="whether bodies of one tree can touch, unless they are neighbours in it or "
        "overlap at the start; default true, with forces: paper false",
    )

    impact_time: Literal["touch", "step"] = Field(
        "touch",
        description="touch (default): a step is cut where bodies meet; step: impacts at the start "
        "of the step that finds an overlap, as always with forces: paper",
    )

    @property
    def at_touch(self) -> bool:
        """Whether impacts happen at the moment of touch."""
        return self.impact_time == "touch" and self.forces == "implicit"

    @property
    def rigid(self) -> bool:
        """Whether contacts are as rigid as their masses allow: the scene gives no stiffness."""
        return self.stiffness is None

    @property
    def gains(self) -> tuple[float, float]:
        """K [N/m] and B [N s/m] of (5); zeros where contact is rigid."""
        return self.stiffness or 0.0, self.damping or 0.0

    @model_validator(mode="before")
    @classmethod
    def _without_null(cls, given: Any) -> Any:
        """Leave out a stiffness or damping of null: the scene does not give it."""
        if not isinstance(given, Mapping):
            return given
        gains = ("stiffness", "damping")
        return {key: x for key, x in given.items() if x is not None or key not in gains}

    @model_validator(mode="after")
    def _stiff_where_damped(self) -> Self:
        expected = "none without contact.stiffness, as forces are implicit"
        require(self.stiffness is not None or self.damping is None, expected)
        return self


def _usual_damping(given: dict[str, Any]) -> float | None:
    if given.get("forces") == "paper":
        return 50.0
    stiffness = given.get("stiffness")
    return None if stiffness is None else min(RELAXATION * stiffness, STIFFEST)


def _spelled_out(given: Any) -> Any:
    """Return the fields that the word `paper` is short for; anything else as it is given."""
    return {"forces": "paper"} if given == "paper" else given


_SHORT = BeforeValidator(_spelled_out, json_schema_input_type=Literal["paper"] | Contact)


class Hand(ScenePart):
    """The hand: a force on one body. A constant force is the worst case for stability (paper,
    section VI).

    The force is the sum of `force`, `force_table` and `force_function`, evaluated in the middle of
    each step: at its start, the velocity would keep an error of half a step of the first force.
    """

    body: Name = Field(description="the body that the hand holds")
    point: Vector2 = Field(
        (0.0, 0.0), description="where it holds it [m], body axes; default: the body's origin"
    )
    force: tuple[Number, Number, Number] = Field(
        (0.0, 0.0, 0.0),
        description="constant force and torque [N, N, N m], world axes; default: none",
    )
    force_table: Annotated[tuple[tuple[Number, ...], ...], Field(max_length=MAX_ROWS)] = Field(
        (),
        description="rows "
        "of time [s] and force as in force; linear in between, the first row before it and the "
        "last one after it; "
        "default: none",
    )
    force_function: tuple[Expression, ...] = Field(
        (),
        description="the force as functions of the time t [s], one "
        "text for each number of force, such as 0.5*sin(2*pi*t); default: none",
    )

    @field_validator("force_table", "force_function")
    @classmethod
    def _like_the_force(cls, given: Any, info: ValidationInfo) -> Any:
        count = len(cls.model_fields["force"].default)
        if info.field_name == "force_function":
            require(len(given) in (0, count), f"{count} texts, one for each number of force")
            return given
        require(
            all(len(row) == 1 + count for row in given),
            f"rows of {1 + count} numbers: the time, then {count} as in force",
        )
        require(
            all(after[0] > before[0] for before, after in itertools.pairwise(given)),
            "rows in the order of their times, none twice",
        )
        return given

    @property
    def changes(self) -> bool:
        """Whether the force changes over time."""
        return bool(self.force_table or self.force_function)

    def force_at(self, time: float) -> list[float]:
        """Return the force at a time [s].

        Raises
        ------
        IapbError
            An expression has no finite value at this time.
        """
        parts: list[Iterable[float]] = [self.force]
        if self.force_table:
            parts.append(_between(self.force_table, time))
        if self.force_function:
            parts.append(function_of(text)(time) for text in self.force_function)
        return [sum(each) for each in zip(*parts, strict=True)]

    def largest_force(self) -> float:
        """Return the magnitude of the largest force [N] at t = 0 and at the table's times."""
        return max(
            math.hypot(*force[: 2 if len(force) == 3 else 3])
            for force in map(self.force_at, self.times())
        )

    def times(self, duration: float = 0.0) -> list[float]:
        """Return t = 0, the times of the table, and 200 times of a function within a duration
        [s]."""
        spread = [k * duration / 200.0 for k in range(201)] if self.force_function else []
        return [0.0, *(row[0] for row in self.force_table), *spread]


def _between(rows: tuple[tuple[float, ...], ...], time: float) -> list[float]:
    """Return the force at a time, by linear interpolation between the rows."""
    k = bisect.bisect_right(rows, time, key=lambda row: row[0])
    start, *first = rows[max(k - 1, 0)]
    stop, *last = rows[min(k, len(rows) - 1)]
    share = (time - start) / (stop - start) if stop > start else 0.0
    return [a + share * (b - a) for a, b in zip(first, last, strict=True)]


class SpatialHand(Hand):
    """The hand of a scene in space."""

    point: Vector3 = Field(ORIGIN, description="where it holds the body [m], body axes")  # type: ignore[assignment]
    force: tuple[Number, Number, Number, Number, Number, Number] = Field(  # type: ignore[assignment]
        (0.0,) * 6,
        description="constant force and torque [N, N, N, N m, N m, N m], world axes; default: none",
    )


class Device(ScenePart):
    """The haptic device. It has the tool's kinematics, so its lists have one number per tool
    coordinate."""

    force_limit: tuple[Positive, ...] | None = Field(
        None, description="largest force per coordinate [N, N m]; default: no limit"
    )
    delay: Annotated[int, Field(strict=True, ge=0, le=MAX_DELAY)] = Field(
        0, description="steps between the device and the world, each way; default 0"
    )
    position_resolution: PerCoordinate | None = Field(
        None,
        description="smallest step that its sensors see, per coordinate [m, rad]; default: exact",
    )
    damping: PerCoordinate | None = Field(
        None, description="physical damping per coordinate [N s/m, N m s/rad]; default: none"
    )


class Gains(ScenePart):
    """A spring and damper per coordinate of the tool (Table I)."""

    stiffness: PerCoordinate = Field(description="one per tool coordinate [N/m, N m/rad]")
    damping: PerCoordinate = Field(description="one per tool coordinate [N s/m, N m s/rad]")


class Couplings(ScenePart):
    """Gains of the couplings; the caller chooses which coupling is used."""

    four_channel: Gains | None = Field(None, description="K_coord and B_coord of Table I")
    unilateral: Gains | None = Field(None, description="K_cpl and B_cpl of Table I")


class Scene(ScenePart):
    """A scene to simulate: bodies, walls, contact parameters, and the hand that moves the tool (SI
    units)."""

    name: SceneName = Field(description="the scene's name; runs are filed under it")
    title: Text = Field("", description="one line for reports")
    source: Text = Field("", description="where the scene comes from")
    dimensions: Literal[2] = Field(
        2, exclude=True, description="3 for a scene in space; default 2, a scene in the plane"
    )
    rate: Annotated[Positive, Field(le=MAX_RATE)] = Field(
        description="simulation rate [Hz]; the step is 1/rate"
    )
    duration: Positive = Field(description="simulated time [s]")
    integrator: Literal["momentum", "semi_implicit_euler"] | None = Field(
        None,
        description="how a step moves the bodies; default momentum, which keeps linear and angular momentum; in "
        "the plane with contact.forces: paper semi_implicit_euler",
    )
    gravity: Gravity[Vector2] = None
    bodies: Bodies[Body]
    walls: Walls[Wall] = ()
    contact: Annotated[Contact, _SHORT] = Field(
        default_factory=lambda: Contact.model_validate({}), description="how contacts behave"
    )
    hand: Hand | None = Field(None, description="the hand that holds the tool; default: nobody")
    device: Device | None = Field(
        None, description="limits of the haptic device; default: an ideal one"
    )
    couplings: Couplings = Field(
        default_factory=lambda: Couplings.model_validate({}),
        description="gains between device and tool",
    )

    # as read, or written at first use for a scene made of values
    _source_text: str = PrivateAttr("")
    _about: str = PrivateAttr("")  # comment above a text that is not yet written
    _file: str = PrivateAttr("")  # file that the text was read from, if any
    _remarks: tuple[str, ...] = PrivateAttr(())  # on the files of its robots

    @field_validator("duration")
    @classmethod
    def _ends(cls, duration: float, info: ValidationInfo) -> float:
        steps = duration * info.data.get("rate", 1.0 / duration)
        expected = f"between 1 and {MAX_STEPS} steps; duration times rate is {steps:g}"
        require(1.0 <= round(steps, 6) <= MAX_STEPS, expected)
        return duration

    @classmethod
    def across_fields(cls, given: Any) -> Iterable[tuple[Path, Any, str]]:
        if cls is Scene and any(
            body.get("joint") == "free_flyer" for body in _mappings(given, "bodies")
        ):
            yield ("dimensions",), MISSING, "3 for a scene in space: free_flyer is a joint there"
        yield from _across_parts(given)

    @property
    def step(self) -> float:
        """Length of one step [s]."""
        return 1.0 / self.rate

    @property
    def steps(self) -> int:
        """Number of steps in the duration."""
        return round(self.duration * self.rate)

    @property
    def own_integrator(self) -> str:
        """Name of the integrator that the scene asks for."""
        plane_of_paper = self.contact.forces == "paper" and not isinstance(self, SpatialScene)
        return self.integrator or ("semi_implicit_euler" if plane_of_paper else "momentum")

    @property
    def largest_friction(self) -> float:
        """The largest coefficient of friction [1] that the scene gives anywhere."""
        parts = (self.contact, *self.bodies, *self.walls)
        return max(part.friction for part in parts if part.friction is not None)

    @property
    def is_coupled(self) -> bool:
        """Whether the hand holds the tool through a device, coupled by gains that the scene
        gives."""
        gains = self.couplings
        return self.hand is not None and bool(gains.four_channel or gains.unilateral)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences on what the files of its robots say in vain, and on starts that were moved."""
        return self._remarks

    @property
    def source_text(self) -> str:
        """The YAML text of this scene; reading it gives the same values to the last bit."""
        if not self._source_text:
            comment = f"# {self._about}\n" * bool(self._about)
            self._about = ""
            self._source_text = comment + yaml_text(self.resolved())
        return self._source_text

    def place_of(self, *path: str | int) -> str:
        """Return the place of a field as "file:line:column: "; empty if the scene was not read from
        a file."""
        if not self._file:
            return ""
        line, column = Document(self._source_text).place(path)
        return f"{self._file}:{line}:{column}: "

    def field_name(self, *path: str | int) -> str:
        """Return the path of a field; bodies of a robot, which no file numbers, by name."""
        if self._file or path[0] != "bodies":
            return written(path)
        return written(("bodies", self.bodies[int(path[1])].name, *path[2:]))

    def resolved(self) -> dict[str, Any]:
        """Return every field with its value, defaults included, as plain numbers, texts, lists and
        mappings."""
        plain = self.model_dump(mode="json")
        if self.contact.rigid:  # not given, and other forces have other defaults
            del plain["contact"]["stiffness"], plain["contact"]["damping"]
        return plain

    def with_values(self, values: dict[str, Any]) -> Self:
        """Return a copy with some values changed, checked like a file.

        Parameters
        ----------
        values
            new value by dotted path; items of a list by name or by number:
            ``{"contact.friction": 0.3, "bodies.peg.position": [0, 0, 0.1], "bodies.peg.position.2":
            0.1}``.

        Raises
        ------
        ArgumentError
            a path does not exist, or `values` or one of them is of a type that no scene file can
            hold.
        SceneError
            values are invalid; the error lists all of them with their paths.
        """
        if not isinstance(values, Mapping):
            raise ArgumentError("values", values, "a mapping of dotted paths to values")
        plain = self.resolved()
        for path, value in values.items():
            set_value(plain, path, value)
        try:
            made = type(self).model_validate(plain)
        except ValidationError as failure:
            raise SceneError(
                mistakes_of(failure, f"scene {self.name} with new values", plain)
            ) from failure
        made._remarks = self._remarks
        made._about = f"{self.name} with new values for {', '.join(values) or 'nothing'}"
        return made


class SpatialScene(Scene):
    """A scene in space: like `Scene`, but vectors have three numbers."""

    dimensions: Literal[3] = Field(description="3: a scene in space")  # type: ignore[assignment]
    gravity: Gravity[Vector3] = None  # type: ignore[assignment]
    bodies: Bodies[SpatialBody]  # type: ignore[assignment]
    walls: Walls[SpatialWall] = ()  # type: ignore[assignment]
    hand: SpatialHand | None = Field(
        None, description="the hand that holds the tool; default: nobody"
    )


class _Outline(NamedTuple):
    """What the other parts of a file may refer to, of one body; None where it is wrong."""

    name: str | None
    parent: str | None
    joint: str | None
    follows: Any  # its joint_mimic
    root: str | None  # name of its tree's root
    shapes: int


def _outlines(given: dict[str, Any]) -> list[_Outline]:
    """Return the outlines of the bodies."""
    root: dict[str | None, str | None] = {}
    found = []
    for body in _mappings(given, "bodies"):
        name = _text(body, "name")
        parent = _text(body, "parent", WORLD)
        own = root.setdefault(name, name if parent == WORLD else root.get(parent))
        shapes = len(_mappings(body, "shapes"))
        joint = _text(body, "joint")
        found.append(_Outline(name, parent, joint, body.get("joint_mimic"), own, shapes))
    return found


def _across_parts(given: Any) -> Mistakes:
    """Yield path, value and expectation of each mistake between the parts: names, parents, lists as
    long as the tool.

    It uses the plain values of the file, so it reports its mistakes even if other fields are wrong.
    """
    if not isinstance(given, dict):
        return
    bodies = _outlines(given)
    walls = _mappings(given, "walls")
    names = [body.name for body in bodies]
    for part, own, known in (
        ("bodies", names, {WORLD: "the static world"}),
        ("walls", [_text(wall, "name") for wall in walls], {}),
    ):
        for i, name in enumerate(own):
            if name in known:
                yield (part, i, "name"), name, f"a name of its own: {known[name]} has this one"
            elif name is not None:
                known[name] = "an earlier one"
    roots = [body.root for body in bodies]
    for i, body in enumerate(bodies):
        if body.parent not in (None, WORLD, *names[:i]):
            order = "listed before it" if body.parent in names else "of this scene"
            yield ("bodies", i, "parent"), body.parent, f"world, or the name of a body {order}"
        # M would not be block diagonal
        if i and body.root not in (None, roots[i - 1]) and body.root in roots[:i]:
            expected = f"its place among the other bodies of {body.root}'s tree"
            yield ("bodies", i), body.name, expected
        leader = _text(body.follows, "body")
        leaders = [one.name for one in bodies if one.root == body.root and _leads(one)]
        if leader is not None and leader not in leaders:
            expected = "a revolute or prismatic body of the same tree that follows no other"
            yield ("bodies", i, "joint_mimic", "body"), leader, expected
    if bodies and all(body.joint == "fixed" for body in bodies):
        yield ("bodies", 0, "joint"), "fixed", "at least one body of the scene that can move"
    count = len(walls) + sum(body.shapes for body in bodies)
    if count > MAX_SHAPES:
        yield ("bodies",), f"{count} shapes", f"at most {MAX_SHAPES} shapes, walls included"
    yield from _tool(given, bodies)


def _leads(body: _Outline) -> bool:
    return body.joint in ("revolute", "prismatic") and not body.follows


def _mappings(given: Any, field: str) -> list[dict[str, Any]]:
    """Return the items of a list; an item that is no mapping becomes an empty one, to keep the
    numbering."""
    items = given.get(field) if isinstance(given, dict) else None
    if not isinstance(items, list | tuple):
        return []
    return [item if isinstance(item, dict) else {} for item in items]


def _text(given: Any, field: str, default: str | None = None) -> str | None:
    text = given.get(field, default) if isinstance(given, dict) else None
    return text if isinstance(text, str) else None


def _tool(given: dict[str, Any], bodies: list[_Outline]) -> Mistakes:
    """Check that the hand's body exists and moves, and that its lists have one entry per coordinate
    of the tool."""
    hand = given.get("hand")
    gains = given.get("couplings")
    held = _text(hand, "body")
    names = [body.name for body in bodies]
    sections: list[tuple[Path, Any]] = [(("device",), given.get("device"))]
    if hand is None:
        for path, section in (*sections, (("couplings",), gains)):
            if isinstance(section, dict) and any(section.values()):
                yield path, section, "a hand in the scene: without one no device takes part"
    if held is None or None in names or not names:  # an unreadable body may be the hand's body
        return
    if held not in names:
        yield ("hand", "body"), held, "the name of a body of this scene"
        return
    root = bodies[names.index(held)].root
    if root is None or not all(body.root and body.joint in KINDS for body in bodies):
        return
    tool = [body for body in bodies if body.root == root and not body.follows]
    coordinates = sum(KINDS[str(body.joint)].nv for body in tool)
    if coordinates == 0:
        yield ("hand", "body"), held, "a body that can move"
    if isinstance(gains, dict):
        sections += [(("couplings", name), gains.get(name)) for name in Couplings.model_fields]
    for path, section in sections:
        for field in ("force_limit", "position_resolution", "stiffness", "damping"):
            numbers = section.get(field) if isinstance(section, dict) else None
            if isinstance(numbers, list | tuple) and len(numbers) != coordinates:
                expected = f"{counted(coordinates, 'number')}, one per coordinate of the tool"
                yield (*path, field), numbers, expected


def scene_kind(given: Any) -> type[Scene]:
    """Return the class of scene that plain values describe: `SpatialScene` or `Scene`."""
    space = isinstance(given, dict) and given.get("dimensions", 2) != 2
    return SpatialScene if space else Scene


def set_value(plain: dict[str, Any], path: Any, value: Any) -> None:
    """Set a value at a dotted path of a resolved scene, without checks; missing sections are
    added."""
    if not isinstance(path, str) or not path:
        raise ArgumentError("values", path, "dotted paths as keys, such as contact.friction")
    *steps, last = path.split(".")
    place: Any = plain
    for step in steps:
        key = _key(place, step, path)
        if isinstance(place, dict) and place.get(key) is None:
            place[key] = {}
        place = place[key]
    for replaced in INERTIAL if last == "density" and isinstance(place, dict) else ():
        place.pop(replaced, None)
    if isinstance(value, Set | Iterator):  # has no order, or can be read once only
        raise ArgumentError("values", value, "numbers, texts, lists or mappings")
    place[_key(place, last, path)] = (
        value.tolist() if hasattr(value, "tolist") else copy.deepcopy(value)
    )


def _key(place: Any, step: str, path: str) -> str | int:
    """Return the dictionary key or list index that one step of a dotted path refers to."""
    if isinstance(place, dict):
        return step
    if not isinstance(place, list):
        raise ArgumentError(
            "values", path, f"a path to a field; before {step!r} stands a value without fields"
        )
    names = [item.get("name") if isinstance(item, dict) else None for item in place]
    if step in names:
        return names.index(step)
    if step.isdecimal() and int(step) < len(place):
        return int(step)
    known = [name for name in names if name] or [f"0 to {len(place) - 1}"]
    raise ArgumentError("values", path, one_of(step, known, f"at {step!r} one of: "))


DIALECT = "https://json-schema.org/draft/2020-12/schema"


def scene_schema() -> dict[str, Any]:
    """Return the JSON Schema of scene files; the description of each field gives its default.

    As in the reader, a file without `dimensions`, or with 2, is a scene in the plane.
    """
    _, schema = models_json_schema(
        [(model, "validation") for model in (Scene, SpatialScene, Robot)]
    )
    # with bodies, or robots that the reader turns into bodies
    space = schema["$defs"]["SpatialScene"]
    space["properties"]["robots"] = {
        "type": "array",
        "items": {"$ref": "#/$defs/Robot"},
        "description": "URDF files that become bodies; default: none",
    }
    least = {"minItems": space["properties"]["bodies"].pop("minItems")}
    space["required"].remove("bodies")
    space["anyOf"] = [
        {"required": ["bodies"], "properties": {"bodies": least}},
        {"required": ["robots"]},
    ]
    return {
        "$schema": DIALECT,
        "title": "Scene file",
        "type": "object",
        "if": {"properties": {"dimensions": {"const": 2}}},
        "then": {"$ref": "#/$defs/Scene"},
        "else": {"$ref": "#/$defs/SpatialScene"},
        "$defs": schema["$defs"],
    }
