"""The hand's port of a whole device scene: sensors, coupling, tool, contact law and actuators in the engine's loop.

A hand moves the device along prescribed positions x_k, one per step; what the loop makes of them are forces F_k that
the actuators hold until the next sample. As at the bare wall (`verification.laws.engine_laws.hand_port`), of all
motions through the same positions the straight one loses least in the physical damping b, and the device's inertia
stores energy and makes none, so the hand has put in at least

    E_n = Σ −F_k Δx_k + b Δx_k²/T,       and needed(n) = Σ F_k Δx_k / Σ Δx_k²/T

is the least b with E_n >= 0. In the world CBuc with e = 0 and ideal sensors, a tool that rests on the wall makes the
coupler that wall of stiffness K_cpl and damping B_cpl: b >= K_cpl T/2 + B_cpl is enough. With the four-channel
controller the tool moves by itself, and wall, coordination and the tool's inertia answer the hand together: no such
bound is proved, K and B are the wall's, and what b the loop needs is measured.

The hand's force is not told to the tool (a force channel needs a sensor): the position channels and F_env work.
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
RADIUS = 0.01  # [m] of the tool, a disc on a slide; the wall is at 0
COORDINATION = (100.0, 70.0)  # Table I: K_coord [N/m], B_coord [N s/m]


@dataclass(frozen=True)
class DeviceLoop:
    """A device before a wall (SI units).

    stiffness, damping : of the wall in the four-channel worlds, of the coupler in CBuc
    dt : T; mass, clearance : of the tool, and its distance from the wall at the start
    delay : steps that readings and forces take, each; resolution : of the position sensor
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
        """KT/2 + |B|: Colgate's and Schenkel's condition on b [N s/m]."""
        return 0.5 * self.stiffness * self.dt + abs(self.damping)

    @property
    def bound_with_coordination(self) -> float:
        """The same with the gains of the coordination added to the wall's, where there is one [N s/m]."""
        if self.world == COUPLER_WORLD:
            return self.bound
        return self.bound + 0.5 * COORDINATION[0] * self.dt + COORDINATION[1]

    def scene(self) -> Scene:
        """Tool, wall and gains; e = 0."""
        own, gains = [self.stiffness, self.damping], COORDINATION
        wall = {"stiffness": own[0], "damping": own[1]} if self.world != COUPLER_WORLD else {}
        couplings = {"four_channel": {"stiffness": [gains[0]], "damping": [gains[1]]},
                     "unilateral": {"stiffness": own[:1], "damping": own[1:]}}  # fmt: skip
        return scene_from_text(json.dumps({
            "name": "device_loop", "rate": 1.0 / self.dt, "duration": 1.0,
            "bodies": [{"name": "tool", "joint": "prismatic", "axis": [1, 0], "mass": self.mass,
                        "shapes": [{"kind": "circle", "radius": RADIUS}], "position": [-RADIUS - self.clearance]}],
            "walls": [{"name": "wall", "kind": "half_plane", "point": [0, 0], "normal": [-1, 0]}],
            "contact": {"restitution": 0.0, **wall}, "device": {}, "couplings": couplings,
            "hand": {"body": "tool", "force": [0, 0, 0]},
        }))  # fmt: skip


class MovedDevice:
    """A device that a hand moves along positions (n + 1,), read through sensors; it keeps what it is told."""

    def __init__(self, positions: Floats, loop: DeviceLoop) -> None:
        step = loop.resolution
        sensed = np.round(positions / step) * step if step > 0.0 else positions
        rate = np.concatenate([[0.0], np.diff(sensed)]) / loop.dt
        late = np.zeros(loop.delay)
        self._q, self._v = np.concatenate([late + sensed[0], sensed]), np.concatenate([late, rate])
        self._forces: list[float] = []

    def read(self) -> DeviceReading:
        """Return position and velocity, quantised and late; the velocity is their difference over one step."""
        k = len(self._forces)
        return DeviceReading(self._q[k : k + 1].copy(), self._v[k : k + 1].copy())

    def apply(self, force: ArrayLike) -> None:
        """Take the force; the hand moves on."""
        self._forces.append(float(np.asarray(force)[0]))

    def held_forces(self, delay: int) -> Floats:
        """What the actuators gave in each step, `delay` steps after it was asked for; nothing before."""
        return np.array([0.0] * delay + self._forces)[: len(self._forces)]


def actuator_forces(loop: DeviceLoop, positions: Floats) -> Floats:
    """Force (n,) [N] of the actuators in each step, for positions (n + 1,) [m], 0 where the tool touches the wall.

    Positive into the wall. The tool starts at its clearance before the wall, at rest; so should the device.
    """
    scene, world = loop.scene(), find_world(loop.world)
    device = MovedDevice(positions - RADIUS, loop)
    simulation = Simulation(scene, world.law, world.coupling_in(scene), device=device)
    for _ in range(len(positions) - 1):
        simulation.step()
    return device.held_forces(loop.delay)


def entered_energy(positions: Floats, forces: Floats, device_damping: float, dt: float) -> Floats:
    """Least energy (n,) [J] that the hand has put in by the end of each step."""
    change = np.diff(positions)
    return np.asarray(np.cumsum(-forces * change + device_damping * change**2 / dt))


def needed_damping(positions: Floats, forces: Floats, dt: float) -> float:
    """Least b [N s/m] with which no energy comes out on this motion."""
    change = np.diff(positions)
    got_out, moved = np.cumsum(forces * change), np.cumsum(change**2) / dt
    shares = np.divide(got_out, moved, out=np.zeros_like(moved), where=moved > 0.0)
    return max(0.0, float(np.max(shares)))
