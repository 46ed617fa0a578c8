"""Robots of a spatial scene: a URDF file becomes bodies of the scene.

    robots:
      - {name: arm, urdf: robots/six_axis_arm.urdf, shapes: {forearm: [{kind: sphere, radius:
         0.05}]}, position: {upper_arm: [0.3]}}

By default no link can touch anything. `shapes` gives shapes link by link; <collision> elements of
the file are ignored. Limits, damping and friction of the joints are those of the file. A start that
is not given is the neutral one, or the nearest one within the limits.

Each link becomes the body ``<robot>_<link>``, with ``_`` for dots and blanks. After reading, the
scene has the bodies themselves, so its text and its runs do not need the URDF file. Paths are
relative to the scene file and must stay in its folder.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field, ValidationError

from iapb.errors import ArgumentError, Mistake, shown
from iapb.mechanics.joints import KINDS, Range, ranges_of
from iapb.names import one_of
from iapb.numerics.linalg import product
from iapb.scene.bodies import ORIGIN, WORLD, SpatialBody, SpatialShape
from iapb.scene.document import Document
from iapb.scene.parts import Name, Number, ScenePart, Text, Truth, Vector3, mistakes_of

if TYPE_CHECKING:
    from iapb.mechanics.urdf import Link

MAX_ROBOTS = 100  # in one scene; each one is a file to read


class Robot(ScenePart):
    """A URDF file as a tree of bodies."""

    name: Name = Field(description="the robot's name; its bodies are called <name>_<link>")
    urdf: Text = Field(
        description="path of the URDF file, relative to the scene file, inside its folder"
    )
    origin: Vector3 = Field(ORIGIN, description="where its root link lies [m], world axes")
    rpy: Vector3 = Field(ORIGIN, description="how its root link is turned: roll, pitch, yaw [rad]")
    floating: Truth = Field(
        False, description="true: the root link moves freely; default: fixed to the world"
    )
    shapes: dict[str, tuple[SpatialShape, ...]] = Field(
        default_factory=dict, description="what can touch, by link; link axes; default: nothing"
    )
    position: dict[str, tuple[Number, ...]] = Field(
        default_factory=dict,
        description="coordinates at the start of the joint that carries a link; default: at rest",
    )
    velocity: dict[str, tuple[Number, ...]] = Field(
        default_factory=dict, description="the same for velocities"
    )
    leave_out: dict[str, tuple[Literal["joint", "limit", "dynamics", "mimic"], ...]] = Field(
        default_factory=dict,
        description="parts of joints to leave out, by joint: limit, dynamics, mimic; joint: it is "
        "welded, or taken away if another joint carries its child",
    )


class Robots(ScenePart):
    """The robots of a scene."""

    robots: Annotated[tuple[Robot, ...], Field(max_length=MAX_ROBOTS)]


class Added(NamedTuple):
    """What the robots of a scene add to it."""

    mistakes: list[Mistake]
    remarks: list[str]
    origins: list[tuple[int, str, str]]  # of each body: its robot, link and joint


def with_robots(document: Document) -> tuple[Any, Added]:
    """Return the plain values of a scene with its robots turned into bodies, and what they
    add."""
    given = document.value
    added = Added([], [], [])
    file = document.file
    if not (
        isinstance(given, dict) and "dimensions" in given and isinstance(given.get("robots"), list)
    ):
        return given, added
    bodies: list[dict[str, Any]] = []
    robots: tuple[Robot, ...] = ()
    try:
        robots = Robots.model_validate({"robots": given["robots"]}).robots
    except ValidationError as failure:
        added.mistakes.extend(mistakes_of(failure, file, given, document.place))
    for i, robot in enumerate(robots):
        try:
            bodies += bodies_of(robot, Path(file).parent, added, i)
        except ArgumentError as failure:
            field = failure.argument.split(" ")[0]
            place = document.place(("robots", i, field if field in Robot.model_fields else "urdf"))
            where = f"robots[{i}].{failure.argument}"
            value = shown(failure.value)
            added.mistakes.append(Mistake(file, *place, where, value, failure.expected))
    listed = given.get("bodies", [])
    kept = {key: value for key, value in given.items() if key != "robots"}
    if isinstance(listed, list | None):
        kept["bodies"] = [*(listed or ()), *bodies]
    return kept, added


def told(mistakes: Sequence[Mistake], added: Added, document: Document) -> list[Mistake]:
    """Return mistakes of a scene with robots: those of a robot's body name its link and joint, and
    a robot that is refused adds no second mistake, such as a hand without a body."""
    listed = document.value.get("bodies") if isinstance(document.value, dict) else None
    first = len(listed) if isinstance(listed, list) else 0
    found = []
    for mistake in mistakes:
        if added.mistakes and _FOLLOWS.match(f"{mistake.path} {mistake.expected}"):
            continue
        match = re.match(r"bodies\[(\d+)\]\.?(.*)", mistake.path)
        if match and first <= int(match[1]) < first + len(added.origins):
            i, link, joint = added.origins[int(match[1]) - first]
            place = document.place(("robots", i))
            path = f"robots[{i}]: {match[2]} of link {link!r}"
            path += f", joint {joint!r}" * bool(joint)
            mistake = replace(mistake, line=place[0], column=place[1], path=path)
        found.append(mistake)
    return found


# mistakes that the missing bodies of a refused robot make
_FOLLOWS = re.compile(
    r"bodies |hand\.body |\S+\.parent |bodies\[0\]\.joint at least|device |couplings "
)


def bodies_of(robot: Robot, folder: Path, added: Added, number: int) -> list[dict[str, Any]]:
    """Return the robot's links as plain bodies of a spatial scene; add remarks and origins.

    Raises
    ------
    ArgumentError
        The path leads out of the folder, the file is not a URDF robot, or a named link does not
        exist.
    """
    from iapb.mechanics.rotations import angles_of, rotation_of
    from iapb.mechanics.urdf import read_robot

    path = Path(robot.urdf)
    root = folder.resolve()
    leads_out = "\0" in robot.urdf or path.is_absolute() or ".." in path.parts
    # after following symbolic links
    if leads_out or not (root / path).resolve().is_relative_to(root):
        raise ArgumentError("urdf", robot.urdf, "a relative path inside the scene's folder")
    links, remarks = read_robot(root / path, robot.floating, robot.leave_out)
    names = sorted(link.body.name for link in links)
    for field in ("shapes", "position", "velocity"):
        for name in getattr(robot, field):
            if name not in names:
                raise ArgumentError(
                    f"{field} of robot {robot.name}", name, one_of(name, names, "a link of it: ")
                )
    added.remarks.extend(f"robot {robot.name}, {robot.urdf}: {remark}" for remark in remarks)
    bodies = []
    ranges = ranges_of((link.body.name, link.limits, link.body.mimic) for link in links)
    for link in links:
        body = link.body
        rotation, origin = body.placement
        if body.parent is None:
            turn = rotation_of(robot.rpy)
            rotation = product(turn, rotation)
            origin = product(turn, origin) + np.array(robot.origin)
        kind = KINDS[body.joint.kind]
        limits = ranges.get(body.name)
        start = _start(robot, link, limits)
        if start and not body.mimic and start != (robot.position.get(link.name) or kind.neutral):
            added.remarks.append(
                f"robot {robot.name}: {link.name} starts at {start[0]:g}, the limit of joint "
                f"{link.joint}, for 0 is outside its limits {list(limits or ())}"
            )
        added.origins.append((number, body.name, link.joint))
        bodies.append(
            {
                "name": _body_name(robot, body.name),
                "parent": WORLD if body.parent is None else _body_name(robot, body.parent),
                "joint": kind.name,
                "axis": list(body.joint.axis) if kind.name in SpatialBody.with_axis else None,
                "origin": origin.tolist(),
                "rpy": list(angles_of(rotation)),
                "center_of_mass": body.center_of_mass.tolist(),
                "mass": body.mass,
                "inertia": body.inertia.tolist(),
                "shapes": [
                    shape.model_dump(mode="json") for shape in robot.shapes.get(body.name, ())
                ],
                "position": list(start),
                "velocity": list(robot.velocity.get(link.name, ())),
                "joint_limits": link.limits and list(link.limits),
                "joint_damping": [link.damping] * (link.damping > 0.0),
                "joint_friction": [link.friction] * (link.friction > 0.0),
                "joint_mimic": body.mimic
                and {**body.mimic._asdict(), "body": _body_name(robot, body.mimic.body)},
            }
        )
    return bodies


def _start(robot: Robot, link: Link, limits: Range | None) -> tuple[float, ...]:
    """Return the start of a link's joint: as given, else the neutral one or the nearest within the
    limits."""
    neutral = KINDS[link.body.joint.kind].neutral
    given = robot.position.get(link.name)
    if link.body.mimic:
        return given or ()
    if limits is None or (given and len(given) != 1):
        return given or neutral
    low, high = limits
    if low >= high:
        raise ArgumentError(
            f"limits of robot {robot.name}, link {link.name}",
            [low, high],
            f"limits of joint {link.joint} and of those that follow it with a range in common; "
            "leave_out: {JOINT: [limit]} leaves those of one out",
        )
    if given and not low <= given[0] <= high:
        raise ArgumentError(
            f"position of robot {robot.name}, link {link.name}",
            given[0],
            f"a start within the limits [{low:g}, {high:g}] of joint {link.joint}",
        )
    return given or (min(max(neutral[0], low), high),)


def _body_name(robot: Robot, link: str) -> str:
    """Return the name of a link's body: <robot>_<link>, with _ for characters that are not allowed
    (link_3.0)."""
    return re.sub(r"[^A-Za-z0-9_-]", "_", f"{robot.name}_{link}")
