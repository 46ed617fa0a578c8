"""How much energy whole device loops leak at the hand's port: coupling, delay and sensors, beside b >= KT/2 + |B|.

A hand moves the device to and fro by half a millimetre, at several shares of half the sampling rate: so deep that a
coupler always presses, or across the surface of the wall, in and out of contact.
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


COLUMNS = titled((
    "world", "stiffness [N/m]", "damping [N s/m]", "sensors", "the hand", "KT/2 + |B| [N s/m]",
    "with the coordination's gains [N s/m]", "damping needed [N s/m]", "needed / bound", "leak at the bound [mJ]",
    "of what was turned over",
)).columns  # fmt: skip


def device_port_leaks(depth: str = "quick", failures: list[Failure] | None = None) -> Table:
    """Measure every wall, sensor and kind of motion."""

    def leak(case: tuple[tuple[str, float, float], str, str]) -> list[dict[str, Any]]:
        wall, sensors, kind = case
        delay, resolution = SENSORS[sensors]
        return [_worst(DeviceLoop(*wall, delay=delay, resolution=resolution), sensors, kind, SPEEDS[depth])]

    def name(case: tuple[tuple[str, float, float], str, str]) -> str:
        (world, K, B), sensors, kind = case
        return f"hand's port in {world}, K = {K:g} N/m, B = {B:g} N s/m, {sensors} sensors, the hand {kind}"

    note = ("Whole device loops at 512 Hz, the hand moving 0.5 mm to and fro, worst over several speeds; stiffness and "
            "damping of the coupler in CBuc, else of the wall, with the coordination of Table I.")
    return table_of(COLUMNS, of_each(product(WALLS[depth], SENSORS, MOTIONS), leak, failures, name), note=note)


def _worst(loop: DeviceLoop, sensors: str, kind: str, speeds: tuple[float, ...]) -> dict[str, Any]:
    """The least damping without a leak, and at b = KT/2 + |B| the most energy that came out, over the speeds."""
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
        "of what was turned over": leak / turned_over if leak else 0.0,
    }  # fmt: skip


def coupled(ports: Table) -> Part:
    """Whether the coupler on a rigid wall leaks nothing from its bound on, and what asks for more."""
    rows = [row for row in ports.records() if row["world"] == COUPLER_WORLD]

    def most(motion: str, ideal: bool) -> float:
        return max(float(row["needed / bound"]) for row in rows
                   if row["the hand"] == motion and (row["sensors"] == "ideal") == ideal)  # fmt: skip

    pressing = most(PRESSES, True)
    return Part(
        f"A device coupled to a tool on a rigid wall, the hand pressing and the sensors ideal, leaks nothing from "
        f"b = KT/2 + |B| of the coupler on: it needs {pressing:.4f} of that. Late or coarse sensors need up to "
        f"{most(PRESSES, False):.3g} of it, and a hand that goes in and out of contact {most(CROSSES, True):.3g}: a "
        "coupler that switches on stretched brings energy of its own.",
        MIXED if pressing <= 1.0 + 1e-9 else REFUTED)  # fmt: skip


def coordinated(ports: Table) -> Part:
    """How much more the four-channel controller needs."""
    rows = [row for row in ports.records() if row["world"] != COUPLER_WORLD]
    needed = [row["damping needed"] for row in rows]
    whole = max(row["damping needed"] / row["with the coordination's gains"] for row in rows)
    return Part(
        f"With the four-channel controller the wall's own KT/2 + |B| is not enough: up to "
        f"{max(row['needed / bound'] for row in rows):.3g} of it is needed, {min(needed):.3g} to {max(needed):.3g} "
        f"N s/m, for the coordination's damping of {COORDINATION[1]:g} N s/m is felt in the hand as well. The gains of "
        f"both added, up to {whole:.3g} of the bound is needed: no bound here, for the tool moves. The paper's device "
        "has no damping.", MIXED)  # fmt: skip


def hand_positions(loop: DeviceLoop, kind: str, share: float) -> Floats:
    """Positions (n + 1,) [m]: slowly to the middle of the motion, then to and fro at a share of half the rate."""
    swing = HALF * np.cos(np.pi * share * np.arange(_STEPS))
    quickest = float(np.max(np.abs(np.diff(swing)))) / loop.dt
    middle = HALF + loop.damping / loop.stiffness * quickest if kind == PRESSES else 0.0
    start = -loop.clearance
    way = np.linspace(start, middle + HALF, 1 + round(10.0 * (middle + HALF - start) / HALF), endpoint=False)
    return np.concatenate([way, middle + swing])
