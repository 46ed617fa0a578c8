"""Random scenes: free bodies and short linkages among walls, with random initial states,
restitution, stiffness, step.

In spatial scenes, boxes and balls fly in a room of planes, or rest on a plane or on each other. A
scene consists of the plain values of a scene file, so that it can be stored, shrunk and pasted.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from iapb.run import Run
from iapb.scene import Scene, scene_from_text
from reference.worlds import run_world

Values = dict[str, Any]

ROOM = 0.5  # [m] half width of the room
# at most one body starts in each
CELLS = tuple((x, y) for x in (-0.27, 0.0, 0.27) for y in (-0.27, 0.0, 0.27))
RENDERINGS = ("full", "full", "saturate", "scale", "spread")
# With √(K/m)·Δt above this, (5) has less than one sample per quarter of its period and the motion
# diverges.
STIFFEST = 0.5
# Spatial scenes: at most one flying body starts in each cell.
SPATIAL_CELLS = tuple(
    (x, y, z) for x in (-0.25, 0.25) for y in (-0.25, 0.25) for z in (-0.25, 0.25)
)
MIDDLE_CHAIN = 0.45  # share of scenes with a linkage, hung in the middle of the room
STACK = 0.4  # share of scenes with a box on the floor and a smaller box or a ball on it
# Up to four points of a face share an impact, and a hit on a corner turns its box: K is limited as
# for a lighter mass.
SOFTER = 6.0


@dataclass(frozen=True)
class SceneCase:
    """A scene as plain values, its world, and how the device renders impulses beyond its limits."""

    values: Values
    world: str  # "IAPB" or "PB"
    rendering: str = "full"

    def scene(self) -> Scene:
        """Return the validated scene."""
        return scene_from_text(json.dumps(self.values))

    def simulate(self) -> Run:
        """Return the run of the scene."""
        return run_world(self.scene(), self.world, self.rendering, partial=True)


def draw_scene(rng: np.random.Generator, steps: int = 400) -> SceneCase:
    """Return a random planar scene of `steps` steps, with its world and rendering."""
    bodies = _bodies(rng)
    return _drawn(
        rng,
        steps,
        {"name": "random_scene"},
        (256, 512, 1000, 2000),
        bodies,
        _walls,
        (0.5, [0.0, -9.81]),
        min(body["mass"] for body in bodies),
        ([2.0, 2.0, 0.05], [15.0, 15.0, 1.0], (0.3, 1.0)),
    )


def draw_spatial_scene(rng: np.random.Generator, steps: int = 400) -> SceneCase:
    """Return a random spatial scene of `steps` steps, with its world and rendering."""
    bodies = _spatial_bodies(rng)
    return _drawn(
        rng,
        steps,
        {"name": "random_scene_in_space", "dimensions": 3},
        (512, 1000, 2000),
        bodies,
        _room,
        (0.6, [0.0, 0.0, -9.81]),
        min(body["mass"] for body in bodies) / SOFTER,
        ([2.0] * 3 + [0.05] * 3, [15.0] * 3 + [1.0] * 3, (0.0, 0.7)),
    )


def _drawn(
    rng: np.random.Generator,
    steps: int,
    head: Values,
    rates: Sequence[int],
    bodies: list[Values],
    walls: Callable[[np.random.Generator], list[Values]],
    gravity: tuple[float, list[float]],
    least_mass: float,
    hand: tuple[list[float], list[float], tuple[float, float]],
) -> SceneCase:
    """Return a scene of these bodies and draw the rest.

    gravity : share of the scenes that have gravity, and its field [m/s²]
    hand : scale of its force and torque, the limits of its device, and the draws from [0, 1) for
        which it has a device
    """
    values: Values = {
        **head,
        "rate": float(rng.choice(rates)),
        "bodies": bodies,
        "walls": walls(rng),
    }
    values["duration"] = steps / values["rate"]
    values["integrator"] = "semi_implicit_euler"
    if rng.random() < gravity[0]:
        values["gravity"] = gravity[1]
    values["contact"] = _contact(rng, least_mass, 1.0 / values["rate"])
    held = rng.random() < 0.4
    if held:
        _add_hand(rng, values, *hand)
    impulses = rng.random() < 0.8
    rendering = str(rng.choice(RENDERINGS)) if held and impulses else "full"
    return SceneCase(values, "IAPB" if impulses else "PB", rendering)


def _bodies(rng: np.random.Generator) -> list[Values]:
    cells = rng.permutation(len(CELLS))[: int(rng.integers(1, 5))]
    bodies = [_free_body(rng, k, CELLS[cell]) for k, cell in enumerate(cells)]
    return bodies + (_linkage(rng) if rng.random() < 0.5 and 4 not in cells else [])


def _free_body(rng: np.random.Generator, k: int, cell: tuple[float, float]) -> Values:
    mass = round(10.0 ** rng.uniform(-1.5, 0.7), 4)
    size = round(rng.uniform(0.03, 0.09), 4)
    shape: Values = {"kind": "circle", "radius": size}
    if rng.random() < 0.5:
        shape = {"kind": "box", "size": [2.0 * size, round(rng.uniform(0.03, 0.12), 4)]}
    return {
        "name": f"body_{k}",
        "joint": "planar",
        "mass": mass,
        "inertia": round(0.5 * mass * size**2, 9) + 1e-6,
        "shapes": [shape],
        "position": [*cell, round(rng.uniform(-3.0, 3.0), 3)],
        "velocity": [round(x, 3) for x in rng.normal(scale=[1.0, 1.0, 4.0])],
    }


def _linkage(rng: np.random.Generator, in_space: bool = False) -> list[Values]:
    """Return a chain of one to three links in the middle of the room; in space the joint axes have
    any direction, and the first joint is sometimes a ball joint.
    """
    links: list[Values] = []
    for k in range(int(rng.integers(1, 4))):
        length = 0.09
        mass = round(10.0 ** rng.uniform(-1.0, 0.3), 4)
        zero = [0.0] * (1 + in_space)
        across = mass * (length**2 + 0.02**2) / 12.0
        link: Values = {
            "name": f"link_{k}",
            "mass": mass,
            "center_of_mass": [length / 2, *zero],
            "inertia": [mass * 0.02**2 / 6.0, across, across]
            if in_space
            else round(mass * length**2 / 12, 9),
            "shapes": [
                {
                    "kind": "box",
                    "size": [length, *(0.02 for _ in zero)],
                    "center": [length / 2, *zero],
                }
            ],
        } | _joint(rng, in_space, ball=in_space and k == 0 and rng.random() < 0.3)
        links.append(link | ({"parent": f"link_{k - 1}", "origin": [length, *zero]} if k else {}))
    return links


def _joint(rng: np.random.Generator, in_space: bool, ball: bool) -> Values:
    if ball:
        return {
            "joint": "spherical",
            "velocity": [round(float(x), 3) for x in rng.normal(scale=3.0, size=3)],
        }
    axis = {"axis": [round(float(x), 3) for x in rng.normal(size=3)]} if in_space else {}
    return {
        "joint": "revolute",
        **axis,
        "position": [round(rng.uniform(-1.5, 1.5), 3)],
        "velocity": [round(rng.normal(scale=3.0), 3)],
    }


def _walls(rng: np.random.Generator) -> list[Values]:
    sides = ((ROOM, 0.0), (-ROOM, 0.0), (0.0, ROOM), (0.0, -ROOM))
    walls: list[Values] = [
        {
            "name": f"side_{k}",
            "kind": "half_plane",
            "point": [x, y],
            "normal": [-x / ROOM, -y / ROOM],
        }
        for k, (x, y) in enumerate(sides)
    ]
    if rng.random() < 0.4:
        place = [round(rng.uniform(-0.4, 0.4), 3), 0.44]
        walls.append({"name": "post", "kind": "circle", "radius": 0.03, "center": place})
    return walls


def _contact(rng: np.random.Generator, least_mass: float, dt: float) -> Values:
    """Draw contact constants for the lightest body's mass [kg] and a step [s]."""
    stiffness = min(10.0 ** rng.uniform(2.0, 5.0), (STIFFEST / dt) ** 2 * least_mass)
    damping = rng.choice([0.0, 0.3, 1.0]) * np.sqrt(stiffness * least_mass)
    contact: Values = {
        "forces": "paper",
        "stiffness": round(stiffness, 3),
        "damping": round(float(damping), 4),
        "restitution": float(rng.choice([0.0, 0.5, 1.0, round(rng.uniform(), 3)])),
    }
    if rng.random() < 0.4:
        friction = round(rng.uniform(0.05, 1.0), 3)
        # no draw: all other values stay the same
        forces = "paper" if round(1e3 * friction) % 3 == 0 else "implicit"
        contact |= {"forces": forces, "friction": friction, "friction_velocity": 1e-2}
    if rng.random() < 0.5:
        contact["coherence_distance"] = 1e-2
    if rng.random() < 0.3:
        contact["cluster_distance"] = 1e-3
    if rng.random() < 0.3:
        contact["self_collisions"] = True
    if rng.random() < 0.2:
        contact["penalty"] = "printed"
    return contact


