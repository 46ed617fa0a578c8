"""Robots of a spatial scene: a URDF file becomes bodies of the scene.

    robots:
      - {name: arm, urdf: robots/six_axis_arm.urdf, shapes: {forearm: [{kind: sphere, radius: 0.05}]},
         position: {upper_arm: [0.3]}}

By default no link can touch anything. `shapes` gives shapes link by link; ``collisions: urdf`` takes the boxes and
spheres of the file's <collision> elements. `shapes` of a link replace those of the file. A scene has no cylinders,
capsules or meshes, so a link with one of them needs boxes and spheres, or ``[]``, under `shapes`.

Each link becomes the body ``<robot>_<link>``, with ``_`` for dots and blanks. After reading, the scene has the bodies
themselves, so its text and its runs do not need the URDF file. Paths are relative to the scene file and must stay in
its folder.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field, ValidationError

from iapb.errors import ArgumentError, Mistake, shown
from iapb.mechanics.joints import KINDS
from iapb.names import one_of
from iapb.scene.bodies import ORIGIN, WORLD, SpatialBody, SpatialShape
from iapb.scene.document import Document
from iapb.scene.parts import Name, Number, ScenePart, Text, Truth, Vector3, mistakes_of

HELD = ("box", "sphere")  # URDF geometries that the compiled narrow phase supports
MAX_ROBOTS = 100  # in one scene; each one is a file to read


class Robot(ScenePart):
    """A URDF file as a tree of bodies."""

    name: Name = Field(description="the robot's name; its bodies are called <name>_<link>")
    urdf: Text = Field(description="path of the URDF file, relative to the scene file, inside its folder")
    origin: Vector3 = Field(ORIGIN, description="where its root link lies [m], world axes")
    rpy: Vector3 = Field(ORIGIN, description="how its root link is turned: roll, pitch, yaw [rad]")
    floating: Truth = Field(False, description="true: the root link moves freely; default: fixed to the world")
    collisions: Literal["none", "urdf"] = Field("none", description="urdf: boxes and spheres of the file's "
        "<collision> elements can touch, where shapes says nothing about the link; none: shapes alone")
    shapes: dict[str, tuple[SpatialShape, ...]] = Field(default_factory=dict, description="what can touch, by link; "
        "link axes; [] for nothing")
    position: dict[str, tuple[Number, ...]] = Field(default_factory=dict, description="coordinates at the start of "
        "the joint that carries a link; default: at rest")
    velocity: dict[str, tuple[Number, ...]] = Field(default_factory=dict, description="the same for velocities")


def with_robots(document: Document) -> tuple[Any, list[Mistake]]:
    """Return the plain values of a scene with its robots turned into bodies, and the mistakes found."""
    given, mistakes, file = document.value, [], document.file
    if not (isinstance(given, dict) and "dimensions" in given and isinstance(given.get("robots"), list)):
        return given, []
    listed, robots = given.get("bodies", []), given["robots"]
    if len(robots) > MAX_ROBOTS:
        place = document.place(("robots",))
        return given, [Mistake(file, *place, "robots", f"{len(robots)} robots", f"at most {MAX_ROBOTS} robots")]
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
    return kept | {"bodies": [*(listed or ()), *bodies] if isinstance(listed, list | None) else listed}, mistakes


def bodies_of(robot: Robot, folder: Path) -> list[dict[str, Any]]:
    """Return the robot's links as plain bodies of a spatial scene.

    Raises
    ------
    ArgumentError
        The path leads out of the folder, the file is not a URDF robot, a named link does not exist, or the
        <collision> of a link is neither box nor sphere.
    """
    from iapb.linalg import product  # brings numba along
    from iapb.mechanics.rotations import angles_of, rotation_of
    from iapb.mechanics.urdf import read_collisions, read_urdf

    path, root = Path(robot.urdf), folder.resolve()
    leads_out = "\0" in robot.urdf or path.is_absolute() or ".." in path.parts
    if leads_out or not (root / path).resolve().is_relative_to(root):  # after following symbolic links
        raise ArgumentError("urdf", robot.urdf, "a relative path inside the scene's folder")
    links = read_urdf(root / path, robot.floating)
    names = sorted(link.name for link in links)
    for field in ("shapes", "position", "velocity"):
        for name in getattr(robot, field):
            if name not in names:
                raise ArgumentError(f"{field} of robot {robot.name}", name, one_of(name, names, "a link of it: "))
    shapes: dict[str, Any] = {link: [shape.model_dump(mode="json") for shape in given]
                              for link, given in robot.shapes.items()}
    if robot.collisions == "urdf":
        read = {link: given for link, given in read_collisions(root / path).items() if link not in shapes}
        foreign = {f"{link} <{shape.kind}>": 0 for link, given in read.items() for shape in given
                   if shape.kind not in HELD}
        if foreign:
            expected = "links with boxes and spheres; give the others boxes and spheres, or [], under shapes"
            raise ArgumentError("collisions", ", ".join(foreign), expected)
        shapes |= {link: [_plain_shape(shape) for shape in given] for link, given in read.items()}
    bodies = []
    for link in links:
        rotation, origin = link.placement
        if link.parent is None:
            turn = rotation_of(robot.rpy)
            rotation, origin = product(turn, rotation), product(turn, origin) + np.array(robot.origin)
        kind = KINDS[link.joint.kind]
        bodies.append({
            "name": _body_name(robot, link.name),
            "parent": WORLD if link.parent is None else _body_name(robot, link.parent),
            "joint": kind.name,
            "axis": list(link.joint.axis) if kind.name in SpatialBody.with_axis else None,
            "origin": origin.tolist(),
            "rpy": list(angles_of(rotation)),
            "center_of_mass": link.center_of_mass.tolist(),
            "mass": link.mass,
            "inertia": link.inertia.tolist(),
            "shapes": shapes.get(link.name, []),
            "position": list(robot.position.get(link.name, kind.neutral)),
            "velocity": list(robot.velocity.get(link.name, ())),
        })
    return bodies


def _plain_shape(shape: Any) -> dict[str, Any]:
    from iapb.mechanics.rotations import angles_of  # brings numba along

    plain = {"kind": shape.kind, "center": shape.center.tolist()}
    if shape.kind == "sphere":
        return plain | {"radius": float(shape.lengths[0])}
    return plain | {"size": shape.lengths.tolist(), "rpy": list(angles_of(shape.rotation))}


def _body_name(robot: Robot, link: str) -> str:
    """Return the name of a link's body: <robot>_<link>, with _ for characters that are not allowed (link_3.0)."""
    return re.sub(r"[^A-Za-z0-9_-]", "_", f"{robot.name}_{link}")
