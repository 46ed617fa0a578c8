"""Passivity observer at the hand's port of a whole device scene: a unilateral coupler to a tool on a rigid wall.

Assume that b ≥ K_cpl T/2 + B_cpl, that e = 0, that the sensors are ideal, and that the hand, once in the wall, keeps
the coupler pressing. Then no motion extracts energy from the loop of coupler, tool, rigid contact and device, because
the tool rests and the coupler acts as the wall of `hand_port`. `verification.stability.device_port` measures the other
cases.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from verification.laws.bounds import LawResidual
from verification.laws.engine_laws.hand_port import EPS, hand_motion
from verification.stability.device_loop import (
    COUPLER_WORLD,
    RADIUS,
    DeviceLoop,
    Floats,
    actuator_forces,
    entered_energy,
)

Subject = Callable[[DeviceLoop, Floats], Floats]  # (loop, positions (n + 1,)) -> actuator forces (n,)
STEPS, WAY = 150, 10  # steps of the motion; how much slower the entry is, so that its damping adds little energy


@dataclass(frozen=True)
class HeldDevice:
    """A loop, the device's physical damping [N s/m], and the positions (n + 1,) [m] that the hand imposes."""

    loop: DeviceLoop
    device_damping: float
    positions: Floats


def draw(rng: np.random.Generator) -> HeldDevice:
    """Draw gains and masses over decades, b at or above the bound, and a slow entry followed by any pressing motion."""
    dt = float(rng.choice([1.0 / 512.0, 1e-3]))
    stiffness = 10.0 ** rng.uniform(1.0, 5.0)
    damping = float(rng.choice([0.0, 1.0])) * stiffness * dt * rng.uniform(0.0, 2.0)
    motion = hand_motion(rng, STEPS)
    quickest = float(np.max(np.abs(np.diff(motion))))
    motion += damping / stiffness * quickest / dt - float(np.min(motion))  # K z + B ż >= 0: it presses
    clearance = quickest / WAY
    way = np.linspace(-clearance, motion[0], int(WAY * (motion[0] + clearance) / quickest) + 1, endpoint=False)
    loop = DeviceLoop(COUPLER_WORLD, stiffness, damping, dt, 10.0 ** rng.uniform(-1.0, 1.0), clearance)
    margin = float(rng.choice([1.0, 1.0, rng.uniform(1.0, 3.0)]))
    return HeldDevice(loop, margin * loop.bound, np.concatenate([way, motion]))


def ours(loop: DeviceLoop, positions: Floats) -> Floats:
    """Actuator forces (n,) [N] of the engine's loop with the rigid contacts of `reference`."""
    return actuator_forces(loop, positions)


def device_port_is_passive(case: HeldDevice, subject: Subject) -> LawResidual:
    """Leak relative to the energy exchanged with coupler and damper.

    The tolerance covers the rounding of n sums and of the coupler's extension, which is a difference of two positions.
    """
    x, dt = case.positions, case.loop.dt
    leak = max(0.0, -float(np.min(entered_energy(x, subject(case.loop, x), case.device_damping, dt))))
    steps = np.diff(x)
    turnover = (case.device_damping + case.loop.bound) * float(np.sum(steps**2)) / dt
    places = RADIUS / float(np.sqrt(np.mean(steps**2)))
    return LawResidual("device_port", leak / turnover, 4.0 * len(x) * EPS * (1.0 + places))
