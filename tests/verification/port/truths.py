"""Closed forms for what force laws need of the device: the truths by which the search is judged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from verification.port import BareDevice
from verification.port.baselines.penalty import PenaltyWall

T = 1e-3
K = 2000.0
B = 2.0
JUMP = 0.2  # [N]
ANGLES = np.geomspace(1e-4, np.pi, 20001)


@dataclass
class Linear:
    """F = −K x − B v_f with the velocity through a first-order filter τ; K is a number or a matrix."""

    stiffness: float | np.ndarray = K
    damping: float = 0.0
    tau: float = 0.0

    def reset(self, dt):
        self.share = self.tau / (self.tau + dt)
        self.rate = 0.0

    def step(self, x, v):
        self.rate = self.share * self.rate + (1.0 - self.share) * v
        spring = self.stiffness @ x if np.ndim(self.stiffness) else self.stiffness * x
        return -spring - self.damping * self.rate

    def need(self, device):
        """T/2 · max λmax Herm[(1 − z⁻¹) H]/(1 − cos θ), the damping that F = −H(z) x needs."""
        z = np.exp(1j * ANGLES)[:, None, None]
        share = self.tau / (self.tau + device.dt)
        rate = (1.0 - share) / (1.0 - share / z) * (1.0 - 1.0 / z) / device.dt
        K = np.atleast_2d(self.stiffness)
        loop = (1.0 - 1.0 / z) * (K + self.damping * rate * np.eye(len(K))) / z**device.delay
        top = np.linalg.eigvalsh(loop + np.conj(np.swapaxes(loop, 1, 2)))[:, -1]
        return float(0.25 * device.dt * np.max(top / (1.0 - np.cos(ANGLES))))


class Renewed:
    """A spring whose force is renewed every second period."""

    def reset(self):
        self.k = 0
        self.force = 0.0

    def step(self, x, v):
        self.force = self.force if self.k % 2 else -K * x
        self.k += 1
        return self.force


@dataclass
class ForceTable:
    """A force table over −r ≤ x ≤ r: straight lines between random values, 0 at the start."""

    at: np.ndarray
    force: np.ndarray

    def __call__(self, x, v):
        return float(np.interp(x, self.at, self.force))

    def need(self, device):
        """T/2 times the steepest fall of the force, beside the energy stored at the start."""
        return 0.5 * device.dt * float(np.max(-np.diff(self.force) / np.diff(self.at)))

    @property
    def stored(self):
        """Potential energy at the start above the lowest [J], with a margin for the grid."""
        x = np.linspace(-0.01, 0.01, 200001)
        work = np.cumsum(np.interp(x, self.at, self.force)) * (x[1] - x[0])
        return 1.0001 * float(np.max(work) - work[100000])


def random_wall(k):
    """Random linear wall number k, and its device without damping; every fifth is in the plane."""
    rng = np.random.default_rng([7, k])
    rate = float(rng.choice([500.0, 1000.0, 4000.0]))
    stiffness = 10.0 ** rng.uniform(2.0, 4.0)
    damping = float(rng.choice([0.0, 1.0, -0.3])) * stiffness / rate
    damping *= 10.0 ** rng.uniform(-1.0, 0.7)
    tau = float(rng.choice([0.0, rng.uniform(0.0, 10.0)])) / rate
    delay = int(rng.choice([0, 0, 1, 2, 4]))
    if k % 5 == 4:
        root = rng.normal(size=(2, 2))
        stiffness = stiffness * (root @ root.T / np.trace(root @ root.T) + 0.1 * np.eye(2))
    return Linear(stiffness, damping, tau), BareDevice(rate, delay=delay)


def random_table(k):
    """Random force table number k, and its device without damping."""
    rng = np.random.default_rng([8, k])
    entries = int(rng.integers(8, 60))
    at = np.linspace(-0.01, 0.01, 2 * entries + 1)
    force = np.cumsum(rng.normal(size=len(at))) * 10.0 ** rng.uniform(-2.0, 0.0)
    return ForceTable(at, force - force[entries]), BareDevice()


def random_rounded(k):
    """Random wall behind an encoder, number k, and a device with what it needs: KT/2 + B beside
    KΔ/2 + BΔ/T."""
    rng = np.random.default_rng([9, k])
    stiffness = 10.0 ** rng.uniform(2.0, 4.0)
    damping = float(rng.choice([0.0, 1.0])) * stiffness * 1e-3 * rng.uniform(0.0, 2.0)
    step = 10.0 ** rng.uniform(-6.0, -4.0)
    need = 0.5 * stiffness * T + damping
    device = BareDevice(1.0 / T, need, need * step / T, step)
    return (PenaltyWall if k % 2 else Linear)(stiffness, damping), device
