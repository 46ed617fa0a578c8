"""What of a scene can be seen: rings and balls that bodies carry, standing walls, lines between joints.

Everything is told in the view's frame, right-handed: x across the picture, y up, z towards the reader, in metres. A
scene in the plane is seen from above.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reports.figures import planar
from reports.figures.canvas import is_turned
from reports.figures.scenes_space import Sight, pieces
from reports.figures.spatial import (
    WORLD,
    Floats,
    Placement,
    View,
    body_placements,
    cuboid_faces,
    cuboid_of_inertia,
    placement,
)

_REACH = 50.0  # the side of a standing half-plane that is drawn, in sizes of the bodies


@dataclass(frozen=True)
class Ring:
    """Corners (n, 3) [m] in the frame of a body (its number); -1 = the world. `flat`: seen from both sides."""

    body: int
    corners: Floats
    flat: bool = False


@dataclass(frozen=True)
class Ball:
    """A ball or disc about a center (3,) [m]; `spoke`: a line from its center shows how it turns."""

    body: int
    center: Floats
    radius: float
    spoke: bool


@dataclass(frozen=True)
class Link:
    """A line from a point of one body to a point of another."""

    first: int
    start: Floats
    second: int
    end: Floats


@dataclass(frozen=True)
class Parts:
    """All that is drawn of a scene."""

    seen: View
    rings: tuple[Ring, ...]
    balls: tuple[Ball, ...]
    links: tuple[Link, ...]
    walls: tuple[Floats, ...]  # rings (n, 2) in the picture


def is_spatial(scene: Mapping[str, Any]) -> bool:
    """Tell whether a scene is one in space."""
    return int(scene.get("dimensions", 2)) == 3


def plan(scene: Mapping[str, Any]) -> View:
    """Return the view on a scene in the plane, turned as its drawing in the paper is."""
    sign = -1.0 if is_turned(scene) else 1.0
    return View(np.array([sign, 0.0, 0.0]), np.array([0.0, sign, 0.0]), np.array([0.0, 0.0, 1.0]))


def frames(scene: Mapping[str, Any], seen: View, q: Floats) -> tuple[Placement, ...]:
    """Return where the bodies are at q (nq,), in the view's frame."""
    turn = Placement(np.array([seen.across, seen.up, seen.towards]), np.zeros(3))
    if is_spatial(scene):
        return tuple(turn @ place for place in body_placements(scene, q).values())
    return tuple(turn @ _raised(pose) for pose in planar.body_poses(scene, q).values())


def parts(scene: Mapping[str, Any], sight: Sight | None) -> Parts:
    """Return what is drawn; a scene in space needs the `sight` from which it is looked at."""
    number = {body["name"]: k for k, body in enumerate(scene["bodies"])} | {WORLD: -1}
    seen = sight.seen if sight else plan(scene)
    shapes = [shape for k, body in enumerate(scene["bodies"]) for shape in _shapes(k, body)]
    rings = tuple(shape for shape in shapes if isinstance(shape, Ring))
    balls = tuple(shape for shape in shapes if isinstance(shape, Ball))
    return Parts(seen, rings, balls, tuple(_links(scene, number)) if sight else (), tuple(_walls(scene, seen, sight)))


def _raised(pose: planar.Pose) -> Placement:
    rotation = np.eye(3)
    rotation[:2, :2] = pose.rotation
    return Placement(rotation, np.append(pose.origin, 0.0))


def _shapes(number: int, body: Mapping[str, Any]) -> Iterator[Ring | Ball]:
    for shape in body["shapes"] or _of_inertia(body):
        if shape["kind"] in ("circle", "sphere"):
            center = np.resize(np.append(shape["center"], 0.0), 3)
            yield Ball(number, center, shape["radius"], spoke=shape["kind"] == "circle")
        elif "rpy" in shape:
            own = placement(shape["center"], shape["rpy"])
            yield from (Ring(number, face) for face in cuboid_faces(own, shape["size"]))
        else:
            corners = planar.outline(shape)
            yield Ring(number, np.column_stack([corners, np.zeros(len(corners))]), flat=True)


def _of_inertia(body: Mapping[str, Any]) -> Sequence[Mapping[str, Any]]:
    """Return the even box of a free body's mass and inertia, which stands for a body without shape."""
    if body["joint"] != "free_flyer":
        return ()
    return ({"kind": "box", "size": cuboid_of_inertia(body), "center": body["center_of_mass"], "rpy": (0, 0, 0)},)


def _links(scene: Mapping[str, Any], number: Mapping[str, int]) -> Iterator[Link]:
    """Yield lines from joint to joint, and on to the shapes."""
    for body in scene["bodies"]:
        if body["parent"] != WORLD:
            own = number[body["name"]]
            yield Link(number[body["parent"]], np.zeros(3), own, np.zeros(3))
            yield from (Link(own, np.zeros(3), own, np.asarray(s["center"], dtype=float)) for s in body["shapes"])


def _walls(scene: Mapping[str, Any], seen: View, sight: Sight | None) -> Iterator[Floats]:
    if sight:
        yield from (seen.flat(piece.points) for piece in pieces(sight, {**scene, "bodies": ()}, np.zeros(0)))
        return
    corners = [outline for _, outline in planar.body_outlines(scene)]
    reach = _REACH * float(max(np.ptp(np.vstack(corners), axis=0)))
    for wall in scene["walls"]:
        ring = planar.half_plane(wall, reach) if wall["kind"] == "half_plane" else planar.outline(wall)
        yield ring @ np.array([seen.across[:2], seen.up[:2]]).T
