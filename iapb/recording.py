"""Record a simulation chunk by chunk, and turn the record into a Run."""

from __future__ import annotations

import time
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.advice.distrust import distrust_of
from iapb.haptics.rendering import PLANNED
from iapb.loop import LINES, STATES, make_record
from iapb.mechanics.energy import FORCES, energy_of_run, last_of
from iapb.numerics.schema import Floats
from iapb.run import UNSOLVED, ContactTable, EffectRow, ImpactTable, Later, Run, digests
from iapb.scene.model import SpatialScene
from iapb.thinning import Thinned

# bounds the memory of a chunk in scenes with many contacts (about 30 MB)
_CONTACT_ROWS_PER_CHUNK = 200_000
_ROOM = 30e6  # bytes of a record, unless one chunk is larger
_PIECE = 16e6  # bytes of the steps that are held before they are thinned
_BATCH = 50_000_000  # bytes of mass matrices held at once
# one second of the paper's loop: progress and Ctrl-C work at least that often
_STEPS_PER_CHUNK = PLANNED

_KEPT_WHEN_CARRIED = (
    "kinetic",
    "potential",
    "impact_loss",
    "device_kinetic",
    "device_hand_work",
    "device_actuator_work",
)


def chunk_steps(contacts: int, remaining: int) -> int:
    """Return the number of steps of the next chunk."""
    return max(1, min(remaining, _STEPS_PER_CHUNK, _CONTACT_ROWS_PER_CHUNK // max(1, contacts)))


class Recorder:
    """Collect the chunks of a running simulation and join them into a Run with poses, energies and
    effects.

    Parameters
    ----------
    simulation : in its initial state
    every : N, to keep every N-th step of a long run (see `iapb.thinning`); its steps are thinned
        piece by piece
    """

    def __init__(self, simulation: Any, every: int = 1) -> None:
        self.simulation = simulation
        port = simulation.port
        state = simulation.state
        system = simulation.system
        states: dict[str, Any] = port.members | state.members
        self.start = {each.name: states[each.name].copy() for each in STATES}
        self.coordinates: Any = tuple(map(len, self.start.values()))
        self.shape = self.coordinates, system.capacity, system.most_impacts
        self._line_bytes = _bytes_of_lines(*self.shape)
        self.records: list[Any] = []  # of the steps held
        self.timings: list[tuple[int, float]] = []  # steps and seconds of each chunk
        self.first = 0  # number of steps before those held
        self.steps = 0  # number of all steps done
        self._thinned = Thinned(every) if every > 1 else None
        self._before: dict[str, float] = {}  # the energies at `first`

    @property
    def bytes_per_step(self) -> int:
        """Bytes that a kept step without contacts adds to a run: lines (twice, for joining) and
        energies."""
        return 2 * _bytes_of_lines(self.coordinates, 0, 0) + 8 * len(FORCES) + 40

    def chunk(self, total: int, most: int | None = None) -> BaseException | None:
        """Simulate and record the next chunk, of at most `most` steps; return the exception that
        stopped it early."""
        if self._thinned and (self.steps - self.first) * self._line_bytes > _PIECE:
            self._thin(self._thinned, "", "", last=False)
        left = total - self.steps
        size = chunk_steps(self.simulation.system.capacity, min(left, most or left))
        if not self.records or len(self.records[-1].steps.q) < self.records[-1].used[0] + size:
            room = int(_ROOM / max(1, self._line_bytes))
            self.records.append(make_record(max(size, min(left, room)), *self.shape))
        record = self.records[-1]
        before = int(record.used[0])
        started = time.perf_counter()
        try:
            _, stop = self.simulation.advance_chunk(record, size)
        except KeyboardInterrupt as interrupt:  # raised when the steps of the chunk were done
            stop = interrupt
        done = int(record.used[0]) - before
        self.timings.append((done, time.perf_counter() - started))
        self.steps += done
        return stop

    def run(self, world: str, stopped: str) -> Run:
        """Return the recorded steps as a Run; `stopped` says why it is incomplete, empty if it is
        complete."""
        if self._thinned:
            return self._thinned.run(self._thin(self._thinned, world, stopped, last=True))
        return self._held(world, stopped)

    def _thin(self, thinned: Thinned, world: str, stopped: str, last: bool) -> Run:
        """Thin and release the steps held; return them as a run."""
        piece = self._held(world, stopped)
        ledger = self._ledger(piece)
        vars(piece)["energy"] = _shown(ledger, piece)
        thinned.add(piece, self.first, self._before, last)
        self._before = last_of(ledger, self._before)
        self.start = {each.name: getattr(piece, each.name)[-1].copy() for each in STATES}
        self.records = []
        self.first = self.steps
        return piece

    def joined(self, lines: str) -> dict[str, Any]:
        """Return copies of the columns of `steps`, `contacts` or `impacts` over all records; states
        from the start."""
        number = list(LINES).index(lines)
        found = {}
        for each in LINES[lines]:
            kept = [self.start[each.name][None]] if each in STATES else []
            for record in self.records:
                lines_of_record = getattr(record, lines)
                kept.append(getattr(lines_of_record, each.name)[: record.used[number]])
            found[each.name] = np.concatenate(kept)
        return found

    def _held(self, world: str, stopped: str) -> Run:
        """Return the steps held as a Run."""
        simulation = self.simulation
        system = self.simulation.system
        law = simulation.law
        coupling = simulation.coupling
        scene = simulation.scene
        mechanism = system.mechanism
        steps = self.joined("steps")
        impacts = self.joined("impacts")
        offsets = np.append(0, np.cumsum(steps.pop("contact_count")))
        if not simulation.compiled:  # a law written in Python logs no configuration
            impacts["q"] = steps["q"][impacts["step"] - self.first]
        impacts["time"] += impacts["step"] * system.dt
        ledger = self._ledger
        planar = not isinstance(scene, SpatialScene)
        later: dict[str, Any] = {
            "scene_source": Later(lambda run: scene.source_text),
            "scene_resolved": Later(lambda run: scene.resolved()),
            "pose": Later(lambda run: mechanism.poses(run.q, planar=planar)),
            "energy": Later(lambda run: _shown(ledger(run), run)),
            "distrust": Later(partial(distrust_of, system=system)),
        }
        remarks = system.remarks + (UNSOLVED,) * bool(simulation.state.rest_work.shortened[0])
        return Run(
            scene_name=scene.name,
            world=world or f"{law.name} + {coupling.name}",
            law=law.name,
            law_settings=dict(law.settings),
            coupling=coupling.name,
            coupling_settings=dict(coupling.settings),
            dt=system.dt,
            complete=not stopped,
            coordinate_names=mechanism.coordinate_names,
            coordinate_units=mechanism.coordinate_units,
            velocity_names=mechanism.velocity_names,
            velocity_units=mechanism.velocity_units,
            body_names=mechanism.names,
            tool_dofs=system.tool_dofs,
            tool_coordinates=system.tool_coordinates,
            time=np.arange(self.first, self.steps + 1, dtype=np.float64) * system.dt,
            **steps,
            contacts=ContactTable(offsets, **self.joined("contacts")),
            impacts=ImpactTable(**impacts, mass_digest=_mass_digests(system, impacts["q"])),
            effects=tuple(
                EffectRow(one.name, one.active, one.reason, one.ignores)
                for one in simulation.effects
            ),
            chunk_steps=np.array([steps for steps, _ in self.timings], np.int64),
            chunk_seconds=np.array([seconds for _, seconds in self.timings], np.float64),
            kernel="compiled" if simulation.compiled else "python",
            stopped=stopped,
            remarks=remarks,
            **later,
        )

    @property
    def _ledger(self) -> Any:
        """The function that computes all energies of a run made now."""
        system = self.simulation.system
        device = system.device_mechanism() if self.simulation.coupling.name != "none" else None
        return partial(
            energy_of_run,
            mechanism=system.mechanism,
            gravity=system.gravity,
            device=device,
            before=self._before,
        )


def _bytes_of_lines(coordinates: Any, contacts: int, impacts: int) -> int:
    """Return the bytes of the record of a step."""
    _, *lines = make_record(1, coordinates, contacts, impacts).arrays()
    return sum(array.nbytes for array in lines)


def _mass_digests(system: Any, places: Floats) -> NDArray[np.int64]:
    """Return the digest of M at each of n configurations (n, nq), a few at a time: all of them may
    take gigabytes."""
    mechanism = system.mechanism
    few = max(1, _BATCH // max(1, 8 * mechanism.nv**2))
    parts = [places[k : k + few] for k in range(0, max(1, len(places)), few)]
    start = system.start[0]
    return np.concatenate([digests(mechanism.mass_matrices_of_run(start, part)) for part in parts])


def _shown(ledger: dict[str, Floats], run: Run) -> dict[str, Floats]:
    """Return the energies to record. A unilateral coupler carries the tool at times: then leave its
    balance out."""
    carried = run.coupling == "unilateral"
    return {
        name: values for name, values in ledger.items() if name in _KEPT_WHEN_CARRIED or not carried
    }
