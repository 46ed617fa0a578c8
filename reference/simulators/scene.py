"""Scenes for every engine: rigid bodies of spheres and boxes, fixed boxes, gravity and one restitution.

A scene has plain numbers in SI units. Contacts are frictionless. Quaternions are x, y, z, w and rotate body axes into
world axes; velocities are those of the centre of mass in world axes.

`FIXED_SCENES` is the set for comparisons of engines; each scene has an exact result or a law. Impact scenes have no
gravity, so the velocities after the last impact are known exactly; distances are not multiples of a step. In resting
scenes the bodies touch at the start and must stay in place.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin, sqrt
from typing import Any

import numpy as np

from iapb.errors import ArgumentError
from iapb.names import one_of
from reference import Floats

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
    """A free body; its origin is the centre of mass, and its axes are principal axes."""

    name: str
    mass: float  #: [kg]
    inertia: Vector  #: three principal moments [kg m2]
    shapes: tuple[Sphere | Cuboid, ...]
    position: Vector
    orientation: Quaternion = UPRIGHT
    velocity: Vector = ORIGIN  #: [m/s] in world axes
    spin: Vector = ORIGIN  #: [rad/s] in world axes


@dataclass(frozen=True)
class Obstacle:
    """A fixed box: full side lengths [m], centre [m] and orientation. As a body, it has mass 0 and one shape."""

    name: str
    size: Vector
    position: Vector
    orientation: Quaternion = UPRIGHT
    mass = 0.0

    @property
    def shapes(self) -> tuple[Cuboid]:
        """The box, about its centre."""
        return (Cuboid(self.size),)


@dataclass(frozen=True)
class FixedScene:
    """One scene of the set, and the known facts of its motion."""

    name: str
    title: str
    law: str  #: the condition that the motion must satisfy, in words
    bodies: tuple[RigidBody, ...]
    obstacles: tuple[Obstacle, ...]
    restitution: float
    duration: float
    length: float  #: size of the bodies [m], the scale of overlaps
    gravity: Vector = ORIGIN
    final_velocities: tuple[Vector, ...] | None = None  #: (bodies, 3) world axes, after the last impact

    @property
    def rests(self) -> bool:
        """Whether the bodies must stay in place, and final velocities are None."""
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


def _ball(name: str, mass: float, x: float, y: float, speed: float) -> RigidBody:
    inertia = 0.4 * mass * RADIUS**2
    return RigidBody(name, mass, (inertia,) * 3, (Sphere(RADIUS),), (x, y, 0.0), velocity=(speed, 0.0, 0.0))


def _box(name: str, mass: float, height: float, shapes: tuple[Cuboid, ...] = (Cuboid((SIDE,) * 3),),
         turn: Quaternion = UPRIGHT, fall: float = 0.0) -> RigidBody:  # fmt: skip
    inertia = (mass * SIDE**2 / 6.0,) * 3
    return RigidBody(name, mass, inertia, shapes, (0.0, 0.0, height), turn, (0.0, 0.0, -fall) if fall else ORIGIN)


def _about_y(angle: float) -> Quaternion:
    return (0.0, sin(0.5 * angle), 0.0, cos(0.5 * angle))


def _slope(name: str, side: float) -> Obstacle:
    """Return half of a groove: a box whose upper face rises from the origin to the `side` at 45 degrees."""
    width, depth, root = 1.0, 0.2, sqrt(0.5)
    x, z = (0.5 * width * a - 0.5 * depth * n for a, n in ((side * root, -side * root), (root, root)))
    return Obstacle(name, (width, 1.0, depth), (x, 0.0, z), _about_y(-side * pi / 4))


_CLEAR = 0.0103  # distance of falling boxes from what they strike [m]
_FEET = tuple(Cuboid((0.02,) * 3, (x, y, -0.04)) for x in (-0.04, 0.04) for y in (-0.04, 0.04))
_HEAVY, _LIGHT = after_all_collisions(MASS_RATIO_OF_BALLS)
_ACROSS = 0.2 * sqrt(3.0)  # 2 sqrt(3)/5 along normals at 30 degrees
_LANDS = "e = 1/2: the box leaves flat at half its speed"

FIXED_SCENES: dict[str, FixedScene] = {scene.name: scene for scene in (
    # five equal balls, 4 mm apart, so that the collisions are successive
    FixedScene("elastic_cradle", "Elastic cradle", "the last ball leaves with the first one's velocity",
               tuple(_ball(f"ball {k + 1}", 1.0, x, 0.0, 0.0 if k else 1.0) for k, x in
                     enumerate([-2.0 * RADIUS - 0.0203, *(k * (2.0 * RADIUS + 0.0041) for k in range(4))])),
               (), 1.0, 0.2, 2.0 * RADIUS, final_velocities=(ORIGIN,) * 4 + ((1.0, 0.0, 0.0),)),
    # a ball strikes two touching balls at once (Bernoulli 1742); energy, momentum and symmetry give the result
    FixedScene("bernoulli", "Bernoulli's three balls", "the striker returns with 1/5 of its speed, the others leave "
                                                       "with 2√3/5 of it at ±30°",
               (_ball("striker", 1.0, -sqrt(3.0) * RADIUS - 0.0203, 0.0, 1.0), _ball("upper", 1.0, 0.0, RADIUS, 0.0),
                _ball("lower", 1.0, 0.0, -RADIUS, 0.0)), (), 1.0, 0.1, 2.0 * RADIUS,
               final_velocities=((-0.2, 0.0, 0.0), (0.6, _ACROSS, 0.0), (0.6, -_ACROSS, 0.0))),
    # a ball of 100 kg drives one of 1 kg against a wall: 31 collisions (Galperin 2003)
    FixedScene("two_balls_and_a_wall", "Two balls and a wall", "31 elastic collisions, which conserve all energy",
               (_ball("heavy", MASS_RATIO_OF_BALLS, -1.1, 0.0, 1.0), _ball("light", 1.0, -0.55, 0.0, 0.0)),
               (Obstacle("wall", (0.5, 2.0, 2.0), (0.25, 0.0, 0.0)),), 1.0, 3.0, 2.0 * RADIUS,
               final_velocities=((_HEAVY, 0.0, 0.0), (_LIGHT, 0.0, 0.0))),
    # a box lands flat on its face with four corners, or on four square feet with sixteen; thirteen are redundant
    FixedScene("box_on_four_corners", "Box dropped on four corners", _LANDS,
               (_box("box", 1.0, 0.5 * SIDE + _CLEAR, fall=1.0),), (FLOOR,), 0.5, 0.05, SIDE,
               final_velocities=((0.0, 0.0, 0.5),)),
    FixedScene("box_on_sixteen_corners", "Box dropped on sixteen corners", _LANDS,
               (_box("box", 1.0, 0.5 * SIDE + _CLEAR, _FEET, fall=1.0),), (FLOOR,), 0.5, 0.05, SIDE,
               final_velocities=((0.0, 0.0, 0.5),)),
    # a cube falls edge first into a right-angled groove, with eight corners at once; three are independent
    FixedScene("redundant_wedge", "Redundant wedge", "e = 1: the cube leaves with its initial speed",
               (_box("cube", 1.0, sqrt(2.0) * (0.5 * SIDE + _CLEAR), turn=_about_y(pi / 4), fall=1.0),),
               (_slope("left", -1.0), _slope("right", 1.0)), 1.0, 0.05, SIDE, final_velocities=((0.0, 0.0, 1.0),)),
    # four stacked boxes, each with a hundred times the mass of the one below
    FixedScene("heavy_stack", "Stack with mass ratio 10⁶",
               "no box moves; 1 g, 100 g, 10 kg and 1000 kg, the heaviest on top",
               tuple(_box(f"box {k + 1}", mass, (k + 0.5) * SIDE) for k, mass in enumerate((1e-3, 0.1, 10.0, 1000.0))),
               (FLOOR,), 0.0, 1.0, SIDE, WEIGHT),
    FixedScene("resting_box", "Resting box", "the box does not move", (_box("box", 1.0, 0.5 * SIDE),), (FLOOR,), 0.0,
               60.0, SIDE, WEIGHT),
)}  # fmt: skip


def fixed_scene(name: str) -> FixedScene:
    """Return the scene of that name."""
    if name not in FIXED_SCENES:
        raise ArgumentError("scene", name, one_of(name, FIXED_SCENES))
    return FIXED_SCENES[name]
