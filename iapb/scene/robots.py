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
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field, ValidationError

from iapb.errors import ArgumentError, Mistake, shown
from iapb.mechanics.joints import KINDS
from iapb.names import one_of
from iapb.scene.bodies import ORIGIN, SpatialShape
from iapb.scene.parts import Name, Number, Part, Place, Text, Vector3, written

HELD = ("box", "sphere")  # URDF geometries that the compiled narrow phase supports
MAX_ROBOTS = 100  # in one scene; each one is a file to read


class Robot(Part):
    """A URDF file as a tree of bodies."""

    name: Name = Field(description="the robot's name; its bodies are called <name>_<link>")
    urdf: Text = Field(description="path of the URDF file, relative to the scene file, inside its folder")
    origin: Vector3 = Field(ORIGIN, description="where its root link lies [m], world axes")
    rpy: Vector3 = Field(ORIGIN, description="how its root link is turned: roll, pitch, yaw [rad]")
    floating: bool = Field(
        False, strict=True, description="true: the root link moves freely; default: fixed to the world"
    )
    collisions: Literal["none", "urdf"] = Field(
        "none", description="urdf: boxes and spheres of the file's <collision> elements can touch, where shapes says "
        "nothing about the link; none: shapes alone"
    )
    shapes: dict[str, tuple[SpatialShape, ...]] = Field(
        default_factory=dict, description="what can touch, by link; link axes; [] for nothing"
    )
    position: dict[str, tuple[Number, ...]] = Field(
        default_factory=dict, description="coordinates at the start of the joint that carries a link; default: at rest"
    )
    velocity: dict[str, tuple[Number, ...]] = Field(default_factory=dict, description="the same for velocities")


def bodies_of(robot: Robot, folder: Path) -> list[dict[str, Any]]:
    """Return the robot's links as plain bodies of a spatial scene.

    Raises
    ------
    ArgumentError
        The path leads out of the folder, the file is not a URDF robot, a named link does not exist, or the
        <collision> of a link is neither box nor sphere.
    """
    from iapb.mechanics.urdf import read_urdf  # brings numba along

    path = urdf_path(robot.urdf, folder)
    links = read_urdf(path, robot.floating)
    names = {link.name for link in links}
    for field in ("shapes", "position", "velocity"):
        for link in getattr(robot, field):
            if link not in names:
                expected = one_of(link, sorted(names), "a link of it: ")
                raise ArgumentError(f"{field} of robot {robot.name}", link, expected)
    shapes = {link: [shape.model_dump(mode="json") for shape in given] for link, given in robot.shapes.items()}
    if robot.collisions == "urdf":
        shapes = _collisions_of(robot, path) | shapes
    return [_plain_body(robot, link, shapes.get(link.name, [])) for link in links]


def _collisions_of(robot: Robot, path: Path) -> dict[str, list[dict[str, Any]]]:
    """Return the URDF file's collision shapes by link, for the links without an entry in `shapes`."""
    from iapb.mechanics.urdf import read_collisions

    read = {link: shapes for link, shapes in read_collisions(path).items() if link not in robot.shapes}
    foreign = [f"{link} <{shape.kind}>" for link, shapes in read.items() for shape in shapes if shape.kind not in HELD]
    if foreign:
        expected = "links with boxes and spheres; give the others boxes and spheres, or [], under shapes"
        raise ArgumentError("collisions", ", ".join(dict.fromkeys(foreign)), expected)
    return {link: [_plain_shape(shape) for shape in shapes] for link, shapes in read.items()}


def _plain_shape(shape: Any) -> dict[str, Any]:
    from iapb.mechanics.rotations import angles_of  # brings numba along

    center = shape.center.tolist()
    if shape.kind == "sphere":
        return {"kind": "sphere", "radius": float(shape.lengths[0]), "center": center}
    return {"kind": "box", "size": shape.lengths.tolist(), "center": center, "rpy": list(angles_of(shape.rotation))}


def urdf_path(text: str, folder: Path) -> Path:
    """Return the file at a relative path; after following symbolic links it must be inside the folder."""
    path, root = Path(text), folder.resolve()
    leads_out = "\0" in text or path.is_absolute() or ".." in path.parts
    if leads_out or not (root / path).resolve().is_relative_to(root):
        raise ArgumentError("urdf", text, "a relative path inside the scene's folder")
    return root / path


def _plain_body(robot: Robot, link: Any, shapes: list[dict[str, Any]]) -> dict[str, Any]:
    from iapb.linalg import product  # brings numba along
    from iapb.mechanics.rotations import angles_of, rotation_of

    rotation, origin = link.placement
    if link.parent is None:
        turn = rotation_of(robot.rpy)
        rotation, origin = product(turn, rotation), product(turn, origin) + np.array(robot.origin)
    body = {
        "name": body_name(robot.name, link.name),
        "parent": "world" if link.parent is None else body_name(robot.name, link.parent),
        "joint": link.joint.kind,
        "origin": origin.tolist(),
        "rpy": list(angles_of(rotation)),
        "center_of_mass": link.center_of_mass.tolist(),
        "mass": link.mass,
        "inertia": link.inertia.tolist(),
        "shapes": shapes,
        "position": list(robot.position.get(link.name, KINDS[link.joint.kind].neutral)),
        "velocity": list(robot.velocity.get(link.name, ())),
    }
    if link.joint.kind in ("revolute", "continuous", "prismatic"):
        body["axis"] = list(link.joint.axis)
    return body


def body_name(robot: str, link: str) -> str:
    """Return the name of a link's body: <robot>_<link>, with _ for characters that are not allowed (link_3.0)."""
    return re.sub(r"[^A-Za-z0-9_-]", "_", f"{robot}_{link}")


def with_robots(given: Any, file: str, stands_at: Callable[[Place], tuple[int, int]]) -> tuple[Any, list[Mistake]]:
    """Return the plain values of a scene with its robots turned into bodies, and the mistakes found.

    `stands_at` gives line and column of a path such as ("robots", 0, "urdf") in the file.
    """
    if not (isinstance(given, dict) and "dimensions" in given and isinstance(given.get("robots"), list)):
        return given, []
    listed, mistakes = given.get("bodies"), []
    bodies = list(listed) if isinstance(listed, list) else []
    if len(given["robots"]) > MAX_ROBOTS:
        expected = f"at most {MAX_ROBOTS} robots"
        return given, [Mistake(file, *stands_at(("robots",)), "robots", f"{len(given['robots'])} robots", expected)]
    for i, item in enumerate(given["robots"]):
        try:
            bodies += bodies_of(Robot.model_validate(item), Path(file).parent)
        except ValidationError as failure:
            for error in failure.errors(include_url=False):
                place = ("robots", i, *error["loc"])
                mistakes.append(Mistake(file, *stands_at(place), written(place), shown(error["input"]), error["msg"]))
        except ArgumentError as failure:
            where, field = f"robots[{i}].{failure.argument}", failure.argument.split(" ")[0]
            place = ("robots", i, field if field in Robot.model_fields else "urdf")
            mistakes.append(Mistake(file, *stands_at(place), where, shown(failure.value), failure.expected))
    kept = {key: value for key, value in given.items() if key != "robots"}
    return kept | {"bodies": bodies if listed is None or isinstance(listed, list) else listed}, mistakes
