"""The simulation loop: couple, advance the contact law, drive the device, record. It runs compiled
or in Python.

    every step of length Δt:
        hand and coupling pull the tool                 (VI)   couple
        contacts → collisions → resting forces → move   (III-V, IV)   the law
        F_env is rendered, the device moves             (V-C, VI)   render, move_device

A real device gets its force after the law has advanced. Its position is read at the end of the
step.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import cached_property, lru_cache
from numbers import Integral, Real
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iapb.contact.laws import (
    STEP_VECTORS,
    ContactLaw,
    ImpulseAugmented,
    Penalty,
    StepResult,
    copied_step,
)
from iapb.effects import decide
from iapb.engines import Engine, is_engine
from iapb.errors import ArgumentError, IapbError
from iapb.haptics.coupling import Coupling, NoCoupling
from iapb.haptics.device import Device, DeviceLink
from iapb.haptics.rendering import read_device
from iapb.loop import (
    ADVANCE,
    COUPLE,
    FAILURES,
    MOVE,
    RENDER,
    WHOLE,
    WRITE,
    follow_hand,
    make_record,
    run_steps,
)
from iapb.mechanics.bodies import finite_array, real_numbers
from iapb.numerics.compiled import Entry
from iapb.numerics.schema import Floats
from iapb.recording import Recorder
from iapb.run import COLLIDING, FREE, INTERRUPTED, RESTING, Run
from iapb.scene import Scene, find_scene, load_scene
from iapb.scene.mechanism import wrench, wrench_of
from iapb.system import System, system_of
from iapb.worlds import find_world


class Simulation:
    """A simulation of a scene under a contact law and a coupling, advanced by single steps or by
    chunks.

    Parameters
    ----------
    scene : Scene, its `iapb.system.System`, the path of a scene file, or the name of a scene of the
        project.
    law : contact law; default `ImpulseAugmented()`.
    coupling : coupling of device and tool; default `NoCoupling()`, with which the hand holds the
        tool itself.
    device : a Python device model (`iapb.haptics.device.Device`); default: the compiled device.

    Examples
    --------
    >>> simulation = Simulation(load_scene("scenes/peg_corner.yaml"))
    >>> result = simulation.step(hand_force=[0.1, 0.0, 0.0])
    """

    def __init__(
        self,
        scene: Scene | System | str | Path,
        law: ContactLaw | None = None,
        coupling: Coupling | None = None,
        device: Device | None = None,
    ) -> None:
        self.law: Any = ImpulseAugmented() if law is None else law
        parts = ("name", "settings", "advance")
        if isinstance(law, type) or not all(hasattr(self.law, part) for part in parts):
            expected = "a contact law: an object with name, settings and advance(...); "
            raise ArgumentError("law", law, f"{expected}the name of a world is given as world=...")
        self.coupling: Coupling = NoCoupling() if coupling is None else coupling
        if not isinstance(self.coupling, Coupling):
            expected = "a NoCoupling(), FourChannel(...) or UnilateralCoupler(...)"
            raise ArgumentError("coupling", coupling, expected)
        if not isinstance(scene, Scene | System):
            scene = load_scene(find_scene(scene))
        self.system = scene if isinstance(scene, System) else System(scene)
        self.scene = self.system.scene
        if isinstance(self.law, ImpulseAugmented | Penalty):
            self.law = self.law.within(self.scene)
        self.state = self.system.make_state()
        # else a subclass overrides it
        self.compiled = getattr(type(self.law), "advance", None) is Penalty.advance
        self.effects = decide(self.system, self.law, self.coupling)
        self.world = self.system.world_under(self.law if self.compiled else Penalty())
        self.port = self.system.make_port(self.coupling, self.effects, external=device is not None)
        if not isinstance(self.coupling, NoCoupling):
            self.state.cut.whole[:] = self.system.tool_tree
        self.link = None
        if device is not None:
            self.link = DeviceLink(device, self.world, self.state, self.port)
        self._planned = self.scene.hand is not None and self.scene.hand.changes
        self.steps_done = 0
        self._first: list[np.ndarray] | None = None  # of `rewind`

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.steps_done * self.system.dt

    def step(self, hand_force: ArrayLike | None = None) -> StepResult:
        """Do one step and return its result; the arrays are copies, with q and v at the end of the
        step.

        Parameters
        ----------
        hand_force : force [N] and torque [N m] of the hand from now on in world axes, (3,) in the
            plane or (6,) in space. None keeps the last one; at first that is the scene's force,
            which may change over time.

        Raises
        ------
        ArgumentError
            The force has a wrong shape or is not finite, or the scene has no hand.
        IapbError
            The step fails (see `iapb.contact.kernels.motion`), or the law returned an invalid step.
        """
        if hand_force is not None:
            self.hold(hand_force)
        self._step()
        return copied_step(self.system, self.state)

    def _step(self) -> None:
        if self._planned:
            self.port.wrench[:] = self._wrench_at(self.steps_done)
        moved = MOVE if self.link is None else 0
        if self.compiled:
            self._do(COUPLE | ADVANCE | RENDER | moved)
        else:
            self._do(COUPLE)
            self._take()
            self._do(RENDER | moved)
        if self.link is not None:
            self.link.exchange()
        self.steps_done += 1

    def follow(self, q: Floats, v: Floats) -> Floats:
        """Move the device through readings (n, d) of its position and velocity, one a step; return
        the actuator forces (n, d).

        Each call begins at the scene's start. The simulation needs a coupling; sensors and delay are
        the caller's.
        """
        self.rewind()
        forces = np.zeros(q.shape)
        status = 0
        if self.compiled:
            _, status = follow_hand(self.world, self.state, self.port, q, v, forces)
        else:
            for k in range(len(q)):
                self._read(self.world, self.state, self.port, q[k], v[k])
                self._do(COUPLE)
                self._take()
                self._do(RENDER)
                forces[k] = self.port.device_force
        if status:
            raise IapbError(FAILURES[status])
        return forces

    @cached_property
    def _read(self) -> Any:
        return Entry(read_device)

    def rewind(self) -> None:
        """Return to the state in which this was called first, at time 0."""
        arrays = self.state.arrays() + self.port.arrays()
        if self._first is None:
            self._first = [array.copy() for array in arrays]
        for array, first in zip(arrays, self._first, strict=True):
            array[...] = first
        self.steps_done = 0

    def _do(self, parts: int) -> None:
        """Do parts of one step."""
        _, status = run_steps(
            self.world, self.state, self.port, self._unwritten, parts, self.steps_done, 1
        )
        if status:
            raise IapbError(FAILURES[status])

    @cached_property
    def _unwritten(self) -> Any:
        """A record that is never written, for steps that are not recorded."""
        return make_record(1, *Recorder(self).shape)

    def hold(self, hand_force: ArrayLike) -> None:
        """Set the force of the hand from now on; see `step`."""
        if self.system.tool_tree < 0:
            raise ArgumentError(
                "hand_force", hand_force, f"None: scene {self.scene.name} has no hand"
            )
        force = real_numbers(hand_force)
        if force is None or force.shape not in ((3,), (6,)) or not np.isfinite(force).all():
            raise ArgumentError("hand_force", hand_force, "3 (plane) or 6 (space) finite numbers")
        self._planned = False
        self.port.wrench[:] = wrench(force)

    def _take(self) -> None:
        """Do the step of a law written in Python, and copy its result into the state that the device
        and the record read."""
        state = self.state
        result = self.law.advance(self.system, state, self.port.applied, self.system.dt)
        law = f"the law {self.law.name!r} returned"
        if not isinstance(result, StepResult):
            raise ArgumentError(f"{law} result", result, "a StepResult")
        if result.state not in (FREE, COLLIDING, RESTING):
            raise ArgumentError(f"{law} state", result.state, "FREE, COLLIDING or RESTING")
        contacts = state.contact_count, len(state.contacts.gap)
        for what, (count, most) in {
            "contact_count[0]": contacts,
            "impacts.logged[0]": (state.impacts.logged, len(state.impacts.rows)),
        }.items():
            given = int(count[0])
            if not 0 <= given <= most:
                state.contact_count[0] = state.impacts.logged[0] = 0
                expected = f"a count from 0 to {most}, the size of its buffer"
                raise ArgumentError(f"{law} {what}", given, expected)
        checked = {}
        for name in STEP_VECTORS:
            shape = getattr(state, name).shape
            checked[name] = finite_array(f"{law} {name}", getattr(result, name), shape)
        for name, vector in checked.items():
            getattr(state, name)[:] = vector
        tool = self.system.tool_tree
        state.state_of_tree[tool if tool >= 0 else slice(None)] = result.state

    def advance_chunk(self, record: Any, steps: int) -> tuple[int, BaseException | None]:
        """Do and record up to `steps` steps; return the number done, and the exception that stopped
        them or None."""
        if self.compiled and self.link is None:
            planned, stop = self._plan(steps)
            done, status = run_steps(
                self.world, self.state, self.port, record, WHOLE, self.steps_done, planned
            )
            self.steps_done += done
            return done, IapbError(FAILURES[status]) if status else stop
        for k in range(steps):
            try:
                self._step()
            except (IapbError, KeyboardInterrupt) as stop:
                return k, stop
            done = self.steps_done - 1
            run_steps(self.world, self.state, self.port, record, WRITE, done, 1)
        return steps, None

    def _plan(self, steps: int) -> tuple[int, IapbError | None]:
        """Give the compiled loop the hand's force of each step; return the number of valid steps
        and the error."""
        self.port.planned[:steps] = self.port.wrench
        if self._planned:
            for k in range(steps):
                try:
                    self.port.planned[k] = self._wrench_at(self.steps_done + k)
                except IapbError as stop:
                    return k, stop
        return steps, None

    def _wrench_at(self, step: int) -> Floats:
        """Return force and torque of the scene's hand in the middle of a step."""
        return wrench_of(self.scene, (step + 0.5) * self.system.dt)


