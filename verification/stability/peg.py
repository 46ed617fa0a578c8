"""The peg of Fig. 4 in the engine's loop with a device: at many walls, and with every waveform of the impulses."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count, product
from typing import Any

import numpy as np

from iapb.haptics.waveforms import WAVEFORMS
from iapb.run import Run
from iapb.scene import find_scene, load_scene
from verification.finding import (
    REFUTED,
    REPRODUCED,
    Failure,
    Part,
    Table,
    of_each,
    table_of,
    titled,
    verdict_of_trials,
)
from verification.scenes.measures import bounces, deepest_penetration, settling_time
from verification.scenes.trace import trace_of

SCENE = "peg_corner"
STIFFNESSES = {"quick": (500.0, 1000.0, 4000.0, 16000.0), "full": (250.0, 500.0, 1e3, 2e3, 4e3, 8e3, 16e3, 32e3)}
DAMPINGS = {"quick": (0.0, 50.0, 200.0), "full": (0.0, 12.5, 25.0, 50.0, 100.0, 200.0, 400.0)}
WORLDS = ("PB", "IAPB")
# name: (rate [Hz], device), which emulate the paper's experiments as in the report's device runs
LATE: dict[str, Any] = {"device.delay": 1, "device.position_resolution": [1e-6, 1e-6, 1e-5]}
DEVICES: dict[str, tuple[float, dict[str, Any]]] = {
    "512 Hz": (512.0, {}),
    "512 Hz, late sensors": (512.0, LATE),
    "1 kHz": (1000.0, {}),
    "1 kHz, late sensors": (1000.0, LATE),
}
WAVEFORM_RATE = 1000.0  # [Hz]
COLUMNS = titled(("device", "stiffness [N/m]", "damping [N s/m]", "world", "settles after [s]", "bounces",
                  "penetration [mm]", "stopped")).columns  # fmt: skip
PULSE_COLUMNS = titled((
    "waveform", "rate-hardness [N/m]", "peak force [N]", "settles after [s]", "bounces", "penetration [mm]",
    "momentum not given", "given to the hand [mJ]", "lost in collisions [mJ]",
)).columns  # fmt: skip


def peg_contacts(
    run: Callable[..., Run], depth: str = "quick", progress: Callable[[int, int], None] | None = None,
    failures: list[Failure] | None = None,
) -> Table:  # fmt: skip
    """Run every device and wall in both worlds; omit a wall if one of its runs raises an error.

    Parameters
    ----------
    run : (scene, world, keep=False, partial=True) -> Run, which may be incomplete
    """
    scene = load_scene(find_scene(SCENE))
    chosen, done = list(product(DEVICES, STIFFNESSES[depth], DAMPINGS[depth])), count()

    def both(case: tuple[str, float, float]) -> list[dict[str, Any]]:
        if progress is not None:
            progress(next(done), len(chosen))
        (rate, sensors), K, B = DEVICES[case[0]], *case[1:]
        changed = scene.with_values({"rate": rate, "contact.stiffness": K, "contact.damping": B, **sensors})
        return [_contact(*case, run(changed, world, keep=False, partial=True)) for world in WORLDS]

    rows = of_each(chosen, both, failures, lambda case: "peg at {}, K = {:g} N/m, B = {:g} N s/m".format(*case))
    return table_of(COLUMNS, rows, digits=3, note="A dash: the peg never came to rest.")


def _contact(device: str, stiffness: float, damping: float, run: Run) -> dict[str, Any]:
    trace = trace_of(run)
    return {
        "device": device, "stiffness": stiffness, "damping": damping, "world": run.world,
        "settles after": settling_time(trace) if run.complete else None, "bounces": bounces(trace),
        "penetration": 1e3 * deepest_penetration(trace), "stopped": run.stopped,
    }  # fmt: skip


def peg(pegs: Table) -> Part:
    """Return the part on whether the peg comes to rest no later with impulses than with penalties.

    A wall at which the peg rests under neither law gives no outcome.
    """
    rows = pegs.records()
    pairs = list(zip(rows[::2], rows[1::2], strict=True))
    times = [tuple(np.inf if row["settles after"] is None else row["settles after"] for row in pair) for pair in pairs]
    sooner = [None if np.isinf(min(pair)) else bool(pair[1] <= pair[0]) for pair in times]
    fewer = sum(ours["bounces"] <= theirs["bounces"] for theirs, ours in pairs)
    return Part(
        f"With impulses the peg in the corner comes to rest no later than with penalties in {sooner.count(True)} of "
        f"{len(sooner) - sooner.count(None)} combinations of device and wall in which it comes to rest at all, and "
        f"bounces no more often in {fewer} of {len(pairs)}.", verdict_of_trials(sooner))  # fmt: skip


def waveforms(run: Callable[..., Run], failures: list[Failure] | None = None) -> Table:
    """Run the peg in the world IAPB at WAVEFORM_RATE; its device renders the impulses with each waveform."""
    scene = load_scene(find_scene(SCENE))

    def under(name: str) -> list[dict[str, Any]]:
        return [_pulse(name, run(scene.with_values({"rate": WAVEFORM_RATE, "device.waveform": name}), "IAPB",
                                 keep=False))]  # fmt: skip

    note = ("The peg in the corner at 1 kHz; its device renders the impulses with each waveform. Negative energy: the "
            "pulses took energy from the hand. Momentum not given: the part of the computed impulse that the device "
            "has not rendered when the run ends.")
    rows = of_each(WAVEFORMS, under, failures, lambda name: f"waveform {name}")
    return table_of(PULSE_COLUMNS, rows, digits=3, note=note)


def _pulse(name: str, run: Run) -> dict[str, Any]:
    """Return what the hand feels. Rate-hardness is the first rise of the force in one step over the approach speed."""
    trace = trace_of(run)
    pulse = run.environment_force - run.penalty_force - run.friction_force
    mean = 0.5 * (run.device_v[1:] + run.device_v[:-1])
    computed = run.impulse.sum(axis=0)
    first = int(run.impacts.step[0])
    size = float(np.linalg.norm(pulse[first, :2]))
    speed = abs(float(run.device_v[first, :2] @ pulse[first, :2])) / size
    return {
        "waveform": name, "rate-hardness": size / run.dt / speed,
        "peak force": float(np.abs(run.device_force[:, :2]).max()), "settles after": settling_time(trace),
        "bounces": bounces(trace), "penetration": 1e3 * deepest_penetration(trace),
        "momentum not given": float(np.abs(pulse.sum(axis=0) * run.dt - computed).max() / np.abs(computed).max()),
        "given to the hand": 1e3 * float(np.sum(pulse * mean) * run.dt),
        "lost in collisions": 1e3 * float(run.impacts.energy_lost.sum()),
    }  # fmt: skip


def pulses(table: Table) -> Part:
    """Return the part on whether every waveform gives the momentum, and no more energy than the collisions lose."""
    rows = table.records()
    most = max(row["given to the hand"] - row["lost in collisions"] for row in rows)
    forces = {row["waveform"]: row["peak force"] for row in rows}
    brake = ("" if not {"step", "brake"} <= set(forces) else
             f"; the peak force is {forces['brake']:.3g} N with a brake and {forces['step']:.3g} N with a one-step "
             "pulse")
    return Part(
        f"Every waveform gives the hand the computed momentum (relative difference at most "
        f"{max(row['momentum not given'] for row in rows):.0e}) and no more energy than the collisions took{brake}.",
        REPRODUCED if most <= 0.0 else REFUTED)  # fmt: skip
