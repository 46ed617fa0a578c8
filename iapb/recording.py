"""Record a simulation chunk by chunk, and turn the record into a Run."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache, partial
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.advice.distrust import distrust_of
from iapb.advice.effects import Effect
from iapb.compiled import address_of, block, columns, copy_into, kernel
from iapb.contact.kernels.step import contact_state
from iapb.haptics.kernels import PLANNED
from iapb.linalg import load, store
from iapb.mechanics.energy import FORCES, energy_of_run, last_of
from iapb.mechanics.mechanism import Mechanism
from iapb.run import ContactTable, EffectRow, ImpactTable, Later, Run, blank, digests, quantities
from iapb.scene.model import SpatialScene

Floats = NDArray[np.float64]
Start = tuple[dict[str, Floats], dict[str, float]]  # state and energy at the first instant

_CONTACT_ROWS_PER_CHUNK = 200_000  # bounds the memory of a chunk in scenes with many contacts (about 30 MB)
_ROOM = 30e6  # bytes of consecutive chunks together, unless one chunk is larger
_BATCH = 50_000_000  # bytes of mass matrices held at once
_STEPS_PER_CHUNK = PLANNED  # one second of the paper's loop: progress and Ctrl-C work at least that often

# Arrays that the loop writes; poses, energies and digests of M are computed from them.
STATES = tuple(each for each in quantities(Run, "time") if each.name != "pose")
STEPS = quantities(Run, "step")
CONTACTS = quantities(ContactTable, "contact")
IMPACTS = tuple(each for each in quantities(ImpactTable) if each.name != "mass_digest")
_LINES = {"steps": STATES + STEPS, "contacts": CONTACTS, "impacts": IMPACTS}
_KEPT_WHEN_CARRIED = ("kinetic", "potential", "impact_loss", "device_kinetic", "device_hand_work",
                      "device_actuator_work")


class Record(NamedTuple):
    """Arrays of one chunk of n steps, with the names of `iapb.run`."""

    used: np.ndarray  # (2,) int64: contacts and impacts written so far
    contact_count: np.ndarray  # (n,) int64
    steps: Any  # n lines, with the states at the *end* of each step
    contacts: Any  # up to m lines, where m is the capacity of the chunk
    impacts: Any  # up to n t lines, one per island and step, with t trees


def chunk_steps(contacts: int, remaining: int) -> int:
    """Return the number of steps of the next chunk."""
    return max(1, min(remaining, _STEPS_PER_CHUNK, _CONTACT_ROWS_PER_CHUNK // max(1, contacts)))


def bytes_per_step(simulation: Any) -> int:
    """Return the bytes that a step without contacts adds to a run: lines (twice, for joining) and energies."""
    return 2 * _line_bytes(coordinates_of(simulation), 0, 0) + 8 * len(FORCES) + 40


def coordinates_of(simulation: Any) -> tuple[int, int, int, int]:
    """Return the lengths of q and v, of the scene and of the device."""
    mechanism, port = simulation.system.mechanism, simulation.port
    return mechanism.nq, mechanism.nv, len(port.device_q), len(port.device_v)


@lru_cache(maxsize=8)
def _line_bytes(coordinates: tuple[int, int, int, int], contacts: int, trees: int) -> int:
    """Return the bytes of the lines of a step with so many contacts and trees."""
    return sum(array.nbytes for array in chain(*_lines(1, coordinates, contacts, trees, np.empty).values()))


def make_record(steps: int, coordinates: tuple[int, int, int, int], contacts: int, trees: int) -> Record:
    """Allocate one chunk; `coordinates` = (nq, d, nq_t, d_t)."""
    return Room(steps, coordinates, contacts, trees).record(steps)


@lru_cache(maxsize=8)
def _first_record(steps: int, coordinates: tuple[int, int, int, int], contacts: int, trees: int) -> Any:
    """Make a chunk that serves as the layout for others of its shape; its zeros take no memory."""
    lines = _lines(steps, coordinates, contacts, trees, np.zeros)
    return block(Record(np.zeros(2, np.int64), np.zeros(steps, np.int64), **lines))


def _lines(steps: int, coordinates: tuple[int, int, int, int], contacts: int, trees: int,
           make: Callable[..., Any]) -> dict[str, Any]:
    lengths = {"time": steps, "step": steps, "contact": steps * contacts, "impact": steps * trees, "axis": 3}
    lengths |= zip(("coordinate", "velocity", "device_coordinate", "device_velocity"), coordinates, strict=True)
    return {name: columns(f"{name}_lines", blank(listed, lengths, make)) for name, listed in _LINES.items()}


class Room:
    """Memory for consecutive chunks: the lines of a run that fits in need no joining.

    Parameters
    ----------
    steps : number of steps of all chunks together
    coordinates, contacts, trees : see `make_record`
    """

    def __init__(self, steps: int, coordinates: tuple[int, int, int, int], contacts: int, trees: int) -> None:
        self._most, self._sizes = steps, (coordinates, contacts, trees)
        self.counts = np.empty(steps, np.int64)
        self.lines = _lines(steps, *self._sizes, np.empty)
        self._arrays = [self.counts, *chain(*self.lines.values())]
        self._table = [0] * (1 + len(STATES + STEPS)) + [1] * len(CONTACTS) + [2] * len(IMPACTS)
        self._places = np.array([address_of(array) for array in self._arrays])
        self._strides = np.array([array.strides[0] for array in self._arrays])
        self.chunks = 0
        self.used = [0, 0, 0]  # numbers of kept steps, contacts and impacts
        self._open: Any = None  # the chunk that is being written

    def fits(self, steps: int) -> bool:
        """Whether the last chunk is kept and there is room for another one."""
        return self._open is None and self.used[0] + steps <= self._most

    def record(self, steps: int) -> Record:
        """Return the next chunk; its content is not initialised."""
        coordinates, contacts, trees = self._sizes
        used, sizes = np.zeros(2, np.int64), (steps, steps * contacts, steps * trees)
        arrays = [array[self.used[t] : self.used[t] + sizes[t]]
                  for array, t in zip(self._arrays, self._table, strict=True)]
        places = np.array([address_of(used), *self._places])
        places[1:] += self._strides * np.array(self.used)[self._table]
        self._open = _first_record(steps, coordinates, contacts, trees).on([used, *arrays], places)
        made: Record = self._open
        return made

    def keep(self, record: Any, steps: int) -> bool:
        """Keep the lines written to the open chunk; return False if `record` is another one."""
        if record is not self._open:
            return False
        self._open, self.chunks = None, self.chunks + 1
        self.used = [used + more for used, more in zip(self.used, (steps, *record.used.tolist()), strict=True)]
        return True


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
    """Collect the chunks of a running simulation and join them into a Run with poses, energies and effects.

    `take` returns the chunks held so far as a Run that is a part of the whole, and releases them. The next part
    continues from its end.
    """

    def __init__(self, simulation: Any) -> None:
        self.simulation = simulation
        port, state = simulation.port, simulation.state
        self.start = {"q": state.q.copy(), "v": state.v.copy(),
                      "device_q": port.device_q.copy(), "device_v": port.device_v.copy()}
        self.records: list[Any] = []
        self._room: Room | None = None
        self.sizes: list[int] = []
        self.seconds: list[float] = []
        self.first, self.steps = 0, 0  # number of steps before those held, and number of all steps
        self._before: dict[str, float] | None = None  # the energies at `first`
        self._at_first: Start | None = None

    @property
    def held_bytes(self) -> int:
        """Memory of the chunks held [bytes]."""
        return sum(array.nbytes for record in self.records for array in record.arrays())

    def chunk(self, total: int) -> BaseException | None:
        """Simulate and keep the next chunk; return the exception that stopped it early, if any."""
        record, size = self._in_a_row(total)
        if self.steps == 0:
            self.simulation.prepare(record)  # so that only steps are timed
        started = time.perf_counter()
        done, stop = self.simulation.advance_chunk(record, size)
        self.keep(record, done, time.perf_counter() - started)
        return stop

    def blank(self, total: int) -> tuple[Record, int]:
        """Return a record of its own for the next chunk, and its number of steps; the whole run has `total` steps."""
        size = chunk_steps(self.simulation.system.capacity, total - self.steps)
        return make_record(size, *self._sizes), size

    def _in_a_row(self, total: int) -> tuple[Record, int]:
        """Return the record behind the last chunk if there is room, else in new memory, and its number of steps."""
        size = chunk_steps(self.simulation.system.capacity, total - self.steps)
        if self._room is None or not self._room.fits(size):
            most = int(_ROOM / max(1, _line_bytes(*self._sizes)))
            self._room = Room(max(size, min(total - self.steps, most)), *self._sizes)
        return self._room.record(size), size

    @property
    def coordinates(self) -> tuple[int, int, int, int]:
        """Lengths of q and v, of the scene and of the device."""
        return coordinates_of(self.simulation)

    @cached_property
    def _sizes(self) -> tuple[tuple[int, int, int, int], int, int]:
        system = self.simulation.system
        return self.coordinates, system.capacity, len(system.mechanism.tree_dofs)

    def keep(self, record: Any, steps: int, seconds: float) -> None:
        """Keep a chunk with `steps` written lines, which took `seconds` to simulate."""
        if self._room is not None and not self._room.keep(record, steps):
            self._room = None
        self.records.append(record)
        self.sizes.append(steps)
        self.seconds.append(seconds)
        self.steps += steps

    def held(self) -> list[tuple[Any, int, float]]:
        """Return the chunks held, each as its record, steps and seconds."""
        return list(zip(self.records, self.sizes, self.seconds, strict=True))

    def forget(self) -> None:
        """Release all chunks, after the caller has stored them."""
        self.records, self.sizes, self.seconds, self.first, self._room = [], [], [], self.steps, None

    def go_on(self, steps: int) -> None:
        """Continue the count from a number of steps that were done and stored before."""
        self.first = self.steps = steps

    def joined(self, lines: str, before: Mapping[str, np.ndarray] | None = None,
               copied: bool = False) -> dict[str, Any]:
        """Return the columns of `steps`, `contacts` or `impacts` over all chunks.

        `before` gives a first line; `copied` gives arrays that share no memory with the chunks.
        """
        table, ahead = list(_LINES).index(lines), before or {}
        if not copied and self._room is not None and self._room.chunks == len(self.records):
            used = self._room.used[table]
            found = {each.name: _filled(getattr(self._room.lines[lines], each.name), used) for each in _LINES[lines]}
            return found | {name: np.concatenate([first[None], found[name]]) for name, first in ahead.items()}
        sizes = self.sizes if lines == "steps" else [int(each.used[table - 1]) for each in self.records]
        parts = [getattr(each, lines) for each in self.records]
        return {each.name: np.concatenate([
            *([ahead[each.name][None]] if each.name in ahead else []),
            *(getattr(part, each.name)[:size] for part, size in zip(parts, sizes, strict=True))])
            for each in _LINES[lines]}

    def _counts(self) -> NDArray[np.int64]:
        """Return the number of contacts of each step."""
        if self._room is not None and self._room.chunks == len(self.records):
            return self._room.counts[: self._room.used[0]]
        return np.concatenate([each.contact_count[:size] for each, size in zip(self.records, self.sizes, strict=True)])

    def run(self, world: str, stopped: str) -> Run:
        """Return everything held as a Run; `stopped` says why it is incomplete, empty if it is complete."""
        return self._part(world, stopped)[0]

    def take(self, world: str) -> Run:
        """Return and release everything held, as a part of a run; the next part starts at its end."""
        part, ledger = self._part(world, "")
        self._at_first = self._at_first or _first_of(part)
        self._before = last_of(ledger(part), self._before)
        self.start = {each.name: getattr(part, each.name)[-1].copy() for each in STATES}
        self.forget()
        return part

    def _part(self, world: str, stopped: str) -> tuple[Run, Callable[[Run], dict[str, Floats]]]:
        """Return the Run, and the function that computes all its energies."""
        simulation, system = self.simulation, self.simulation.system
        more = bool(stopped)  # the run may continue, and the holder of this part may change it
        steps = self.joined("steps", self.start, copied=more)
        states = {each.name: steps.pop(each.name) for each in STATES}
        counts = self._counts()
        offsets = np.zeros(len(counts) + 1, np.int64)
        np.cumsum(counts, out=offsets[1:])
        law, coupling, scene, mechanism = simulation.law, simulation.coupling, simulation.scene, system.mechanism
        impacts = self.joined("impacts", copied=more)
        struck = states["q"][impacts["step"] - self.first]
        device = system.device_mechanism() if coupling.name != "none" else None
        ledger = _once(partial(energy_of_run, mechanism=mechanism, gravity=system.gravity, device=device,
                               before=self._before))
        planar = not isinstance(scene, SpatialScene)
        later: dict[str, Any] = {
            "scene_source": Later(lambda run: scene.source_text),
            "scene_resolved": Later(lambda run: scene.resolved()),
            "effects": Later(partial(_rows, simulation.effects)),
            "pose": Later(lambda run: mechanism.poses(run.q, planar=planar)),
            "energy": Later(partial(_shown, ledger, coupling.name == "unilateral")),
            "distrust": Later(partial(_distrust, self._at_first)),
        }
        run = Run(
            scene_name=scene.name, world=world or f"{law.name} + {coupling.name}",
            law=law.name, law_settings=dict(law.settings), coupling=coupling.name,
            coupling_settings=dict(coupling.settings), dt=system.dt, complete=not stopped,
            coordinate_names=mechanism.coordinate_names, coordinate_units=mechanism.coordinate_units,
            velocity_names=mechanism.velocity_names, velocity_units=mechanism.velocity_units,
            body_names=mechanism.names, tool_dofs=system.tool_dofs, tool_coordinates=system.tool_coordinates,
            time=np.arange(self.first, self.steps + 1, dtype=np.float64) * system.dt, **states, **steps,
            contacts=ContactTable(offsets, **self.joined("contacts", copied=more)),
            impacts=ImpactTable(**impacts, mass_digest=_mass_digests(mechanism, struck)),
            chunk_steps=np.array(self.sizes, np.int64), chunk_seconds=np.array(self.seconds),
            kernel="compiled" if simulation.compiled else "python", stopped=stopped, remarks=system.remarks, **later,
        )
        return run, ledger


def _mass_digests(mechanism: Mechanism, places: Floats) -> NDArray[np.int64]:
    """Return the digest of M at each of n configurations (n, nq), a few at a time: all of them may take gigabytes."""
    few = max(1, _BATCH // max(1, 8 * mechanism.nv**2))
    return np.concatenate([np.zeros(0, np.int64), *(digests(mechanism.mass_matrices(places[k : k + few]))
                                                    for k in range(0, len(places), few))])


def _rows(effects: Sequence[Effect], run: Run) -> tuple[EffectRow, ...]:
    return tuple(EffectRow(one.name, one.active, one.reason, one.ignores) for one in effects)


def _once(make: Callable[[Run], dict[str, Floats]]) -> Callable[[Run], dict[str, Floats]]:
    """Return the function with its first result cached."""
    known: list[dict[str, Floats]] = []

    def ask(run: Run) -> dict[str, Floats]:
        if not known:
            known.append(make(run))
        return known[0]

    return ask


def _shown(ledger: Callable[[Run], dict[str, Floats]], carried: bool, run: Run) -> dict[str, Floats]:
    """Return the energies to record. A unilateral coupler carries the tool at times: then leave its balance out."""
    return {name: values for name, values in ledger(run).items() if name in _KEPT_WHEN_CARRIED or not carried}


def _first_of(run: Run) -> Start:
    """Return state and energy at the start of a run."""
    return ({name: getattr(run, name)[0].copy() for name in ("q", "v")},
            {name: run.energy[name][0] for name in ("kinetic", "potential")})


def _distrust(at_first: Start | None, part: Run) -> tuple[str, ...]:
    """Return the distrust of a run; of a later part, as if its first state were that of the whole run."""
    if at_first is None:
        return distrust_of(part)
    states: dict[str, Any] = {
        name: np.concatenate([state[None], getattr(part, name)[1:]]) for name, state in at_first[0].items()}
    ledger = {name: np.concatenate([[value], part.energy[name][1:]]) for name, value in at_first[1].items()}
    return distrust_of(replace(part, energy=part.energy | ledger, distrust=(), **states))


def _filled(array: np.ndarray, used: int) -> np.ndarray:
    """Return the first lines of an array; if most of it is unused, as a copy, which does not keep the array alive."""
    return array[:used] if 2 * used >= len(array) else array[:used].copy()
