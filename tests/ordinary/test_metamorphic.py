"""What may not change a motion: the order and names of bodies and walls, a turn, a mirror, the place,
the unit of length, a wall given twice or in two parts, a far body.

Each ordinary scene of free bodies is run once as it is and once changed. The change is undone on the
final poses, and the largest difference is a share of the size of the motion.
"""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from iapb.scene import scene_from_text
from iapb.simulation import simulate
from tests.ordinary.scenes import CASES, FLOOR

Values = dict[str, Any]

# Motions that double each difference at a touch many times over, or end at a threshold of the engine
# (a collision counts or not): their last digits say nothing.
UNSTABLE = {"bounce_100_percent", "dominoes", "thrown_box_lands", "balls_and_wall", "bernoulli"}
SHORT = 0.5  # [s] of each scene: enough to land, slide, roll and stand


def is_free(values: Values) -> bool:
    """Whether a scene has free bodies alone."""
    bodies = values["bodies"]
    free = all(body["joint"] in ("planar", "free_flyer") for body in bodies)
    return free and not any("parent" in body for body in bodies) and "hand" not in values


SCENES = [name for name, case in CASES.items() if is_free(case.scene) and name not in UNSTABLE]


def ends(values: Values) -> dict[str, np.ndarray]:
    """Return the final place of each body by its name, and its sine and cosine or quaternion."""
    values = values | {"duration": min(values["duration"], SHORT)}
    run = simulate(scene_from_text(json.dumps(values)))
    assert run.complete
    found = {}
    for name, pose in zip(run.body_names, run.pose[-1], strict=True):
        turned = [math.cos(pose[2]), math.sin(pose[2])] if len(pose) == 3 else pose[3:]
        found[name] = np.array([*pose[: 2 if len(pose) == 3 else 3], *turned])
    return found


def size_of(values: Values) -> float:
    """Return the largest extent of a shape [m]."""
    return max(
        2.0 * shape.get("radius", 0.0)
        + np.max(np.abs(shape.get("size", shape.get("vertices", 0.0))))
        for body in values["bodies"]
        for shape in body["shapes"]
    )


def placed(values: Values, scale: float, shift: np.ndarray, turn: np.ndarray) -> Values:
    """Return a scene in another unit of length, at another place, turned or mirrored in the plane."""
    made = copy.deepcopy(values)
    space = made.get("dimensions") == 3
    mirrored = np.linalg.det(turn) < 0.0
    sign, angle = (-1.0, 0.0) if mirrored else (1.0, math.atan2(turn[1, 0], turn[0, 0]))

    def vector(x: Any, length: float = scale) -> np.ndarray:
        return length * (np.asarray(x, float) if space else turn @ np.asarray(x, float))

    def shaped(shape: Values) -> None:
        for key in ("radius", "size"):
            if key in shape:
                shape[key] = (scale * np.asarray(shape[key])).tolist()
        for key in ("vertices", "center"):
            if key in shape:  # in the axes of the body, of which the mirror turns x round
                points = scale * np.asarray(shape[key], float) * ([-1.0, 1.0] if mirrored else 1.0)
                shape[key] = points[:: -1 if mirrored and key == "vertices" else 1].tolist()
        if mirrored and "angle" in shape:
            shape["angle"] *= -1.0

    for body in made["bodies"]:
        axes = 3 if space else 2
        body["position"][:axes] = (vector(body["position"][:axes]) + shift[:axes]).tolist()
        velocity = body.get("velocity") or [0.0] * (2 * axes if space else 3)
        body["velocity"] = [*vector(velocity[:axes]), *velocity[axes:]]
        if not space:
            body["position"][2] = sign * body["position"][2] + angle
            body["velocity"][2] *= sign
        if "density" in body:
            body["density"] /= scale**axes
        if "inertia" in body:
            body["inertia"] = (scale**2 * np.asarray(body["inertia"])).tolist()
        if "center_of_mass" in body:
            body["center_of_mass"] = [scale * x for x in body["center_of_mass"]]
        for shape in body["shapes"]:
            shaped(shape)
    for wall in made.get("walls", []):
        for key in ("point", "center"):
            if key in wall:
                wall[key] = (vector(wall[key]) + shift[: 3 if space else 2]).tolist()
        if "normal" in wall:
            wall["normal"] = vector(wall["normal"], 1.0).tolist()
        if wall["kind"] == "box" and not space:
            wall["angle"] = sign * wall.get("angle", 0.0) + angle
        if "size" in wall:
            wall["size"] = [scale * x for x in wall["size"]]
    if made.get("gravity"):
        made["gravity"] = vector(made["gravity"]).tolist()
    return made


PLANE = np.eye(2)
QUARTER = np.array([[0.0, -1.0], [1.0, 0.0]])
ODD = np.array([[math.cos(0.7), -math.sin(0.7)], [math.sin(0.7), math.cos(0.7)]])
MIRROR = np.diag([-1.0, 1.0])
HERE = np.zeros(3)
FAR = np.array([1000.0, 1000.0, 0.0])


