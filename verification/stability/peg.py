"""The peg of Figure 4 in the loop of the device: when it comes to rest, how often it bounces, what the hand feels."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np

from iapb.haptics.waveforms import WAVEFORMS
from iapb.run import Run
from verification.check import Check, Study
from verification.finding import Part, verdict_of_trials
from verification.scenes.measures import bounces, deepest_penetration, settling_time, trace_of
from verification.table import Table

SCENE = "peg_corner"
STIFFNESSES = {"quick": (500.0, 1000.0, 4000.0, 16000.0), "full": (250.0, 500.0, 1e3, 2e3, 4e3, 8e3, 16e3, 32e3)}
DAMPINGS = {"quick": (0.0, 50.0, 200.0), "full": (0.0, 12.5, 25.0, 50.0, 100.0, 200.0, 400.0)}
# name: (rate [Hz], device), which emulate the paper's experiments as in the report's device runs
LATE: dict[str, Any] = {"device.delay": 1, "device.position_resolution": [1e-6, 1e-6, 1e-5]}
DEVICES: dict[str, tuple[float, dict[str, Any]]] = {
    "512 Hz": (512.0, {}), "512 Hz, late sensors": (512.0, LATE),
    "1 kHz": (1000.0, {}), "1 kHz, late sensors": (1000.0, LATE),
}
WAVEFORM_RATE = 1000.0  # [Hz]


def _contacts(study: Study, case: tuple[str, float, float]) -> Iterator[dict[str, Any]]:
    """Yield the row of a device and a wall with penalties, then with impulses; runs may be incomplete."""
    device, K, B = case
    rate, sensors = DEVICES[device]
    values = {"rate": rate, "contact.stiffness": K, "contact.damping": B, **sensors}
    changed = study.scene(SCENE).with_values(values)
    for world in ("PB", "IAPB"):
        run = study.run(changed, world, keep=False, partial=True)
        trace = trace_of(run)
        yield {
            "device": device, "stiffness [N/m]": K, "damping [N s/m]": B, "world": run.world,
            "settles after [s]": settling_time(trace) if run.complete else None, "bounces": bounces(trace),
            "penetration [mm]": 1e3 * deepest_penetration(trace), "stopped": run.stopped,
        }


def peg(pegs: Table) -> Part:
    """Return the part on whether the peg comes to rest no later with impulses than with penalties.

    A wall at which the peg rests under neither law gives no outcome.
    """
    rows = pegs.records()
    pairs = list(zip(rows[::2], rows[1::2], strict=True))
    times = [tuple(np.inf if row["settles after"] is None else row["settles after"] for row in pair) for pair in pairs]
    sooner = [None if np.isinf(min(pair)) else bool(pair[1] <= pair[0]) for pair in times]
    fewer = sum(ours["bounces"] <= theirs["bounces"] for theirs, ours in pairs)
    return Part.of(
        "With impulses the peg in the corner comes to rest no later than with penalties",
        f"in {sooner.count(True)} of {len(sooner) - sooner.count(None)} combinations of device and wall in which it "
        f"comes to rest at all; it bounces no more often in {fewer} of all {len(pairs)} combinations", "in all",
        verdict_of_trials(sooner))


def _pulse(study: Study, name: str) -> dict[str, Any]:
    """Return what the hand feels. Rate-hardness is the first rise of the force in one step over the approach speed."""
    scene = study.scene(SCENE).with_values({"rate": WAVEFORM_RATE, "device.waveform": name})
    run: Run = study.run(scene, "IAPB", keep=False)
    trace = trace_of(run)
    pulse = run.environment_force - run.penalty_force - run.friction_force
    mean = 0.5 * (run.device_v[1:] + run.device_v[:-1])
    computed = run.impulse.sum(axis=0)
    first = int(run.impacts.step[0])
    size = float(np.linalg.norm(pulse[first, :2]))
    speed = abs(float(run.device_v[first, :2] @ pulse[first, :2])) / size
    return {
        "waveform": name, "rate-hardness [N/m]": size / run.dt / speed,
        "peak force [N]": float(np.abs(run.device_force[:, :2]).max()), "settles after [s]": settling_time(trace),
        "bounces": bounces(trace), "penetration [mm]": 1e3 * deepest_penetration(trace),
        "momentum not given": float(np.abs(pulse.sum(axis=0) * run.dt - computed).max() / np.abs(computed).max()),
        "given to the hand [mJ]": 1e3 * float(np.sum(pulse * mean) * run.dt),
        "lost in collisions [mJ]": 1e3 * float(run.impacts.energy_lost.sum()),
    }


PEG = Check(
    key="peg", question="Does the peg come to rest no later with impulses than with penalties?",
    cases=lambda study: product(DEVICES, STIFFNESSES[study.depth], DAMPINGS[study.depth]), row=_contacts, says=peg,
    digits=3, note="A dash: the peg never came to rest.",
)
PULSES = Check(
    key="waveforms", question="Every waveform of the device gives the hand the computed momentum, and no more energy "
    "than the collisions took.", cases=lambda study: WAVEFORMS, row=_pulse, digits=3,
    holds=lambda row: bool(row["given to the hand"] <= row["lost in collisions"]),
    spans=("momentum not given", "peak force"),
    note="The peg in the corner at 1 kHz; its device renders the impulses with each waveform. Negative energy: the "
    "pulses took energy from the hand. Momentum not given: the part of the computed impulse that the device has not "
    "rendered when the run ends.",
)