def simulate(
    scene: Scene | str | Path,
    law: ContactLaw | Engine | None = None,
    coupling: Coupling | None = None,
    *,
    world: str = "",
    steps: int | None = None,
    every: int = 1,
    progress: Callable[[int, int], None] | None = None,
    max_memory: float | None = None,
) -> Run:
    """Simulate a scene in a named world, or with a contact law and a coupling, and return the run.

    Parameters
    ----------
    scene : Scene, the path of a scene file, or the name of a scene of the project.
    law, coupling : see `Simulation`; without both, those of the world. An engine (`iapb.engines`)
        in place of the law simulates the scene by its own method, without coupling.
    world : ``"IAPB"``, ``"PB"`` or another name of `iapb.worlds`, which selects the law, and the
        coupling with the scene's gains; default: IAPB, as in `iapb run`. If `law` is given, it is
        only a name for the record; default then: the names of law and coupling.
    steps : number of steps, at least 1; default: the scene's duration times its rate.
    every : N thins the record: it keeps every N-th step, each step with an impact, all impacts and
        the state at the end. Energies and distrust are those of all steps. For runs whose record
        would not fit in memory.
    progress : called as progress(steps done, total steps) after every chunk.
    max_memory : largest size of the record [bytes]; ``math.inf`` for no limit; default: half of the
        machine's memory.

    Returns
    -------
    Run
        ``complete`` is False if the loop was interrupted (Ctrl-C) or failed, and ``stopped`` says
        why. The arrays then end at the last complete chunk or step.

    Raises
    ------
    SceneError, ArgumentError
        The scene or the arguments are invalid, or the record would exceed `max_memory`; nothing is
        allocated yet.
    IapbError, KeyboardInterrupt
        The run stopped before its first step was done, so there is nothing to return.
    """
    is_limit = max_memory is None or _is_positive(max_memory, Real)
    counts = "a function of the steps done and the total"
    for name, value, fine, expected in (
        ("world", world, isinstance(world, str), "the name of a world, as text"),
        ("steps", steps, steps is None or _is_positive(steps, Integral), "a whole number >= 1"),
        ("every", every, _is_positive(every, Integral), "a whole number >= 1"),
        ("progress", progress, progress is None or callable(progress), counts),
        ("max_memory", max_memory, is_limit, "a number of bytes > 0; math.inf for no limit"),
    ):
        if not fine:
            raise ArgumentError(name, value, expected)
    if not isinstance(scene, Scene):
        scene = _scene_at(find_scene(scene))
    if law is None and (world or coupling is None):
        world = world or "IAPB"
        chosen = find_world(world)
        law = chosen.law
        coupling = chosen.coupling_in(scene) if coupling is None else coupling
    if is_engine(law):
        if every != 1:
            raise ArgumentError("every", every, f"1: {law.name} records every step")
        started = perf_counter()
        run = law.run(scene, steps, progress)
        seconds = run.chunk_seconds
        if not seconds.any():
            seconds = np.array([perf_counter() - started])
        return replace(run, world=world or law.name, chunk_seconds=seconds)
    contact_law: Any = law
    simulation = Simulation(system_of(scene), contact_law, coupling)
    total = simulation.scene.steps if steps is None else int(steps)
    recorder = Recorder(simulation, int(every))
    _check_memory(recorder.bytes_per_step, total, int(every), max_memory)
    stopped = record(recorder, total, progress)
    return recorder.run(world, stopped)


