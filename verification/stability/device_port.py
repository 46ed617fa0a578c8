"""The hand's port of a whole device scene: sensors, coupling, tool, contact law and actuators in
the engine's loop.

A hand moves the device along prescribed positions x_k, one per step. The loop answers with forces
F_k, which the actuators hold until the next sample. As for the wall alone
(`verification.laws.engine`), uniform motion between the positions dissipates least in the physical
damping b, and the device's inertia only stores energy. The hand therefore supplies at least

    E_n = Σ −F_k Δx_k + b Δx_k²/T,       and needed(n) = Σ F_k Δx_k / Σ Δx_k²/T

is the least b with E_n >= 0. In the world CBuc with e = 0 and ideal sensors, if the tool rests on
the wall, the coupler acts as a wall of stiffness K_cpl and damping B_cpl, so b >= K_cpl T/2 + B_cpl
is sufficient. With the four-channel controller the tool moves, and the force depends on wall,
coordination and the tool's inertia. No such bound is proved for this case; K and B are then the
wall's constants, and the study measures the b that the loop needs.

The four-channel coupling works without its channel for the hand's force, which needs a sensor: the
position channels act, and the channel for F_env.

The study moves the device back and forth by half a millimetre, at several shares of half the
sampling rate. The motion is either so deep that the coupler always presses, or crosses the surface
of the wall, in and out of contact.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product
from operator import truediv
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iapb.haptics.device import DeviceReading
from iapb.scene import Scene, scene_from_text
from iapb.simulation import Simulation
from reference.worlds import find_world
from verification.check import Check, Study
from verification.finding import MIXED, REFUTED, REPRODUCED, Part
from verification.impacts import Floats
from verification.table import Table

COUPLER_WORLD = "CBuc"
RADIUS = 0.01  # [m] of the tool, a disc that slides along x; the wall is at 0
COORDINATION = (100.0, 70.0)  # Table I: K_coord [N/m], B_coord [N s/m]


@dataclass(frozen=True)
class DeviceLoop:
    """A device and a tool in front of a wall (SI units).

    stiffness, damping : constants of the wall in the four-channel worlds, of the coupler in CBuc
    dt : the step T; mass, clearance : mass of the tool, and its initial distance from the wall
    delay : delay of the readings and of the forces [steps each]; resolution : of the position
        sensor
    """

    world: str
    stiffness: float
    damping: float
    dt: float = 1.0 / 512.0
    mass: float = 2.0
    clearance: float = 1e-3
    delay: int = 0
    resolution: float = 0.0

    @property
    def bound(self) -> float:
        """KT/2 + |B|: the lower bound on b in Colgate and Schenkel's condition [N s/m]."""
        return 0.5 * self.stiffness * self.dt + abs(self.damping)

    @property
    def bound_with_coordination(self) -> float:
        """KT/2 + |B| with the gains of the coordination, if there is one, added to those of the
        wall [N s/m]."""
        if self.world == COUPLER_WORLD:
            return self.bound
        return self.bound + 0.5 * COORDINATION[0] * self.dt + COORDINATION[1]

    def scene(self) -> Scene:
        """Return the scene with tool, wall and gains; e = 0."""
        own, gains = [self.stiffness, self.damping], COORDINATION
        wall = {"stiffness": own[0], "damping": own[1]} if self.world != COUPLER_WORLD else {}
        couplings = {
            "four_channel": {"stiffness": [gains[0]], "damping": [gains[1]]},
            "unilateral": {"stiffness": own[:1], "damping": own[1:]},
        }
        return scene_from_text(
            json.dumps(
                {
                    "name": "device_loop",
                    "rate": 1.0 / self.dt,
                    "duration": 1.0,
                    "bodies": [
                        {
                            "name": "tool",
                            "joint": "prismatic",
                            "axis": [1, 0],
                            "mass": self.mass,
                            "shapes": [{"kind": "circle", "radius": RADIUS}],
                            "position": [-RADIUS - self.clearance],
                        }
                    ],
                    "walls": [
                        {"name": "wall", "kind": "half_plane", "point": [0, 0], "normal": [-1, 0]}
                    ],
                    "contact": {"forces": "paper", "restitution": 0.0, **wall},
                    "device": {},
                    "couplings": couplings,
                    "hand": {"body": "tool", "force": [0, 0, 0]},
                }
            )
        )


