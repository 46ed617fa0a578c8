"""`iapb live SCENE`: simulate a scene in real time, with a device, a mouse and a viewer."""

from __future__ import annotations

import sys
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, TextIO

import typer

from iapb.compiling import compiling_told, to_stderr
from iapb.errors import ArgumentError
from iapb.simulation import INTERRUPTED, Simulation
from reference.worlds import find_world
from reports.commands.answer import Json, print_json
from reports.commands.run import Rendering, SceneName, Values, counted, duration, scene_given
from reports.live.budget import calibrated
from reports.live.deadline import Pace
from reports.live.device import live_simulation
from reports.live.loop import Loop
from reports.live.replay import finish_live, open_log
from reports.live.viewer import Viewer
from reports.store.logs import RunLog

LONGEST = 1e8  # ticks: at 1 kHz more than a day


def live(
    scene: SceneName,
    rate: Annotated[float, typer.Option(help="Steps per second; replaces the scene's own.")] = 1000.0,
    seconds: Annotated[float, typer.Option(help="Duration in real time; Ctrl-C ends it earlier.")] = 60.0,
    world: Annotated[str, typer.Option(help="Contact law and coupling, as in `iapb run`.")] = "IAPB",
    rendering: Rendering = "full",
    device: Annotated[str, typer.Option(
        help="module:factory of your own device (factory(scene) -> iapb.haptics.device.Device), or: simulated. "
             "Default: the device compiled into the loop.")] = "",
    view: Annotated[bool, typer.Option("--view", help="Show it in a browser, with the mouse as the hand.")] = False,
    port: Annotated[int, typer.Option(min=1, max=65535, help="Port of the viewer, on this machine only.")] = 8080,
    budget: Annotated[bool, typer.Option(help="Limit the rows of an impact to the time left.")] = True,
    set_: Values = None,
    out: Annotated[Path, typer.Option(help="Folder of the run files.")] = Path("out/live"),
    json_: Json = False,
) -> None:
    """Simulate SCENE in real time, report missed deadlines, and store the run and its tick times."""
    if not 0.0 < rate < float("inf"):
        raise ArgumentError("--rate", rate, "a number of steps per second > 0")
    if not 1.0 <= seconds * rate < LONGEST:
        raise ArgumentError("--seconds", seconds, f"at least one step ({1.0 / rate:g} s), less than {LONGEST:g} s")
    source = scene_given(scene, set_)
    out.mkdir(parents=True, exist_ok=True)  # an unusable folder is reported before the run, not after it
    with compiling_told(to_stderr):
        simulation = live_simulation(source, find_world(world, rendering), rate, device)
        name = f"{source.name}-{datetime.now(UTC):%Y%m%dT%H%M%S%f}"
        ticks = round(seconds * rate)
        log = open_log(out, name, simulation, world, ticks)
        try:
            stopped = _held(simulation, ticks, budget, port if view else None, log,
                            sys.stderr if json_ else sys.stdout)
            run, timetable, pace = finish_live(log.path, stopped, log.steps)
        except BaseException:
            log.close(remove=log.steps == 0)
            if log.steps:
                print(f"What was done is in {log.path}; iapb store repair {out} makes it readable.", file=sys.stderr)
            raise
        log.close(remove=True)
    if json_:
        print_json(asdict(pace) | {"run": run, "timetable": timetable, "stopped": stopped})
    else:
        describe(pace)
        print(f"Run: {run}\nTimetable: {timetable}")
        if stopped:
            print(f"Stopped: {stopped}. What was done is in the files.")
    if stopped:
        raise typer.Exit(130 if stopped == INTERRUPTED else 1)


def _held(simulation: Simulation, ticks: int, budget: bool, port: int | None, log: RunLog, to: TextIO) -> str:
    """Run the ticks and return what stopped them. With a `port`, start a viewer and print its address to `to`."""
    rows = calibrated(simulation, simulation.system.dt) if budget else None
    length = f"{ticks * simulation.system.dt:.4g} s; Ctrl-C ends it before."
    if port is None:
        loop = Loop(simulation, ticks, budget=rows, log=log)
        print(f"Under way for {length}", file=to, flush=True)
        return loop.stream()
    viewer = Viewer(simulation, port)
    try:
        loop = Loop(simulation, ticks, budget=rows, audience=viewer, log=log)
        print(f"See it, and drag the handle, at {viewer.start()} for {length}", file=to, flush=True)
        return loop.stream()
    finally:
        viewer.stop()


def describe(pace: Pace) -> None:
    """Print in sentences how well the loop kept its deadlines."""
    print(f"{pace.scene}: {pace.ticks} ticks at {pace.rate:g} Hz, {1e3 / pace.rate:.4g} ms each.")
    for what, times in (("A tick's work took", pace.work), ("It began late by", pace.lateness)):
        half, ninety, hundredth, thousandth, worst = map(duration, times)
        print(f"{what} {half} in the median; {ninety} at 90 %, {hundredth} at 99 %, {thousandth} at 99.9 %, "
              f"{worst} at worst.")
    print(_misses(pace))
    print(_rows(pace))


def _misses(pace: Pace) -> str:
    if not pace.missed:
        return "No deadline was missed: simulated time is the clock's."
    share = 100.0 * pace.missed / pace.ticks
    were = "was" if pace.missed == 1 else "were"
    return (f"{counted(pace.missed, 'deadline')} {were} missed ({share:.3g} %). No step was left out: what came "
            f"after was done that much later, and simulated time is {duration(pace.behind)} behind the clock.")


def _rows(pace: Pace) -> str:
    if not pace.collisions:
        return "No collision was resolved by an impulse."
    collisions, left_out = counted(pace.collisions, "collision"), pace.rows_left_out
    if not left_out:
        return f"{collisions}, each with all the rows it needed (the least budget was {pace.least_rows})."
    were = "was" if left_out == 1 else "were"
    return (f"{collisions}; the time left gave them {counted(pace.least_rows, 'row')} at the least, and "
            f"{counted(left_out, 'row')} that still approached {were} left to the next steps.")
