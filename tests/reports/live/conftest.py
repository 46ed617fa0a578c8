"""A clock that tests set, and the peg that it paces."""

from __future__ import annotations

import pytest

from iapb.scene import find_scene, load_scene
from reference.worlds import find_world
from reports.live.device import live_simulation

# A tilted peg near the corner, fast: a collision of several contacts within the first hundredths of a second.
VALUES = {"bodies.peg.position": [0.0209, -0.0141, 0.08], "bodies.peg.velocity": [-0.3, 0.4, 0.0]}
RATE = 1000.0


class FakeClock:
    """Time passes by a microsecond each time that it is asked, and by jumps: number of the wait -> seconds too late."""

    def __init__(self, jumps=None, at=None):
        self.time, self.jumps, self.waits, self.at = 100.0, jumps or {}, 0, at or {}

    def now(self):
        self.time += 1e-6
        return self.time

    def wait_until(self, instant):
        self.time = max(self.time, instant) + self.jumps.get(self.waits, 0.0)
        self.at.get(self.waits, lambda: None)()
        self.waits += 1


@pytest.fixture
def fake_clock():
    """Make a clock: fake_clock(jumps, at), at: number of the wait -> what happens then."""
    return FakeClock


@pytest.fixture
def peg():
    """Make a simulation: peg(device="", world="IAPB", **values)."""
    def made(device="", world="IAPB", **values):
        scene = load_scene(find_scene("peg_corner")).with_values(VALUES | values)
        return live_simulation(scene, find_world(world), RATE, device)

    return made
