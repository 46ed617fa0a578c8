"""Cases of sticking friction: a nudged box that stops, and a box and a stack of boxes that stick on
a slope.

A friction force that is constant over a step can reverse the motion that it should stop. Law (6) of
the paper is an explicit damper μ N / v_threshold, which is unstable if μ N Δt > 2 m v_threshold.
Here μ N Δt / (m v_threshold) is 4.9 for one box at the default threshold.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from iapb.run import Run
from verification.hard_cases.case import (
    NO_GAIN,
    Measured,
    TrajectoryCase,
    largest_gain,
    scene_named,
)

_G = 9.81
_MU = 0.5
_ENGINE = ("IAPB", "PB", "IAPB-friction")
_SECOND_ORDER = (
    0.02  # relative error of the lean per box: the contact point lies at half the overlap
)


def nudged_box() -> TrajectoryCase:
    """A box that starts at 0.2 m/s on a flat floor."""
    speed = 0.2
    way = speed**2 / (2.0 * _MU * _G)
    stopped = speed / (_MU * _G)

    def measure(run: Run) -> Measured:
        """Measure the largest distance from the stopping place, from a tenth of a second after the
        stop on.

        The position of a first-order step is wrong by at most the distance of one step.
        """
        x = run.q[run.time > stopped + 0.1, 0]
        return Measured(
            largest_gain(run), NO_GAIN, float(np.abs(x - way).max()) / way, speed * run.dt / way
        )

    return TrajectoryCase(
        "Nudged box",
        "Coulomb's law; a box on a floor",
        "a friction force that is constant over a step can reverse the motion and drive the box across the floor",
        "the box stops where Coulomb's law predicts and stays there",
        f"Coulomb's law in closed form: the box slides by v²/(2 μ g) = {1e3 * way:.4g} mm",
        scene_named("nudged_box"),
        measure,
        _ENGINE,
    )


def on_a_slope(name: str) -> TrajectoryCase:
    """Boxes of 1 kg on one another on a slope of 20 degrees, for ten seconds.

    The slabs of a stack oscillate on their springs without slipping.
    """
    scene = scene_named(name)
    count = len(scene.bodies)
    leans = _lean(scene, math.radians(20.0))

    def measure(run: Run) -> Measured:
        """Measure the distance of the upper box from its elastic deflection at the end, relative to
        the deflection."""
        off = abs(float(run.q[-1, 3 * (count - 1)]) - leans)
        return Measured(largest_gain(run), NO_GAIN, off / leans, _SECOND_ORDER * count)

    return TrajectoryCase(
        scene.title,
        "Coulomb's law; springs of (5)",
        "a sticking contact must not creep; lever arms couple normal and friction forces",
        f"the {'upper ' * (count > 1)}box moves by {1e6 * leans:.3g} μm as the contact springs deflect, then stays",
        "no contact slips, because tan 20° < μ; force and moment deflect the contact springs between two faces",
        scene,
        measure,
        _ENGINE,
    )


def _lean(scene: Any, slope: float) -> float:
    """Return the elastic displacement of the upper box's centre down the slope [m], to first order,
    without slip.

    Face k carries the moment g sin(slope) h (n − k)² / 2 of the boxes above it. The face rotates by
    this moment divided by K w² / 2. The centre of the upper box is (n − 1 − k) h + h / 2 above the
    face.
    """
    count = len(scene.bodies)
    width, height = scene.bodies[0].shapes[0].size
    stiffness = scene.contact.stiffness
    turns = [
        _G * math.sin(slope) * height * (count - k) ** 2 / (stiffness * width**2)
        for k in range(count)
    ]
    return sum(turn * height * (count - k - 0.5) for k, turn in enumerate(turns))
