"""How much energy whole device loops leak at the hand's port: coupling, delay and sensors, beside b >= KT/2 + |B|.

A hand moves the device to and fro by half a millimetre, at several shares of half the sampling rate: so deep that a
coupler always presses, or across the surface of the wall, in and out of contact.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from verification.finding import Failure, attempt
from verification.stability.device_loop import (
    DeviceLoop,
    Floats,
    actuator_forces,
    entered_energy,
    needed_damping,
)

HALF = 5e-4  # [m] to and fro
# (world, K [N/m], B [N s/m]): the paper's coupler and walls, each without damping too; a wall 16 times as stiff
WALLS = {
    "quick": (("CBuc", 1e3, 0.0), ("CBuc", 1e3, 50.0), ("PB", 1e3, 0.0), ("PB", 1e3, 50.0), ("PB", 16e3, 0.0),
              ("IAPB", 1e3, 50.0)),
    "full": tuple((world, K, B) for world in ("CBuc", "PB", "IAPB") for K in (1e3, 4e3, 16e3) for B in (0.0, 50.0)),
}  # fmt: skip
SPEEDS = {"quick": (0.05, 0.3, 1.0), "full": (0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0)}  # of half the sampling rate
# name: (delay of readings and of forces [steps each], resolution [m]); late and coarse as in the report's device runs
SENSORS = {"ideal": (0, 0.0), "late": (1, 0.0), "coarse": (0, 1e-5), "late and coarse": (1, 1e-5)}
PRESSES, CROSSES = "presses", "crosses"
MOTIONS = (PRESSES, CROSSES)
_STEPS = 200


@dataclass(frozen=True)
class PortLeak:
    """One loop, worst over the motions of a kind.

    needed : least physical damping b without a leak [N s/m]
    leak, turned_over : at b = KT/2 + |B|, most energy that came out [J], and what coupler or wall and damper
        turned over on that motion [J]
    """

    loop: DeviceLoop
    sensors: str
    motion: str
    needed: float
    leak: float
    turned_over: float

    @property
    def ratio(self) -> float:
        """Damping needed over KT/2 + |B|."""
        return self.needed / self.loop.bound


def device_port_leaks(
    depth: str = "quick", progress: Callable[[int, int], None] | None = None, failures: list[Failure] | None = None,
) -> tuple[PortLeak, ...]:
    """Every wall, sensor and kind of motion."""
    chosen = [(wall, sensors, kind) for wall in WALLS[depth] for sensors in SENSORS for kind in MOTIONS]
    found = []
    for done, ((world, K, B), sensors, kind) in enumerate(chosen, start=1):
        delay, resolution = SENSORS[sensors]
        loop = DeviceLoop(world, K, B, delay=delay, resolution=resolution)
        name = f"hand's port in {world}, K = {K:g} N/m, B = {B:g} N s/m, {sensors} sensors, the hand {kind}"
        found.append(attempt(name, partial(_worst, loop, sensors, kind, SPEEDS[depth]), failures))
        if progress is not None:
            progress(done, len(chosen))
    return tuple(leak for leak in found if leak is not None)


def _worst(loop: DeviceLoop, sensors: str, kind: str, speeds: tuple[float, ...]) -> PortLeak:
    needed, worst = 0.0, (0.0, 0.0)
    for share in speeds:
        x = hand_positions(loop, kind, share)
        forces = actuator_forces(loop, x)
        needed = max(needed, needed_damping(x, forces, loop.dt))
        leak = max(0.0, -float(np.min(entered_energy(x, forces, loop.bound, loop.dt))))
        worst = max(worst, (leak, 2.0 * loop.bound * float(np.sum(np.diff(x) ** 2)) / loop.dt))
    return PortLeak(loop, sensors, kind, needed, *worst)


def hand_positions(loop: DeviceLoop, kind: str, share: float) -> Floats:
    """Positions (n + 1,) [m]: slowly to the middle of the motion, then to and fro at a share of half the rate."""
    swing = HALF * np.cos(np.pi * share * np.arange(_STEPS))
    quickest = float(np.max(np.abs(np.diff(swing)))) / loop.dt
    middle = HALF + loop.damping / loop.stiffness * quickest if kind == PRESSES else 0.0
    start = -loop.clearance
    way = np.linspace(start, middle + HALF, 1 + round(10.0 * (middle + HALF - start) / HALF), endpoint=False)
    return np.concatenate([way, middle + swing])
