"""Faults of force laws, each with the name of the law of the kit that finds it. Those with a closed
form are in truths.

The sound wall has K = 2000 N/m and B = 2 N s/m at 1 kHz, and needs 3 N s/m; the device has 2 % more.
"""

from __future__ import annotations

import numpy as np

K = 2000.0
B = 2.0
DAMPING = 3.06


def wall(x, v, stiffness=K, damping=B):
    return -max(stiffness * x + damping * v, 0.0) if x > 0.0 else 0.0


def negative_friction(x, v):
    return wall(x, v) + 0.05 * np.sign(v)


def pole(x, v):
    return -1e-4 / (0.0101 - x) + 1e-4 / 0.0101 if x > 0.0 else 0.0


def not_a_number_deep_inside(x, v):
    return wall(x, v) if x < 0.006 else float("nan")


def raises_deep_inside(x, v):
    if x > 0.006:
        raise ValueError("too deep")
    return wall(x, v)


def returns_nothing_outside(x, v):
    return wall(x, v) if x > 0.0 else None


def bias(x, v):
    return wall(x, v) - 0.01


class Counting:
    """A law of the number k of the sample."""

    force = 0.0

    def reset(self):
        self.k = -1

    def step(self, x, v):
        self.k += 1
        self.force = self.at(x, v)
        return self.force


class Integral:
    """A controller with an integral term."""

    def reset(self, dt):
        self.sum = 0.0
        self.dt = dt

    def step(self, x, v):
        self.sum += x * self.dt
        return -K * x - 5e3 * self.sum


class StifferAfterDeep:
    """Stiffer on the way back from the deepest point."""

    def reset(self):
        self.deepest = 0.0

    def step(self, x, v):
        self.deepest = max(self.deepest, x)
        return wall(x, v, stiffness=K * (1.2 if x < 0.8 * self.deepest else 1.0))


class Vibrates(Counting):
    """Vibrates at 100 Hz where it is stiff."""

    def at(self, x, v):
        return wall(x, v) + (0.3 * np.sin(0.2 * np.pi * self.k) if x > 0.0 else 0.0)


class FreeTool:
    """A tool of 0.1 kg that takes the hand's velocity for nothing, and hits the wall by a coupler."""

    def reset(self, dt):
        self.dt = dt
        self.at = 0.0
        self.rate = 0.0

    def step(self, x, v):
        if x <= 0.0:
            self.at = x
            self.rate = v
            return 0.0
        pull = 500.0 * (x - self.at)
        self.rate += self.dt * (pull - (3e3 * self.at if self.at > 0.0 else 0.0)) / 0.1
        self.at += self.dt * self.rate
        return -pull


class Drifts(Counting):
    """Drifts with time."""

    def at(self, x, v):
        return wall(x, v) * (1.0 + 1e-6 * self.k)


class NoisyDamper:
    """A damper with noise."""

    rng = np.random.default_rng(0)

    def step(self, x, v):
        return wall(x, v) * (1.0 + 1e-9 * self.rng.normal())


class NeverForgets:
    """A warm start that is never cleared."""

    last = 0.0

    def step(self, x, v):
        NeverForgets.last = wall(x, v) + 1e-12 * NeverForgets.last
        return NeverForgets.last


class ImpulseAsForce:
    """(1 + e) m v [N s] at the first sample inside, handed over as a force [N]."""

    def reset(self):
        self.inside = False

    def step(self, x, v):
        new = x > 0.0 and not self.inside
        self.inside = x > 0.0
        return -2.0 * v if new else 0.0


def above_the_limit(x, v):
    return wall(x, 0.0)


def changes_position(x, v):
    x *= 1.0001
    return -K * x


def texture_in_a_fixed_direction(x, v):
    return np.array([0.2 * np.sin(2000.0 * x[1]), 0.0])


FAULTS = {
    "energy": [
        negative_friction,
        pole,
        Integral,
        StifferAfterDeep,
        Vibrates,
        FreeTool,
        texture_in_a_fixed_direction,
    ],
    "finite": [not_a_number_deep_inside, raises_deep_inside, returns_nothing_outside],
    "silent": [bias],
    "waiting": [Drifts],
    "repeatable": [NoisyDamper, NeverForgets],
    "tap": [ImpulseAsForce],
    "bounded": [above_the_limit],
    "arguments": [changes_position],
}
IN_THE_PLANE = {texture_in_a_fixed_direction, changes_position}
EVERY = [(law, fault) for law, faults in FAULTS.items() for fault in faults]
