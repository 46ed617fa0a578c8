"""What may not change a motion: the order and names of bodies and walls, a turn, a mirror, the place,
the unit of length, a wall given twice, a far body, the plane given as a part of
space.

Each ordinary scene of free bodies is run once as it is and once changed. The change is undone on the
final poses, and the largest difference is a share of the size of the motion.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from iapb.run import Run
from iapb.scene import scene_from_text
from iapb.simulation import simulate
from verification.ordinary.scenes import CASES

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


def run_of(values: Values) -> Run:
    values = values | {"duration": min(values["duration"], SHORT)}
    run = simulate(scene_from_text(json.dumps(values)))
    assert run.complete
    return run


def ends(run: Run) -> dict[str, np.ndarray]:
    """Return the final place of each body by its name: three coordinates and the entries of its
    rotation. The plane is z = 0."""
    found = {}
    for name, pose in zip(run.body_names, run.pose[-1], strict=True):
        flat = len(pose) == 3
        at = [*pose[:2], 0.0] if flat else pose[:3]
        turned = turn_about([0, 0, 1], pose[2]) if flat else Rotation.from_quat(pose[3:])
        found[name] = np.array([*at, *turned.as_matrix().ravel()])
    return found


def turn_about(axis: Any, angle: float) -> Rotation:
    return Rotation.from_rotvec(angle * np.asarray(axis, float))


def size_of(values: Values) -> float:
    """Return the largest extent of a shape [m]."""
    return max(
        2.0 * shape.get("radius", 0.0)
        + np.max(np.abs(shape.get("size", shape.get("vertices", 0.0))))
        for body in values["bodies"]
        for shape in body["shapes"]
    )


class Place(NamedTuple):
    """Where and how a scene is placed: its unit, a shift, a turn (about z in the plane, about a
    tilted axis in space), and whether x is mirrored in the world and in each body."""

    scale: float = 1.0
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    angle: float = 0.0
    mirrored: bool = False

    def turn(self, space: bool) -> np.ndarray:
        axis = np.array([1.0, 2.0, 2.0]) / 3.0 if space else np.array([0.0, 0.0, 1.0])
        return turn_about(axis, self.angle).as_matrix() @ self.flip

    @property
    def flip(self) -> np.ndarray:
        """What the mirror does to the axes of a body."""
        return np.diag([-1.0 if self.mirrored else 1.0, 1.0, 1.0])


def placed(values: Values, place: Place) -> Values:
    """Return the scene at a place."""
    made = copy.deepcopy(values)
    space = made.get("dimensions") == 3
    axes = 3 if space else 2
    scale = place.scale
    sign = -1.0 if place.mirrored else 1.0
    turn = place.turn(space)
    flip = place.flip[:axes, :axes]

    def vector(x: Any, length: float = scale) -> np.ndarray:
        return length * (turn[:axes, :axes] @ np.asarray(x, float))

    def moved(x: Any) -> list[float]:
        return (vector(x) + place.shift[:axes]).tolist()

    def turned(rotation: Rotation) -> Rotation:
        return Rotation.from_matrix(turn @ rotation.as_matrix() @ place.flip)

    for body in made["bodies"]:
        velocity = np.array(body.get("velocity") or [0.0] * (2 * axes if space else 3))
        linear = velocity[:axes]
        angular = velocity[axes:]
        body["position"][:axes] = moved(body["position"][:axes])
        if space:  # the velocity is in the axes of the body; an angular one has an axis
            body["position"][3:] = (
                turned(Rotation.from_quat(body["position"][3:])).as_quat().tolist()
            )
            body["velocity"] = [*(scale * flip @ linear), *(sign * flip @ angular)]
        else:
            body["position"][2] = sign * body["position"][2] + place.angle
            body["velocity"] = [*vector(linear), *(sign * angular)]
        if "density" in body:
            body["density"] /= scale**axes
        if "inertia" in body:
            body["inertia"] = (scale**2 * np.asarray(body["inertia"])).tolist()
        if "center_of_mass" in body:
            body["center_of_mass"] = (scale * flip @ body["center_of_mass"]).tolist()
        for shape in body["shapes"]:
            for key in ("radius", "size"):
                if key in shape:
                    shape[key] = (scale * np.asarray(shape[key])).tolist()
            for key in ("vertices", "center"):
                if key in shape:
                    shape[key] = (scale * np.asarray(shape[key], float) @ flip).tolist()
            assert not {"angle", "rpy"} & shape.keys()
    for wall in made.get("walls", []):
        for key in ("point", "center"):
            if key in wall:
                wall[key] = moved(wall[key])
        if "normal" in wall:
            wall["normal"] = vector(wall["normal"], 1.0).tolist()
        if "size" in wall:
            wall["size"] = [scale * x for x in wall["size"]]
        if wall["kind"] == "box" and space:
            given = Rotation.from_euler("xyz", wall.get("rpy", [0.0, 0.0, 0.0]))
            wall["rpy"] = turned(given).as_euler("xyz").tolist()
        elif wall["kind"] == "box":
            wall["angle"] = sign * wall.get("angle", 0.0) + place.angle
    if made.get("gravity"):
        made["gravity"] = vector(made["gravity"]).tolist()
    return made


def undone(end: np.ndarray, place: Place, space: bool) -> np.ndarray:
    """Undo `placed` on a pose of `ends`."""
    turn = place.turn(space)
    at = turn.T @ (end[:3] - place.shift) / place.scale
    return np.array([*at, *(turn.T @ end[3:].reshape(3, 3) @ place.flip).ravel()])


def in_space(values: Values) -> Values:
    """The plane as z = 0 in space: discs are balls, and boxes are as deep as the largest shape."""
    deep = size_of(values)
    made = copy.deepcopy(values) | {"dimensions": 3}
    for body in made["bodies"]:
        x, y, angle = body["position"]
        vx, vy, spin = body.get("velocity") or [0.0, 0.0, 0.0]
        turn = turn_about([0, 0, 1], angle)
        body["joint"] = "free_flyer"
        body["position"] = [x, y, 0.0, *turn.as_quat().tolist()]
        body["velocity"] = [*turn.inv().apply([vx, vy, 0.0]).tolist(), 0.0, 0.0, spin]
        body["inertia"] = [body["inertia"]] * 3
        for shape in body["shapes"]:
            if shape["kind"] == "circle":
                shape["kind"] = "sphere"
            deepened(shape, deep)
    for wall in made.get("walls", []):
        if wall["kind"] == "half_plane":
            wall["kind"] = "half_space"
        deepened(wall, 4.0 * deep)
        if "angle" in wall:
            wall["rpy"] = [0.0, 0.0, wall.pop("angle")]
    if made.get("gravity"):
        made["gravity"] = [*made["gravity"], 0.0]
    return made


def deepened(part: Values, deep: float) -> None:
    for key in ("point", "center", "normal"):
        if key in part:
            part[key] = [*part[key], 0.0]
    if "size" in part:
        part["size"] = [*part["size"], deep]


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


def as_it_is(values: Values) -> Values:
    return values


SAME = Place()
# name: change, its place, and the largest difference in shares of the size. Sums in another order
# differ by rounding, 1e-16 of the size. Limits of friction are settled to 1e-3 of themselves, from
# a start that the last step gives, so a rounding can move a slip by that share of a step's: 1e-6.
# Two walls at one place share such a limit, and each half settles by itself: 1e-4. So do the two
# corners in space that are one in the plane.
# A kilometre rounds positions to 1e-13 m, and touch itself by as much. Millimetres change what
# counts as touching (1e-9 m) a thousandfold, and so which impacts of a ladder are one.
CHANGES: dict[str, tuple[Callable[[Values], Values], Place, float]] = {
    "reordered and renamed": (reordered, SAME, 1e-6),
    "each wall twice": (twice, SAME, 1e-4),
    "a light body far away": (beside(1e-3), SAME, 0.0),
    "a heavy body far away": (beside(1e6), SAME, 0.0),
    "turned by 0.7": (as_it_is, Place(angle=0.7), 1e-6),
    "mirrored": (as_it_is, Place(mirrored=True), 1e-6),
    "a kilometre away": (as_it_is, Place(shift=(1000.0, 1000.0, 0.0)), 1e-4),
    "in millimetres": (as_it_is, Place(scale=1000.0), 3e-4),
    "in space": (in_space, SAME, 1e-4),
}


@pytest.fixture(scope="module")
def plain() -> dict[str, Run]:
    return {}


def means_something(name: str, change: str) -> bool:
    """Whether a change can be made: space has no polygons, and
    numbers of a scene are at most 1e9."""
    values = CASES[name].scene
    (how, _, _) = CHANGES[change]
    space = values.get("dimensions") == 3
    if how is in_space:
        shapes = [shape for body in values["bodies"] for shape in body["shapes"]]
        return not space and all(shape["kind"] != "polygon" for shape in shapes)
    return (name, change) != ("heavy_box_rests", "in millimetres")


def difference(plain: Run, changed: Run, values: Values, place: Place = SAME) -> float:
    """Return the largest difference of a final pose in shares of the size of the motion."""
    found = ends(changed)
    size = size_of(values)
    shares = [0.0]
    for body, expected in ends(plain).items():
        back = undone(found[body], place, values.get("dimensions") == 3)
        moved = max(size, float(np.abs(expected[:3]).max()))
        shares.append(float(np.abs(back - expected).max()) / moved)
    return max(shares)


# every pair of a scene and a change; two scenes of each change by default
PAIRS = [
    pytest.param(name, change, marks=[] if (i + 7 * k) % 32 == 0 else pytest.mark.thorough)
    for i, name in enumerate(SCENES)
    for k, change in enumerate(CHANGES)
    if means_something(name, change)
]


@pytest.mark.parametrize(("name", "change"), PAIRS)
def test_a_change_that_means_nothing_changes_nothing(
    name: str, change: str, plain: dict[str, Run]
) -> None:
    values = CASES[name].scene
    how, place, most = CHANGES[change]
    if name not in plain:
        plain[name] = run_of(values)
    changed = run_of(placed(how(values), place))
    assert difference(plain[name], changed, values, place) <= most
