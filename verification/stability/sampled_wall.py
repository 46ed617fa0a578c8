"""A mass that a hand pushes against a sampled wall: exact motion between the samples, many walls at once.

    m ẍ = F_h − F_k − b ẋ      x > 0 inside the wall; F_k held from sample k to k + 1 (integrated exactly)

The wall gets quantised and delayed readings of the position; their difference over one step is the velocity. Under the
law "penalty" its force is (5), clamped. Under "impulses" the first reading inside the wall causes the impulse (20),
p = (1 + e) m γ⁻, applied as the force p/T over one step; the following readings cause (5).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.errors import ArgumentError
from iapb.names import one_of

Floats = NDArray[np.float64]
PENALTY, IMPULSES = "penalty", "impulses"
LAWS = (PENALTY, IMPULSES)

SETTLED_SPEED = 1e-3  # [m/s] as in the claims: a hundredth of the speed at contact
GROWN = 1.05  # neither rounding nor the hand alone explains speeds above this multiple of the initial speed
_SMALL = 1e-4  # for smaller c, T − φ suffers from cancellation, and three terms of the series err by c³/6 < 2e-13
_LAST = 0.25  # share of the time, at its end, in which a settled mass must be still


@dataclass(frozen=True)
class Loop:
    """All parameters except those of the walls; SI units.

    rate [Hz], mass [kg], device_damping b [N s/m], push of the hand [N], initial speed and distance from the wall,
    delay of readings and of forces [samples each], resolution of the sensor [m], restitution
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

    @property
    def step(self) -> float:
        """Step T [s]."""
        return 1.0 / self.rate

    def passive_damping(self, stiffness: Floats) -> Floats:
        """Largest virtual damping B that Colgate and Schenkel's condition b >= KT/2 + |B| allows; if negative, none."""
        return self.device_damping - 0.5 * stiffness * self.step


@dataclass(frozen=True)
class Contact:
    """Outcome at each wall (one entry per wall).

    settled : whether the mass is still in the last quarter of the time and has not grown
    settling_time : time from the first contact [s], infinite if the mass never settles
    grown : whether the mass exceeds GROWN times its initial speed later than 1 s after the first contact at any wall
    bounces : number of times that the mass leaves the wall
    penetration : largest penetration [m]; peak_force : largest force [N]
    rate_hardness : first rate of the force over the first speed [N/m] (Lawrence et al. 2000)
    """

    settled: NDArray[np.bool_]
    settling_time: Floats
    grown: NDArray[np.bool_]
    bounces: NDArray[np.int64]
    penetration: Floats
    rate_hardness: Floats
    peak_force: Floats


def touch_walls(loop: Loop, stiffness: Floats, damping: Floats, law: str) -> Contact:
    """Push the mass into each wall (n,) and return the outcomes.

    Parameters
    ----------
    stiffness : (n,) K [N/m]; damping : (n,) B [N s/m]
    law : "penalty" or "impulses"

    Raises
    ------
    ArgumentError
        An unknown law.
    """
    if law not in LAWS:
        raise ArgumentError("law", law, one_of(law, LAWS))
    steps = round(loop.seconds * loop.rate)
    x, v = np.full(len(stiffness), -loop.distance), np.full(len(stiffness), loop.speed)
    positions, speeds, forces = (np.empty((steps, len(stiffness))) for _ in range(3))
    wall = _Wall(loop, np.asarray(stiffness, float), np.asarray(damping, float), law, x)
    free, moved, held = _held_force(loop)
    for k in range(steps):
        force = wall.answer(x)
        acceleration = (loop.push - force) / loop.mass
        x, v = x + moved * v + held * acceleration, free * v + moved * acceleration
        diverged = ~(np.abs(x) < 1e3)  # metres: the motion diverges and would overflow
        x, v = np.where(diverged, 1e3, x), np.where(diverged, 1e3, v)
        positions[k], speeds[k], forces[k] = x, v, force
    return _watched(loop, positions, speeds, forces)


def _held_force(loop: Loop) -> tuple[float, float, float]:
    """Return E, φ, ψ of the exact step v⁺ = E v + φ a, x⁺ = x + φ v + ψ a with c = bT/m, E = exp(−c)."""
    T, c = loop.step, loop.device_damping * loop.step / loop.mass
    if c < _SMALL:
        return 1.0 - c + 0.5 * c * c, T * (1.0 - c / 2.0 + c * c / 6.0), T * T * (0.5 - c / 6.0 + c * c / 24.0)
    phi = -np.expm1(-c) / c * T
    return float(np.exp(-c)), float(phi), float((T - phi) * T / c)


class _Wall:
    """The sampled side: sensor, delays, law. It stores the readings and commands that are delayed."""

    def __init__(self, loop: Loop, stiffness: Floats, damping: Floats, law: str, start: Floats) -> None:
        self.loop, self.K, self.B, self.law = loop, stiffness, damping, law
        first = self._sense(start)
        self.readings = [first - loop.speed * loop.step, *[first] * (loop.delay + 1)]
        self.commands = [np.zeros_like(start) for _ in range(loop.delay)]

    def _sense(self, x: Floats) -> Floats:
        r = self.loop.resolution
        return np.round(x / r) * r if r > 0.0 else x.copy()

    def answer(self, x: Floats) -> Floats:
        """Return the actuator's force from this sample to the next."""
        self.readings = [*self.readings[1:], self._sense(x)]
        before, now = self.readings[0], self.readings[1]
        rate = (now - before) / self.loop.step
        force = np.where(now > 0.0, np.maximum(self.K * now + self.B * rate, 0.0), 0.0)
        if self.law == IMPULSES:
            new = (now > 0.0) & (before <= 0.0)
            blow = (1.0 + self.loop.restitution) * self.loop.mass * np.maximum(rate, 0.0) / self.loop.step
            force = np.where(new, blow, force)
        self.commands.append(force)
        return self.commands.pop(0)


def _watched(loop: Loop, positions: Floats, speeds: Floats, forces: Floats) -> Contact:
    steps, count = positions.shape
    time = loop.step * np.arange(1, steps + 1)
    inside = positions > 0.0
    first = np.where(inside.any(axis=0), inside.argmax(axis=0), steps - 1)
    moving = np.abs(speeds) > SETTLED_SPEED
    last_moving = np.where(moving.any(axis=0), steps - 1 - moving[::-1].argmax(axis=0), 0)
    settled = last_moving < (1.0 - _LAST) * steps
    late = time > time[first][None].min() + 1.0
    grown = (np.abs(speeds[late]) > GROWN * loop.speed).any(axis=0)
    left = (inside[:-1] & ~inside[1:]).sum(axis=0)
    pressed = (forces > 0.0).argmax(axis=0)
    columns: Any = np.arange(count)
    hardness = forces[pressed, columns] / loop.step / loop.speed
    return Contact(settled & ~grown, np.where(settled, np.maximum(time[last_moving] - time[first], 0.0), np.inf), grown,
                   left.astype(np.int64), positions.max(axis=0, initial=0.0), hardness, forces.max(axis=0))
