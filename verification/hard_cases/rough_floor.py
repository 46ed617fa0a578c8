"""Dry friction at its edges: just below and above sliding, and Painlevé's rod, where rigid bodies have no answer."""

from __future__ import annotations

import math

import numpy as np

from iapb.run import Run
from iapb.scene import scene_from_text
from verification.hard_cases.case import Measured, TrajectoryCase
from verification.hard_cases.energy import largest_gain
from verification.hard_cases.judge_trajectory import COULOMB

_WORLDS = ("IAPB", "PB", COULOMB)
_G = 9.81
_NO_GAIN = 1e-12  # rounding of the ledger's sums over the run's steps

# --- a block pushed along the floor ---------------------------------------------------------------------------
_MU, _DURATION, _CREEP = 0.3, 0.2, 1e-3  # friction, [s], v_threshold of (6) [m/s]
# Law (6) creeps at up to v_threshold where Coulomb's sticks, and runs ahead by as much where it slides; a twentieth
# more for the first steps, in which the creep sets in.
_EXCUSED = 1.05

_BLOCK = """
name: pushed_block
title: A block pushed along the floor
source: textbook
rate: 4000
duration: {duration}
gravity: [0, -{g}]
bodies:
  - name: block
    joint: planar
    mass: 1.0
    inertia: 0.0020833333333333333
    shapes: [{{kind: box, size: [0.15, 0.05]}}]
    position: [0, {height}, 0]
walls:
  - {{name: floor, kind: half_plane, point: [0, 0], normal: [0, 1]}}
contact: {{stiffness: 1e4, damping: 100, friction: {mu}, friction_velocity: {creep}, coherence_distance: 2e-3}}
hand: {{body: block, point: [0, -{height}], force: [{force}, 0, 0]}}
"""


def sticking_threshold() -> TrajectoryCase:
    """A push of 0.99 μ m g."""
    return _pushed(0.99, "Sticking, 1 % below the threshold", "it sticks; law (6) creeps, at most at v_threshold")


def sliding_threshold() -> TrajectoryCase:
    """A push of 1.01 μ m g."""
    expected = "it slides by ½ 0.01 μ g t², under law (6) by at most v_threshold t more"
    return _pushed(1.01, "Sliding, 1 % above the threshold", expected)


def _pushed(share: float, name: str, expected: str) -> TrajectoryCase:
    height = 0.025 - _G / (2.0 * 1e4)  # sunk in by its own weight on two springs
    text = _BLOCK.format(duration=_DURATION, g=_G, height=height, mu=_MU, creep=_CREEP, force=share * _MU * _G)
    slide = 0.5 * max(share - 1.0, 0.0) * _MU * _G * _DURATION**2

    def measure(run: Run) -> Measured:
        """Distance from Coulomb's answer, in units of v_threshold times the duration."""
        off = abs(float(run.q[-1, 0]) - slide) / (_CREEP * _DURATION)
        return Measured(largest_gain(run), _NO_GAIN, off, _EXCUSED)

    return TrajectoryCase(
        name, "Coulomb's law; (6) of the paper is a regularized one",
        "one per cent of the force decides whether it moves", expected,
        f"Coulomb's law in closed form: {slide * 1e3:.4g} mm after {_DURATION:g} s",
        scene_from_text(text), measure, _WORLDS,
    )  # fmt: skip


# --- Painlevé's rod -------------------------------------------------------------------------------------------
_SINE, _COSINE, _ROUGH, _SPEED, _STIFF = 0.8, 0.6, 2.0, 1.0, 1e4
_LATE = 0.1  # share of the stopping time: the closed form holds the rod's angle, which turns by two degrees

_ROD = f"""
name: painleve_rod
title: Painlevé's rod
source: Painlevé (1895)
rate: 1000
duration: 0.1
gravity: [0, -{_G}]
bodies:
  - name: rod
    joint: planar
    mass: 1.0
    inertia: 0.08333333333333333
    shapes: [{{kind: circle, radius: 1.0e-6, center: [-0.5, 0]}}]
    position: [0, {0.5 * _SINE + 1e-6!r}, {math.atan2(_SINE, _COSINE)!r}]
    velocity: [-{_SPEED}, 0, 0]
walls:
  - {{name: floor, kind: half_plane, point: [0, 0], normal: [0, 1]}}
contact: {{stiffness: {_STIFF}, damping: 0, friction: {_ROUGH}, friction_velocity: 1e-3, coherence_distance: 5e-3}}
"""


def painleve_rod() -> TrajectoryCase:
    """A rod pushed over its lower end at μ = 2, where 1/m + … < 0: no finite force keeps the contact closed."""
    return TrajectoryCase(
        "Painlevé's rod: sliding without a finite answer",
        "Painlevé (1895); Génot and Brogliato (1999); Stewart (2000)",
        "the contact's inertia is negative while it slides: rigid bodies have no acceleration, springs blow up",
        "it jams: a rigid contact at once, a spring after the time in which its force has grown enough",
        f"springs: δ grows as cosh λt and the slip stops after {1e3 * _stopping_time():.1f} ms; rigid: at once",
        scene_from_text(_ROD),
        _measure_rod,
        _WORLDS,
    )


def _stopping_time() -> float:
    """When springs have stopped the slip [s]: δ̈ = g − p K δ with p < 0, and v₀ = q K ∫ δ dt, the angle held.

    p = W_nn − μ W_tn and q = μ W_tt − W_tn are the contact's normal and tangential response to the normal force.
    """
    from scipy.optimize import brentq

    p = 1.0 + 3.0 * _COSINE**2 - 3.0 * _ROUGH * _SINE * _COSINE
    q = _ROUGH * (1.0 + 3.0 * _SINE**2) - 3.0 * _SINE * _COSINE
    rate = math.sqrt(-p * _STIFF)
    wanted = -p * _SPEED / (q * _G)
    return float(brentq(lambda t: math.sinh(rate * t) / rate - t - wanted, 0.0, 20.0 / rate))


def _measure_rod(run: Run) -> Measured:
    """How far from the law's instant the slip stops, as a share of the springs' time."""
    slip = run.v[:, 0] + 0.5 * np.sin(run.q[:, 2]) * run.v[:, 2]
    stopped = np.flatnonzero(slip >= -run.scene_resolved["contact"]["friction_velocity"])
    instant = float(run.time[stopped[0]]) if len(stopped) else math.inf
    springs = _stopping_time()
    truth = 0.0 if run.law == "rigid constraints" else springs
    return Measured(largest_gain(run), _NO_GAIN, abs(instant - truth) / springs, _LATE)
