"""Measures of motions with a law in closed form: contact chatter, a sampled wall at Colgate's bound,
a wedged peg, a cradle."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from iapb.run import Run
from verification.hard_cases.case import NO_GAIN, Measured

# --- a ball that chatters
# --------------------------------------------------------------------------------------
_HEIGHT = 0.1
_GRAVITY = 9.81
_RESTITUTION = 0.5
_RADIUS = 0.1
# Each bounce is up to one step late: bounce k is k steps late at speed v eᵏ, in sum v Δt Σ k eᵏ = 2
# v Δt for e = ½. The first bounce penetrates by one step, and the height between two instants has
# an error of one step, too.
_STEPS_LATE = 4.0


def exact_height(time: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the height of the ball above the floor [m] by the closed form: flights whose speeds
    fall by e; the drop is the second half of the first one."""
    fall = math.sqrt(2.0 * _HEIGHT / _GRAVITY)
    speeds = _GRAVITY * fall * _RESTITUTION ** np.arange(60)
    flights = 2.0 * speeds / _GRAVITY
    starts = np.cumsum(flights) - flights - fall
    of = np.searchsorted(starts, time, side="right") - 1
    flown = time - starts[of]
    return np.maximum(speeds[of] * flown - 0.5 * _GRAVITY * flown**2, 0.0)


def chatter(run: Run) -> Measured:
    """Measure the largest distance of a ball dropped from 0.1 m with e = ½ from the closed form,
    relative to the height of the drop."""
    off = float(np.abs(run.q[:, 0] - _RADIUS - exact_height(run.time)).max()) / _HEIGHT
    late = _STEPS_LATE * math.sqrt(2.0 * _GRAVITY * _HEIGHT) * run.dt / _HEIGHT
    return Measured(off, late)


# --- a sampled wall: it is passive if b > K T / 2 + |B|; otherwise its spring can create energy. At
# 2000 times the stiffness K = 2 b / T of the bound, T² K / m = 1.95, half of the value at which the
# step diverges.
# -------------------
_PHYSICAL_DAMPING = 0.5  # b [N s/m] of the device of scenes/wall_1d.yaml
# of tool and device, hand, coupling, in SI units
_MASS = 2.0
_FORCE = 0.4
_COUPLING = 100.0
_COUPLING_DAMPING = 70.0
_RADIUS_OF_HANDLE = 0.01
# Rounding over 1,536 steps, which each new contact amplifies: measured 1e-9 of the distance; faults
# are far larger.
_SAME_NUMBERS = 1e-6


def wall(run: Run) -> Measured:
    """Measure the largest distance of the tool from the sampled law, relative to its initial gap to
    the wall."""
    stiffness = run.scene_resolved["contact"]["stiffness"]
    truth = sampled_wall(run.law, stiffness, run.steps, run.dt)
    way = abs(float(run.q[0, 0])) - _RADIUS_OF_HANDLE
    return Measured(float(np.abs(run.q[:, 0] - truth).max()) / way, _SAME_NUMBERS)


def sampled_wall(law: str, stiffness: float, steps: int, dt: float) -> NDArray[np.float64]:
    """Return the tool positions (steps + 1,) of two coupled masses and a wall that is sampled once
    per step."""
    x = [-0.03, -0.03]
    v = [0.1, 0.1]
    touching = False
    path = [x[0]]
    for _ in range(steps):
        coupling = _COUPLING * (x[1] - x[0]) + _COUPLING_DAMPING * (v[1] - v[0])
        depth = x[0] + _RADIUS_OF_HANDLE
        struck = law == "impulse-augmented penalty" and depth >= 0.0 and not touching and v[0] > 0.0
        touching = depth > 0.0
        impulse = -_MASS * v[0] if struck else 0.0
        push = 0.0 if struck or law == "rigid constraints" else -stiffness * max(depth, 0.0)
        v[0] += (impulse + dt * (_FORCE + push + coupling)) / _MASS
        if law == "rigid constraints" and depth + dt * v[0] > 0.0:
            impulse = -_MASS * (v[0] + depth / dt)
            v[0] = -depth / dt
        v[1] += dt * (_FORCE + push + impulse / dt - coupling - _PHYSICAL_DAMPING * v[1]) / _MASS
        x = [place + dt * speed for place, speed in zip(x, v, strict=True)]
        path.append(x[0])
    return np.array(path)


# --- a peg wedged in its hole
# ------------------------------------------------------------------------------------
# from scenes/peg_hole.yaml: [N/m], [N], slope
_STIFFNESS = 1000.0
_HAND = 0.4
_DRAFT = 0.01
_END = 0.0105  # y [m] of the peg's centre when its front meets the hole's end
_STOPPED = 1e-9  # largest speed [m/s] of a body at rest: ten decades below that of the impact
# Relative tolerance of the springs' rest position: after one second the coupling has settled to
# 1e-8.
_SETTLED = 1e-4


def wedged_peg(run: Run) -> Measured:
    """Measure the distance of the peg that the hand pushes to the end of its hole from the rest
    position, in units of the static depth; a peg that still moves adds one."""
    sine = _DRAFT / math.hypot(1.0, _DRAFT)
    depth = _HAND / (2.0 * _STIFFNESS + 4.0 * _STIFFNESS * sine**2)
    place = _END if run.law == "rigid constraints" else _END - depth
    off = float(np.abs(run.q[-1] - [0.0, place, 0.0]).max()) / depth
    moving = float(np.abs(run.v[-1]).max() > _STOPPED)
    return Measured(off + moving, _SETTLED)


# --- Newton's cradle whose balls touch
# --------------------------------------------------------------------------- Radii and positions
# are binary fractions, so that gaps are exactly 0, or decimal fractions, so that gaps are rounding.
_CRADLE_STIFFNESS = 1e4
# Undamped springs that are sampled once per step conserve energy up to the second-order error 2 K
# Δt² / m.
_BY_SPRINGS = 2.0 * _CRADLE_STIFFNESS * 1e-6


def cradle(run: Run, sunk: float = 0.0) -> Measured:
    """Measure the relative error of momentum and energy at the end; both must equal those of the
    first ball. The balls may be sunk into each other at the start [m].

    A contact counts as new until it overlaps, so contacts with a gap of exactly 0 collide like
    those with a gap of one micrometre. If they counted as old, springs would transmit the impact.
    Springs that are sampled once per step gain up to 2 K Δt²/m, which is 0.21 % here, as the world
    PB shows.
    """
    v = run.v[-1]
    off = max(abs(float(v.sum()) - 1.0), abs(float(v @ v) - 1.0))
    stored = 3.0 * 0.5 * _CRADLE_STIFFNESS * sunk**2 / 0.5  # share of the energy in springs
    # Sampling the springs once per step adds up to a tenth.
    return Measured(off, _BY_SPRINGS, gain_allowed=NO_GAIN + 1.1 * stored)
