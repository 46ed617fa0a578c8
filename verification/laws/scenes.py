"""Random planar scenes: free bodies and short linkages among walls, with random starts, restitution, stiffness, step.

A scene is drawn as the plain values of a scene file, so that it can be kept, shrunk and pasted.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from iapb.run import Run
from iapb.scene import Scene, scene_from_text
from reference.worlds import run_world

Values = dict[str, Any]

ROOM = 0.5  # [m] half width of the room
CELLS = tuple((x, y) for x in (-0.27, 0.0, 0.27) for y in (-0.27, 0.0, 0.27))  # one body starts in each at most
RENDERINGS = ("full", "full", "saturate", "scale", "spread")
# √(K/m)·Δt above this is no wall but an explosion: (5) with one sample per quarter of its period.
STIFFEST = 0.5


@dataclass(frozen=True)
class SceneCase:
    """A scene by its plain values, the law that moves it, and how impulses meet the device's limits."""

    values: Values
    world: str  # "IAPB" or "PB"
    rendering: str = "full"

    def scene(self) -> Scene:
        """The scene, checked."""
        return scene_from_text(json.dumps(self.values))

    def simulate(self) -> Run:
        """Its run."""
        return run_world(self.scene(), self.world, self.rendering, partial=True)


def draw_scene(rng: np.random.Generator, steps: int = 400) -> SceneCase:
    """Return a random scene of `steps` steps, its law and rendering."""
    bodies = _bodies(rng)
    least_mass = min(body["mass"] for body in bodies)
    values: Values = {
        "name": "random_scene", "rate": float(rng.choice([256, 512, 1000, 2000])), "bodies": bodies,
        "walls": _walls(rng),
    }  # fmt: skip
    values["duration"] = steps / values["rate"]
    if rng.random() < 0.5:
        values["gravity"] = [0.0, -9.81]
    values["contact"] = draw_contact(rng, least_mass, 1.0 / values["rate"])
    held = rng.random() < 0.4
    if held:
        _add_hand(rng, values)
    return SceneCase(values, *draw_world(rng, held))


def draw_world(rng: np.random.Generator, held: bool) -> tuple[str, str]:
    """The law that moves a scene, and how its impulses meet the limits of a device."""
    impulses = rng.random() < 0.8
    rendering = str(rng.choice(RENDERINGS)) if held and impulses else "full"
    return "IAPB" if impulses else "PB", rendering


def _bodies(rng: np.random.Generator) -> list[Values]:
    cells = rng.permutation(len(CELLS))[: int(rng.integers(1, 5))]
    bodies = [_free_body(rng, k, CELLS[cell]) for k, cell in enumerate(cells)]
    return bodies + (_linkage(rng) if rng.random() < 0.5 and 4 not in cells else [])


def _free_body(rng: np.random.Generator, k: int, cell: tuple[float, float]) -> Values:
    mass, size = round(10.0 ** rng.uniform(-1.5, 0.7), 4), round(rng.uniform(0.03, 0.09), 4)
    shape: Values = {"kind": "circle", "radius": size}
    if rng.random() < 0.5:
        shape = {"kind": "box", "size": [2.0 * size, round(rng.uniform(0.03, 0.12), 4)]}
    return {
        "name": f"body_{k}", "joint": "planar", "mass": mass, "inertia": round(0.5 * mass * size**2, 9) + 1e-6,
        "shapes": [shape], "position": [*cell, round(rng.uniform(-3.0, 3.0), 3)],
        "velocity": [round(x, 3) for x in rng.normal(scale=[1.0, 1.0, 4.0])],
    }  # fmt: skip


