"""The run in the making: chunks of a simulation, joined into a Run with its energy ledger and effects."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.mechanics.energy import energy_of_run
from iapb.recording import Record, chunk_steps, contact_table, impact_table, joined, make_record
from iapb.run import EffectRow, Run
from iapb.system import System

Floats = NDArray[np.float64]

_KEPT_WHEN_CARRIED = ("kinetic", "potential", "impact_loss", "device_kinetic", "device_hand_work",
                      "device_actuator_work")


class Recorder:
    """The chunks of a simulation in the making."""

    def __init__(self, simulation: Any) -> None:
        self.simulation = simulation
        port, state = simulation.port, simulation.state
        self.start = (state.q.copy(), state.v.copy(), port.device_q.copy(), port.device_v.copy())
        self.records: list[Record] = []
        self.sizes: list[int] = []
        self.seconds: list[float] = []
        self.steps = 0

    def chunk(self, total: int) -> BaseException | None:
        """Do and keep the next chunk; return what stopped it before its end."""
        record, size = self.blank(total)
        if self.steps == 0:
            self.simulation.prepare(record)  # what is timed is steps alone
        started = time.perf_counter()
        done, stop = self.simulation.advance_chunk(record, size)
        self.keep(record, done, time.perf_counter() - started)
        return stop

    def blank(self, total: int) -> tuple[Record, int]:
        """Return an empty record for the next chunk and its number of steps; the whole run has `total`."""
        system, port = self.simulation.system, self.simulation.port
        size = chunk_steps(system.capacity, total - self.steps)
        coordinates = (system.mechanism.nq, system.mechanism.nv, len(port.device_q), len(port.device_v))
        return make_record(size, coordinates, system.capacity, len(system.mechanism.tree_dofs)), size

    def keep(self, record: Record, steps: int, seconds: float) -> None:
        """Take a chunk of which `steps` lines are written, in `seconds` of work."""
        self.records.append(record)
        self.sizes.append(steps)
        self.seconds.append(seconds)
        self.steps += steps

    def run(self, world: str, stopped: str) -> Run:
        """Everything recorded so far as a Run; `stopped` says why it is not complete."""
        simulation, system = self.simulation, self.simulation.system
        states = {
            name: np.concatenate([first[None], joined(self.records, self.sizes, name)])
            for name, first in zip(("q", "v", "device_q", "device_v"), self.start, strict=True)
        }
        forces = {name: joined(self.records, self.sizes, name) for name in (
            "hand_force", "coupling_force", "penalty_force", "friction_force", "impulse", "environment_force",
            "device_force", "state")}
        law, coupling = simulation.law, simulation.coupling
        run = Run(
            scene_name=simulation.scene.name, scene_source=simulation.scene.source_text,
            scene_resolved=simulation.scene.resolved(), world=world or f"{law.name} + {coupling.name}",
            law=law.name, law_settings=dict(law.settings), coupling=coupling.name,
            coupling_settings=dict(coupling.settings), dt=system.dt, complete=not stopped,
            coordinate_names=system.mechanism.coordinate_names, coordinate_units=system.mechanism.coordinate_units,
            velocity_names=system.mechanism.velocity_names, velocity_units=system.mechanism.velocity_units,
            body_names=system.mechanism.names, tool_dofs=system.tool_dofs, tool_coordinates=system.tool_coordinates,
            time=np.arange(self.steps + 1, dtype=np.float64) * system.dt, **states, **forces,
            contacts=contact_table(self.records, self.sizes), impacts=impact_table(self.records, self.sizes),
            energy={}, effects=_effects(simulation),
            chunk_steps=np.array(self.sizes, np.int64), chunk_seconds=np.array(self.seconds),
            kernel="compiled" if simulation.compiled else "python", stopped=stopped,
        )
        return replace(run, energy=_energy(run, system))


def _energy(run: Run, system: System) -> dict[str, Floats]:
    """The ledger; without the tool's balance under a unilateral coupler, where the tool is carried at times."""
    device = system.device_mechanism() if run.coupling != "none" else None
    ledger = energy_of_run(run, system.mechanism, system.gravity, device)
    if run.coupling != "unilateral":
        return ledger
    return {name: values for name, values in ledger.items() if name in _KEPT_WHEN_CARRIED}


def _effects(simulation: Any) -> tuple[EffectRow, ...]:
    return tuple(EffectRow(effect.name, effect.active, effect.reason) for effect in simulation.effects)
