"""`iapb live SCENE`: simulate a scene in real time, with a device, a mouse and a viewer."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import closing, nullcontext
from dataclasses import asdict
from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from iapb.compiling import compiling_told, to_stderr
from iapb.errors import ArgumentError, MissingDependencyError, installing
from iapb.simulation import INTERRUPTED
from iapb.worlds import find_world
from reports.commands.run import Rendering, SceneName, Values, scene_given
from reports.live.budget import calibrated
from reports.live.deadline import Pace
from reports.live.device import live_simulation
from reports.live.loop import Loop
from reports.live.replay import finish_live, open_parts
from reports.live.viewer import Viewer
from reports.show import Answer, Json, counted, duration, one_line

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
) -> Answer:
    """Simulate SCENE in real time, report missed deadlines, and store the run and its tick times."""
    if not 0.0 < rate < float("inf"):
        raise ArgumentError("--rate", rate, "a number of steps per second > 0")
    if not 1.0 <= seconds * rate < LONGEST:
        raise ArgumentError("--seconds", seconds, f"at least one step ({1.0 / rate:g} s), less than {LONGEST:g} s")
    if view and find_spec("viser") is None:
        raise MissingDependencyError("viser", "--view", installing("report"))
    source = scene_given(scene, set_)
    out.mkdir(parents=True, exist_ok=True)  # an unusable folder is reported before the run, not after it
    with compiling_told(to_stderr):
        simulation = live_simulation(source, find_world(world, rendering), rate, device)
        ticks, length = round(seconds * rate), f"{round(seconds * rate) / rate:.4g} s; Ctrl-C ends it before."
        parts = open_parts(out, f"{source.name}-{datetime.now(UTC):%Y%m%dT%H%M%S%f}", simulation, world, ticks)
        try:
            rows = calibrated(simulation, simulation.system.dt) if budget else None
            with closing(Viewer(simulation, port)) if view else nullcontext() as viewer:
                loop = Loop(simulation, ticks, parts, budget=rows, audience=viewer)
                under_way = f"See it, and drag the handle, at {viewer.start()}" if viewer else "Under way"
                print(f"{under_way} for {length}", file=sys.stderr if json_ else sys.stdout, flush=True)
                stopped = loop.run()
            run, timetable, pace = finish_live(parts.folder, stopped, parts.steps)
        except BaseException:
            parts.close(remove=parts.steps == 0)
            if parts.steps:
                to_stderr(f"What was done is in {parts.folder}; iapb store repair {out} makes it readable.")
            raise
        parts.close(remove=True)
    lines = [*describe(pace), f"Run: {one_line(run)}", f"Timetable: {one_line(timetable)}"]
    if stopped:
        lines.append(f"Stopped: {stopped}. What was done is in the files.")
    return Answer(asdict(pace) | {"run": run, "timetable": timetable, "stopped": stopped}, lines,
                  (130 if stopped == INTERRUPTED else 1) if stopped else 0)


def describe(pace: Pace) -> Iterator[str]:
    """Yield in sentences how well the loop kept its deadlines."""
    yield f"{pace.scene}: {pace.ticks} ticks at {pace.rate:g} Hz, {1e3 / pace.rate:.4g} ms each."
    for what, times in (("A tick's work took", pace.work), ("It began late by", pace.lateness)):
        half, ninety, hundredth, thousandth, worst = map(duration, times)
        yield (f"{what} {half} in the median; {ninety} at 90 %, {hundredth} at 99 %, {thousandth} at 99.9 %, "
               f"{worst} at worst.")
    if not pace.missed:
        yield "No deadline was missed: simulated time is the clock's."
    else:
        share = 100.0 * pace.missed / pace.ticks
        yield (f"{counted(pace.missed, 'deadline')} {_were(pace.missed)} missed ({share:.3g} %). No step was left out: "
               f"what came after was done that much later, and simulated time is {duration(pace.behind)} behind the "
               "clock.")
    collisions, left_out = counted(pace.collisions, "impact"), pace.rows_left_out
    if not pace.collisions:
        yield "No contact got an impulse."
    elif not left_out:
        yield f"{collisions}, each with all the rows it needed (the least budget was {pace.least_rows})."
    else:
        yield (f"{collisions}; the time left gave them {counted(pace.least_rows, 'row')} at the least, and "
               f"{counted(left_out, 'row')} that still approached {_were(left_out)} left to the next steps.")


def _were(count: int) -> str:
    return "was" if count == 1 else "were"
