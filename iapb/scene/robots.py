"""Robots of a spatial scene: a URDF file beside the scene becomes bodies of it.

    robots:
      - {name: arm, urdf: robots/six_axis_arm.urdf, shapes: {forearm: [{kind: sphere, radius: 0.05}]},
         position: {upper_arm: [0.3]}}

Each link becomes the body ``<robot>_<link>``. After reading the scene holds the bodies themselves: its text and its
runs need the URDF no more. Paths are relative to the scene file and do not lead out of its folder.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from iapb.errors import ArgumentError, Mistake, shown
from iapb.scene.parts import Name, Part
from iapb.scene.space import JOINTS, ORIGIN, SpatialShape, Vector3


class Robot(Part):
    """A URDF file as a tree of bodies."""

    name: Name = Field(description="the robot's name; its bodies are called <name>_<link>")
    urdf: str = Field(description="path of the URDF file, relative to the scene file, inside its folder")
    origin: Vector3 = Field(ORIGIN, description="where its root link lies [m], world axes")
    rpy: Vector3 = Field(ORIGIN, description="how its root link is turned: roll, pitch, yaw [rad]")
    floating: bool = Field(False, description="true: the root link moves freely; default: fixed to the world")
    shapes: dict[str, tuple[SpatialShape, ...]] = Field(
        default_factory=dict, description="what can touch, by link; link axes"
    )
    position: dict[str, tuple[float, ...]] = Field(
        default_factory=dict, description="coordinates at the start of the joint that carries a link; default: at rest"
    )
    velocity: dict[str, tuple[float, ...]] = Field(default_factory=dict, description="the same for velocities")


def bodies_of(robot: Robot, folder: Path) -> list[dict[str, Any]]:
    """Return the robot's links as plain bodies of a spatial scene.

    Raises
    ------
    ArgumentError
        The path leads out of the folder, the file is no URDF robot, or a link that is named does not exist.
    """
    from iapb.mechanics.urdf import read_urdf

    links = read_urdf(urdf_path(robot.urdf, folder), robot.floating)
    names = {link.name for link in links}
    for field in ("shapes", "position", "velocity"):
        for link in getattr(robot, field):
            if link not in names:
                raise ArgumentError(f"{field} of robot {robot.name}", link, f"a link of it: {', '.join(sorted(names))}")
    return [_plain_body(robot, link) for link in links]


def urdf_path(text: str, folder: Path) -> Path:
    """Return the file that a relative path means; it must lie in the folder, links followed."""
    path, root = Path(text), folder.resolve()
    inside = not path.is_absolute() and ".." not in path.parts and (root / path).resolve().is_relative_to(root)
    if not inside:
        raise ArgumentError("urdf", text, "a relative path inside the scene's folder")
    return root / path


def _plain_body(robot: Robot, link: Any) -> dict[str, Any]:
    rotation, origin = link.placement
    if link.parent is None:
        turn = rotation_of(robot.rpy)
        rotation, origin = turn @ rotation, turn @ origin + np.array(robot.origin)
    body = {
        "name": f"{robot.name}_{link.name}",
        "parent": "world" if link.parent is None else f"{robot.name}_{link.parent}",
        "joint": link.joint.kind,
        "origin": origin.tolist(),
        "rpy": list(angles_of(rotation)),
        "center_of_mass": link.center_of_mass.tolist(),
        "mass": link.mass,
        "inertia": link.inertia.tolist(),
        "shapes": [shape.model_dump(mode="json") for shape in robot.shapes.get(link.name, ())],
        "position": list(robot.position.get(link.name, JOINTS.get(link.joint.kind, (0, 0, ()))[2])),
        "velocity": list(robot.velocity.get(link.name, ())),
    }
    if link.joint.kind in ("revolute", "continuous", "prismatic"):
        body["axis"] = list(link.joint.axis)
    return body


def rotation_of(rpy: Any) -> np.ndarray:
    """Return the rotation (3, 3) by roll, pitch, yaw about fixed x, y, z: R_z R_y R_x."""
    (cr, cp, cy), (sr, sp, sy) = (tuple(f(angle) for angle in rpy) for f in (math.cos, math.sin))
    return np.array([
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ])  # fmt: skip


def angles_of(rotation: np.ndarray) -> tuple[float, float, float]:
    """Return roll, pitch, yaw [rad] of a rotation; at pitch ±90° the roll is taken as zero."""
    across = math.hypot(rotation[0, 0], rotation[1, 0])
    pitch = math.atan2(-rotation[2, 0], across)
    if across < 1e-9:  # x points up or down: only the sum of roll and yaw is determined
        return 0.0, pitch, math.atan2(-rotation[0, 1], rotation[1, 1])
    return math.atan2(rotation[2, 1], rotation[2, 2]), pitch, math.atan2(rotation[1, 0], rotation[0, 0])


def with_robots(given: Any, file: str) -> tuple[Any, list[Mistake]]:
    """Return plain values of a scene with its robots turned into bodies, and what is wrong with them."""
    from pydantic import ValidationError

    if not (isinstance(given, dict) and "dimensions" in given and isinstance(given.get("robots"), list)):
        return given, []
    bodies, mistakes = list(given.get("bodies") or ()), []
    for i, item in enumerate(given["robots"]):
        try:
            bodies += bodies_of(Robot.model_validate(item), Path(file).parent)
        except ValidationError as failure:
            for error in failure.errors(include_url=False):
                path = ".".join(map(str, ("", *error["loc"])))
                mistakes.append(Mistake(file, 0, 0, f"robots[{i}]{path}", shown(error["input"]), error["msg"]))
        except ArgumentError as failure:
            where = f"robots[{i}].{failure.argument}"
            mistakes.append(Mistake(file, 0, 0, where, shown(failure.value), failure.expected))
    return {key: value for key, value in given.items() if key != "robots"} | {"bodies": bodies}, mistakes
