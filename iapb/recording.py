"""Recording of a simulation, chunk by chunk: what the loop writes, and how it becomes a Run."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.compiled import block, columns, copy_into, kernel
from iapb.contact.kernels.step import contact_state
from iapb.distrust import distrust_of
from iapb.haptics.kernels import PLANNED
from iapb.mechanics.energy import FORCES, energy_of_run, last_of
from iapb.mechanics.kernels.vectors import load, store
from iapb.run import ContactTable, EffectRow, ImpactTable, Run, blank, digests, quantities
from iapb.scene.model import SpatialScene

Floats = NDArray[np.float64]

_CONTACT_ROWS_PER_CHUNK = 200_000  # bounds the memory of a chunk in scenes with many contacts (about 30 MB)
_STEPS_PER_CHUNK = PLANNED  # one second of the paper's loop: progress and Ctrl-C answer at least that often

# What the loop writes; poses, energies and digests of M follow from it.
STATES = tuple(each for each in quantities(Run, "time") if each.name != "pose")
STEPS = quantities(Run, "step")
CONTACTS = quantities(ContactTable, "contact")
IMPACTS = tuple(each for each in quantities(ImpactTable) if each.name != "mass_digest")
_LINES = {"steps": STATES + STEPS, "contacts": CONTACTS, "impacts": IMPACTS}
_KEPT_WHEN_CARRIED = ("kinetic", "potential", "impact_loss", "device_kinetic", "device_hand_work",
                      "device_actuator_work")


class Record(NamedTuple):
    """Arrays of one chunk of n steps, by the names of `iapb.run`."""

    steps: Any  # n lines; states are those at the *end* of each step
    contact_count: np.ndarray  # (n,) int64
    contacts: Any  # up to m lines, m the capacity of the chunk
    impacts: Any  # up to n t lines, one per island and step, t trees
    used: np.ndarray  # (2,) int64: contacts and impacts written so far


def chunk_steps(contacts: int, remaining: int) -> int:
    """Number of steps of the next chunk."""
    return max(1, min(remaining, _STEPS_PER_CHUNK, _CONTACT_ROWS_PER_CHUNK // max(1, contacts)))


def bytes_per_step(simulation: Any) -> int:
    """Bytes that each step adds to a run: its lines twice while chunks are joined, and the ledger; no contacts."""
    mechanism, port = simulation.system.mechanism, simulation.port
    lengths = {"time": 1, "step": 1, "coordinate": mechanism.nq, "velocity": mechanism.nv,
               "device_coordinate": len(port.device_q), "device_velocity": len(port.device_v)}
    lines = sum(array.nbytes for array in blank(STATES + STEPS, lengths).values())
    return 2 * lines + 8 * len(FORCES) + 40


def make_record(steps: int, coordinates: tuple[int, int, int, int], contacts: int, trees: int) -> Record:
    """Allocate one chunk; `coordinates` = (nq, d, nq_t, d_t)."""
    made: Record = _first_record(steps, coordinates, contacts, trees).twin(blank=True)
    return made


@lru_cache(maxsize=8)
def _first_record(steps: int, coordinates: tuple[int, int, int, int], contacts: int, trees: int) -> Any:
    """A chunk of which blank twins are used; its zeros take no memory until somebody writes to them."""
    lengths = {"time": steps, "step": steps, "contact": steps * contacts, "impact": steps * trees, "axis": 3}
    lengths |= zip(("coordinate", "velocity", "device_coordinate", "device_velocity"), coordinates, strict=True)
    return block(Record(
        columns("StepLines", blank(STATES + STEPS, lengths)), np.zeros(steps, np.int64),
        columns("ContactLines", blank(CONTACTS, lengths)), columns("ImpactLines", blank(IMPACTS, lengths)),
        np.zeros(2, np.int64)))


@kernel
def write_step(record, k, step, state, port):
    """Copy step number `step` into line k of the chunk."""
    line = record.steps
    for i in range(state.q.shape[0]):
        line.q[k, i] = state.q[i]
    for i in range(state.v.shape[0]):  # one loop: eight short ones would cost more than what they copy
        line.v[k, i] = state.v[i]
        line.hand_force[k, i] = port.hand_force[i]
        line.coupling_force[k, i] = port.coupling_force[i]
        line.penalty_force[k, i] = state.penalty_force[i]
        line.friction_force[k, i] = state.friction_force[i]
        line.impulse[k, i] = state.impulse[i]
        line.environment_force[k, i] = port.environment_force[i]
    for i in range(port.device_q.shape[0]):
        line.device_q[k, i] = port.device_q[i]
    for i in range(port.device_v.shape[0]):
        line.device_v[k, i] = port.device_v[i]
        line.device_force[k, i] = port.device_force[i]
    line.state[k] = contact_state(state, port.tool_tree)
    _write_contacts(record, k, state)
    if state.impacts.logged[0] > 0:
        _write_impacts(record, step, state)


@kernel
def _write_contacts(record, k, state):
    line, contacts, count, m = record.contacts, state.contacts, state.contact_count[0], record.used[0]
    record.contact_count[k] = count
    record.used[0] = m + count
    for i in range(count):
        line.body_a[m], line.body_b[m] = contacts.body_a[i], contacts.body_b[i]
        store(line.point, m, load(contacts.point, i))
        store(line.normal, m, load(contacts.normal, i))
        store(line.friction_force, m, load(contacts.friction_force, i))
        line.gap[m], line.normal_velocity[m] = contacts.gap[i], contacts.normal_velocity[i]
        line.normal_force[m] = contacts.normal_force[i]
        line.impulse[m], line.is_new[m] = state.contact_impulse[i], contacts.is_new[i]
        m += 1


@kernel
def _write_impacts(record, step, state):
    line, log = record.impacts, state.impacts
    for i in range(log.logged[0]):
        m = record.used[1]
        line.step[m], line.group[m] = step, log.group[i]
        line.rows[m], line.rank[m] = log.rows[i], log.rank[i]
        line.scale[m], line.clamp[m] = log.scale[i], log.clamp[i]
        line.energy_lost[m], line.friction_share[m] = log.energy_lost[i], log.friction_share[i]
        line.approaching[m], line.solved[m] = log.approaching[i], log.solved[i]
        copy_into(line.v_minus[m], log.v_minus[i])
        copy_into(line.v_plus[m], log.v_plus[i])
        copy_into(line.impulse[m], log.impulse[i])
        record.used[1] = m + 1


class Recorder:
    """The chunks of a simulation in the making, joined into a Run with its poses, energy ledger and effects.

    What is held can be taken as a Run that is a part of the whole, and forgotten: the next part goes on from there.
    """

    def __init__(self, simulation: Any) -> None:
        self.simulation = simulation
        port, state = simulation.port, simulation.state
        self.start = {"q": state.q.copy(), "v": state.v.copy(),
                      "device_q": port.device_q.copy(), "device_v": port.device_v.copy()}
        self.records: list[Any] = []
        self.sizes: list[int] = []
        self.seconds: list[float] = []
        self.first, self.steps = 0, 0  # steps before those that are held, and steps in all
        self._before: dict[str, float] | None = None  # the ledger at `first`
        self._at_first: tuple[dict[str, Floats], dict[str, float]] | None = None  # state and energy at the start

    @property
    def held_bytes(self) -> int:
        """Memory of the chunks that are held."""
        return sum(array.nbytes for record in self.records for array in record.arrays())

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
        system = self.simulation.system
        size = chunk_steps(system.capacity, total - self.steps)
        return make_record(size, self.coordinates, system.capacity, len(system.mechanism.tree_dofs)), size

    @property
    def coordinates(self) -> tuple[int, int, int, int]:
        """Lengths of q and v, and of the device's."""
        mechanism, port = self.simulation.system.mechanism, self.simulation.port
        return mechanism.nq, mechanism.nv, len(port.device_q), len(port.device_v)

    def keep(self, record: Any, steps: int, seconds: float) -> None:
        """Take a chunk of which `steps` lines are written, in `seconds` of work."""
        self.records.append(record)
        self.sizes.append(steps)
        self.seconds.append(seconds)
        self.steps += steps

    def held(self) -> list[tuple[Any, int, float]]:
        """The chunks that are held: each record, its steps and its seconds."""
        return list(zip(self.records, self.sizes, self.seconds, strict=True))

    def forget(self) -> None:
        """Hold nothing any more: somebody else has written the chunks down."""
        self.records, self.sizes, self.seconds, self.first = [], [], [], self.steps

    def go_on(self, steps: int) -> None:
        """Count from a number of steps that were done, and written down, before."""
        self.first = self.steps = steps

    def joined(self, lines: str, before: Mapping[str, np.ndarray] | None = None) -> dict[str, Any]:
        """The columns of the record's `steps`, `contacts` or `impacts` over all chunks; `before`: a line ahead."""
        sizes = self.sizes if lines == "steps" else [int(each.used[int(lines == "impacts")]) for each in self.records]
        parts = [getattr(each, lines) for each in self.records]
        return {each.name: np.concatenate([
            *([before[each.name][None]] if before and each.name in before else []),
            *(getattr(part, each.name)[:size] for part, size in zip(parts, sizes, strict=True))])
            for each in _LINES[lines]}

    def run(self, world: str, stopped: str) -> Run:
        """Everything held as a Run; `stopped` says why it is not complete."""
        return self._part(world, stopped)[0]

    def take(self, world: str) -> Run:
        """Return what is held as a part of a run, and forget it: the next part starts where this one ends."""
        part, ledger = self._part(world, "")
        self.start = {each.name: getattr(part, each.name)[-1].copy() for each in STATES}
        self._before = last_of(ledger, self._before)
        self.forget()
        return part

    def _part(self, world: str, stopped: str) -> tuple[Run, dict[str, Floats]]:
        """The Run, and its whole ledger."""
        simulation, system = self.simulation, self.simulation.system
        steps = self.joined("steps", self.start)
        states = {each.name: steps.pop(each.name) for each in STATES}
        counts = [each.contact_count[:size] for each, size in zip(self.records, self.sizes, strict=True)]
        offsets = np.concatenate([[0], np.cumsum(np.concatenate(counts))]).astype(np.int64)
        law, coupling = simulation.law, simulation.coupling
        impacts = self.joined("impacts")
        struck = states["q"][impacts["step"] - self.first]
        run = Run(
            scene_name=simulation.scene.name, scene_source=simulation.scene.source_text,
            scene_resolved=simulation.scene.resolved(), world=world or f"{law.name} + {coupling.name}",
            law=law.name, law_settings=dict(law.settings), coupling=coupling.name,
            coupling_settings=dict(coupling.settings), dt=system.dt, complete=not stopped,
            coordinate_names=system.mechanism.coordinate_names, coordinate_units=system.mechanism.coordinate_units,
            velocity_names=system.mechanism.velocity_names, velocity_units=system.mechanism.velocity_units,
            body_names=system.mechanism.names, tool_dofs=system.tool_dofs, tool_coordinates=system.tool_coordinates,
            time=np.arange(self.first, self.steps + 1, dtype=np.float64) * system.dt, **states,
            pose=system.mechanism.poses(states["q"], planar=not isinstance(simulation.scene, SpatialScene)),
            **steps,
            contacts=ContactTable(offsets, **self.joined("contacts")),
            impacts=ImpactTable(**impacts, mass_digest=digests(system.mechanism.mass_matrices(struck))),
            energy={}, effects=tuple(EffectRow(one.name, one.active, one.reason, one.ignores)
                                     for one in simulation.effects),
            chunk_steps=np.array(self.sizes, np.int64), chunk_seconds=np.array(self.seconds),
            kernel="compiled" if simulation.compiled else "python", stopped=stopped, remarks=system.remarks,
        )
        device = system.device_mechanism() if coupling.name != "none" else None
        ledger = energy_of_run(run, system.mechanism, system.gravity, device, self._before)
        # Without the tool's balance under a unilateral coupler, where the tool is carried at times.
        kept = _KEPT_WHEN_CARRIED if coupling.name == "unilateral" else ledger
        run = replace(run, energy={name: values for name, values in ledger.items() if name in kept})
        return replace(run, distrust=distrust_of(self._since_the_start(run))), ledger

    def _since_the_start(self, part: Run) -> Run:
        """Return the run or, of a later part, one that goes from the first state of all to those of the part."""
        first = {name: getattr(part, name)[0].copy() for name in ("q", "v")}
        energy = {name: part.energy[name][0] for name in ("kinetic", "potential")}
        if self._at_first is None:
            self._at_first = first, energy
            return part
        first, energy = self._at_first
        states: dict[str, Any] = {
            name: np.concatenate([state[None], getattr(part, name)[1:]]) for name, state in first.items()}
        ledger = {name: np.concatenate([[value], part.energy[name][1:]]) for name, value in energy.items()}
        return replace(part, energy=part.energy | ledger, **states)
