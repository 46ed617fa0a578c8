"""Passivity observer at the hand's port of a sampled wall (paper section VII, claim C20).

The hand moves a device with physical damping b along x(t). The device's position is read every T seconds, and the
wall's force F = K x_k + B (x_k − x_{k−1})/T (resisting, x > 0 inside, never pulling) is held until the next reading.
Among all motions through the same readings, uniform motion between them dissipates least in b, namely b (Δx)²/T per
step. Every motion therefore satisfies

    E_n ≥ Σ F_k Δx_k + b Δx_k²/T ≥ (b − KT/2 − |B|) Σ Δx_k²/T.

This uses the convexity of ½Kx² for the spring and 2|ab| ≤ a² + b² for the damper. Hence b ≥ KT/2 + |B| is sufficient;
this is the condition of Colgate and Schenkel (J. Robotic Systems 14, 1997). The inertia of the device stores energy but
never creates any.
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
        """KT/2 + |B|: the least device damping that guarantees passivity."""
        return 0.5 * self.stiffness * self.dt + abs(self.damping)


def draw(rng: np.random.Generator) -> WallInTheHand:
    """Draw K and B over decades, T, b at or above the bound, and a motion from slow to half the sampling rate."""
    K, B = 10.0 ** rng.uniform(1.0, 5.0), float(rng.choice([0.0, 1.0])) * 10.0 ** rng.uniform(-1.0, 3.0)
    dt = float(rng.choice([1.0 / 512.0, 1e-3, 1e-4]))
    x = hand_motion(rng, int(rng.integers(50, 800)))
    margin = float(rng.choice([1.0, 1.0, rng.uniform(1.0, 3.0)]))
    return WallInTheHand(K, B, margin * (0.5 * K * dt + abs(B)), dt, x - x[0])


def hand_motion(rng: np.random.Generator, n: int) -> Floats:
    """Return readings of a sine up to half the sampling rate plus a random walk; both have random amplitudes (mm)."""
    k = np.arange(n + 1)
    sine = np.sin(np.pi * rng.uniform(0.0, 1.0) * k + rng.uniform(0.0, 6.3)) + rng.uniform(-1.0, 1.0)
    walk = np.cumsum(rng.normal(size=n + 1)) / np.sqrt(n)
    return np.asarray(1e-3 * 10.0 ** rng.uniform(-2.0, 1.0) * (rng.uniform() * sine + rng.uniform() * walk))


def quickest_motion(K: float, B: float, b: float, dt: float, steps: int = 4000, half: float = 5e-4) -> WallInTheHand:
    """Return the motion to which a sampled wall gives most energy.

    The device enters the wall slowly, so deep that the wall always pushes. Then it moves back and forth by `half` [m]
    at half the sampling rate.
    """
    depth = 2.0 * half + 4.0 * B * half / (K * dt)
    entering = np.linspace(0.0, depth, steps // 4)
    return WallInTheHand(K, B, b, dt, np.concatenate([entering, depth + half * (-1.0) ** np.arange(steps)]))


def ours(depth: float, rate: float, K: float, B: float) -> float:
    """The engine's penalty force (5) [N] at one contact, clamped so that it never pulls."""
    return float(normal_force(-depth, -rate, K, B, True)) if depth > 0.0 else 0.0


def observed_energy(case: WallInTheHand, wall: Wall) -> Floats:
    """Energy (n,) [J] that the hand has supplied by the end of each step, for uniform motion between the readings."""
    x, change = case.readings, np.diff(case.readings)
    rate = np.concatenate([[0.0], change / case.dt])[:-1]
    force = np.array([wall(float(a), float(r), case.stiffness, case.damping)
                      for a, r in zip(x[:-1], rate, strict=True)])  # fmt: skip
    return np.asarray(np.cumsum(force * change + case.device_damping * change**2 / case.dt))


def leak(case: WallInTheHand, wall: Wall) -> float:
    """Largest net energy [J] that the port has returned to the hand."""
    return max(0.0, -float(np.min(observed_energy(case, wall), initial=0.0)))


def hand_port_is_passive(case: WallInTheHand, subject: Wall) -> LawResidual:
    """Leak relative to the energy exchanged with wall and damper; the tolerance covers the rounding of n sums."""
    turnover = (case.device_damping + case.bound) * float(np.sum(np.diff(case.readings) ** 2)) / case.dt
    relative = leak(case, subject) / turnover if turnover > 0.0 else 0.0
    return LawResidual("hand_port", relative, 4.0 * len(case.readings) * EPS)
