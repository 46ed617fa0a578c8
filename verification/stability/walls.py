"""A mass that a hand pushes against a sampled wall: exact motion between the samples, many walls at
once.

    m ẍ = F_h − F_k − b ẋ

x > 0 is inside the wall; F_k is held from sample k to k + 1 (integrated exactly).
The wall gets quantised and delayed readings of the position; their difference over one step is the
velocity. Under the law "penalty" its force is (5), clamped. Under "impulses" the first reading
inside the wall causes the impulse (20), p = (1 + e) m γ⁻, applied as the force p/T over one step;
the following readings cause (5).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from scipy.linalg import expm

from reference import Floats
from verification.port.baselines.impulses import ImpulseWall
from verification.port.baselines.penalty import PenaltyWall

PENALTY = "penalty"
IMPULSES = "impulses"
PAPER_DAMPING = 50.0  # B of the paper's walls [N s/m]

SETTLED_SPEED = 1e-3  # [m/s] as in the claims: a hundredth of the speed at contact
# neither rounding nor the hand alone explains speeds above this multiple of the initial speed
GROWN = 1.05
_LAST = 0.25  # share of the time, at its end, in which a settled mass must be still

# Emulated encoder with a resolution of 1 µm, and a delay of one sample each way, as in the report's
# device runs.
LATE = (1, 1e-6)  # delay [samples], resolution [m]
GRIDS = {"quick": (17, 14), "full": (49, 40)}  # stiffnesses, dampings


@dataclass(frozen=True)
class Loop:
    """All parameters except those of the walls; SI units.

    rate [Hz], mass [kg], device_damping b [N s/m], push of the hand [N], initial speed and distance
    from the wall, delay of readings and of forces [samples each], resolution of the sensor [m],
    restitution
    """

    rate: float = 512.0
    mass: float = 2.0
    device_damping: float = 0.0
    push: float = 0.4
    speed: float = 0.1
    distance: float = 1e-3
    delay: int = 0
    resolution: float = 0.0
    restitution: float = 0.0
    seconds: float = 3.0

    def __str__(self) -> str:
        return f"{self.rate:g} Hz, delay {self.delay}, device damping {self.device_damping:g} N s/m"

    @property
    def step(self) -> float:
        """Step T [s]."""
        return 1.0 / self.rate


def touch_walls(loop: Loop, stiffness: Floats, damping: Floats, law: str) -> Floats:
    """Push the mass into each wall; return the time from the first contact to the last motion [s].

    It is infinite if the mass has not settled: in the last quarter of the time it is not still, or
    leaves the wall; or it exceeds GROWN times its initial speed later than 1 s after the first
    contact at any wall.

    Parameters
    ----------
    stiffness, damping : K [N/m] and B [N s/m] of the walls, in shapes that broadcast
    law : "penalty" or "impulses"
    """
    shape = np.broadcast_shapes(np.shape(stiffness), np.shape(damping))
    wall: Any = PenaltyWall(stiffness, damping)
    if law == IMPULSES:
        wall = ImpulseWall(wall, loop.mass, loop.restitution)
        wall.reset(loop.step)
    r = loop.resolution
    steps = round(loop.seconds * loop.rate)

    def sensed(x: Floats) -> Floats:
        return np.round(x / r) * r if r > 0.0 else x.copy()

    x = np.full(shape, -loop.distance)
    v = np.full(shape, loop.speed)
    first = sensed(x)
    # those that are delayed, oldest first
    readings = [first - loop.speed * loop.step, *[first] * (loop.delay + 1)]
    commands = [np.zeros(shape) for _ in range(loop.delay)]
    positions, speeds = (np.empty((steps, *shape)) for _ in range(2))
    free, moved, held = _held_force(loop)
    for k in range(steps):
        readings = [*readings[1:], sensed(x)]
        before, now = readings[:2]
        commands.append(wall.step(now, (now - before) / loop.step))
        acceleration = (loop.push + commands.pop(0)) / loop.mass
        x = x + moved * v + held * acceleration
        v = free * v + moved * acceleration
        diverged = ~(np.abs(x) < 1e3)  # metres: the motion diverges and would overflow
        x = np.where(diverged, 1e3, x)
        v = np.where(diverged, 1e3, v)
        positions[k] = x
        speeds[k] = v
    return _settles_after(loop, positions, speeds)


def _held_force(loop: Loop) -> tuple[float, float, float]:
    """Return E, φ, ψ of the exact step v⁺ = E v + φ a, x⁺ = x + φ v + ψ a under a held force, from the
    exponential of its matrix."""
    slowed = loop.device_damping / loop.mass
    motion = np.array([[0.0, 1.0, 0.0], [0.0, -slowed, 1.0], [0.0, 0.0, 0.0]])  # of x, v, a
    step = expm(loop.step * motion)
    return float(step[1, 1]), float(step[0, 1]), float(step[0, 2])


def _settles_after(loop: Loop, positions: Floats, speeds: Floats) -> Floats:
    steps = len(positions)
    time = loop.step * np.arange(1, steps + 1)
    inside = positions > 0.0
    first = np.where(inside.any(axis=0), inside.argmax(axis=0), steps - 1)
    moving = np.abs(speeds) > SETTLED_SPEED
    last_moving = np.where(moving.any(axis=0), steps - 1 - moving[::-1].argmax(axis=0), 0)
    left = inside[:-1] & ~inside[1:]
    at_the_end = round((1.0 - _LAST) * steps)
    bouncing = left[at_the_end:].any(axis=0)  # for ever, if slower than SETTLED_SPEED
    grown = (np.abs(speeds[time > time[first].min() + 1.0]) > GROWN * loop.speed).any(axis=0)
    settled = (last_moving < (1.0 - _LAST) * steps) & ~bouncing & ~grown
    return np.where(settled, np.maximum(time[last_moving] - time[first], 0.0), np.inf)


def loops() -> tuple[Loop, ...]:
    """Return the loops: 512 Hz and 1 kHz, ideal and delayed sensors, with and without physical
    damping.

    The paper's device has no physical damping.
    """
    return tuple(
        Loop(rate=rate, device_damping=b, delay=delay, resolution=r)
        for rate, (delay, r), b in product((512.0, 1000.0), ((0, 0.0), LATE), (0.0, 5.0))
    )


def grid(depth: str) -> tuple[Floats, Floats]:
    """Return stiffnesses of 0.1 to 1000 kN/m, and dampings of 0 and 1 to 3000 N s/m, including the
    paper's 50."""
    stiffnesses, dampings = GRIDS[depth]
    damping = np.concatenate([[0.0], np.geomspace(1.0, 3e3, dampings - 2), [PAPER_DAMPING]])
    return np.geomspace(1e2, 1e6, stiffnesses), np.sort(damping)
