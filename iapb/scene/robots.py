"""Robots of a spatial scene: a URDF file becomes bodies of the scene.

    robots:
      - {name: arm, urdf: robots/six_axis_arm.urdf, shapes: {forearm: [{kind: sphere, radius:
         0.05}]}, position: {upper_arm: [0.3]}}

By default no link can touch anything. `shapes` gives shapes link by link; <collision> elements of
the file are ignored.

Each link becomes the body ``<robot>_<link>``, with ``_`` for dots and blanks. After reading, the
scene has the bodies themselves, so its text and its runs do not need the URDF file. Paths are
relative to the scene file and must stay in its folder.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field, ValidationError

from iapb.errors import ArgumentError, Mistake, shown
from iapb.linalg import product
from iapb.mechanics.joints import KINDS
from iapb.names import one_of
from iapb.scene.bodies import ORIGIN, WORLD, SpatialBody, SpatialShape
from iapb.scene.document import Document
from iapb.scene.parts import Name, Number, ScenePart, Text, Truth, Vector3, mistakes_of

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


def with_robots(document: Document) -> tuple[Any, list[Mistake]]:
    """Return the plain values of a scene with its robots turned into bodies, and the mistakes
    found."""
    given, mistakes, file = document.value, [], document.file
    if not (
        isinstance(given, dict) and "dimensions" in given and isinstance(given.get("robots"), list)
    ):
        return given, []
    listed, robots = given.get("bodies", []), given["robots"]
    if len(robots) > MAX_ROBOTS:
        place = document.place(("robots",))
        return given, [
            Mistake(file, *place, "robots", f"{len(robots)} robots", f"at most {MAX_ROBOTS} robots")
        ]
    bodies: list[dict[str, Any]] = []
    for i, item in enumerate(robots):
        try:
            bodies += bodies_of(Robot.model_validate(item), Path(file).parent)
        except ValidationError as failure:
            mistakes += mistakes_of(failure, file, given, document.place, ("robots", i))
        except ArgumentError as failure:
            field = failure.argument.split(" ")[0]
            place = document.place(("robots", i, field if field in Robot.model_fields else "urdf"))
            where = f"robots[{i}].{failure.argument}"
            mistakes.append(Mistake(file, *place, where, shown(failure.value), failure.expected))
    kept = {key: value for key, value in given.items() if key != "robots"}
    return kept | {
        "bodies": [*(listed or ()), *bodies] if isinstance(listed, list | None) else listed
    }, mistakes


def bodies_of(robot: Robot, folder: Path) -> list[dict[str, Any]]:
    """Return the robot's links as plain bodies of a spatial scene.

    Raises
    ------
    ArgumentError
        The path leads out of the folder, the file is not a URDF robot, or a named link does not
        exist.
    """
    from iapb.mechanics.rotations import angles_of, rotation_of
    from iapb.mechanics.urdf import read_urdf

    path, root = Path(robot.urdf), folder.resolve()
    leads_out = "\0" in robot.urdf or path.is_absolute() or ".." in path.parts
    if leads_out or not (root / path).resolve().is_relative_to(
        root
    ):  # after following symbolic links
        raise ArgumentError("urdf", robot.urdf, "a relative path inside the scene's folder")
    links = read_urdf(root / path, robot.floating)
    names = sorted(link.name for link in links)
    for field in ("shapes", "position", "velocity"):
        for name in getattr(robot, field):
            if name not in names:
                raise ArgumentError(
                    f"{field} of robot {robot.name}", name, one_of(name, names, "a link of it: ")
                )
    bodies = []
    for link in links:
        rotation, origin = link.placement
        if link.parent is None:
            turn = rotation_of(robot.rpy)
            rotation, origin = (
                product(turn, rotation),
                product(turn, origin) + np.array(robot.origin),
            )
        kind = KINDS[link.joint.kind]
        bodies.append(
            {
                "name": _body_name(robot, link.name),
                "parent": WORLD if link.parent is None else _body_name(robot, link.parent),
                "joint": kind.name,
                "axis": list(link.joint.axis) if kind.name in SpatialBody.with_axis else None,
                "origin": origin.tolist(),
                "rpy": list(angles_of(rotation)),
                "center_of_mass": link.center_of_mass.tolist(),
                "mass": link.mass,
                "inertia": link.inertia.tolist(),
                "shapes": [
                    shape.model_dump(mode="json") for shape in robot.shapes.get(link.name, ())
                ],
                "position": list(robot.position.get(link.name, kind.neutral)),
                "velocity": list(robot.velocity.get(link.name, ())),
            }
        )
    return bodies


def _body_name(robot: Robot, link: str) -> str:
    """Return the name of a link's body: <robot>_<link>, with _ for characters that are not allowed
    (link_3.0)."""
    return re.sub(r"[^A-Za-z0-9_-]", "_", f"{robot.name}_{link}")