def _linkage(rng: np.random.Generator) -> list[Values]:
    """One to three links, pinned in the middle of the room."""
    links = []
    for k in range(int(rng.integers(1, 4))):
        length, mass = 0.09, round(10.0 ** rng.uniform(-1.0, 0.3), 4)
        link: Values = {
            "name": f"link_{k}", "joint": "revolute", "mass": mass, "center_of_mass": [length / 2, 0.0],
            "inertia": round(mass * length**2 / 12, 9), "position": [round(rng.uniform(-1.5, 1.5), 3)],
            "velocity": [round(rng.normal(scale=3.0), 3)],
            "shapes": [{"kind": "box", "size": [length, 0.02], "center": [length / 2, 0.0]}],
        }  # fmt: skip
        links.append(link | ({"parent": f"link_{k - 1}", "origin": [length, 0.0]} if k else {}))
    return links


def _walls(rng: np.random.Generator) -> list[Values]:
    sides = ((ROOM, 0.0), (-ROOM, 0.0), (0.0, ROOM), (0.0, -ROOM))
    walls: list[Values] = [
        {"name": f"side_{k}", "kind": "half_plane", "point": [x, y], "normal": [-x / ROOM, -y / ROOM]}
        for k, (x, y) in enumerate(sides)
    ]
    if rng.random() < 0.4:
        place = [round(rng.uniform(-0.4, 0.4), 3), 0.44]
        walls.append({"name": "post", "kind": "circle", "radius": 0.03, "center": place})
    return walls


def draw_contact(rng: np.random.Generator, least_mass: float, dt: float) -> Values:
    """Constants of contact for a lightest body [kg] and a step [s]."""
    stiffness = min(10.0 ** rng.uniform(2.0, 5.0), (STIFFEST / dt) ** 2 * least_mass)
    damping = rng.choice([0.0, 0.3, 1.0]) * np.sqrt(stiffness * least_mass)
    contact: Values = {
        "stiffness": round(stiffness, 3), "damping": round(float(damping), 4),
        "restitution": float(rng.choice([0.0, 0.5, 1.0, round(rng.uniform(), 3)])),
    }  # fmt: skip
    if rng.random() < 0.4:
        friction = round(rng.uniform(0.05, 1.0), 3)
        law = "regularised" if round(1e3 * friction) % 3 == 0 else "coulomb"  # no draw: all else stays as it was
        contact |= {"friction": friction, "friction_velocity": 1e-2, "friction_law": law}
    if rng.random() < 0.5:
        contact["coherence_distance"] = 1e-2
    if rng.random() < 0.3:
        contact["cluster_distance"] = 1e-3
    if rng.random() < 0.3:
        contact["self_collisions"] = True
    if rng.random() < 0.2:
        contact["penalty"] = "printed"
    return contact


def _add_hand(rng: np.random.Generator, values: Values) -> None:
    """A hand on the first free body, sometimes through a device with limits, delay and quantised sensors."""
    values["hand"] = {"body": "body_0", "force": [round(x, 3) for x in rng.normal(scale=[2.0, 2.0, 0.05])]}
    if rng.random() < 0.3:
        return
    mass, inertia = values["bodies"][0]["mass"], values["bodies"][0]["inertia"]
    add_coupling(rng, values, np.array([mass, mass, inertia]), [15.0, 15.0, 1.0])


def add_coupling(rng: np.random.Generator, values: Values, inertia: np.ndarray, limits: list[float]) -> None:
    """A four-channel controller for a tool of these inertias, and a device with limits, delay and quantised sensors."""
    rate = 0.05 * values["rate"]  # of the coupling [1/s]: slow beside the step
    values["couplings"] = {"four_channel": {
        "stiffness": [float(f"{x:.6g}") for x in inertia * rate**2 * 0.3],
        "damping": [float(f"{x:.6g}") for x in inertia * rate]}}  # fmt: skip
    device: Values = {}
    if rng.random() < 0.7:
        device["force_limit"] = limits
    if rng.random() < 0.3:
        device["delay"] = int(rng.integers(1, 3))
    if rng.random() < 0.3:
        device["position_resolution"] = [1e-5 if limit > 1.0 else 1e-4 for limit in limits]
    values["device"] = device
