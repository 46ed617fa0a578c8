"""Contact chatter: a ball that bounces for ever in finite time."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from iapb.run import Run
from iapb.scene import scene_from_text
from verification.hard_cases.case import Measured, TrajectoryCase
from verification.hard_cases.energy import largest_gain

_HEIGHT, _GRAVITY, _RESTITUTION, _RADIUS = 0.1, 9.81, 0.5, 0.1
# Each bounce is found up to a step late: bounce k is k steps late at speed v eᵏ, in all v Δt Σ k eᵏ = 2 v Δt for e = ½;
# the first is one step deep, and the height between two instants is off by as much.
_STEPS_LATE = 4.0
_NO_GAIN = 1e-12  # rounding of the ledger's sums over the run's steps

_SCENE = f"""
name: chatter
title: A ball that chatters to rest
source: textbook
rate: 1000
duration: 1.0
gravity: [0, {-_GRAVITY}]
bodies:
  - {{name: ball, joint: prismatic, axis: [0, 1], mass: 1.0, shapes: [{{kind: circle, radius: {_RADIUS}}}],
     position: [{_RADIUS + _HEIGHT}]}}
walls:
  - {{name: floor, kind: half_plane, point: [0, 0], normal: [0, 1]}}
contact:
  restitution: {_RESTITUTION}
  stiffness: 1e5
  damping: 200
  coherence_distance: 5e-3
"""


def chatter() -> TrajectoryCase:
    """Dropped from 0.1 m with e = ½."""
    return TrajectoryCase(
        "Contact chatter: infinitely many bounces in 0.43 s",
        "Zeno's bouncing ball; textbook",
        "the bounces accumulate: an event-driven method never gets past their end, one that steps may ring on",
        "the parabolas as far as a step can follow them, then rest",
        f"parabolas of heights h e²ᵏ in closed form, at rest from {_end():.4f} s on",
        scene_from_text(_SCENE),
        _measure,
    )


def exact_height(time: NDArray[np.float64]) -> NDArray[np.float64]:
    """Height of the ball above the floor [m] by the closed form."""
    fall = math.sqrt(2.0 * _HEIGHT / _GRAVITY)
    height = np.where(time < fall, _HEIGHT - 0.5 * _GRAVITY * time**2, 0.0)
    start, speed = fall, _GRAVITY * fall * _RESTITUTION
    while speed * speed / (2.0 * _GRAVITY) > np.finfo(float).eps * _HEIGHT:
        flown = time - start
        height = np.where((flown >= 0.0) & (flown < 2.0 * speed / _GRAVITY),
                          speed * flown - 0.5 * _GRAVITY * flown**2, height)  # fmt: skip
        start, speed = start + 2.0 * speed / _GRAVITY, speed * _RESTITUTION
    return np.asarray(height, np.float64)


def _end() -> float:
    """When the last bounce ends [s]: the geometric series of flights."""
    fall = math.sqrt(2.0 * _HEIGHT / _GRAVITY)
    return fall * (1.0 + 2.0 * _RESTITUTION / (1.0 - _RESTITUTION))


def _measure(run: Run) -> Measured:
    """Largest distance from the closed form, as a share of the drop."""
    off = float(np.abs(run.q[:, 0] - _RADIUS - exact_height(run.time)).max()) / _HEIGHT
    late = _STEPS_LATE * math.sqrt(2.0 * _GRAVITY * _HEIGHT) * run.dt / _HEIGHT
    return Measured(largest_gain(run), _NO_GAIN, off, late)
