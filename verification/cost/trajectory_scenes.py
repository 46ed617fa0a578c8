"""Three motions with an event-driven truth, for every engine: a cradle, a bouncing ball, a landing peg."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import cos, sin, sqrt

from reference.simulators import FixedScene, fixed_scene
from reference.simulators.fixed_scenes import FLOOR, RADIUS, WEIGHT
from reference.simulators.scene import Cuboid, Obstacle, RigidBody, Sphere

_BOUNCE, _FALL, _SPEED = 0.7, 0.1037, 1.0  # e, height [m] above the floor and speed [m/s] downwards at the start
_PEG = (0.021, 0.0105, 0.0105)  # [m] the paper's peg, a third side added
_TILT, _PUSH = 0.05, (-0.8, 0.0, -1.0)  # [rad] about y, [m/s2] towards wall and floor


def cradle() -> FixedScene:
    """The fixed set's, until all four collisions are over."""
    return replace(fixed_scene("elastic_cradle"), title="cradle, e = 1")


def bouncing_ball() -> FixedScene:
    """A ball falls, and is caught in flight after its fifth bounce."""
    ball = RigidBody("ball", 1.0, (0.4 * RADIUS**2,) * 3, (Sphere(RADIUS),), (0.0, 0.0, RADIUS + _FALL),
                     velocity=(0.0, 0.0, -_SPEED))  # fmt: skip
    duration, gravity = 0.75, -WEIGHT[2]
    landing = sqrt(_SPEED**2 + 2.0 * gravity * _FALL)
    time, speed = (landing - _SPEED) / gravity, _BOUNCE * landing
    while time + 2.0 * speed / gravity < duration:
        time, speed = time + 2.0 * speed / gravity, _BOUNCE * speed
    end = ((0.0, 0.0, speed - gravity * (duration - time)),)
    return FixedScene("bouncing_ball", "bouncing ball, e = 0.7", "parabolas", (ball,), (FLOOR,), _BOUNCE, duration,
                      2.0 * RADIUS, WEIGHT, end)  # fmt: skip


def peg_landing() -> FixedScene:
    """A tilted peg is driven into a corner without bounce: edge after edge comes to lie on the floor and the wall."""
    wall = Obstacle("wall", (0.5, 2.0, 2.0), (-0.25, 0.0, 0.75))
    half = 0.5 * _PEG[0]
    peg = RigidBody("peg", 2.0, (0.005,) * 3, (Cuboid(_PEG),), (half + 0.0131, 0.0, 0.5 * _PEG[2] + 0.0087),
                    (0.0, sin(0.5 * _TILT), 0.0, cos(0.5 * _TILT)))  # fmt: skip
    return FixedScene("peg_landing", "peg into a corner, e = 0", "every impact plastic", (peg,), (FLOOR, wall), 0.0,
                      0.185, _PEG[0], _PUSH)  # fmt: skip


TRAJECTORY_SCENES: dict[str, Callable[[], FixedScene]] = {
    made.__name__: made for made in (cradle, bouncing_ball, peg_landing)
}
