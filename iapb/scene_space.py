"""A spatial scene as bodies and shapes of the engine."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.contact import spatial_geometry
from iapb.contact.geometry import WORLD as STATIC
from iapb.contact.geometry import Shapes
from iapb.mechanics.bodies import Body
from iapb.mechanics.joints import Joint
from iapb.scene.bodies import WORLD
from iapb.scene.robots import rotation_of
from iapb.scene.space import SpatialBody, SpatialScene, inertia_matrix

Floats = NDArray[np.float64]
Placement = tuple[int, Floats, Floats]  # body that carries a shape (-1 = static), rotation and shift to its frame


def body_in_space(body: SpatialBody) -> Body:
    """Return a body of the scene as one of the mechanism."""
    return Body(
        name=body.name,
        parent=None if body.parent == WORLD else body.parent,
        joint=Joint(body.joint, body.axis) if body.axis is not None else Joint(body.joint),
        placement=(rotation_of(body.rpy), np.array(body.origin)),
        mass=body.mass,
        center_of_mass=np.array(body.center_of_mass),
        inertia=np.array(inertia_matrix(body.inertia)),
    )


def shapes_in_space(scene: SpatialScene) -> Shapes:
    """Return the shapes of the bodies in order, then the walls; those of bodies that nothing moves are static."""
    placed: list[tuple[Any, Placement]] = [
        (shape, _placement(scene, i)) for i, body in enumerate(scene.bodies) for shape in body.shapes
    ]
    placed += [(wall, (STATIC, np.eye(3), np.zeros(3))) for wall in scene.walls]
    return spatial_geometry.make_spatial_shapes([_described(shape, *place) for shape, place in placed])


def _placement(scene: SpatialScene, owner: int) -> Placement:
    """Return the frame of a body's shapes; that of the world for bodies that nothing moves."""
    index = {body.name: i for i, body in enumerate(scene.bodies)}
    rotation, shift, link = np.eye(3), np.zeros(3), owner
    while link >= 0:
        body = scene.bodies[link]
        if body.joint != "fixed":
            return owner, np.eye(3), np.zeros(3)
        turn = rotation_of(body.rpy)
        rotation, shift = turn @ rotation, turn @ shift + np.array(body.origin)
        link = -1 if body.parent == WORLD else index[body.parent]
    return STATIC, rotation, shift


def _described(shape: Any, body: int, rotation: Floats, shift: Floats) -> spatial_geometry.SpatialShape:
    """Return a shape of the scene as the narrow phase describes it."""
    if shape.kind == "half_space":
        return spatial_geometry.HalfSpace(shape.point, shape.normal)
    center = rotation @ np.array(shape.center) + shift
    if shape.kind == "sphere":
        return spatial_geometry.Sphere(shape.radius, center, body)
    return spatial_geometry.SpatialBox(shape.size, center, rotation @ rotation_of(shape.rpy), body)