def _add_hand(
    rng: np.random.Generator,
    values: Values,
    scale: list[float],
    limits: list[float],
    through: tuple[float, float],
) -> None:
    """Add a hand on the first free body, usually through a device, perhaps with limits, delay and
    quantised sensors."""
    values["hand"] = {
        "body": "body_0",
        "force": [round(float(x), 3) for x in rng.normal(scale=scale)],
    }
    if not through[0] <= rng.random() < through[1]:
        return
    body = values["bodies"][0]
    turning = np.ravel(values["bodies"][0]["inertia"])
    inertia = np.array([body["mass"]] * (len(limits) - len(turning)) + turning.tolist())
    rate = 0.05 * values["rate"]  # of the coupling [1/s]: slow beside the step
    values["couplings"] = {
        "four_channel": {
            "stiffness": [float(f"{x:.6g}") for x in inertia * rate**2 * 0.3],
            "damping": [float(f"{x:.6g}") for x in inertia * rate],
        }
    }
    device: Values = {}
    if rng.random() < 0.7:
        device["force_limit"] = limits
    if rng.random() < 0.3:
        device["delay"] = int(rng.integers(1, 3))
    if rng.random() < 0.3:
        device["position_resolution"] = [1e-5 if limit > 1.0 else 1e-4 for limit in limits]
    values["device"] = device


