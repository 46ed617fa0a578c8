"""Stability of a haptic loop: tool, coupling and device, sampled exactly as the engine steps them.

Near rest a loop is linear. Let x be the tool's displacement, y the device's as the coupling reads
it, N the delay each way [steps] and w = z − 1. A step of the engine then says

    (M w²/Δt² + E + C) x = C y,    C = z K + w B/Δt,
    z²ᴺ (M w²/Δt² + w b/Δt) y = C (x − y) − s E x,

where b is the damping of the device, E the contact and the joint damping of the tool, and s = 1 if
the device gets the contact force (four-channel), else 0. The motion grows if the determinant of
these 2 d equations has a root outside the unit circle. The turns of its phase count the roots
inside, which is exact for any delay. Without delay, contact and b, tool and device move against
each other with m/2, and the limit is K Δt²/(m/2) + 2 B Δt/(m/2) = 4. This includes Colgate's
condition B Δt/(m/2) < 2.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from iapb.numerics.schema import Floats

SLOW = 30.0  # s: a motion that needs longer to grow e-fold counts as stable
# s: the same for a unilateral coupler that acts before the tool touches, which it soon does
SOON = 0.02
CLOSE = 1e-6  # per step: a root closer to the unit circle counts as on it
NEXT = 1e-7  # rad: distance of two points that give the rate of a phase
FINEST = 1e-12  # rad: smallest distance of two points on the circle
AT_ONCE = 1_000_000  # numbers of the matrices that are held at a time
MARGIN = {"stiffness": 1.5, "damping": 1.5}  # factors with which a loop that follows advice holds
T = TypeVar("T")


@dataclass(frozen=True)
class HapticLoop:
    """A linear loop of d coordinates.

    mass : M of the tool and of the device (d, d)
    stiffness, damping : K and B of the coupling (d,)
    device_damping : b (d,); joint_damping : of the tool's joints (d,)
    delay : N [steps] each way; dt : [s]
    spring, damper : stiffness and damping of the contact (d, d) [N/m, N s/m]
    implicit : whether the contact's force follows the velocity after the step
    reflects : whether the device gets the contact force
    within : time [s] of a growth that counts
    """

    mass: Floats
    stiffness: Floats
    damping: Floats
    device_damping: Floats
    joint_damping: Floats
    delay: int
    dt: float
    spring: Floats
    damper: Floats
    implicit: bool
    reflects: bool
    within: float = SLOW

    @property
    def grows(self) -> bool:
        """Whether a small motion grows e-fold within that time.

        The roots inside a circle are half the turns of the determinant along its upper half. Points
        are added until the determinant's logarithm changes by less than 1 between two.
        """
        size = len(self.mass) * (2 * self.delay + 4)
        angle = np.linspace(0.0, math.pi, 2 * size + 1)
        phase, rate = self._determinant(angle)
        while True:
            step = np.diff(angle)
            after = np.flatnonzero((np.maximum(rate[1:], rate[:-1]) * step > 1.0) & (step > FINEST))
            if not len(after):
                turns = float(np.angle(phase[1:] / phase[:-1]).sum()) / math.pi
                return round(turns) < size
            middle = 0.5 * (angle[after] + angle[after + 1])
            new_phase, new_rate = self._determinant(middle)
            angle = np.insert(angle, after + 1, middle)
            phase = np.insert(phase, after + 1, new_phase)
            rate = np.insert(rate, after + 1, new_rate)

    def _determinant(self, angle: Floats) -> tuple[Any, Floats]:
        """Return the phase of the determinant at points of the circle, and the rate of its
        logarithm."""
        parts = 1 + 4 * len(angle) * self.mass.size // AT_ONCE
        found = [
            np.linalg.slogdet(self._equations(part + shift))
            for part in np.array_split(angle, parts)
            for shift in (0.0, NEXT)
        ]
        here, there = (
            [np.concatenate(values) for values in zip(*found[k::2], strict=True)] for k in (0, 1)
        )
        change = there[1] - here[1] + 1j * np.angle(there[0] / here[0])
        return here[0], np.abs(change) / NEXT

    def _equations(self, angle: Floats) -> Any:
        """Return the matrix (n, 2 d, 2 d) of the equations on the circle, just outside the unit
        circle."""
        exponent = (max(self.dt / self.within, CLOSE) + 1j * angle)[:, None, None]
        z = np.exp(exponent)
        w = np.expm1(exponent)
        rate = w / self.dt  # times z: a velocity after the step, without: before it
        inertia = self.mass * rate**2
        coupling = z * np.diag(self.stiffness) + rate * np.diag(self.damping)
        contact = z * self.spring + z * rate * np.diag(self.joint_damping)
        if self.implicit:
            contact = contact + z * rate * (self.dt * self.spring + self.damper)
        else:
            contact = contact + rate * self.damper
        device = np.exp(2 * self.delay * exponent) * (inertia + rate * np.diag(self.device_damping))
        tool = np.concatenate([inertia + contact + coupling, -coupling], axis=2)
        told = np.concatenate([self.reflects * contact - coupling, device + coupling], axis=2)
        return np.concatenate([tool, told], axis=1)


def hold(loops: Iterable[HapticLoop]) -> bool:
    """Whether no loop grows, nor with all gains larger by the margin."""
    return not any(loop.grows or scaled(loop, MARGIN).grows for loop in loops)


def scaled(loop: HapticLoop, factors: dict[str, Any]) -> HapticLoop:
    """Return a loop with some fields multiplied by factors."""
    values = {name: getattr(loop, name) * factor for name, factor in factors.items()}
    return replace(loop, **values)


def nearest(holds: Callable[[T], bool], candidates: Sequence[T]) -> T | None:
    """Return the first of the candidates from which on something holds; None if it holds for
    none."""
    k = bisect_left(candidates, True, key=holds)
    return candidates[k] if k < len(candidates) else None
