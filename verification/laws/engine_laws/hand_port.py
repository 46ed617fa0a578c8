"""Passivity observer at the hand's port of a sampled wall (paper section VII, claim C20).

A device with physical damping b is moved along x(t); its position is read every T seconds, and the wall's force
F = K x_k + B (x_k − x_{k−1})/T (resisting, x > 0 inside, never pulling) is held until the next reading. Of all motions
through the same readings the straight one loses least in b, b (Δx)²/T per step, so for every motion

    E_n ≥ Σ F_k Δx_k + b Δx_k²/T ≥ (b − KT/2 − |B|) Σ Δx_k²/T:

convexity of ½Kx² for the spring, 2|ab| ≤ a² + b² for the damper. Hence b ≥ KT/2 + |B| suffices, and it is Colgate's and
Schenkel's condition (J. Robotic Systems 14, 1997). The inertia of the device stores energy and never makes any.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from iapb.contact.kernels.resting import normal_force
from verification.impacts import Floats
from verification.laws.bounds import LawResidual

Wall = Callable[[float, float, float, float], float]  # (depth x [m], its rate [m/s], K, B) -> resisting force [N]
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class WallInTheHand:
    """Constants of the wall and the device (SI), and the readings (n + 1,) of the device's position; the first is 0."""

    stiffness: float
    damping: float
    device_damping: float
    dt: float
    readings: Floats

    @property
    def bound(self) -> float:
        """KT/2 + |B|: the least device damping that is sure to be passive."""
        return 0.5 * self.stiffness * self.dt + abs(self.damping)


def draw(rng: np.random.Generator) -> WallInTheHand:
    """K, B, T over decades, b at the bound or above it, and motions from slow to as quick as the sampling."""
    K, B = 10.0 ** rng.uniform(1.0, 5.0), float(rng.choice([0.0, 1.0])) * 10.0 ** rng.uniform(-1.0, 3.0)
    dt = float(rng.choice([1.0 / 512.0, 1e-3, 1e-4]))
    x = hand_motion(rng, int(rng.integers(50, 800)))
    margin = float(rng.choice([1.0, 1.0, rng.uniform(1.0, 3.0)]))
    return WallInTheHand(K, B, margin * (0.5 * K * dt + abs(B)), dt, x - x[0])


def hand_motion(rng: np.random.Generator, n: int) -> Floats:
    """Readings of a sine up to half the sampling rate, a walk, or both, some millimetres wide."""
    k = np.arange(n + 1)
    sine = np.sin(np.pi * rng.uniform(0.0, 1.0) * k + rng.uniform(0.0, 6.3)) + rng.uniform(-1.0, 1.0)
    walk = np.cumsum(rng.normal(size=n + 1)) / np.sqrt(n)
    return np.asarray(1e-3 * 10.0 ** rng.uniform(-2.0, 1.0) * (rng.uniform() * sine + rng.uniform() * walk))


def quickest_motion(K: float, B: float, b: float, dt: float, steps: int = 4000, half: float = 5e-4) -> WallInTheHand:
    """Slowly into the wall, so deep that it always pushes, then forth and back by `half` [m] at half the sampling rate.

    That is the motion that a wall feeds most.
    """
    depth = 2.0 * half + 4.0 * B * half / (K * dt)
    entering = np.linspace(0.0, depth, steps // 4)
    return WallInTheHand(K, B, b, dt, np.concatenate([entering, depth + half * (-1.0) ** np.arange(steps)]))


def ours(depth: float, rate: float, K: float, B: float) -> float:
    """The engine's penalty (5), clamped, at one contact."""
    return float(normal_force(-depth, -rate, K, B, True)) if depth > 0.0 else 0.0


def observed_energy(case: WallInTheHand, wall: Wall) -> Floats:
    """Energy (n,) [J] that the hand has put in by the end of each step, on the straightest motion."""
    x, change = case.readings, np.diff(case.readings)
    rate = np.concatenate([[0.0], change / case.dt])[:-1]
    force = np.array([wall(float(a), float(r), case.stiffness, case.damping)
                      for a, r in zip(x[:-1], rate, strict=True)])  # fmt: skip
    return np.asarray(np.cumsum(force * change + case.device_damping * change**2 / case.dt))


def leak(case: WallInTheHand, wall: Wall) -> float:
    """Most energy [J] that came out of the port beyond what had gone in."""
    return max(0.0, -float(np.min(observed_energy(case, wall), initial=0.0)))


def hand_port_is_passive(case: WallInTheHand, subject: Wall) -> LawResidual:
    """Leak over the energy that wall and damper turned over; each of the n sums rounds."""
    turnover = (case.device_damping + case.bound) * float(np.sum(np.diff(case.readings) ** 2)) / case.dt
    relative = leak(case, subject) / turnover if turnover > 0.0 else 0.0
    return LawResidual("hand_port", relative, 4.0 * len(case.readings) * EPS)
