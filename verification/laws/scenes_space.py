"""Random scenes in space: boxes and balls that fly, stand on planes and on one another, linkages, in a room of planes.

Drawn as plain values of a scene file with ``dimensions: 3``, as `verification.laws.scenes` does in the plane.
"""

from __future__ import annotations

import numpy as np

from verification.laws.scenes import ROOM, SceneCase, Values, add_coupling, draw_contact, draw_world

# One flying body starts in each at most.
CELLS = tuple((x, y, z) for x in (-0.25, 0.25) for y in (-0.25, 0.25) for z in (-0.25, 0.25))
MIDDLE_CHAIN = 0.45  # share of scenes with a linkage, hung in the middle of the room
STACK = 0.4  # share of scenes with a box on the floor and a smaller one, or a ball, on it
# Up to four points of a face share a blow, and a corner turns its box: as stiff as a planar contact of a sixth of K.
SOFTER = 6.0


def draw_spatial_scene(rng: np.random.Generator, steps: int = 400) -> SceneCase:
    """Return a random scene in space of `steps` steps, its law and rendering."""
    bodies = _bodies(rng)
    values: Values = {
        "name": "random_scene_in_space", "dimensions": 3, "rate": float(rng.choice([512, 1000, 2000])),
        "bodies": bodies, "walls": _room(),
    }  # fmt: skip
    values["duration"] = steps / values["rate"]
    if rng.random() < 0.6:
        values["gravity"] = [0.0, 0.0, -9.81]
    values["contact"] = draw_contact(rng, min(body["mass"] for body in bodies) / SOFTER, 1.0 / values["rate"])
    held = rng.random() < 0.4
    if held:
        _add_hand(rng, values)
    return SceneCase(values, *draw_world(rng, held))


def _room() -> list[Values]:
    sides = [sign * ROOM * axis for axis in np.eye(3) for sign in (1.0, -1.0)]
    return [{"name": f"side_{k}", "kind": "half_space", "point": side.tolist(), "normal": (-side / ROOM).tolist()}
            for k, side in enumerate(sides)]  # fmt: skip


def _bodies(rng: np.random.Generator) -> list[Values]:
    """One to four bodies that fly, each in a cell of its own, sometimes a stack and a linkage besides."""
    cells = rng.permutation(len(CELLS))[: int(rng.integers(1, 5))]
    bodies = [_flying(rng, k, CELLS[cell]) for k, cell in enumerate(cells)]
    if rng.random() < STACK:
        bodies += _stack(rng)
    return bodies + (_linkage(rng) if rng.random() < MIDDLE_CHAIN else [])


def _flying(rng: np.random.Generator, k: int, cell: tuple[float, float, float]) -> Values:
    turn = rng.normal(size=4)
    body = _free_body(rng, f"body_{k}", rng.uniform(0.03, 0.08), rng.random() < 0.5)
    speed = rng.normal(scale=[1.0, 1.0, 1.0, 4.0, 4.0, 4.0])
    return body | {"position": [*cell, *(turn / np.linalg.norm(turn)).tolist()],
                   "velocity": [round(float(x), 3) for x in speed]}  # fmt: skip


def _free_body(rng: np.random.Generator, name: str, size: float, ball: bool) -> Values:
    """A ball of this radius or a box within twice this size, uniform."""
    mass = round(10.0 ** rng.uniform(-1.5, 0.7), 4)
    sides = np.array([round(2.0 * size * rng.uniform(0.4, 1.0), 4) for _ in range(3)])
    squares = sides**2
    inertia = np.full(3, 0.4 * mass * size**2) if ball else mass / 12.0 * (squares.sum() - squares)
    shape: Values = {"kind": "sphere", "radius": size} if ball else {"kind": "box", "size": sides.tolist()}
    return {"name": name, "joint": "free_flyer", "mass": mass, "inertia": inertia.tolist(), "shapes": [shape]}


def _stack(rng: np.random.Generator) -> list[Values]:
    """A box at rest on the floor, in the middle of the room, and on it a box or a ball; each sunk by a micrometre."""
    below = _free_body(rng, "below", 0.08, ball=False)
    above = _free_body(rng, "above", 0.04, ball=rng.random() < 0.5)
    height = below["shapes"][0]["size"][2]
    shape = above["shapes"][0]
    half = shape["radius"] if shape["kind"] == "sphere" else 0.5 * shape["size"][2]
    low, high = -ROOM + 0.5 * height - 1e-6, -ROOM + height + half - 2e-6
    return [below | {"position": [0.0, 0.0, low, 0.0, 0.0, 0.0, 1.0]},
            above | {"position": [0.003, -0.002, high, 0.0, 0.0, 0.0, 1.0]}]  # fmt: skip


def _linkage(rng: np.random.Generator) -> list[Values]:
    """One to three links about axes of any direction, the first sometimes in a ball joint."""
    links: list[Values] = []
    for k in range(int(rng.integers(1, 4))):
        length, mass = 0.09, round(10.0 ** rng.uniform(-1.0, 0.3), 4)
        across = mass * (length**2 + 0.02**2) / 12.0
        link: Values = {
            "name": f"link_{k}", "mass": mass, "center_of_mass": [length / 2, 0.0, 0.0],
            "inertia": [mass * 0.02**2 / 6.0, across, across],
            "shapes": [{"kind": "box", "size": [length, 0.02, 0.02], "center": [length / 2, 0.0, 0.0]}],
        } | _joint(rng, ball=k == 0 and rng.random() < 0.3)  # fmt: skip
        links.append(link | ({"parent": f"link_{k - 1}", "origin": [length, 0.0, 0.0]} if k else {}))
    return links


def _joint(rng: np.random.Generator, ball: bool) -> Values:
    if ball:
        return {"joint": "spherical", "velocity": [round(float(x), 3) for x in rng.normal(scale=3.0, size=3)]}
    return {"joint": "revolute", "axis": [round(float(x), 3) for x in rng.normal(size=3)],
            "position": [round(rng.uniform(-1.5, 1.5), 3)], "velocity": [round(rng.normal(scale=3.0), 3)]}  # fmt: skip


def _add_hand(rng: np.random.Generator, values: Values) -> None:
    """A hand on the first free body, mostly through a device: force, and torque about the axes of the world."""
    force = rng.normal(scale=[2.0, 2.0, 2.0, 0.05, 0.05, 0.05])
    values["hand"] = {"body": "body_0", "force": [round(float(x), 3) for x in force]}
    if rng.random() < 0.7:
        body = values["bodies"][0]
        add_coupling(rng, values, np.array([body["mass"]] * 3 + body["inertia"]), [15.0] * 3 + [1.0] * 3)
