"""`iapb run SCENE`: simulate a scene in one of the paper's worlds and store the run."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from iapb.advice.checks import check_scene
from iapb.effects import ignored_fields
from iapb.errors import counted, to_stderr
from iapb.run import INTERRUPTED, Run
from iapb.scene import Scene, find_scene, load_scene, scene_names
from iapb.system import System
from iapb.worlds import find_world
from reports.runner import Runner
from reports.show import Answer, Json, duration, one_line, stage_progress
from reports.store.io import blocks
from reports.store.uses import parsed

SceneName = Annotated[
    str,
    typer.Argument(
        help="A scene file, or the name of a scene that comes with the project: see iapb scenes.",
        autocompletion=lambda incomplete: [
            name for name in scene_names() if name.startswith(incomplete)
        ],
    ),
]
Rendering = Annotated[
    str,
    typer.Option(
        help="How impulses meet the device's limits: full, saturate, scale or spread (IAPB only)."
    ),
]
Values = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="Change a value: contact.friction=0.3, bodies.peg.position=[0.03,-0.01,0]. Repeatable.",
    ),
]
WORTH_SAYING = 60.0  # [s] expected computing time
DISTRUSTED = 3  # exit status of a run whose result is not to be trusted
ROUNDING = 1e-14  # share of the kinetic energy: a smaller loss is printed as 0
SHOWN_COORDINATES = 12  # more would not fit into a readable line


def scene_given(name: str, values: list[str] | None) -> Scene:
    """Return the scene with that name or file, changed by the values of ``--set``."""
    scene = load_scene(find_scene(name))
    return scene.with_values(parsed(values)) if values else scene


def run(
    scene: SceneName,
    world: Annotated[
        str,
        typer.Option(
            help="ideal, IAPB, PB or CBuc (paper, section VI); ideal-friction: with "
            "Coulomb friction; IAPB-friction: with Coulomb friction in impacts; "
            "IAPB-push: contacts only push."
        ),
    ] = "IAPB",
    rendering: Rendering = "full",
    set_: Values = None,
    every: Annotated[
        int, typer.Option(min=1, help="Record every N-th step only; a long run takes less memory.")
    ] = 1,
    out: Annotated[Path, typer.Option(help="Folder of the run files.")] = Path("out/runs"),
    json_: Json = False,
) -> Answer:
    """Simulate SCENE and store the run as HDF5. An existing run is reused.

    Prints the warnings of iapb check first. Ends with status 3 if the result is not to be trusted.
    Ctrl-C keeps the steps done, in a file that ends in .partial.
    """
    source = scene_given(scene, set_)
    runner = Runner(out)
    chosen = find_world(world, rendering)
    law = chosen.law
    cautions = check_scene(source, law, chosen.coupling)
    said, _ = cost_in_words(source, law)
    if said:
        to_stderr(f"{source.name} in {world}: {said}.")
    for caution in cautions:
        to_stderr(f"Warning: {caution}.")
    place = runner.place_of(source, world, rendering, every)
    existed = place.path.is_file()
    stage = f"{source.name} in {world}: steps"
    with stage_progress(stage, transient=True) as progress:
        runner.progress = partial(progress, stage)
        result, _ = runner.fetch(source, world, rendering, every)
    file = place.path if result.complete else place.partial
    lines = list(describe(result, existed))
    if result.complete:
        lines.append(f"Stored in {one_line(file)}")
        status = DISTRUSTED if result.distrust else 0
    else:
        lines.append(
            f"Stopped: {result.stopped}. The {result.steps_done} steps done are readable in {one_line(file)}"
        )
        status = 130 if result.stopped == INTERRUPTED else 1
    return Answer(run_as_json(result) | {"warnings": cautions, "file": file}, lines, status)


def cost_in_words(scene: Scene, law: Any) -> tuple[str, bool]:
    """Return a warning if a rigid world will take long, and whether it refuses the scene; "" for
    other laws."""
    if not hasattr(law, "cost"):
        return "", False
    cost = law.cost(System(scene))
    rows = f"{cost.contacts:,} contacts of {cost.coordinates:,} coordinates in each step"
    if cost.too_large:
        return f"{rows}: more than the rigid worlds take; fewer bodies, or the world IAPB", True
    if cost.seconds * scene.steps < WORTH_SAYING:
        return "", False
    return (
        f"{rows}, about {duration(cost.seconds)} a step and {duration(cost.seconds * scene.steps)} in all",
        False,
    )


def run_as_json(run: Run) -> dict[str, Any]:
    """Return the summary of a run as plain values."""
    return {
        "scene": run.scene_name,
        "world": run.world,
        "law": run.law,
        "coupling": run.coupling,
        "steps": run.steps_done,
        "every": run.every,
        "dt": run.dt,
        "complete": run.complete,
        "stopped": run.stopped,
        "collisions": len(run.impacts.step) if run.records_contacts else None,
        "deepest_penetration": deepest(run) if run.records_contacts else None,
        "end": dict(zip(run.coordinate_names, run.q[-1].tolist(), strict=True)),
        "ignores": ignored_fields(run.effects),
        "remarks": run.remarks,
        "distrust": run.distrust,
    }


def deepest(run: Run) -> float:
    """Return the deepest penetration [m]; the gaps may be in memory or in the run's file."""
    return max(0.0, *(-float(block.min(initial=0.0)) for block in blocks(run.contacts.gap)))


def describe(run: Run, existed: bool) -> Iterator[str]:
    """Yield a summary of a run in sentences; the arrays may be in memory or in the run's file."""
    seconds = float(np.sum(run.chunk_seconds))
    impacts = run.impacts
    ignored = ignored_fields(run.effects)
    said = f"; ignores {', '.join(ignored)}" if ignored else ""
    yield f"{run.scene_name} in the world {run.world}: {run.law}, coupling {run.coupling}{said}."
    how = "read from its file; it had taken" if existed else "computed in"
    yield (
        f"{run.steps_done} steps of {run.dt * 1e3:.4g} ms, {how} {duration(seconds)} "
        f"({duration(seconds / max(run.steps_done, 1))} a step)."
    )
    if run.every > 1:
        yield f"Recorded are {run.steps} of them: one of {run.every}, and those with an impact."
    if len(impacts.step):
        taken = (float(np.sum(block)) for block in blocks(impacts.energy_lost))
        lost = sum(taken)
        if abs(lost) <= ROUNDING * float(np.max(run.energy.get("kinetic", 0.0))):
            lost = 0.0
        most = max(int(block.max()) for block in blocks(impacts.rows))
        yield (
            f"{counted(len(impacts.step), 'impact')}, the first at "
            f"{run.time[impacts.step[0]]:.4f} s, up to "
            f"{counted(most, 'contact')} at once; {lost:.4g} J were lost in them."
        )
    elif run.records_contacts:
        yield "No contact got an impulse."
    if len(run.contacts.gap):
        yield f"Deepest penetration {deepest(run) * 1e3:.4g} mm."
    count = len(run.coordinate_names)
    tool = range(*run.tool_coordinates)
    shown = range(count) if count <= SHOWN_COORDINATES else tool or range(SHOWN_COORDINATES)
    more = (
        f" (and {count - len(shown)} more coordinates in the run's file)"
        if count > len(shown)
        else ""
    )
    yield f"At the end: {', '.join(f'{run.coordinate_names[i]} {run.q[-1, i]:.6g}' for i in shown)}{more}."
    yield from (f"{remark}." for remark in run.remarks)
    if run.distrust:
        yield f"This result is not to be trusted, because {'; '.join(run.distrust)}."
