"""Adapters of this project's engine and rigid world, which are evaluated like the other engines.

`own_scene` converts a fixed scene to a `Scene`; `world_state` converts q and v to the arrays of a `Trajectory`.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from iapb.contact.laws import ContactLaw
from iapb.errors import IapbError
from iapb.scene import Scene, scene_from_text
from iapb.simulation import simulate
from reference.simulators.scene import Cuboid, FixedScene, Floats, RigidBody, Sphere, rotation
from reference.simulators.simulator import Settings
from reference.simulators.trajectory import Trajectory, steps_between_samples
from reference.time_stepping import RigidConstraints

COORDINATES, VELOCITIES = 7, 6  # number per free flyer
STEP = 1e-3  # [s] the step at the haptic rate, for which both are designed


class ImpulseAugmentedEngine:
    """iapb, with impulses at new contacts and penalty forces at lasting ones."""

    title = "iapb (ours)"

    def version(self) -> str:
        """Our own."""
        return _own_version()

    def settings(self, scene: FixedScene, step: float | None = None) -> Settings:
        """Return the defaults of a scene: implicit contact whose stiffness follows from weights and sizes."""
        return Settings(step or STEP, {"forces": "implicit"})

    def run(self, scene: FixedScene, settings: Settings, step: float, duration: float) -> Trajectory:
        """Simulate with the compiled loop."""
        return _simulated(scene, settings, step, duration, None)


class RigidWorld:
    """Rigid contacts at velocity level, with one QP per step."""

    title = "ideal world (ours)"

    def version(self) -> str:
        """Our own."""
        return _own_version()

    def settings(self, scene: FixedScene, step: float | None = None) -> Settings:
        """Return Moreau's step for e > 0 and Stewart and Trinkle's for e = 0, without correction of overlaps."""
        return Settings(step or STEP, {"scheme": "automatic", "margin": 0.02})

    def run(self, scene: FixedScene, settings: Settings, step: float, duration: float) -> Trajectory:
        """Simulate with the Python loop."""
        law = RigidConstraints(scheme=str(settings.options["scheme"]), margin=float(settings.options["margin"]))
        return _simulated(scene, Settings(step), step, duration, law)


def _simulated(scene: FixedScene, settings: Settings, step: float, duration: float,
               law: ContactLaw | None) -> Trajectory:  # fmt: skip
    contact: dict[str, Any] = dict(settings.options)
    run = simulate(own_scene(scene, step, duration, **contact), law)
    if not run.complete:
        raise IapbError(run.stopped)
    keep = slice(None, None, steps_between_samples(step))
    touching = np.append(np.diff(run.contacts.offsets), 0)
    return Trajectory(run.time[keep], *world_state(run.q[keep], run.v[keep]), touching[keep])


def _own_version() -> str:
    from importlib.metadata import version

    return version("iapb")


def own_scene(scene: FixedScene, step: float, duration: float, **contact: float | str) -> Scene:
    """Return a fixed scene as a `Scene`, with contact settings by the names of a scene file."""
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
    """Return angles about the fixed x, y and z axes, for rotations of less than 90 degrees about y."""
    return [float(np.arctan2(turn[2, 1], turn[2, 2])), float(np.arcsin(-turn[2, 0])),
            float(np.arctan2(turn[1, 0], turn[0, 0]))]  # fmt: skip


def world_state(q: Floats, v: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return position, orientation, velocity, spin (..., b, 3 or 4) of free flyers from q (..., 7 b), v (..., 6 b)."""
    places = q.reshape(*q.shape[:-1], -1, COORDINATES)
    local = v.reshape(*v.shape[:-1], -1, VELOCITIES)
    turn = rotation(places[..., 3:])
    linear, angular = (np.einsum("...ij,...j->...i", turn, part) for part in (local[..., :3], local[..., 3:]))
    return places[..., :3], places[..., 3:], linear, angular
