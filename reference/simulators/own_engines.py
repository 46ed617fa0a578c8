"""Adapters of this project's engine and rigid world, which are evaluated like the other engines.

`own_scene` converts a fixed scene to a `Scene`; `world_state` converts q and v to the arrays of a `Trajectory`.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

import numpy as np

from iapb.contact.laws import ContactLaw
from iapb.errors import IapbError
from iapb.scene import Scene, scene_from_text
from iapb.simulation import simulate
from reference.simulators.scene import Cuboid, FixedScene, Floats, Sphere, rotation
from reference.simulators.simulator import Settings, Simulator
from reference.simulators.trajectory import Trajectory, steps_between_samples
from reference.time_stepping import RigidConstraints

COORDINATES, VELOCITIES = 7, 6  # number per free flyer
STEP = 1e-3  # [s] the step at the haptic rate, for which both are designed


class ImpulseAugmentedEngine(Simulator):
    """iapb, with impulses at new contacts and penalty forces at lasting ones."""

    title, module, package = "iapb (ours)", "iapb", "iapb"

    def settings(self, scene: FixedScene, step: float | None = None) -> Settings:
        """Return the defaults of a scene: implicit contact whose stiffness follows from weights and sizes."""
        return Settings(step or STEP, {"forces": "implicit"})

    def run(self, scene: FixedScene, settings: Settings, step: float, duration: float,
            law: ContactLaw | None = None) -> Trajectory:  # fmt: skip
        """Simulate with the compiled loop, or with a given law."""
        contact: dict[str, Any] = {} if law else dict(settings.options)
        run = simulate(own_scene(scene, step, duration, **contact), law)
        if not run.complete:
            raise IapbError(run.stopped)
        keep = slice(None, None, steps_between_samples(step))
        return Trajectory(run.time[keep], *world_state(run.q[keep], run.v[keep]))


class RigidWorld(ImpulseAugmentedEngine):
    """Rigid contacts at velocity level, with one QP per step."""

    title = "ideal world (ours)"

    def settings(self, scene: FixedScene, step: float | None = None) -> Settings:
        """Return Moreau's step for e > 0 and Stewart and Trinkle's for e = 0, without correction of overlaps."""
        return Settings(step or STEP, {"scheme": "automatic", "margin": 0.02})

    def run(self, scene: FixedScene, settings: Settings, step: float, duration: float,
            law: ContactLaw | None = None) -> Trajectory:  # fmt: skip
        """Simulate with the Python loop."""
        options: dict[str, Any] = dict(settings.options)
        return super().run(scene, settings, step, duration, law or RigidConstraints(**options))


def own_scene(scene: FixedScene, step: float, duration: float, **contact: float | str) -> Scene:
    """Return a fixed scene as a `Scene`, with contact settings by the names of a scene file."""
    document: dict[str, Any] = {
        "name": scene.name, "dimensions": 3, "rate": 1.0 / step, "duration": duration, "bodies": [], "walls": [],
        "contact": {"restitution": scene.restitution, **contact}, "gravity": scene.gravity,
    }  # fmt: skip
    for body in scene.bodies:
        turn = rotation(body.orientation)
        local = [*(turn.T @ np.array(body.velocity)), *(turn.T @ np.array(body.spin))]
        document["bodies"].append({
            "name": body.name.replace(" ", "_"), "joint": "free_flyer", "mass": body.mass, "inertia": body.inertia,
            "shapes": [_shape(shape) for shape in body.shapes], "position": [*body.position, *body.orientation],
            "velocity": local})  # fmt: skip
    for wall in scene.obstacles:
        turn = rotation(wall.orientation)  # as roll, pitch, yaw, for less than 90 degrees about y
        rpy = [np.arctan2(turn[2, 1], turn[2, 2]), np.arcsin(-turn[2, 0]), np.arctan2(turn[1, 0], turn[0, 0])]
        document["walls"].append({"name": wall.name, "rpy": rpy, **_shape(Cuboid(wall.size, wall.position))})
    return scene_from_text(json.dumps(document))


def _shape(shape: Sphere | Cuboid) -> dict[str, Any]:
    return {"kind": "sphere" if isinstance(shape, Sphere) else "box", **asdict(shape)}


def world_state(q: Floats, v: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return position, orientation, velocity, spin (..., b, 3 or 4) of free flyers from q (..., 7 b), v (..., 6 b)."""
    places = q.reshape(*q.shape[:-1], -1, COORDINATES)
    local = v.reshape(*v.shape[:-1], -1, VELOCITIES)
    turn = rotation(places[..., 3:])
    linear, angular = (np.einsum("...ij,...j->...i", turn, part) for part in (local[..., :3], local[..., 3:]))
    return places[..., :3], places[..., 3:], linear, angular
