"""Quantities of the motion of ordinary scenes, which cases.yaml names."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from verification.scenes.points import points_of

Floats = NDArray[np.float64]
ALL = slice(None)


class Motion(NamedTuple):
    """The motion of B bodies at n + 1 instants, in space (planar bodies lie in z = 0)."""

    time: Floats  # (n + 1,) [s]
    place: Floats  # (n + 1, B, 3) origins of the body frames [m], world axes
    turn: Floats  # (n + 1, B, 3, 3) rotations of the body frames

    def angle(self, body: int = 0) -> Floats:
        """Return the angle about z of a planar body over time [rad], without jumps."""
        return np.unwrap(np.arctan2(self.turn[:, body, 1, 0], self.turn[:, body, 0, 0]))


def moved(motion: Motion, axis: int = 0, body: int = 0) -> Any:
    """How far a body has moved along an axis at the end [m]."""
    return motion.place[-1, body, axis] - motion.place[0, body, axis]


def moved_along(motion: Motion, direction: list[float]) -> Any:
    """How far the first body has moved along a direction at the end [m]."""
    return (motion.place[-1, 0] - motion.place[0, 0]) @ direction


def at_end(motion: Motion, axis: int | list[int], body: int | slice = ALL) -> Any:
    """The coordinate of a body, or of all bodies, along an axis at the end [m]."""
    return motion.place[-1, body, axis]


def from_origin(motion: Motion, body: int) -> Any:
    """The distance of a body from the origin at the end [m]."""
    return np.linalg.norm(motion.place[-1, body])


def highest(motion: Motion, body: int, above: float, start: int) -> Any:
    """How far a body rises above a height from a step on [m]."""
    return motion.place[start:, body, 1].max() - above


def lowest(motion: Motion, above: float) -> Any:
    """How far above a height the first body stays [m]."""
    return motion.place[:, 0, 1].min() - above


def beyond(motion: Motion, start: float) -> float:
    """How far the first body goes on beyond a place along x [m]."""
    return max(0.0, float(motion.place[:, 0, 0].max()) - start)


def farthest(motion: Motion, size: float) -> Any:
    """The largest displacement of a body's origin, or of points at `size` from it, at any time
    [m]."""
    slid = np.linalg.norm(motion.place - motion.place[:1], axis=-1)
    turned = np.linalg.norm(motion.turn - motion.turn[:1], axis=(-2, -1)) / math.sqrt(2.0)
    return (slid + size * turned).max()


def heights(motion: Motion, touches: Sequence[float], above: float, axis: int) -> list[Any]:
    """The largest heights of the first body between touches [s], above the height at a touch
    [m]."""
    height = motion.place[:, 0, axis] - above
    flights = pairwise(np.searchsorted(motion.time, touches))
    return [height[start:end].max() for start, end in flights]


def lands(motion: Motion) -> list[Any]:
    """Height of the centre at the end, and how far the body still moves in the last tenth of a
    second [m]."""
    last = motion.place[motion.time > motion.time[-1] - 0.1, 0]
    return [motion.place[-1, 0, 2], np.ptp(last, axis=0).max()]


def leaving(motion: Motion, steps: int = 10, axis: int | slice = ALL) -> Any:
    """The mean velocity of each body over the last steps [m/s]."""
    went = motion.place[-1] - motion.place[-1 - steps]
    return (went / (motion.time[-1] - motion.time[-1 - steps]))[:, axis]


def turned(motion: Motion) -> Any:
    """How far the first body has turned at the end [rad]."""
    return motion.angle()[-1] - motion.angle()[0]


def turned_in_place(motion: Motion) -> list[Any]:
    """How far the first body has turned [rad] and moved [cm] at the end."""
    return [turned(motion), 100.0 * moved(motion), 100.0 * moved(motion, 1)]


def turned_and_left(motion: Motion, start: int) -> list[Any]:
    """How far the first body turns from a step on [rad], and its mean velocity along x then
    [m/s]."""
    angle = motion.angle()
    went = motion.place[-1, 0, 0] - motion.place[start, 0, 0]
    return [angle[-1] - angle[start], went / (motion.time[-1] - motion.time[start])]


def time_of_turn(motion: Motion, body: int, angle: float) -> Any:
    """When a body has turned clockwise beyond an angle [s]."""
    return motion.time[np.argmax(motion.angle(body) < angle)]


def at_instants(motion: Motion, arm: float, axes: Sequence[int]) -> Floats:
    """The points of all bodies at five instants [m]."""
    chosen = np.linspace(0, len(motion.time) - 1, 6)[1:].round().astype(int)
    return points_of(motion.place, motion.turn, arm, axes)[chosen]


def way(motion: Motion, arm: float, axes: Sequence[int]) -> Any:
    """The longest way of a point [m], in the axes of the first body's origin, so that the drift of
    a free body does not count."""
    ends = points_of(motion.place, motion.turn, arm, axes)
    steps = np.diff(ends - ends[:, :1, :1], axis=0)
    return np.linalg.norm(steps, axis=-1).sum(axis=0).max()
