"""Prepare a scene for a live run (rate, world, device), and measure how a live run keeps its rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from iapb.errors import ArgumentError, IapbError
from iapb.haptics.device import Device, SimulatedDevice
from iapb.run import Run
from iapb.scene import Scene
from iapb.simulation import Simulation
from iapb.system import System
from reference.worlds import World, find_world
from reports.by_name import function_named
from reports.live.budget import calibrated
from reports.live.deadline import Clock, Spread, Timetable
from reports.live.loop import LiveRun, Loop

_SIMULATED = "simulated"  # the word for `simulated_device`


def live_simulation(scene: Scene, world: World, rate: float, device: str = "") -> Simulation:
    """Return a simulation whose step is the period of the rate, so that simulated time is real time.

    Parameters
    ----------
    scene : Scene; its own rate is replaced.
    world : law and coupling, see `reference.worlds`.
    rate : float [1/s]
    device : ``module:factory`` of a user's device, ``simulated``, or empty for the compiled device.
    """
    scene = scene.with_values({"rate": rate})
    made = made_device(device, scene)
    try:
        return Simulation(scene, world.law, world.coupling_in(scene), made)
    except IapbError:
        raise
    except Exception as error:
        if made is None:
            raise
        raise IapbError(f"the device failed at its first reading: {type(error).__name__}: {error}") from error


def made_device(name: str, scene: Scene) -> Device | None:
    """Return the device that ``module:factory`` makes for a scene; None for an empty name.

    Raises
    ------
    ArgumentError
        There is no such factory, or it does not return a device.
    """
    if not name:
        return None
    make = simulated_device if name == _SIMULATED else function_named(
        "--device", name, "module:factory, such as my_lab.omega:connect, or simulated")  # fmt: skip
    try:
        device: Device = make(scene)
    except IapbError:
        raise
    except Exception as error:  # a device of somebody's own
        why = f"{type(error).__name__}: {error}"
        raise ArgumentError("--device", name, f"a factory that makes a device of a scene ({why})") from error
    return device


@dataclass(frozen=True)
class Pace:
    """How a live run kept its rate; times [s] at the percentiles of `reports.live.deadline.PERCENTILES`."""

    scene: str
    rate: float  # [1/s]
    ticks: int
    work: tuple[float, ...]  # of a tick
    lateness: tuple[float, ...]  # of its beginning
    missed: int
    behind: float  # [s] that simulated time fell behind the clock
    collisions: int
    least_rows: int  # that the time left gave a collision
    rows_left_out: int  # rows that still approached after impacts that had used up their budget


def simulated_device(scene: Scene) -> SimulatedDevice:
    """Return the Python version of a scene's compiled device: its inertia, damping, delay, sensors and limits.

    Raises
    ------
    ArgumentError
        The scene has no hand, or the tool's mass matrix is not constant, which only the compiled device supports.
    """
    system = System(scene)
    if system.tool_tree < 0:
        raise ArgumentError("scene", scene.name, "a scene with a hand")
    tool, state = system.device_mechanism(), system.make_state()
    q, v = state.q[slice(*system.tool_coordinates)], state.v[slice(*system.tool_dofs)]
    if not tool.has_constant_mass_matrix or len(q) != len(v):
        raise ArgumentError("scene", scene.name, "a tool of constant inertia, with as many velocities as coordinates")
    given = scene.device
    settings: dict[str, Any] = {} if given is None else {
        "damping": given.damping, "force_limit": given.force_limit, "delay": given.delay,
        "resolution": given.position_resolution,
    }  # fmt: skip
    return SimulatedDevice(tool.mass_matrix(q), q, v, dt=system.dt, **settings)


def pace(scene: Scene, rate: float, seconds: float, *, world: str = "IAPB", budgeted: bool = True,
         clock: Clock | None = None) -> Pace:
    """Run a scene for some seconds of real time at a rate, and return how it kept the rate.

    Parameters
    ----------
    scene : Scene; its own rate is replaced by `rate`.
    rate : float [1/s]
    seconds : float [s] of simulated time, and of real time if no deadline is missed.
    world : one of `reference.worlds.WORLDS`.
    budgeted : whether the time left limits the rows of an impact; otherwise impacts use all rows.
    clock : default: the clock of this machine.
    """
    simulation = live_simulation(scene, find_world(world), rate)
    budget = calibrated(simulation, simulation.system.dt) if budgeted else None
    live = Loop(simulation, max(1, round(seconds * rate)), clock, budget).run(world)
    return summary(live)


def summary(live: LiveRun) -> Pace:
    """Return the measured numbers of a live run."""
    tally = Tally()
    tally.add(live.run, live.timetable)
    return tally.pace()


class Tally:
    """Collects the numbers of a live run that is given in parts, in constant memory."""

    def __init__(self) -> None:
        self._scene, self._period, self._ticks, self._behind = "", 1.0, 0, 0.0
        self._work, self._lateness = Spread(), Spread()
        self._missed = self._collisions = self._left_out = 0
        self._least: int | None = None

    def add(self, run: Run, table: Timetable) -> None:
        """Add a part of the run and the ticks of this part."""
        impacts = run.impacts
        given = table.budget[impacts.step[:] - self._ticks]
        short = (impacts.rank[:] >= given) & (given < run.v.shape[1])
        self._left_out += int(impacts.approaching[:][short].clip(0).sum())
        self._collisions += len(given)
        if len(given):
            self._least = min(int(given.min()), self._least or int(given.min()))
        self._scene, self._period, self._ticks = run.scene_name, table.period, self._ticks + len(table.due)
        self._work.add(table.work)
        self._lateness.add(table.lateness)
        self._missed += int(table.missed.sum())
        self._behind += table.behind

    def pace(self) -> Pace:
        """Return the numbers of all parts."""
        return Pace(self._scene, 1.0 / self._period, self._ticks, self._work.percentiles(),
                    self._lateness.percentiles(), self._missed, self._behind, self._collisions, self._least or 0,
                    self._left_out)  # fmt: skip
