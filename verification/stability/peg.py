"""The peg of Fig. 4 against walls of many stiffnesses and dampings, in the engine's own loop with its device."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from iapb.run import Run
from iapb.scene import Scene
from verification.finding import Failure, attempt
from verification.scenes.measures import bounces, deepest_penetration, settling_time
from verification.scenes.trace import trace_of

Runner = Callable[[Scene, str], Run]

STIFFNESSES = {"quick": (500.0, 1000.0, 4000.0, 16000.0), "full": (250.0, 500.0, 1e3, 2e3, 4e3, 8e3, 16e3, 32e3)}
DAMPINGS = {"quick": (0.0, 50.0, 200.0), "full": (0.0, 12.5, 25.0, 50.0, 100.0, 200.0, 400.0)}
WORLDS = ("PB", "IAPB")
# name: (rate [Hz], device): as the paper's experiments are emulated in the report's device runs
LATE: dict[str, Any] = {"device.delay": 1, "device.position_resolution": [1e-6, 1e-6, 1e-5]}
DEVICES: dict[str, tuple[float, dict[str, Any]]] = {
    "512 Hz": (512.0, {}),
    "512 Hz, late sensors": (512.0, LATE),
    "1 kHz": (1000.0, {}),
    "1 kHz, late sensors": (1000.0, LATE),
}


@dataclass(frozen=True)
class PegContact:
    """One run; settling_time [s] from first contact, None where the peg never rests or the loop gave up (`note`)."""

    device: str
    stiffness: float
    damping: float
    world: str
    settling_time: float | None
    bounces: int
    penetration: float
    note: str = ""


def peg_contacts(
    scene: Scene, run: Runner, depth: str = "quick", progress: Callable[[int, int], None] | None = None,
    failures: list[Failure] | None = None,
) -> tuple[PegContact, ...]:
    """Every device and wall, in both worlds in turn; a wall that raises in one is left out.

    Parameters
    ----------
    scene : the peg in the corner; run : (scene, world) -> Run, complete or not
    """
    chosen = [(device, K, B) for device in DEVICES for K in STIFFNESSES[depth] for B in DAMPINGS[depth]]

    def both(device: str, K: float, B: float) -> list[PegContact]:
        rate, sensors = DEVICES[device]
        values = {"rate": rate, "contact.stiffness": K, "contact.damping": B, **sensors}
        return [_contact(device, K, B, run(scene.with_values(values), world)) for world in WORLDS]

    found: list[PegContact] = []
    for done, case in enumerate(chosen, start=1):
        name = "peg at {}, K = {:g} N/m, B = {:g} N s/m".format(*case)
        found += attempt(name, partial(both, *case), failures) or []
        if progress is not None:
            progress(done, len(chosen))
    return tuple(found)


def _contact(device: str, stiffness: float, damping: float, run: Run) -> PegContact:
    trace = trace_of(run)
    settled = settling_time(trace) if run.complete else None
    return PegContact(device, stiffness, damping, run.world, settled, bounces(trace), deepest_penetration(trace),
                      run.stopped)  # fmt: skip