class MovedDevice:
    """A device that a hand moves along positions (n + 1,), read through sensors; it records the
    forces applied to it."""

    def __init__(self, positions: Floats, loop: DeviceLoop) -> None:
        step = loop.resolution
        sensed = np.round(positions / step) * step if step > 0.0 else positions
        rate = np.concatenate([[0.0], np.diff(sensed)]) / loop.dt
        late = np.zeros(loop.delay)
        self._q, self._v = np.concatenate([late + sensed[0], sensed]), np.concatenate([late, rate])
        self._forces: list[float] = []

    def read(self) -> DeviceReading:
        """Return the quantised, delayed position, and its difference over one step as the
        velocity."""
        k = len(self._forces)
        return DeviceReading(self._q[k : k + 1].copy(), self._v[k : k + 1].copy())

    def apply(self, force: ArrayLike) -> None:
        """Record the force and advance the hand by one step."""
        self._forces.append(float(np.asarray(force)[0]))

    def held_forces(self, delay: int) -> Floats:
        """Return the actuator force of each step: the command of `delay` steps before, and 0 in the
        first steps."""
        return np.array([0.0] * delay + self._forces)[: len(self._forces)]


def actuator_forces(loop: DeviceLoop, positions: Floats) -> Floats:
    """Return the actuator forces (n,) [N] of the steps for positions (n + 1,) [m].

    Position 0 is where the tool touches the wall; positive is into the wall. The tool starts at
    rest at its clearance from the wall; the positions should start there, too.
    """
    scene, world = loop.scene(), find_world(loop.world)
    device = MovedDevice(positions - RADIUS, loop)
    simulation = Simulation(scene, world.law, world.coupling_in(scene), device=device)
    for _ in range(len(positions) - 1):
        simulation.step()
    return device.held_forces(loop.delay)


def leaked(positions: Floats, forces: Floats, device_damping: float, dt: float) -> float:
    """Return the largest net energy [J] that the hand has drawn by the end of a step; 0 if it never
    draws any."""
    change = np.diff(positions)
    supplied = np.cumsum(
        -forces * change + device_damping * change**2 / dt
    )  # by the hand, at least
    return max(0.0, -float(np.min(supplied)))


def needed_damping(positions: Floats, forces: Floats, dt: float) -> float:
    """Return the least b [N s/m] for which the hand extracts no energy on this motion."""
    change = np.diff(positions)
    got_out, moved = np.cumsum(forces * change), np.cumsum(change**2) / dt
    shares = np.divide(got_out, moved, out=np.zeros_like(moved), where=moved > 0.0)
    return max(0.0, float(np.max(shares)))


HALF = 5e-4  # [m] amplitude of the motion
# (world, K [N/m], B [N s/m]): the paper's coupler and walls, also without damping; and a wall 16
# times as stiff
WALLS = {
    "quick": (
        ("CBuc", 1e3, 0.0),
        ("CBuc", 1e3, 50.0),
        ("PB", 1e3, 0.0),
        ("PB", 1e3, 50.0),
        ("PB", 16e3, 0.0),
        ("IAPB", 1e3, 50.0),
    ),
    "full": tuple(
        (world, K, B)
        for world in ("CBuc", "PB", "IAPB")
        for K in (1e3, 4e3, 16e3)
        for B in (0.0, 50.0)
    ),
}
SPEEDS = {
    "quick": (0.05, 0.3, 1.0),
    "full": (0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0),
}  # of half the sampling rate
# name: (delay of readings and of forces [steps each], resolution [m]), as in the report's device
# runs
SENSORS = {"ideal": (0, 0.0), "late": (1, 0.0), "coarse": (0, 1e-5), "late and coarse": (1, 1e-5)}
PRESSES, CROSSES = "presses", "crosses"
MOTIONS = (PRESSES, CROSSES)
_STEPS = 200


Case = tuple[tuple[str, float, float], str, str]  # wall, sensors, motion


def _leak(study: Study, case: Case) -> dict[str, Any]:
    """Return the least damping without a leak, and the largest leak at b = KT/2 + |B|, over all
    speeds."""
    wall, sensors, kind = case
    delay, resolution = SENSORS[sensors]
    loop, needed, leak, turned_over = (
        DeviceLoop(*wall, delay=delay, resolution=resolution),
        0.0,
        0.0,
        0.0,
    )
    for share in SPEEDS[study.depth]:
        x = hand_positions(loop, kind, share)
        forces = actuator_forces(loop, x)
        needed = max(needed, needed_damping(x, forces, loop.dt))
        came_out = leaked(x, forces, loop.bound, loop.dt)
        turned = 2.0 * loop.bound * float(np.sum(np.diff(x) ** 2)) / loop.dt
        leak, turned_over = max((leak, turned_over), (came_out, turned))
    return {
        "world": loop.world,
        "stiffness [N/m]": loop.stiffness,
        "damping [N s/m]": loop.damping,
        "sensors": sensors,
        "the hand": kind,
        "KT/2 + |B| [N s/m]": loop.bound,
        "with the coordination's gains [N s/m]": loop.bound_with_coordination,
        "damping needed [N s/m]": needed,
        "needed / bound": needed / loop.bound,
        "leak at the bound [mJ]": 1e3 * leak,
        "leak / energy exchanged": leak / turned_over if leak else 0.0,
    }


