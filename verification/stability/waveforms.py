"""What a hand feels of a collision under each waveform: hardness, force, depth, settling, momentum and energy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from iapb.haptics.waveforms import WAVEFORMS
from iapb.run import Run
from iapb.scene import Scene
from verification.finding import Failure, attempt
from verification.scenes.measures import bounces, deepest_penetration, settling_time
from verification.scenes.trace import trace_of

RATE = 1000.0  # [Hz]: aluminium rings at 300 Hz


@dataclass(frozen=True)
class WaveformRecord:
    """The peg in the corner under one waveform.

    rate_hardness : first rise of the device's force over one step per speed on touching [N/m], largest coordinate
    peak_force : [N]; settling_time [s], None where it never rests; penetration of the tool [m]
    unpaid : momentum computed and not given, as a share of the largest [1]
    given, lost : energy that the pulses gave the device and that the collisions took [J]
    """

    waveform: str
    rate_hardness: float
    peak_force: float
    settling_time: float | None
    bounces: int
    penetration: float
    unpaid: float
    given: float
    lost: float


def compare_waveforms(
    scene: Scene, run: Callable[[Scene], Run], failures: list[Failure] | None = None
) -> tuple[WaveformRecord, ...]:
    """Run the scene of the peg at RATE under every waveform; `run` simulates it in the world IAPB."""

    def under(name: str) -> WaveformRecord:
        return _record(name, run(scene.with_values({"rate": RATE, "device.waveform": name})))

    found = (attempt(f"waveform {name}", partial(under, name), failures) for name in WAVEFORMS)
    return tuple(record for record in found if record is not None)


def _record(name: str, run: Run) -> WaveformRecord:
    trace = trace_of(run)
    pulse = run.environment_force - run.penalty_force - run.friction_force
    mean = 0.5 * (run.device_v[1:] + run.device_v[:-1])
    computed = run.impulse.sum(axis=0)
    unpaid = np.abs(pulse.sum(axis=0) * run.dt - computed).max() / np.abs(computed).max()
    return WaveformRecord(
        name, _rate_hardness(run, pulse), float(np.abs(run.device_force[:, :2]).max()), settling_time(trace),
        bounces(trace), deepest_penetration(trace), float(unpaid), float(np.sum(pulse * mean) * run.dt),
        float(run.impacts.energy_lost.sum()),
    )  # fmt: skip


def _rate_hardness(run: Run, pulse: np.ndarray) -> float:
    """First force of the first collision over the step and the speed along it (translations)."""
    first = int(run.impacts.step[0])
    force = pulse[first, :2]
    speed = abs(float(run.device_v[first, :2] @ force)) / float(np.linalg.norm(force))
    return float(np.linalg.norm(force)) / run.dt / speed
