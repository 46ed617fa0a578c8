"""Energy leaks of whole device loops at the hand's port, with coupling, delay and sensors, relative to b = KT/2 + |B|.

A hand moves the device back and forth by half a millimetre, at several shares of half the sampling rate. The motion is
either so deep that the coupler always presses, or crosses the surface of the wall, in and out of contact.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from verification.finding import MIXED, REFUTED, Failure, Part, Table, of_each, table_of, titled
from verification.stability.device_loop import (
    COORDINATION,
    COUPLER_WORLD,
    DeviceLoop,
    Floats,
    actuator_forces,
    entered_energy,
    needed_damping,
)

HALF = 5e-4  # [m] amplitude of the motion
# (world, K [N/m], B [N s/m]): the paper's coupler and walls, also without damping; and a wall 16 times as stiff
WALLS = {
    "quick": (("CBuc", 1e3, 0.0), ("CBuc", 1e3, 50.0), ("PB", 1e3, 0.0), ("PB", 1e3, 50.0), ("PB", 16e3, 0.0),
              ("IAPB", 1e3, 50.0)),
    "full": tuple((world, K, B) for world in ("CBuc", "PB", "IAPB") for K in (1e3, 4e3, 16e3) for B in (0.0, 50.0)),
}  # fmt: skip
SPEEDS = {"quick": (0.05, 0.3, 1.0), "full": (0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0)}  # of half the sampling rate
# name: (delay of readings and of forces [steps each], resolution [m]), as in the report's device runs
SENSORS = {"ideal": (0, 0.0), "late": (1, 0.0), "coarse": (0, 1e-5), "late and coarse": (1, 1e-5)}
PRESSES, CROSSES = "presses", "crosses"
MOTIONS = (PRESSES, CROSSES)
_STEPS = 200


COLUMNS = titled((
    "world", "stiffness [N/m]", "damping [N s/m]", "sensors", "the hand", "KT/2 + |B| [N s/m]",
    "with the coordination's gains [N s/m]", "damping needed [N s/m]", "needed / bound", "leak at the bound [mJ]",
    "leak / energy exchanged",
)).columns  # fmt: skip


def device_port_leaks(depth: str = "quick", failures: list[Failure] | None = None) -> Table:
    """Measure the energy leak for every wall, sensor and kind of motion."""

    def leak(case: tuple[tuple[str, float, float], str, str]) -> list[dict[str, Any]]:
        wall, sensors, kind = case
        delay, resolution = SENSORS[sensors]
        return [_worst(DeviceLoop(*wall, delay=delay, resolution=resolution), sensors, kind, SPEEDS[depth])]

    def name(case: tuple[tuple[str, float, float], str, str]) -> str:
        (world, K, B), sensors, kind = case
        return f"hand's port in {world}, K = {K:g} N/m, B = {B:g} N s/m, {sensors} sensors, the hand {kind}"

    note = ("The complete device loop at 512 Hz. The hand moves to and fro by 0.5 mm; the worst of several speeds is "
            "shown. Stiffness and damping are the coupler's in CBuc, else the wall's, with the coordination gains of "
            "Table I. Leak: energy that the hand draws from the loop at b = KT/2 + |B|.")
    return table_of(COLUMNS, of_each(product(WALLS[depth], SENSORS, MOTIONS), leak, failures, name), note=note)


def _worst(loop: DeviceLoop, sensors: str, kind: str, speeds: tuple[float, ...]) -> dict[str, Any]:
    """Return the least damping without a leak, and the largest leak at b = KT/2 + |B|, over all speeds."""
    needed, leak, turned_over = 0.0, 0.0, 0.0
    for share in speeds:
        x = hand_positions(loop, kind, share)
        forces = actuator_forces(loop, x)
        needed = max(needed, needed_damping(x, forces, loop.dt))
        came_out = max(0.0, -float(np.min(entered_energy(x, forces, loop.bound, loop.dt))))
        turned = 2.0 * loop.bound * float(np.sum(np.diff(x) ** 2)) / loop.dt
        leak, turned_over = max((leak, turned_over), (came_out, turned))
    return {
        "world": loop.world, "stiffness": loop.stiffness, "damping": loop.damping, "sensors": sensors,
        "the hand": kind, "KT/2 + |B|": loop.bound, "with the coordination's gains": loop.bound_with_coordination,
        "damping needed": needed, "needed / bound": needed / loop.bound, "leak at the bound": 1e3 * leak,
        "leak / energy exchanged": leak / turned_over if leak else 0.0,
    }  # fmt: skip


def coupled(ports: Table) -> Part:
    """Return the part on the coupler at a rigid wall: whether its bound prevents leaks, and which cases need more."""
    rows = [row for row in ports.records() if row["world"] == COUPLER_WORLD]

    def most(motion: str, ideal: bool) -> float:
        return max(float(row["needed / bound"]) for row in rows
                   if row["the hand"] == motion and (row["sensors"] == "ideal") == ideal)  # fmt: skip

    pressing = most(PRESSES, True)
    return Part(
        f"In CBuc, with the tool on a rigid wall, a pressing hand and ideal sensors, the device is passive once its "
        f"damping reaches {pressing:.4f} times b = KT/2 + |B| of the coupler. Late or coarse sensors need up to "
        f"{most(PRESSES, False):.3g} times that damping. A hand that moves in and out of contact needs up to "
        f"{most(CROSSES, True):.3g} times, because the coupler is already stretched when it switches on.",
        MIXED if pressing <= 1.0 + 1e-9 else REFUTED)  # fmt: skip


def coordinated(ports: Table) -> Part:
    """Return the part on the additional damping that the four-channel controller needs."""
    rows = [row for row in ports.records() if row["world"] != COUPLER_WORLD]
    needed = [row["damping needed"] for row in rows]
    whole = max(row["damping needed"] / row["with the coordination's gains"] for row in rows)
    return Part(
        "With the four-channel controller the bound KT/2 + |B| of the wall alone is not enough: the device needs up to "
        f"{max(row['needed / bound'] for row in rows):.3g} times as much damping, {min(needed):.3g} to "
        f"{max(needed):.3g} N s/m, because the hand also feels the coordination's damping of {COORDINATION[1]:g} N "
        f"s/m. The bound with the gains of wall and coordination added is not sufficient either: up to {whole:.3g} "
        "times its value is needed. Colgate's bound does not apply here because the tool moves. The paper's device has "
        "no damping.", MIXED)  # fmt: skip


def hand_positions(loop: DeviceLoop, kind: str, share: float) -> Floats:
    """Return positions (n + 1,) [m]: a slow entry, then a cosine at the given share of half the sampling rate."""
    swing = HALF * np.cos(np.pi * share * np.arange(_STEPS))
    quickest = float(np.max(np.abs(np.diff(swing)))) / loop.dt
    middle = HALF + loop.damping / loop.stiffness * quickest if kind == PRESSES else 0.0
    start = -loop.clearance
    way = np.linspace(start, middle + HALF, 1 + round(10.0 * (middle + HALF - start) / HALF), endpoint=False)
    return np.concatenate([way, middle + swing])