def reordered(values: Values) -> Values:
    made = copy.deepcopy(values)
    made["bodies"].reverse()
    made["walls"] = made.get("walls", [])[::-1]
    for k, wall in enumerate(made["walls"]):
        wall["name"] = f"other{k}"
    return made


def twice(values: Values) -> Values:
    walls = copy.deepcopy(values.get("walls", []))
    return values | {
        "walls": walls + [wall | {"name": f"again{k}"} for k, wall in enumerate(walls)]
    }


def in_two(values: Values) -> Values:
    """The floor as two blocks that join below the first body."""
    seam = values["bodies"][0]["position"][0] + 0.013
    blocks = [
        {"name": f"block{k}", "kind": "box", "size": [100, 1], "center": [seam + x, -0.5]}
        for k, x in enumerate((-50.0, 50.0))
    ]
    return values | {"walls": blocks + [wall for wall in values["walls"] if wall != FLOOR]}


def beside(mass: float) -> Callable[[Values], Values]:
    """A body that never touches anything."""

    def change(values: Values) -> Values:
        space = values.get("dimensions") == 3
        body: Values = {
            "name": "far",
            "mass": mass,
            "joint": "free_flyer" if space else "planar",
            "inertia": [mass, mass, mass] if space else mass,
            "shapes": [{"kind": "sphere" if space else "circle", "radius": 3.0}],
            "position": [500, 0, 500, 0, 0, 0, 1] if space else [500, 500, 0],
        }
        return values | {"bodies": [*values["bodies"], body]}

    return change


def undone(end: np.ndarray, scale: float, shift: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Undo `placed` on a pose of `ends`."""
    if len(end) > 4:
        return np.array([*((end[:3] - shift) / scale), *end[3:]])
    mirrored = np.linalg.det(turn) < 0.0
    c, s = end[2:]
    back = [c, -s] if mirrored else turn.T @ [c, s]
    return np.array([*(turn.T @ (end[:2] - shift[:2]) / scale), *back])


Place = tuple[float, np.ndarray, np.ndarray]
SAME: Place = (1.0, HERE, PLANE)
# name: change, its place, and the largest difference in shares of the size. Sums in another order
# differ by rounding, 1e-16 of the size. Limits of friction are settled to 1e-3 of themselves, from
# a start that the last step gives, so a rounding can move a slip by that share of a step's: 1e-6.
# Two walls at one place share such a limit, and each half settles by itself: 1e-4.
# A kilometre rounds positions to 1e-13 m, and touch itself by as much.
CHANGES: dict[str, tuple[Callable[[Values], Values], Place, float]] = {
    "reordered and renamed": (reordered, SAME, 1e-6),
    "each wall twice": (twice, SAME, 1e-4),
    "floor in two": (in_two, SAME, 1e-6),
    "a light body far away": (beside(1e-3), SAME, 0.0),
    "a heavy body far away": (beside(1e6), SAME, 0.0),
    "turned by a right angle": (lambda x: x, (1.0, HERE, QUARTER), 1e-6),
    "turned by 0.7": (lambda x: x, (1.0, HERE, ODD), 1e-6),
    "mirrored": (lambda x: x, (1.0, HERE, MIRROR), 1e-6),
    "a kilometre away": (lambda x: x, (1.0, FAR, PLANE), 1e-4),
    "in millimetres": (lambda x: x, (1000.0, HERE, PLANE), 1e-4),
}


@pytest.fixture(scope="module")
def plain() -> dict[str, dict[str, np.ndarray]]:
    return {}


def means_something(name: str, change: str) -> bool:
    """Whether a change can be made: turns and mirrors are of the plane, blocks replace its floor,
    and numbers of a scene are at most 1e9."""
    values, (how, place, _) = CASES[name].scene, CHANGES[change]
    if values.get("dimensions") == 3:
        return how is not in_two and place[2] is PLANE
    whole = how is not in_two or FLOOR in values.get("walls", [])
    return whole and (name, change) != ("heavy_box_rests", "in millimetres")


# every pair of a scene and a change; one of six by default
PAIRS = [
    pytest.param(name, change, marks=[] if (i + k) % 6 == 0 else pytest.mark.thorough)
    for i, name in enumerate(SCENES)
    for k, change in enumerate(CHANGES)
    if means_something(name, change)
]


@pytest.mark.parametrize(("name", "change"), PAIRS)
def test_a_change_that_means_nothing_changes_nothing(
    name: str, change: str, plain: dict[str, dict[str, np.ndarray]]
) -> None:
    values = CASES[name].scene
    how, place, most = CHANGES[change]
    if name not in plain:
        plain[name] = ends(values)
    found, size = ends(placed(how(values), *place)), size_of(values)
    for body, expected in plain[name].items():
        difference = np.abs(undone(found[body], *place) - expected)
        moved = max(size, float(np.abs(expected[: -2 if len(expected) == 4 else 3]).max()))
        assert difference.max() / moved <= most, body
