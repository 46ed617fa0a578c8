"""Closed forms for what force laws need of the device: the truths by which the search is judged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from verification.port import BareDevice

T = 1e-3
K = 2000.0
B = 2.0
JUMP = 0.2  # [N]


def linear_need(response, dt, angles=None):
    """T/2 · max λmax Herm[(1 − z⁻¹) H]/(1 − cos θ): the damping that a linear law F = −H(z) x needs."""
    angles = np.geomspace(1e-4, np.pi, 20001) if angles is None else angles
    z = np.exp(1j * angles)
    H = np.asarray(response(z))
    own = (1.0 - 1.0 / z) * H if H.ndim == 1 else (1.0 - 1.0 / z)[:, None, None] * H
    top = (
        own.real
        if H.ndim == 1
        else np.linalg.eigvalsh(0.5 * (own + np.conj(np.swapaxes(own, 1, 2))))[:, -1]
    )
    return float(0.5 * dt * np.max(top / (1.0 - np.cos(angles))))


def spring(x, v):
    return -K * x


def damped(x, v):
    return -K * x - B * v


def one_sided(x, v):
    return -max(K * x + B * v, 0.0) if x > 0.0 else 0.0


def jump(x, v):
    return -K * x - (JUMP if x > 0.00123 else 0.0)


def dry_friction(x, v):
    return -JUMP * np.sign(v)


class Filtered:
    """A spring and a damper whose velocity passes a first-order filter."""

    def __init__(self, stiffness=K, damping=B, tau=3e-3):
        self.stiffness = stiffness
        self.damping = damping
        self.tau = tau

    def reset(self, dt):
        self.share = self.tau / (self.tau + dt)
        self.rate = 0.0

    def step(self, x, v):
        self.rate = self.share * self.rate + (1.0 - self.share) * v
        return -self.stiffness * x - self.damping * self.rate


class Renewed:
    """A spring whose force is renewed every second period."""

    def reset(self):
        self.k = 0
        self.force = 0.0

    def step(self, x, v):
        if self.k % 2 == 0:
            self.force = -K * x
        self.k += 1
        return self.force


@dataclass
class Linear:
    """F = −K x − B v_f, with the velocity through a first-order filter; numbers or matrices."""

    stiffness: float | np.ndarray
    damping: float
    tau: float = 0.0

    def reset(self, dt):
        self.share = self.tau / (self.tau + dt)
        self.rate = 0.0

    def step(self, x, v):
        self.rate = self.share * self.rate + (1.0 - self.share) * v
        return (
            -(self.stiffness * x if np.ndim(self.stiffness) == 0 else self.stiffness @ x)
            - self.damping * self.rate
        )

    def need(self, device):
        """The damping that it needs of a device."""
        share = self.tau / (self.tau + device.dt)

        def response(z):
            rate = self.damping * (1.0 - share) / (1.0 - share / z) * (1.0 - 1.0 / z) / device.dt
            own = np.asarray(self.stiffness)
            whole = own + (rate if own.ndim == 0 else rate[:, None, None] * np.eye(len(own)))
            late = z ** -float(device.delay)
            return whole * (late if own.ndim == 0 else late[:, None, None])

        return linear_need(response, device.dt)


def random_wall(k):
    """Random linear wall number k, and its device without damping; every fifth is in the plane."""
    rng = np.random.default_rng([7, k])
    rate = float(rng.choice([500.0, 1000.0, 4000.0]))
    stiffness = 10.0 ** rng.uniform(2.0, 4.0)
    damping = (
        float(rng.choice([0.0, 1.0, -0.3])) * stiffness / rate * 10.0 ** rng.uniform(-1.0, 0.7)
    )
    tau = float(rng.choice([0.0, rng.uniform(0.0, 10.0)])) / rate
    delay = int(rng.choice([0, 0, 1, 2, 4]))
    if k % 5 == 4:
        root = rng.normal(size=(2, 2))
        stiffness = stiffness * (root @ root.T / np.trace(root @ root.T) + 0.1 * np.eye(2))
    return Linear(stiffness, damping, tau), BareDevice(rate, delay=delay)


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
        x = np.linspace(self.at[0], self.at[-1], 200001)
        force = np.interp(x, self.at, self.force)
        work = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(x))])
        return 1.0001 * float(np.max(work) - np.interp(0.0, x, work))


def random_table(k):
    """Random force table number k, and its device without damping."""
    rng = np.random.default_rng([8, k])
    entries = int(rng.integers(8, 60))
    at = np.concatenate([np.linspace(-0.01, 0.01, 2 * entries + 1)])
    force = np.cumsum(rng.normal(size=len(at))) * 10.0 ** rng.uniform(-2.0, 0.0)
    return ForceTable(at, force - force[entries]), BareDevice(1000.0)


@dataclass
class Rounded:
    """A spring and damper, perhaps clamped to push only, behind an encoder."""

    stiffness: float
    damping: float
    clamped: bool

    def __call__(self, x, v):
        force = -self.stiffness * x - self.damping * v
        return min(force, 0.0) if self.clamped and x >= 0.0 else 0.0 if self.clamped else force

    def needs(self, device):
        """The damping and the friction that are enough together."""
        step = device.resolution
        b = 0.5 * self.stiffness * device.dt + abs(self.damping)
        return b, 0.5 * self.stiffness * step + abs(self.damping) * step / device.dt


def random_rounded(k):
    """Random wall behind an encoder, number k, and its device."""
    rng = np.random.default_rng([9, k])
    stiffness = 10.0 ** rng.uniform(2.0, 4.0)
    damping = float(rng.choice([0.0, 1.0])) * stiffness * 1e-3 * rng.uniform(0.0, 2.0)
    return Rounded(stiffness, damping, bool(k % 2)), BareDevice(
        resolution=10.0 ** rng.uniform(-6.0, -4.0)
    )
