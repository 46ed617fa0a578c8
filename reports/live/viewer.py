"""The scene in a browser at about 30 Hz, from a process of its own: the paper's graphics computer.

The loop only writes configurations into a shared page and reads where the mouse wants the hand (`reports.live.window`).
The viewer's process starts Python anew, so that it shares nothing else with the loop, and runs at lower priority.
"""

from __future__ import annotations

from multiprocessing import get_context
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.errors import IapbError
from iapb.simulation import Simulation
from reports.live.browser import HOST, show_in_browser
from reports.live.hand import SpringHand
from reports.live.window import Window
from reports.workers import starting_a_process

Floats = NDArray[np.float64]

_START_SECONDS = 60.0  # that a browser's server may take to start, on a machine that is busy otherwise
_END_SECONDS = 3.0


class Viewer:
    """A process that shows a simulation, and the hand that it moves: the loop's `Audience`.

    Parameters
    ----------
    simulation : what is shown.
    port : of the web server; the next free one where it is taken.
    """

    def __init__(self, simulation: Simulation, port: int = 8080) -> None:
        self._hand = SpringHand(simulation) if simulation.system.tool_tree >= 0 else None
        self._own = simulation.port.wrench.copy()
        self._target: Floats | None = None
        self.window = Window.made(len(simulation.state.q))
        self.window.publish(simulation.state.q)
        self._scene, self._port = simulation.scene.resolved(), port
        self.process: Any = None

    def start(self) -> str:
        """Start the process and return the address that it serves; raise IapbError if it does not come up."""
        context = get_context("spawn")
        ours, theirs = context.Pipe(duplex=False)
        arguments = (self.window.name, self.window.coordinates, self._scene, self._port, theirs)
        self.process = context.Process(target=show_in_browser, args=arguments, daemon=True, name="iapb viewer")
        with starting_a_process():  # Ctrl-C is the loop's, which then ends the viewer
            self.process.start()
        theirs.close()
        try:
            if ours.poll(_START_SECONDS):
                return f"http://{HOST}:{ours.recv()}"
        except EOFError:
            pass
        self.stop()
        raise IapbError("the viewer did not start; without --view the loop needs none")

    def publish(self, q: Floats) -> None:
        """Say where everything is."""
        self.window.publish(q)

    def pull(self, now: float) -> Floats:
        """Return the wrench (6,) of the hand: the scene's own, and the mouse's while it holds the handle."""
        if self._hand is None:
            return self._own
        self._target = self.window.target(now, self._target)
        return self._hand.wrench(self._target)

    def stop(self) -> None:
        """End the process, whatever it is doing, and give the page back."""
        if self.process is not None and self.process.is_alive():
            self.process.terminate()
            self.process.join(_END_SECONDS)
            if self.process.is_alive():
                self.process.kill()
                self.process.join()
        self.window.close()
