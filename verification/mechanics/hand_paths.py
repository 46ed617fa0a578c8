"""Paths of a hand that leads an arm by one point, through the arm's singular poses.

A path gives the hand's position as a function of the arc length s [m] from its start; it ends at `length`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

BEYOND = 1.15  # largest distance of the hand from the base, relative to the arm's reach


class Path(NamedTuple):
    """Position (2,) [m] at the arc length s [m], and the length [m] of the path."""

    place: Callable[[float], Floats]
    length: float


def stretch(start: Floats, reach: float) -> Path:
    """Return a line away from the base, beyond the arm's reach, and back: the arm is straight twice."""
    out = BEYOND * reach * start / np.linalg.norm(start)
    return along([start, out, start])


def across(start: Floats, reach: float) -> Path:
    """Return a line through the base to the other side and back: near the base the arm folds."""
    return along([start, -0.9 * reach * start / np.linalg.norm(start), start])


def whirl(start: Floats, reach: float) -> Path:
    """Return a path out to the full reach and once around the base: the arm stays straight on the circle."""
    direction = start / np.linalg.norm(start)
    way_out = abs(reach - float(np.linalg.norm(start)))
    first = float(np.arctan2(direction[1], direction[0]))

    def place(s: float) -> Floats:
        if s < way_out:
            return start + s / way_out * (reach * direction - start)
        angle = first + (s - way_out) / reach
        return reach * np.array([np.cos(angle), np.sin(angle)])

    return Path(place, way_out + 2.0 * np.pi * reach)


PATHS: dict[str, Callable[[Floats, float], Path]] = {"stretch": stretch, "across": across, "whirl": whirl}


def along(corners: list[Floats]) -> Path:
    """Return the polyline through the corners."""
    points = np.array(corners)
    ways = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])

    def place(s: float) -> Floats:
        return np.array([np.interp(s, ways, points[:, axis]) for axis in range(2)])

    return Path(place, float(ways[-1]))
