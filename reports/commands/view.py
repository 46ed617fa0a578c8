"""`iapb view SCENE`: a scene in real time in the browser, with the mouse as the hand."""

from __future__ import annotations

import webbrowser
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from iapb.engines import is_engine
from iapb.errors import ArgumentError, to_stderr
from iapb.simulation import Simulation
from iapb.worlds import find_world
from reports.commands.run import SceneName, Values, describe, run_as_json, scene_given
from reports.show import Answer, Json, duration, one_line
from reports.store.runs import write_run
from reports.view.loop import watch
from reports.view.page import Page

_LONGEST = 3600.0  # [s] the record of a run is in memory


def view(
    scene: SceneName,
    world: Annotated[
        str, typer.Option(help="Contact law and coupling, as in `iapb run`.")
    ] = "IAPB",
    set_: Values = None,
    seconds: Annotated[float, typer.Option(help="Longest duration.")] = 300.0,
    port: Annotated[
        int, typer.Option(min=1, max=65535, help="Port of the page, on this machine only.")
    ] = 8080,
    browser: Annotated[
        bool, typer.Option(help="Open the page in a browser, or only print its address.")
    ] = True,
    out: Annotated[Path, typer.Option(help="Folder of the run files.")] = Path("out/views"),
    json_: Json = False,
) -> Answer:
    """Show SCENE in real time in a browser, with the mouse as the hand, and store the run.

    The motion begins when the page is open. Drag the tool to pull it.
    Closing the page or Ctrl-C ends the run.
    """
    if not 0.0 < seconds <= _LONGEST:
        raise ArgumentError("--seconds", seconds, f"a time > 0, at most {_LONGEST:g} s")
    source = scene_given(scene, set_)
    law = find_world(world)
    if is_engine(law.law):
        raise ArgumentError("--world", world, "a contact law: an engine only runs as a whole")
    out.mkdir(parents=True, exist_ok=True)  # an unusable folder is reported before the run
    simulation = Simulation(source, law.law, law.coupling_in(source))
    if source.hand is None:
        to_stderr("The scene has no hand, so nothing can be pulled.")
    with closing(Page(source, port)) as page:
        to_stderr(f"Open {page.address}")
        if browser:
            webbrowser.open(page.address)
        page.wait()
        seen = watch(simulation, world, seconds, page)
    file = out / f"{source.name}-{world}-{datetime.now(UTC):%Y%m%dT%H%M%S%f}.h5"
    write_run(file, seen.run)
    lines = [*describe(seen.run, existed=False), f"Stored in {one_line(file)}"]
    if seen.run.stopped:
        lines.append(f"Stopped: {seen.run.stopped}.")
    if seen.late:
        steps = f"{seen.late} of {seen.run.steps} steps"
        lines.append(f"{steps} were late, by at most {duration(seen.latest)}.")
    facts = {"late_steps": seen.late, "latest": seen.latest, "file": file}
    return Answer(run_as_json(seen.run) | facts, lines, 1 if seen.run.stopped else 0)