def coupled(ports: Table) -> Part:
    """Return the part on the coupler at a rigid wall: whether its bound prevents leaks, and which
    cases need more."""
    most: dict[tuple[str, bool], float] = {}
    for row in ports.where(world=COUPLER_WORLD).records():
        case = row["the hand"], row["sensors"] == "ideal"
        most[case] = max(most.get(case, 0.0), row["needed / bound"])
    return Part.of(
        "CBuc at a rigid wall: the least device damping at which the hand draws no energy, as a "
        "multiple of Colgate's "
        "bound KT/2 + |B| of the coupler",
        f"{most[PRESSES, True]:.4f} if the hand keeps pressing (late or "
        f"coarse sensors: up to {most[PRESSES, False]:.3g}); {most[CROSSES, True]:.3g} if it "
        f"moves in and out of "
        f"contact (up to {most[CROSSES, False]:.3g}), because the coupler is already stretched "
        f"when it switches on",
        "at most 1",
        _at_most_one(most.values()) if most[PRESSES, True] <= 1.0 + 1e-9 else REFUTED,
    )


def coordinated(ports: Table) -> Part:
    """Return the part on the additional damping that the four-channel controller needs."""
    found = ports.only(world != COUPLER_WORLD for world in ports["world"])
    needed, sums = found["damping needed"], found["with the coordination's gains"]
    return Part.of(
        "Four-channel coupling at a wall of springs: the least device damping at which the hand "
        "draws no energy, as a "
        "multiple of Colgate's bound for the wall alone",
        f"up to {max(found['needed / bound']):.3g}: the device "
        f"needs {min(needed):.3g} to {max(needed):.3g} N s/m, because the hand also feels the "
        f"coupling's damping of "
        f"{COORDINATION[1]:g} N s/m. Up to {max(map(truediv, needed, sums)):.3g} times the bound "
        f"for wall and coupling "
        "together",
        "at most 1, which is proved for CBuc only",
        _at_most_one(found["needed / bound"]),
    )


def _at_most_one(ratios: Iterable[float]) -> str:
    """Return the verdict on ratios that should be at most 1, up to rounding."""
    held = [ratio <= 1.0 + 1e-9 for ratio in ratios]
    return REPRODUCED if all(held) else MIXED if any(held) else REFUTED


def hand_positions(loop: DeviceLoop, kind: str, share: float) -> Floats:
    """Return positions (n + 1,) [m]: a slow entry, then a cosine at the given share of half the
    sampling rate."""
    swing = HALF * np.cos(np.pi * share * np.arange(_STEPS))
    quickest = float(np.max(np.abs(np.diff(swing)))) / loop.dt
    middle = HALF + loop.damping / loop.stiffness * quickest if kind == PRESSES else 0.0
    start = -loop.clearance
    way = np.linspace(
        start, middle + HALF, 1 + round(10.0 * (middle + HALF - start) / HALF), endpoint=False
    )
    return np.concatenate([way, middle + swing])


PORT = Check(
    key="hand port",
    question="How much damping does the device need so that the hand draws no energy from the loop?",
    cases=lambda study: product(WALLS[study.depth], SENSORS, MOTIONS),
    row=_leak,
    says=lambda table: (coupled(table), coordinated(table)),
    note="The complete device loop at 512 Hz; the worst of several speeds of the hand. The hand moves by ±0.5 mm: "
    "it always presses, or it crosses the surface. Late here: readings and forces each come one "
    "step late, without "
    "rounding; coarse: readings rounded to 10 µm. Stiffness and damping: of the coupler in CBuc, "
    "else of the wall. The "
    "four-channel coupling has the gains of Table I, but no channel for the hand's force: the "
    "motion of the hand is "
    "given. Leak: energy that the hand draws from the loop at b = KT/2 + |B|.",
)
