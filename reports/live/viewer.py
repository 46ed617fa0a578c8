"""The scene in a browser at about 30 Hz, shown by a separate process (the graphics computer in the paper).

The loop only writes poses to a shared memory and reads the mouse's target for the hand (`reports.live.window`). The
viewer's process is a new Python process, so it shares nothing else with the loop. It runs at lower priority.

The mouse acts as the hand: a spring with limited force pulls the held point to the position of the mouse.
"""

from __future__ import annotations

from multiprocessing import get_context
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.errors import ArgumentError, IapbError
from iapb.simulation import Simulation
from reports.batches import starting_a_process
from reports.live.browser import show_in_browser
from reports.live.window import Window

Floats = NDArray[np.float64]

_FREQUENCY = 2.0 * np.pi * 2.0  # [rad/s] of the tool on the spring: about as fast as an arm follows a target
_ACCELERATION = 1.0  # [m/s²] that the largest force gives the tool, on top of holding it against gravity
_START_SECONDS = 180.0  # that a browser's server may take to start, on a machine that is busy otherwise
_END_SECONDS = 3.0


class SpringHand:
    """Pulls the held point towards a target: F = k (target − x) − b ẋ, with |F| limited and b critical.

    k, b and the limit follow from the smallest effective mass at the held point, 1 / λ_max(J M⁻¹ Jᵀ). Therefore the
    spring is slow compared to the time step in every direction.

    Parameters
    ----------
    simulation : a simulation of a scene with a hand.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation, self._port, system = simulation, simulation.port, simulation.system
        if system.tool_tree < 0:
            raise ArgumentError("scene", simulation.scene.name, "a scene with a hand")
        self._own = self._port.wrench.copy()
        self._planar = len(simulation.scene.hand.point) == 2  # type: ignore[union-attr]
        mechanism, q = system.mechanism, simulation.state.q
        jacobian = mechanism.point_jacobian(q, self._port.hand_body, self.point())
        mobility = jacobian @ np.linalg.solve(mechanism.mass_matrix(q), jacobian.T)
        mass = 1.0 / float(np.linalg.eigvalsh(mobility)[-1])
        self.stiffness, self.damping = mass * _FREQUENCY**2, 2.0 * mass * _FREQUENCY
        self.limit = mass * (_ACCELERATION + float(np.linalg.norm(system.gravity)))
        self._last: Floats | None = None

    def point(self) -> Floats:
        """Return the point (3,) [m] at which the hand holds the tool."""
        rotations, positions = self._simulation.system.mechanism.placements(self._simulation.state.q)
        held: Floats = positions[self._port.hand_body] + rotations[self._port.hand_body] @ self._port.hand_point
        return held

    def wrench(self, target: Floats | None) -> Floats:
        """Return the wrench (6,) of the scene's hand, plus the spring's force if there is a target (3,) [m]."""
        wrench = self._own.copy()
        if target is None:
            self._last = None
            return wrench
        point = self.point()
        velocity = 0.0 if self._last is None else (point - self._last) / self._simulation.system.dt
        self._last = point
        force = self.stiffness * (target - point) - self.damping * velocity
        if self._planar:
            force[2] = 0.0
        size = float(np.linalg.norm(force))
        wrench[:3] += force * min(1.0, self.limit / size) if size > 0.0 else 0.0
        return wrench


class Viewer:
    """A process that shows the simulation of a loop and lets the mouse pull the hand.

    Parameters
    ----------
    simulation : the simulation to show.
    port : port of the web server; if it is taken, the next free port is used.
    """

    def __init__(self, simulation: Simulation, port: int = 8080) -> None:
        self._hand = SpringHand(simulation) if simulation.system.tool_tree >= 0 else None
        self._own, self._mechanism = simulation.port.wrench.copy(), simulation.system.mechanism
        self._target: Floats | None = None
        self._scene, self._port = simulation.scene.resolved(), port
        self.window = Window(7 * len(self._scene["bodies"]))
        self.publish(simulation.state.q)
        self.process: Any = None

    def start(self) -> str:
        """Start the process and return its secret address; raise IapbError if it does not start. `close` ends it."""
        context = get_context("spawn")
        ours, theirs = context.Pipe(duplex=False)
        arguments = (self.window.name, self._scene, self._port, theirs)
        self.process = context.Process(target=show_in_browser, args=arguments, daemon=True, name="iapb viewer")
        with starting_a_process():  # Ctrl-C is the loop's, which then ends the viewer
            self.process.start()
        theirs.close()
        try:
            if ours.poll(_START_SECONDS):
                return str(ours.recv())
        except EOFError:
            pass
        raise IapbError("the viewer did not start; run without --view")

    def publish(self, q: Floats) -> None:
        """Write the poses at q to the shared memory."""
        self.window.publish(self._mechanism.poses(q[None], planar=False).ravel())

    def pull(self, now: float) -> Floats:
        """Return the wrench (6,) [N, N m] of the hand at the held point, in world axes: that of the scene, plus that of
        the mouse while it holds the handle."""
        if self._hand is None:
            return self._own
        self._target = self.window.target(now, self._target)
        return self._hand.wrench(self._target)

    def close(self) -> None:
        """End the process, by force if necessary, and release the shared memory."""
        if self.process is not None and self.process.is_alive():
            self.process.terminate()
            self.process.join(_END_SECONDS)
            if self.process.is_alive():
                self.process.kill()
                self.process.join()
        self.window.close()
