"""`iapb effects SCENE`: list which effects a scene needs, why, and what leaving one out would
change."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from iapb import decide_effects
from iapb.effects import ignored_fields
from iapb.errors import ArgumentError
from iapb.scene import Scene
from iapb.worlds import find_world
from reports.commands.run import Rendering, SceneName, scene_given
from reports.show import Answer, Json, stage_progress
from verification.cost.effects import MEASURED, SAME, effects_of, step_of
from verification.table import titled


def effects(
    scene: SceneName,
    world: Annotated[
        str | None,
        typer.Option(
            help="Decide for one world (ideal, ideal-friction, IAPB, PB, CBuc, IAPB-friction, IAPB-push); else an "
            "effect is on if some world needs it."
        ),
    ] = None,
    rendering: Rendering = "full",
    measure: Annotated[
        bool,
        typer.Option(
            "--measure",
            help="Run the scene with and without each effect (in the world IAPB or PB), and time its step. "
            "Takes seconds.",
        ),
    ] = False,
    json_: Json = False,
) -> Answer:
    """List every effect of SCENE: on or off, the reason, and what leaving it out would change."""
    source = scene_given(scene, None)
    if measure:
        return _measured(source, world or "IAPB")
    chosen = find_world(world, rendering) if world else None
    found = (
        decide_effects(source, chosen.law, chosen.coupling_in(source))
        if chosen
        else decide_effects(source)
    )
    on = [effect for effect in found if effect.active]
    ignored = ignored_fields(found)
    said = f" ({world} ignores {', '.join(ignored)})" if ignored else ""
    lines = [
        f"Effects of {source.name}{f' in {world}' if world else ''}: what is on, and what it prevents{said}"
    ]
    lines += [f"  {one.name:<20}{one.reason}\n{'':<22}without it: {one.left_out}" for one in on]
    lines += ["Off, because", *(f"  {one.name:<20}{one.reason}" for one in found if not one.active)]
    lines.append(f"{len(on)} of {len(found)} effects are on; the others cost nothing.")
    return Answer({"scene": source.name, "world": world, "effects": found}, lines)


def _measured(source: Scene, world: str) -> Answer:
    """Return what changes without each effect, and the time that the effects which are off save."""
    if world not in ("IAPB", "PB"):
        raise ArgumentError(
            "world", world, "IAPB or PB: --measure needs a world of the compiled engine"
        )
    with stage_progress() as progress:
        progress("with and without each effect", 0, 1)
        table = effects_of(source, world)
        times = step_of(source, world)
    found = table.records()
    columns = ("effect", "reason", *MEASURED)
    shown = titled(
        columns,
        [[one[key.partition(" [")[0]] for key in columns] for one in found if one["active"]],
    )
    lines: list[Any] = [
        f"Effects of {source.name} in {world}, measured",
        shown,
        f"A step takes {times['step [µs]']:.3g} µs; with every effect on "
        f"{times['all on [µs]']:.3g} µs: {times['saved [%]']:.0f} % saved, noise "
        f"{times['noise [%]']:.0f} %.",
    ]
    if idle := [one["effect"] for one in found if one["without it"] == SAME]:
        lines.append(f"On, and change nothing in this run: {', '.join(idle)}.")
    return Answer({"scene": source.name, "world": world, "measured": found, "times": times}, lines)
