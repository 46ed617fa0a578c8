"""Random scenes: free bodies and short linkages among walls, with random initial states,
restitution, stiffness, step.

In spatial scenes, boxes and balls fly in a room of planes, or rest on a plane or on each other. A
scene consists of the plain values of a scene file, so that it can be stored, shrunk and pasted.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, NamedTuple

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


# field of contact, its value, and the share of the scenes that have it
RARE = (
    ("coherence_distance", 1e-2, 0.5),
    ("cluster_distance", 1e-3, 0.3),
    ("self_collisions", True, 0.3),
    ("penalty", "printed", 0.2),
)


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


class _Space(NamedTuple):
    """What differs between scenes in the plane and in space.

    rates : samples per second that are drawn; field : of gravity [m/s²], in a share of the scenes
    softer : the stiffness is limited as for a mass that is so many times lighter
    scale, limits : of the hand's force and torque, and the limits of its device
    through : the draws from [0, 1) for which the hand has a device
    """

    head: Values
    rates: tuple[int, ...]
    field: list[float]
    share: float
    softer: float
    scale: list[float]
    limits: list[float]
    through: tuple[float, float]


PLANE = _Space(
    head={"name": "random_scene"},
    rates=(256, 512, 1000, 2000),
    field=[0.0, -9.81],
    share=0.5,
    softer=1.0,
    scale=[2.0, 2.0, 0.05],
    limits=[15.0, 15.0, 1.0],
    through=(0.3, 1.0),
)
SPACE = _Space(
    head={"name": "random_scene_in_space", "dimensions": 3},
    rates=(512, 1000, 2000),
    field=[0.0, 0.0, -9.81],
    share=0.6,
    softer=6.0,  # up to four points of a face share an impact, and a hit on a corner turns its box
    scale=[2.0] * 3 + [0.05] * 3,
    limits=[15.0] * 3 + [1.0] * 3,
    through=(0.0, 0.7),
)


def draw_scene(rng: np.random.Generator, steps: int = 400) -> SceneCase:
    """Return a random planar scene of `steps` steps, with its world and rendering."""
    bodies = _bodies(rng)
    return _drawn(rng, steps, PLANE, bodies, _sides(2, "half_plane"))


def draw_spatial_scene(rng: np.random.Generator, steps: int = 400) -> SceneCase:
    """Return a random spatial scene of `steps` steps, with its world and rendering."""
    bodies = _spatial_bodies(rng)
    return _drawn(rng, steps, SPACE, bodies, _sides(3, "half_space"))


def _drawn(
    rng: np.random.Generator, steps: int, space: _Space, bodies: list[Values], walls: list[Values]
) -> SceneCase:
    """Return a scene of these bodies and walls, and draw the rest."""
    rate = float(rng.choice(space.rates))
    if space is PLANE and rng.random() < 0.4:
        place = [round(rng.uniform(-0.4, 0.4), 3), 0.44]
        walls.append({"name": "post", "kind": "circle", "radius": 0.03, "center": place})
    values: Values = space.head | {"rate": rate, "bodies": bodies, "walls": walls}
    values["duration"] = steps / rate
    values["integrator"] = "semi_implicit_euler"
    if rng.random() < space.share:
        values["gravity"] = space.field
    lightest = min(body["mass"] for body in bodies) / space.softer
    values["contact"] = _contact(rng, lightest, 1.0 / rate)
    held = rng.random() < 0.4
    if held:
        _add_hand(rng, values, space)
    impulses = rng.random() < 0.8
    rendering = str(rng.choice(RENDERINGS)) if held and impulses else "full"
    return SceneCase(values, "IAPB" if impulses else "PB", rendering)


def _sides(dimensions: int, kind: str) -> list[Values]:
    """Return the planes around the room."""
    sides = [sign * axis for axis in np.eye(dimensions) for sign in (1.0, -1.0)]
    return [
        {
            "name": f"side_{k}",
            "kind": kind,
            "point": (ROOM * side).tolist(),
            "normal": (-side).tolist(),
        }
        for k, side in enumerate(sides)
    ]


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
    return contact | {name: value for name, value, share in RARE if rng.random() < share}


def _add_hand(rng: np.random.Generator, values: Values, space: _Space) -> None:
    """Add a hand on the first free body, usually through a device, perhaps with limits, delay and
    quantised sensors."""
    limits = space.limits
    values["hand"] = {
        "body": "body_0",
        "force": [round(float(x), 3) for x in rng.normal(scale=space.scale)],
    }
    if not space.through[0] <= rng.random() < space.through[1]:
        return
    body = values["bodies"][0]
    turning = np.ravel(body["inertia"])
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
