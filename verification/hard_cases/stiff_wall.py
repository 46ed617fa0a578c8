"""A sampled wall at and beyond Colgate's bound b > K T / 2 + |B|: where a spring becomes a source of energy."""

from __future__ import annotations

import math

import numpy as np

from iapb.run import Run
from iapb.scene import find_scene, load_scene
from verification.hard_cases.case import Measured, TrajectoryCase
from verification.hard_cases.energy import largest_gain

_SOURCE = "Colgate and Schenkel, J. Robotic Systems 14 (1997); scenes/wall_1d.yaml"
_LAW = (
    "Colgate and Schenkel's theorem: passive at the bound; beyond it no promise, so what is made is measured; "
    "the error is the speed left where a rigid wall leaves none, as a share of the largest, and is not judged"
)
_STEP, _PHYSICAL_DAMPING = 1.0 / 512.0, 0.5  # T [s], b [N s/m] of the scene's device
_BOUND = 2.0 * _PHYSICAL_DAMPING / _STEP  # K [N/m] with B = 0: 512
_NO_GAIN = 1e-12  # rounding of the ledger's sums over the run's steps


def wall_at_the_bound() -> TrajectoryCase:
    """K = 2 b / T exactly."""
    return _wall(1, "the last stiffness for which passivity is proved", "no energy from the wall in any world")


def wall_beyond_the_bound() -> TrajectoryCase:
    """Five hundred times that."""
    return _wall(500, "a penalty wall bounces the handle back faster than it came",
                 "an impulse takes the speed before the spring sees it: no energy from the wall")  # fmt: skip


def wall_far_beyond_the_bound() -> TrajectoryCase:
    """Two thousand times that: T² K / m = 1.95, half of where the step itself diverges."""
    return _wall(2000, "the spring alone carries lasting contact, and one step of it is as long as a bounce",
                 "impulses do not save a spring this stiff: only the rigid wall is passive")  # fmt: skip


def _wall(factor: int, why_hard: str, expected: str) -> TrajectoryCase:
    values = {"contact.stiffness": factor * _BOUND, "contact.damping": 0.0, "duration": 3.0}
    name = "Stiff wall at the Colgate bound" if factor == 1 else f"Stiff wall, {factor:,} times the Colgate bound"
    scene = load_scene(find_scene("wall_1d")).with_values(values)
    return TrajectoryCase(name, _SOURCE, why_hard, expected, _LAW, scene, _measure)


def _measure(run: Run) -> Measured:
    left = float(np.abs(run.v[-1]).max() / np.abs(run.v).max())
    return Measured(largest_gain(run), _NO_GAIN, left, math.nan)