def _is_positive(value: Any, kind: Any) -> bool:
    return isinstance(value, kind) and not isinstance(value, bool) and bool(value > 0)


def _scene_at(path: Path) -> Scene:
    """Return the scene of a file, cached by its text; a scene with a robot is read again, for its
    URDF may change."""
    text = b"urdf"  # of a file that cannot be read: `load_scene` raises the right error
    with suppress(OSError):
        text = path.read_bytes()
    return load_scene(path) if b"urdf" in text else _scene_of(path, text)


@lru_cache(maxsize=8)
def _scene_of(path: Path, text: bytes) -> Scene:
    return load_scene(path)


def record(
    recording: Recorder, total: int, progress: Callable[[int, int], None] | None = None
) -> str:
    """Simulate up to `total` steps, chunk by chunk; return why the run stopped early, or "" if it
    did not.

    progress : see `simulate`.

    Raises
    ------
    IapbError, KeyboardInterrupt
        The run stopped before its first step was done.
    """
    stop: BaseException | None = None
    try:
        while recording.steps < total and stop is None:
            stop = recording.chunk(total)
            if progress is not None:
                progress(recording.steps, total)
    except KeyboardInterrupt as interrupt:
        stop = interrupt
    if stop is not None and recording.steps == 0:
        raise stop
    why = INTERRUPTED if isinstance(stop, KeyboardInterrupt) else str(stop)
    return "" if recording.steps == total else why


def _check_memory(each: int, steps: int, every: int, most: float | None) -> None:
    """Raise an ArgumentError if the kept steps take more than `most` bytes; default: half of the
    machine's memory."""
    if most is None:
        most = 4e9  # if the system does not report it
        with suppress(AttributeError, ValueError, OSError):
            most = 0.5 * os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    size = -(-steps // every) * each
    if size > most:
        fits = -(-steps * each // max(int(most), 1))
        raise ArgumentError(
            "steps",
            steps,
            f"at most {int(most / each) * every:,}: the record takes {each} bytes a step and more "
            f"with contacts, {min(size, 1e300) / 1e9:.3g} GB in all, of {most / 1e9:.3g} GB that it may take. "
            f"every={fits} (iapb run --every {fits}) keeps one step of {fits} and fits; "
            "max_memory=math.inf takes the limit away",
        )


def require_complete(run: Run) -> Run:
    """Return the run if it is complete; otherwise raise the error that stopped it."""
    if run.complete:
        return run
    if run.stopped == INTERRUPTED:
        raise KeyboardInterrupt
    raise IapbError(
        f"{run.scene_name} in the world {run.world} stopped after {run.time[-1]:g} s: {run.stopped}"
    )
