"""Simulate in real time while a page shows the motion, and let the mouse pull the tool by a spring.

The loop works in ticks of a few milliseconds. In each tick it evaluates the force of the hand once,
does the steps of that time in one call, and waits for the end of the tick. If the steps take longer
than the tick, all later ticks are put off by as much. So no step is left out, and two ticks never
run in the time of one.
"""

from __future__ import annotations

import signal
import time
from dataclasses import replace
from threading import Event
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.errors import IapbError
from iapb.recording import Recorder
from iapb.run import Run
from iapb.scene.mechanism import wrench_of
from iapb.simulation import Simulation

Floats = NDArray[np.float64]

TICK = 4e-3  # [s] in which the hand's force stays the same; short compared to the spring's period
PULLED = "the mouse pulled the tool, so the scene alone does not give this run again"
_FREQUENCY = 2.0 * np.pi * 2.0  # [rad/s] of the pulled point: as fast as an arm follows a target
_ACCELERATION = 1.0  # [m/s²] that the largest force gives the pulled point


class Pull(NamedTuple):
    """What the mouse pulls: a point of the tool, in its body's axes, and where to; (3,) [m]."""

    point: Floats
    target: Floats


class Seen(NamedTuple):
    """A run that was shown: how many of its steps were late, and by how much at most [s]."""

    run: Run
    late: int
    latest: float


def spring(simulation: Simulation, pull: Pull, own: Floats) -> Floats:
    """Return force and torque (6,) [N, N m] of a spring from a point x of the tool to the mouse.

    F = k (target − x) − b ẋ with k = m ω² and b = 2 m ω. m = 1 / λ_max(J M⁻¹ Jᵀ) is the smallest
    effective mass at x, so the spring is slow in every direction. |F| is limited to the force that
    gives m an acceleration of 1 m/s², and holds it against gravity and the scene's own hand.

    Parameters
    ----------
    simulation : of a scene with a hand.
    own : (6,) force and torque of the scene's own hand.

    Returns
    -------
    At the point that the hand holds, in world axes.
    """
    port = simulation.port
    mechanism = simulation.system.mechanism
    q = simulation.state.q
    v = simulation.state.v
    rotations, origins = mechanism.placements(q)
    point = origins[port.hand_body] + rotations[port.hand_body] @ pull.point
    arm = rotations[port.hand_body] @ (pull.point - port.hand_point)
    jacobian = mechanism.point_jacobian(q, port.hand_body, point)
    mobility = jacobian @ np.linalg.solve(mechanism.mass_matrix(q), jacobian.T)
    mass = 1.0 / float(np.linalg.eigvalsh(mobility)[-1])
    force = mass * _FREQUENCY * (_FREQUENCY * (pull.target - point) - 2.0 * jacobian @ v)
    acceleration = _ACCELERATION + np.linalg.norm(simulation.system.gravity)
    limit = mass * acceleration + np.linalg.norm(own[:3])
    force *= limit / max(limit, np.linalg.norm(force))
    return np.concatenate([force, np.cross(arm, force)])


def watch(simulation: Simulation, world: str, seconds: float, page: Any, clock: Any = time) -> Seen:
    """Simulate in real time until the time is over, the page closes, Ctrl-C comes, or a step fails.

    Parameters
    ----------
    simulation : in its initial state.
    world : name of the world, for the record.
    seconds : longest duration [s].
    page : a `reports.view.page.Page`, or another object with `pull`, `show` and `is_open`.
    clock : has the functions `monotonic` and `sleep` of the module `time`.

    Raises
    ------
    IapbError
        The first step fails.
    """
    dt = simulation.system.dt
    total = max(1, round(seconds / dt))
    most = max(1, round(TICK / dt))
    mechanism = simulation.system.mechanism
    recorder = Recorder(simulation)
    stop: BaseException | None = None
    was_pulled = False
    late = 0
    latest = 0.0
    interrupted = Event()  # so that Ctrl-C ends the loop between two ticks, and every step is whole
    before = signal.signal(signal.SIGINT, lambda *_: interrupted.set())
    due = clock.monotonic()
    try:
        while (
            stop is None and recorder.steps < total and page.is_open() and not interrupted.is_set()
        ):
            steps = min(most, total - recorder.steps)
            try:
                was_pulled = was_pulled or page.pull is not None
                if was_pulled:
                    own = wrench_of(simulation.scene, simulation.time + 0.5 * steps * dt)
                    pull = page.pull  # may change meanwhile
                    simulation.hold(
                        own + spring(simulation, pull, own) if pull is not None else own
                    )
                stop = recorder.chunk(total, steps)
            except IapbError as error:
                stop = error
            page.show(mechanism.poses(simulation.state.q[None], planar=False)[0])
            due += steps * dt
            behind = clock.monotonic() - due
            if behind > 0.0:
                late += steps
                latest = max(latest, behind)
                due += behind
            clock.sleep(max(0.0, -behind))
    finally:
        signal.signal(signal.SIGINT, before)
    if recorder.steps == 0 and stop is not None:
        raise stop
    run = recorder.run(world, "" if stop is None else str(stop))
    if was_pulled:
        run = replace(run, remarks=(*run.remarks, PULLED))
    return Seen(run, late, latest)
