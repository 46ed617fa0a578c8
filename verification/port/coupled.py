"""Our own coupled loop as a force law: coupling, tool, contacts and actuators of a scene in a world,
in the engine.

The hand moves the device along the first coordinates of the tool; the others stay at the start.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from iapb.scene import Scene, find_scene, load_scene
from iapb.simulation import Simulation
from reference import Floats
from reference.worlds import find_world

COUPLER_WORLD = "CBuc"
RADIUS = 0.01  # [m] of the tool in wall.yaml


@dataclass
class CoupledLoop:
    """A scene in a world, as an object with `follow(x, v)`.

    rendering : of impulses beyond the scene's limits of force: full, saturate, scale, spread.
    """

    scene: Scene | str | Path
    world: str
    rendering: str = "full"

    @cached_property
    def simulation(self) -> Simulation:
        """The simulation that every motion uses again."""
        scene = self.scene
        if not isinstance(scene, Scene):
            scene = load_scene(find_scene(scene))
        world = find_world(self.world, self.rendering)
        return Simulation(scene, world.law, world.coupling_in(scene))

    @property
    def rate(self) -> float:
        """Samples per second [Hz]; the device must have the same."""
        return float(self.simulation.scene.rate)

    def start(self, size: int) -> Floats:
        """The tool's first coordinates at the start (size,)."""
        return self.simulation.port.device_q[:size].copy()

    def follow(self, x: Floats, v: Floats) -> Floats:
        """Return the actuator forces (n, d) at readings (n, d) from the scene's start."""
        port = self.simulation.port
        (n, d) = x.shape
        q = np.tile(self._at_start, (n, 1))
        rate = np.zeros((n, len(port.device_v)))
        q[:, :d] = x
        rate[:, :d] = v
        return self.simulation.follow(q, rate)[:, :d]

    @cached_property
    def _at_start(self) -> Floats:
        return np.array(self.simulation.port.device_q)

    def __getstate__(self) -> dict[str, object]:
        """Leave the compiled state out; it is made again."""
        return {"scene": self.scene, "world": self.world, "rendering": self.rendering}


def wall_scene(
    world: str,
    stiffness: float,
    damping: float,
    rate: float = 512.0,
    limit: float | None = None,
) -> Scene:
    """Return the scene of wall.yaml: a disc that slides along x to a wall at x = 0, with e = 0.

    stiffness, damping : of the coupler in CBuc, else of the wall; limit : of the device's force [N].
    """
    gains = "couplings.unilateral" if world == COUPLER_WORLD else "contact"
    values: dict[str, Any] = {f"{gains}.stiffness": stiffness, f"{gains}.damping": damping}
    if world == COUPLER_WORLD:
        values = {name: [value] for name, value in values.items()}
    if limit is not None:
        values["device.force_limit"] = [limit]
    scene = load_scene(Path(__file__).with_name("wall.yaml"))
    return scene.with_values(values | {"rate": rate})