def _room(_: np.random.Generator) -> list[Values]:
    sides = [sign * ROOM * axis for axis in np.eye(3) for sign in (1.0, -1.0)]
    return [
        {
            "name": f"side_{k}",
            "kind": "half_space",
            "point": side.tolist(),
            "normal": (-side / ROOM).tolist(),
        }
        for k, side in enumerate(sides)
    ]


def _spatial_bodies(rng: np.random.Generator) -> list[Values]:
    """Return one to four flying bodies in separate cells, and sometimes a stack and a linkage."""
    cells = rng.permutation(len(SPATIAL_CELLS))[: int(rng.integers(1, 5))]
    bodies = [_flying(rng, k, SPATIAL_CELLS[cell]) for k, cell in enumerate(cells)]
    if rng.random() < STACK:
        bodies += _stack(rng)
    return bodies + (_linkage(rng, in_space=True) if rng.random() < MIDDLE_CHAIN else [])


def _flying(rng: np.random.Generator, k: int, cell: tuple[float, float, float]) -> Values:
    turn = rng.normal(size=4)
    body = _box_or_ball(rng, f"body_{k}", rng.uniform(0.03, 0.08), rng.random() < 0.5)
    speed = rng.normal(scale=[1.0, 1.0, 1.0, 4.0, 4.0, 4.0])
    return body | {
        "position": [*cell, *(turn / np.linalg.norm(turn)).tolist()],
        "velocity": [round(float(x), 3) for x in speed],
    }


def _box_or_ball(rng: np.random.Generator, name: str, size: float, ball: bool) -> Values:
    """Return a uniform ball of radius `size`, or a uniform box with sides up to twice `size`
    [m]."""
    mass = round(10.0 ** rng.uniform(-1.5, 0.7), 4)
    sides = np.array([round(2.0 * size * rng.uniform(0.4, 1.0), 4) for _ in range(3)])
    squares = sides**2
    inertia = np.full(3, 0.4 * mass * size**2) if ball else mass / 12.0 * (squares.sum() - squares)
    shape: Values = (
        {"kind": "sphere", "radius": size} if ball else {"kind": "box", "size": sides.tolist()}
    )
    return {
        "name": name,
        "joint": "free_flyer",
        "mass": mass,
        "inertia": inertia.tolist(),
        "shapes": [shape],
    }


def _stack(rng: np.random.Generator) -> list[Values]:
    """Return a box at rest in the middle of the floor, and a box or a ball on it; each contact
    penetrates by 1 µm."""
    below = _box_or_ball(rng, "below", 0.08, ball=False)
    above = _box_or_ball(rng, "above", 0.04, ball=rng.random() < 0.5)
    height = below["shapes"][0]["size"][2]
    shape = above["shapes"][0]
    half = shape["radius"] if shape["kind"] == "sphere" else 0.5 * shape["size"][2]
    low = -ROOM + 0.5 * height - 1e-6
    high = -ROOM + height + half - 2e-6
    return [
        below | {"position": [0.0, 0.0, low, 0.0, 0.0, 0.0, 1.0]},
        above | {"position": [0.003, -0.002, high, 0.0, 0.0, 0.0, 1.0]},
    ]
