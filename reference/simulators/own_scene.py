"""A fixed scene as a scene of ours, and our states as a trajectory."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from iapb.scene import Scene, scene_from_text
from reference.simulators.scene import Cuboid, FixedScene, Floats, RigidBody, Sphere, rotation

COORDINATES, VELOCITIES = 7, 6  # of a free flyer


def own_scene(scene: FixedScene, step: float, duration: float, **contact: float) -> Scene:
    """The scene in our terms (JSON is YAML), with contact settings by our names."""
    document = {
        "name": scene.name, "dimensions": 3, "rate": 1.0 / step, "duration": duration,
        "gravity": list(scene.gravity), "bodies": [_body(body) for body in scene.bodies],
        "walls": [{"name": wall.name, "kind": "box", "size": wall.size, "center": wall.center,
                   "rpy": _roll_pitch_yaw(rotation(wall.orientation))} for wall in scene.obstacles],
        "contact": {"restitution": scene.restitution, **contact},
    }  # fmt: skip
    if not any(scene.gravity):
        del document["gravity"]
    return scene_from_text(json.dumps(document))


def _body(body: RigidBody) -> dict[str, Any]:
    turn = rotation(body.orientation)
    local = np.concatenate([turn.T @ np.array(body.velocity), turn.T @ np.array(body.spin)])
    return {"name": body.name.replace(" ", "_"), "joint": "free_flyer", "mass": body.mass, "inertia": body.inertia,
            "shapes": [_shape(shape) for shape in body.shapes], "position": [*body.position, *body.orientation],
            "velocity": local.tolist()}  # fmt: skip


def _shape(shape: Sphere | Cuboid) -> dict[str, Any]:
    if isinstance(shape, Sphere):
        return {"kind": "sphere", "radius": shape.radius, "center": shape.center}
    return {"kind": "box", "size": shape.size, "center": shape.center}


def _roll_pitch_yaw(turn: Floats) -> list[float]:
    """Angles about the fixed x, y and z axes, for turns short of a quarter about y."""
    return [float(np.arctan2(turn[2, 1], turn[2, 2])), float(np.arcsin(-turn[2, 0])),
            float(np.arctan2(turn[1, 0], turn[0, 0]))]  # fmt: skip


def world_state(q: Floats, v: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Position, orientation, velocity and spin (..., b, 3 or 4) of free flyers from q (..., 7 b) and v (..., 6 b)."""
    places = q.reshape(*q.shape[:-1], -1, COORDINATES)
    local = v.reshape(*v.shape[:-1], -1, VELOCITIES)
    turn = rotation(places[..., 3:])
    linear, angular = (np.einsum("...ij,...j->...i", turn, part) for part in (local[..., :3], local[..., 3:]))
    return places[..., :3], places[..., 3:], linear, angular
