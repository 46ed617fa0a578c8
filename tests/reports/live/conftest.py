"""A clock that tests set, and the peg that it paces."""

from __future__ import annotations

import pytest

from iapb.scene import find_scene, load_scene
from reference.worlds import find_world
from reports.live.device import live_simulation
from reports.live.loop import Loop
from reports.live.replay import finish_live, open_parts, read_live

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


@pytest.fixture
def lived(tmp_path):
    """Run a loop, and read the files that it comes to: lived(simulation, ticks, clock, budget=None, audience=None)."""
    def ran(simulation, ticks, *given, **options):
        parts = open_parts(tmp_path, "live", simulation, "IAPB", ticks)
        stopped = Loop(simulation, ticks, parts, *given, **options).run()
        path, _, pace = finish_live(parts.folder, stopped, parts.steps)
        parts.close(remove=True)
        return read_live(path), pace

    return ran
