"""Scenes for every engine: rigid bodies of spheres and boxes, fixed boxes, gravity and one restitution.

A scene has plain numbers in SI units. Contacts are frictionless. Quaternions are x, y, z, w and rotate body axes into
world axes; velocities are those of the centre of mass in world axes.

`FIXED_SCENES` is the set for comparisons of engines; each scene has an exact result or a law. Impact scenes have no
gravity, so the velocities after the last impact are known exactly; distances are not multiples of a step. In resting
scenes the bodies touch at the start and must stay in place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, pi, sin, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.errors import ArgumentError
from iapb.names import one_of

Floats = NDArray[np.float64]
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

ORIGIN: Vector = (0.0, 0.0, 0.0)
UPRIGHT: Quaternion = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Sphere:
    """A ball: radius [m] and centre in body axes [m]."""

    radius: float
    center: Vector = ORIGIN


@dataclass(frozen=True)
class Cuboid:
    """A box along the body axes: full side lengths [m] and centre in body axes [m]."""

    size: Vector
    center: Vector = ORIGIN


@dataclass(frozen=True)
class RigidBody:
    """A free body; its origin is the centre of mass, and its axes are principal axes.

    mass [kg], inertia: three principal moments [kg m2], velocity [m/s] and spin [rad/s] in world axes
    """

    name: str
    mass: float
    inertia: Vector
    shapes: tuple[Sphere | Cuboid, ...]
    position: Vector
    orientation: Quaternion = UPRIGHT
    velocity: Vector = ORIGIN
    spin: Vector = ORIGIN


@dataclass(frozen=True)
class Obstacle:
    """A fixed box: full side lengths [m], centre [m] and orientation."""

    name: str
    size: Vector
    center: Vector
    orientation: Quaternion = UPRIGHT


@dataclass(frozen=True)
class FixedScene:
    """One scene of the set, and the known facts of its motion.

    law : the condition that the motion must satisfy, in words
    final_velocities : (bodies, 3) world axes, after the last impact; None for a scene that stays at rest
    length : size of the bodies [m], the scale of overlaps
    """

    name: str
    title: str
    law: str
    bodies: tuple[RigidBody, ...]
    obstacles: tuple[Obstacle, ...]
    restitution: float
    duration: float
    length: float
    gravity: Vector = ORIGIN
    final_velocities: tuple[Vector, ...] | None = None

    @property
    def rests(self) -> bool:
        """Whether the bodies must stay in place."""
        return self.final_velocities is None

    @property
    def masses(self) -> Floats:
        """Masses (bodies,) [kg]."""
        return np.array([body.mass for body in self.bodies])

    @property
    def fastest(self) -> float:
        """Largest speed at the start [m/s]."""
        return max(float(np.linalg.norm(body.velocity)) for body in self.bodies)


def rotation(quaternion: Any) -> Floats:
    """Return rotations (..., 3, 3) of quaternions (..., 4), x, y, z, w, of any nonzero length."""
    q = np.asarray(quaternion, np.float64)
    x, y, z, w = np.moveaxis(q / np.linalg.norm(q, axis=-1, keepdims=True), -1, 0)
    entries = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(entries), (0, 1), (-2, -1))


RADIUS, SIDE = 0.05, 0.1  # of all balls and boxes [m]
WEIGHT: Vector = (0.0, 0.0, -9.81)
FLOOR = Obstacle("floor", (2.0, 2.0, 0.5), (0.0, 0.0, -0.25))
MASS_RATIO_OF_BALLS = 100.0  # the heavy ball and the light one collide with each other and the wall 31 times


def elastic_cradle() -> FixedScene:
    """Five equal balls, 4 mm apart, so that the collisions are successive."""
    gap = 0.0041
    places = [-2.0 * RADIUS - 0.0203, *(k * (2.0 * RADIUS + gap) for k in range(4))]
    balls = tuple(
        _ball(f"ball {k + 1}", 1.0, x, 0.0, 1.0 if k == 0 else 0.0) for k, x in enumerate(places)
    )
    end = ((0.0, 0.0, 0.0),) * 4 + ((1.0, 0.0, 0.0),)
    return FixedScene("elastic_cradle", "Elastic cradle", "the last ball leaves with the first one's velocity",
                      balls, (), 1.0, 0.2, 2.0 * RADIUS, final_velocities=end)  # fmt: skip


def bernoulli() -> FixedScene:
    """A ball strikes two touching balls at once (Bernoulli 1742); energy, momentum and symmetry give the result."""
    start = -sqrt(3.0) * RADIUS - 0.0203
    balls = (_ball("striker", 1.0, start, 0.0, 1.0), _ball("upper", 1.0, 0.0, RADIUS, 0.0),
             _ball("lower", 1.0, 0.0, -RADIUS, 0.0))  # fmt: skip
    along, across = 0.6, 0.2 * sqrt(3.0)  # 2 sqrt(3)/5 along normals at 30 degrees
    end = ((-0.2, 0.0, 0.0), (along, across, 0.0), (along, -across, 0.0))
    return FixedScene("bernoulli", "Bernoulli's three balls", "striker −1/5, the others 2√3/5 at 30°", balls, (),
                      1.0, 0.1, 2.0 * RADIUS, final_velocities=end)  # fmt: skip


def two_balls_and_a_wall() -> FixedScene:
    """A ball of 100 kg drives one of 1 kg against a wall: 31 collisions (Galperin 2003)."""
    wall = Obstacle("wall", (0.5, 2.0, 2.0), (0.25, 0.0, 0.0))
    balls = (_ball("heavy", MASS_RATIO_OF_BALLS, -1.1, 0.0, 1.0), _ball("light", 1.0, -0.55, 0.0, 0.0))
    heavy, light = after_all_collisions(MASS_RATIO_OF_BALLS)
    return FixedScene("two_balls_and_a_wall", "Two balls and a wall", "31 elastic collisions, all energy kept", balls,
                      (wall,), 1.0, 3.0, 2.0 * RADIUS,
                      final_velocities=((heavy, 0.0, 0.0), (light, 0.0, 0.0)))  # fmt: skip


def after_all_collisions(ratio: float) -> tuple[float, float]:
    """Return the final velocities of the heavy ball (1 at the start) and the light one; the wall is at +x."""
    heavy, light = 1.0, 0.0
    while heavy > light or light > 0.0:
        if heavy > light:
            common = (ratio * heavy + light) / (ratio + 1.0)
            heavy, light = 2.0 * common - heavy, 2.0 * common - light
        else:
            light = -light
    return heavy, light


def box_on_four_corners() -> FixedScene:
    """A box lands flat on its face, with four corners at once."""
    return _dropped("box_on_four_corners", "Box dropped on four corners", (Cuboid((SIDE,) * 3),))


def box_on_sixteen_corners() -> FixedScene:
    """A box on four square feet lands flat, with sixteen corners at once; thirteen of them are redundant."""
    foot, at = 0.02, 0.04
    feet = tuple(Cuboid((foot,) * 3, (x, y, -at)) for x in (-at, at) for y in (-at, at))
    return _dropped("box_on_sixteen_corners", "Box dropped on sixteen corners", feet)


def redundant_wedge() -> FixedScene:
    """A cube falls edge first into a right-angled groove, with eight corners at once; three are independent."""
    clear = 0.0103
    start = (0.0, 0.0, sqrt(2.0) * (0.5 * SIDE + clear))
    cube = RigidBody("cube", 1.0, _cube_inertia(1.0), (Cuboid((SIDE,) * 3),), start, _about_y(pi / 4),
                     (0.0, 0.0, -1.0))  # fmt: skip
    return FixedScene("redundant_wedge", "Redundant wedge", "elastic: it leaves as it came", (cube,),
                      (_slope("left", -1.0), _slope("right", 1.0)), 1.0, 0.05, SIDE,
                      final_velocities=((0.0, 0.0, 1.0),))  # fmt: skip


def heavy_stack() -> FixedScene:
    """Four stacked boxes, each with a hundred times the mass of the one below."""
    boxes = tuple(_box(f"box {k + 1}", mass, (k + 0.5) * SIDE) for k, mass in enumerate((1e-3, 0.1, 10.0, 1000.0)))
    return FixedScene("heavy_stack", "Stack with mass ratio 10⁶", "it stays", boxes, (FLOOR,), 0.0, 1.0, SIDE, WEIGHT)


def resting_box() -> FixedScene:
    """A box that rests on the floor for a minute."""
    return FixedScene("resting_box", "Resting box", "it stays", (_box("box", 1.0, 0.5 * SIDE),), (FLOOR,), 0.0, 60.0,
                      SIDE, WEIGHT)  # fmt: skip


FIXED_SCENES: dict[str, Callable[[], FixedScene]] = {
    make.__name__: make
    for make in (elastic_cradle, bernoulli, two_balls_and_a_wall, box_on_four_corners, box_on_sixteen_corners,
                 redundant_wedge, heavy_stack, resting_box)
}  # fmt: skip


def fixed_scene(name: str) -> FixedScene:
    """Return the scene of that name."""
    if name not in FIXED_SCENES:
        raise ArgumentError("scene", name, one_of(name, FIXED_SCENES))
    return FIXED_SCENES[name]()


def _ball(name: str, mass: float, x: float, y: float, speed: float) -> RigidBody:
    inertia = 0.4 * mass * RADIUS**2
    return RigidBody(name, mass, (inertia,) * 3, (Sphere(RADIUS),), (x, y, 0.0), velocity=(speed, 0.0, 0.0))


def _box(name: str, mass: float, height: float) -> RigidBody:
    return RigidBody(name, mass, _cube_inertia(mass), (Cuboid((SIDE,) * 3),), (0.0, 0.0, height))


def _cube_inertia(mass: float) -> Vector:
    return (mass * SIDE**2 / 6.0,) * 3


def _dropped(name: str, title: str, shapes: tuple[Cuboid, ...]) -> FixedScene:
    clear, speed, restitution = 0.0103, 1.0, 0.5
    body = RigidBody("box", 1.0, _cube_inertia(1.0), shapes, (0.0, 0.0, 0.5 * SIDE + clear),
                     velocity=(0.0, 0.0, -speed))  # fmt: skip
    return FixedScene(name, title, "e = 1/2: it leaves flat at half the speed", (body,), (FLOOR,), restitution, 0.05,
                      SIDE, final_velocities=((0.0, 0.0, restitution * speed),))  # fmt: skip


def _about_y(angle: float) -> tuple[float, float, float, float]:
    return (0.0, sin(0.5 * angle), 0.0, cos(0.5 * angle))


def _slope(name: str, side: float) -> Obstacle:
    """Return half of the groove: a box whose upper face rises from the origin to the `side` at 45 degrees."""
    width, depth, root = 1.0, 0.2, sqrt(0.5)
    along, normal = (side * root, root), (-side * root, root)
    center = tuple(0.5 * width * a - 0.5 * depth * n for a, n in zip(along, normal, strict=True))
    return Obstacle(name, (width, 1.0, depth), (center[0], 0.0, center[1]), _about_y(-side * pi / 4))
