"""A scene as mechanism and shapes: its planar bodies laid into the plane z = 0 of the spatial engine."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.contact import geometry
from iapb.contact.geometry import Shapes, candidate_pairs, make_shapes
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from iapb.scene import Scene, SpatialScene
from iapb.scene.bodies import WORLD
from iapb.scene.bodies import Body as SceneBody
from iapb.scene_space import body_in_space, shapes_in_space

Floats = NDArray[np.float64]


def mechanism_of(scene: Scene) -> Mechanism:
    """Return the scene's bodies as a mechanism, in the scene's order; q is their positions in a row.

    A planar moment of inertia I about z becomes diag(I/2, I/2, I): the inertia of a flat body, so that the
    spatial engine sees a physical one. Only its zz entry ever moves in the plane.
    """
    lay_out: Callable[[Any], Body] = body_in_space if isinstance(scene, SpatialScene) else _spatial_body
    return Mechanism(lay_out(body) for body in scene.bodies)


def start_of(scene: Scene) -> tuple[Floats, Floats]:
    """Return the scene's first configuration q (nq,) and velocity v (nv,)."""
    q = [x for body in scene.bodies for x in body.position]
    v = [x for body in scene.bodies for x in body.velocity]
    return np.array(q, np.float64), np.array(v, np.float64)


def shapes_of(scene: Scene) -> Shapes:
    """Return the scene's shapes: those of the bodies in order, then the walls.

    A shape of a body that nothing moves (fixed to the world through and through) is static, like a wall.
    """
    if isinstance(scene, SpatialScene):
        return shapes_in_space(scene)
    described = [_described(shape, _Frame.of(scene, owner)) for owner, shape in _owned_shapes(scene)]
    return make_shapes(described)


def pairs_of(scene: Scene, shapes: Shapes) -> NDArray[np.int32]:
    """Return the candidate pairs (k, 2) among the scene's shapes (`shapes_of`), the first of a moving body.

    Bodies of one tree are paired only where ``contact.self_collisions`` asks for it, and never when they are
    rigidly connected or neighbours across one joint: these touch by construction.
    """
    owners = [owner for owner, _ in _owned_shapes(scene)]
    links = _Links(scene)
    kept = [pair for pair in candidate_pairs(shapes) if links.may_touch(owners[pair[0]], owners[pair[1]])]
    return np.array(kept, np.int32).reshape(-1, 2)


class _Links:
    """Which bodies hang together: by a weld (one rigid part), across one joint, or in one tree."""

    def __init__(self, scene: Scene) -> None:
        self.self_collisions = scene.contact.self_collisions
        index = {body.name: i for i, body in enumerate(scene.bodies)}
        self.root: list[int] = []  # of each body: the first body of its tree
        self.part: list[int] = []  # of each body: the first body of its rigid part
        self.carrier: dict[int, int] = {}  # of each part: the part that its joint sits on, -1 = the world
        for i, body in enumerate(scene.bodies):
            parent = -1 if body.parent == WORLD else index[body.parent]
            welded = body.joint == "fixed" and parent >= 0
            self.root.append(i if parent < 0 else self.root[parent])
            self.part.append(self.part[parent] if welded else i)
            if not welded:
                self.carrier[i] = -1 if parent < 0 else self.part[parent]

    def may_touch(self, a: int, b: int) -> bool:
        """Return whether two bodies can touch (indices; -1 = a wall)."""
        if a < 0 or b < 0 or self.root[a] != self.root[b]:
            return True
        part_a, part_b = self.part[a], self.part[b]
        adjoining = part_a == part_b or self.carrier[part_a] == part_b or self.carrier[part_b] == part_a
        return self.self_collisions and not adjoining


def _owned_shapes(scene: Scene) -> list[tuple[int, Any]]:
    """Return every shape with the index of its body, -1 for walls."""
    of_bodies = [(i, shape) for i, body in enumerate(scene.bodies) for shape in body.shapes]
    return of_bodies + [(-1, wall) for wall in scene.walls]


def _rotation(angle: float) -> Floats:
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array([[cos, -sin], [sin, cos]])


def _spatial_body(body: SceneBody) -> Body:
    rotation = np.eye(3)
    rotation[:2, :2] = _rotation(body.angle)
    axis = (*body.axis, 0.0) if body.axis is not None else (0.0, 0.0, 1.0)
    return Body(
        name=body.name,
        parent=None if body.parent == WORLD else body.parent,
        joint=Joint(body.joint, axis),
        placement=(rotation, np.array([*body.origin, 0.0])),
        mass=body.mass,
        center_of_mass=np.array([*body.center_of_mass, 0.0]),
        inertia=np.diag([0.5 * body.inertia, 0.5 * body.inertia, body.inertia]),
    )


class _Frame(NamedTuple):
    """Where a shape's numbers are written: the body that carries it (-1 = static), turn and shift to its frame."""

    body: int
    rotation: Floats
    shift: Floats

    @classmethod
    def of(cls, scene: Scene, owner: int) -> _Frame:
        """Return the frame of a body's shapes; that of the world for walls and for bodies that nothing moves."""
        rotation, shift = np.eye(2), np.zeros(2)
        link = owner
        index = {body.name: i for i, body in enumerate(scene.bodies)} if owner >= 0 else {}
        while link >= 0:
            body = scene.bodies[link]
            if body.joint != "fixed":
                return cls(owner, np.eye(2), np.zeros(2))
            turn = _rotation(body.angle)
            rotation, shift = turn @ rotation, turn @ shift + np.array(body.origin)
            link = -1 if body.parent == WORLD else index[body.parent]
        return cls(-1, rotation, shift)


def _described(shape: Any, frame: _Frame) -> geometry.Shape:
    """Return a shape of the scene as the narrow phase describes it."""
    if shape.kind == "half_plane":
        return geometry.HalfPlane(shape.point, shape.normal)
    center = frame.rotation @ np.array(shape.center) + frame.shift
    if shape.kind == "circle":
        return geometry.Circle(shape.radius, center, frame.body)
    corners = _box_corners(*shape.size) if shape.kind == "box" else np.array(shape.vertices)
    turn = frame.rotation @ _rotation(shape.angle)
    return geometry.Polygon(corners @ turn.T + center, frame.body)


def _box_corners(width: float, height: float) -> Floats:
    return 0.5 * np.array([[-width, -height], [width, -height], [width, height], [-width, height]])
