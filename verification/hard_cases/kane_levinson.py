"""Kane and Levinson's double pendulum: its tip strikes a rough floor, and Newton's law with friction makes energy.

Two uniform rods of 1 m and 1 kg hang from a hinge at 22.6° and 28.1° from the vertical, angles of the triangles 5-12-13
and 8-15-17, near the 20° and 30° of the source: every sine and cosine is a fraction.
"""

from __future__ import annotations

import math

import numpy as np

from iapb.run import Run
from iapb.scene import scene_from_text
from verification.hard_cases.case import HardCase, Measured, TrajectoryCase
from verification.hard_cases.energy import largest_gain
from verification.hard_cases.frictional import FrictionalCase
from verification.hard_cases.judge_impact import NEWTON_COULOMB
from verification.hard_cases.judge_trajectory import COULOMB

_SOURCE = "Kane and Levinson, Dynamics: Theory and Applications (1985); Kane (1984); angles and speeds ours"
_S1, _C1, _S2, _C2 = 5 / 13, 12 / 13, 8 / 17, 15 / 17
_MASS = np.array([[4 / 3, 0.5 * (_C1 * _C2 + _S1 * _S2)], [0.5 * (_C1 * _C2 + _S1 * _S2), 1 / 3]])
_NORMAL, _TANGENT = np.array([[_S1, _S2]]), np.array([[_C1, _C2]])
_VELOCITY = np.array([-0.1, -0.2])
_RESTITUTION, _FRICTION = 0.5, 0.5
# Rounding of three digits at the root where the gain is cut to nothing, and far above any other rounding here: a real
# gain of this law is of order one.
_NO_GAIN = 1e-12


def double_pendulum_without_friction() -> HardCase:
    """The paper's collision: assumption (iii) leaves friction out."""
    return HardCase(
        "Kane and Levinson's double pendulum, frictionless impact",
        _SOURCE,
        "the two rods turn each other: the tip's effective mass is a fifth of a rod's",
        "½ (1 − e²) γ²/W is lost, as Theorem 1 says",
        _MASS,
        _NORMAL,
        _VELOCITY,
        _RESTITUTION,
    )


def double_pendulum_with_friction() -> HardCase:
    """The famous gain: Newton's law in the normal, Coulomb's in the tangential direction."""
    return FrictionalCase(
        "Kane and Levinson's double pendulum, impact with friction",
        _SOURCE,
        "friction reverses the slip: with Newton's and Coulomb's laws as they stand the energy triples",
        "restitution is met and no energy gained: friction is reduced to what the impact can pay for",
        _MASS,
        _NORMAL,
        _VELOCITY,
        _RESTITUTION,
        methods=("factored", NEWTON_COULOMB),
        tangent=_TANGENT,
        friction=_FRICTION,
    )


_SCENE = f"""
name: kane_levinson
title: Kane and Levinson's double pendulum on a rough floor
source: "{_SOURCE}"
rate: 2000
duration: 0.5
gravity: [0, -9.81]
bodies:
  - name: upper
    joint: revolute
    mass: 1.0
    center_of_mass: [0.5, 0]
    inertia: 0.08333333333333333
    position: [{math.atan2(5, 12) - math.pi / 2!r}]
  - name: lower
    parent: upper
    joint: revolute
    origin: [1, 0]
    mass: 1.0
    center_of_mass: [0.5, 0]
    inertia: 0.08333333333333333
    shapes:
      - {{kind: circle, radius: 1.0e-6, center: [1, 0]}}
    position: [{math.atan2(8, 15) - math.atan2(5, 12)!r}]
    velocity: [-0.1]
walls:
  - {{name: floor, kind: half_plane, point: [0, {-(_C1 + _C2) - 1e-3!r}], normal: [0, 1]}}
contact:
  restitution: {_RESTITUTION}
  friction: {_FRICTION}
  stiffness: 1e4
  damping: 100
  coherence_distance: 1e-2
"""


def double_pendulum_motion() -> TrajectoryCase:
    """The same pendulum falling on the floor from 1 mm, for half a second of bounces."""
    return TrajectoryCase(
        "Kane and Levinson's double pendulum, its motion",
        _SOURCE,
        "a bounce with friction may throw it higher than it fell",
        "never more energy than it fell with; Newton's and Coulomb's laws step by step do not promise that",
        "energy balance: kinetic and potential energy never exceed those of the start",
        scene_from_text(_SCENE),
        _measure,
        worlds=("IAPB", "PB", "ideal", COULOMB),
    )


def _measure(run: Run) -> Measured:
    return Measured(largest_gain(run), _NO_GAIN, math.nan, math.nan)
