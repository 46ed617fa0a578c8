"""The hand's port of a whole device scene: sensors, coupling, tool, contact law and actuators in the engine's loop.

A hand moves the device along prescribed positions x_k, one per step. The loop answers with forces F_k, which the
actuators hold until the next sample. As for the wall alone (`verification.laws.engine_laws.hand_port`), uniform motion
between the positions dissipates least in the physical damping b, and the device's inertia only stores energy. The hand
therefore supplies at least

    E_n = Σ −F_k Δx_k + b Δx_k²/T,       and needed(n) = Σ F_k Δx_k / Σ Δx_k²/T

is the least b with E_n >= 0. In the world CBuc with e = 0 and ideal sensors, if the tool rests on the wall, the coupler
acts as a wall of stiffness K_cpl and damping B_cpl, so b >= K_cpl T/2 + B_cpl is sufficient. With the four-channel
controller the tool moves, and the force depends on wall, coordination and the tool's inertia. No such bound is proved
for this case; K and B are then the wall's constants, and the study measures the b that the loop needs.

The tool does not receive the hand's force, since a force channel needs a sensor; the position channels and F_env act.
"""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.haptics.device import DeviceReading
from iapb.scene import Scene, scene_from_text
from iapb.simulation import Simulation
from reference.worlds import find_world

Floats = NDArray[np.float64]

COUPLER_WORLD = "CBuc"
RADIUS = 0.01  # [m] of the tool, a disc that slides along x; the wall is at 0
COORDINATION = (100.0, 70.0)  # Table I: K_coord [N/m], B_coord [N s/m]


@dataclass(frozen=True)
class DeviceLoop:
    """A device and a tool in front of a wall (SI units).

    stiffness, damping : constants of the wall in the four-channel worlds, of the coupler in CBuc
    dt : the step T; mass, clearance : mass of the tool, and its initial distance from the wall
    delay : delay of the readings and of the forces [steps each]; resolution : of the position sensor
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
        """KT/2 + |B| with the gains of the coordination, if there is one, added to those of the wall [N s/m]."""
        if self.world == COUPLER_WORLD:
            return self.bound
        return self.bound + 0.5 * COORDINATION[0] * self.dt + COORDINATION[1]

    def scene(self) -> Scene:
        """Return the scene with tool, wall and gains; e = 0."""
        own, gains = [self.stiffness, self.damping], COORDINATION
        wall = {"stiffness": own[0], "damping": own[1]} if self.world != COUPLER_WORLD else {}
        couplings = {"four_channel": {"stiffness": [gains[0]], "damping": [gains[1]]},
                     "unilateral": {"stiffness": own[:1], "damping": own[1:]}}  # fmt: skip
        return scene_from_text(json.dumps({
            "name": "device_loop", "rate": 1.0 / self.dt, "duration": 1.0,
            "bodies": [{"name": "tool", "joint": "prismatic", "axis": [1, 0], "mass": self.mass,
                        "shapes": [{"kind": "circle", "radius": RADIUS}], "position": [-RADIUS - self.clearance]}],
            "walls": [{"name": "wall", "kind": "half_plane", "point": [0, 0], "normal": [-1, 0]}],
            "contact": {"forces": "paper", "restitution": 0.0, **wall}, "device": {}, "couplings": couplings,
            "hand": {"body": "tool", "force": [0, 0, 0]},
        }))  # fmt: skip


class MovedDevice:
    """A device that a hand moves along positions (n + 1,), read through sensors; it records the forces applied to it.
    """

    def __init__(self, positions: Floats, loop: DeviceLoop) -> None:
        step = loop.resolution
        sensed = np.round(positions / step) * step if step > 0.0 else positions
        rate = np.concatenate([[0.0], np.diff(sensed)]) / loop.dt
        late = np.zeros(loop.delay)
        self._q, self._v = np.concatenate([late + sensed[0], sensed]), np.concatenate([late, rate])
        self._forces: list[float] = []

    def read(self) -> DeviceReading:
        """Return the quantised, delayed position, and its difference over one step as the velocity."""
        k = len(self._forces)
        return DeviceReading(self._q[k : k + 1].copy(), self._v[k : k + 1].copy())

    def apply(self, force: ArrayLike) -> None:
        """Record the force and advance the hand by one step."""
        self._forces.append(float(np.asarray(force)[0]))

    def held_forces(self, delay: int) -> Floats:
        """Return the actuator force of each step: the command of `delay` steps before, and 0 in the first steps."""
        return np.array([0.0] * delay + self._forces)[: len(self._forces)]


def actuator_forces(loop: DeviceLoop, positions: Floats) -> Floats:
    """Return the actuator forces (n,) [N] of the steps for positions (n + 1,) [m].

    Position 0 is where the tool touches the wall; positive is into the wall. The tool starts at rest at its clearance
    from the wall; the positions should start there, too.
    """
    scene, world = loop.scene(), find_world(loop.world)
    device = MovedDevice(positions - RADIUS, loop)
    simulation = Simulation(scene, world.law, world.coupling_in(scene), device=device)
    for _ in range(len(positions) - 1):
        simulation.step()
    return device.held_forces(loop.delay)


def entered_energy(positions: Floats, forces: Floats, device_damping: float, dt: float) -> Floats:
    """Return the least energy (n,) [J] that the hand has supplied by the end of each step."""
    change = np.diff(positions)
    return np.asarray(np.cumsum(-forces * change + device_damping * change**2 / dt))


def needed_damping(positions: Floats, forces: Floats, dt: float) -> float:
    """Return the least b [N s/m] for which the hand extracts no energy on this motion."""
    change = np.diff(positions)
    got_out, moved = np.cumsum(forces * change), np.cumsum(change**2) / dt
    shares = np.divide(got_out, moved, out=np.zeros_like(moved), where=moved > 0.0)
    return max(0.0, float(np.max(shares)))
