"""`iapb effects SCENE`: list which effects a scene needs, why, and what leaving one out would change."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from iapb import decide_effects
from iapb.advice.effects import ignored_fields
from iapb.errors import ArgumentError
from reference.worlds import find_world
from reports.commands.as_json import Json, print_json
from reports.commands.progress import stage_progress
from reports.commands.run import Rendering, SceneName, scene_given
from verification.cost.effects import NOTHING, effects_of, summary


def effects(
    scene: SceneName,
    world: Annotated[str | None, typer.Option(
        help="Decide for one world (ideal, ideal-friction, IAPB, PB, CBuc, IAPB-friction, IAPB-push); else an "
             "effect is on if some world needs it.")] = None,
    rendering: Rendering = "full",
    measure: Annotated[bool, typer.Option(
        "--measure", help="Run the scene with and without each effect (in the world IAPB or PB): its cost per step, "
        "and what changes without it. Takes seconds.")] = False,
    json_: Json = False,
) -> None:
    """List every effect of SCENE: on or off, the reason, and what leaving it out would change."""
    source = scene_given(scene, None)
    if measure:
        _measure(source, world or "IAPB", json_)
        return
    if world is None:
        found = decide_effects(source)
    else:
        chosen = find_world(world, rendering)
        found = decide_effects(source, chosen.law, chosen.coupling_in(source))
    if json_:
        print_json({"scene": source.name, "world": world, "effects": found})
        return
    on = [effect for effect in found if effect.active]
    ignored = ignored_fields(found)
    said = f" ({world} ignores {', '.join(ignored)})" if ignored else ""
    print(f"Effects of {source.name}" + (f" in {world}" if world else "") + f": what is on, and what it prevents{said}")
    for effect in on:
        print(f"  {effect.name:<20}{effect.reason}\n{'':<22}without it: {effect.left_out}")
    print("Off, because")
    for effect in found:
        if not effect.active:
            print(f"  {effect.name:<20}{effect.reason}")
    print(f"{len(on)} of {len(found)} effects are on; the others cost nothing.")


def _measure(source: Any, world: str, json_: bool) -> None:
    """Print the cost and the influence of each effect, and for which no other saves more time at no larger error."""
    if world not in ("IAPB", "PB"):
        raise ArgumentError("world", world, "IAPB or PB: --measure needs a world of the compiled engine")
    with stage_progress() as progress:
        found = effects_of(source, world, lambda done, total: progress("with and without each effect", done, total))
    if json_:
        print_json({"scene": source.name, "world": world, "measured": found.records()})
        return
    best = {row["effect"]: row["best of its error"] for row in summary({source.name: found}).records()}
    caption = "Best of its error: no other effect saves more time at the cost of no larger error."
    table = Table(title=f"Effects of {source.name} in {world}, measured", show_lines=True, caption=caption)
    for heading in ("effect", "on", "why", "cost", "changes without it", "best of its error"):
        table.add_column(heading, overflow="fold")
    for one in found.records():
        change = (one["change"] or one["left out"]) if one["active"] else "–"
        table.add_row(one["effect"], "on" if one["active"] else "off", one["reason"], one["cost"] or "–", change,
                      best.get(one["effect"], "–"))  # fmt: skip
    console = Console(width=max(140, Console().width))
    console.print(table)
    idle = [one["effect"] for one in found.records() if (one["change"] or "").startswith(NOTHING)]
    if idle:
        print(f"On, and change nothing in this run: {', '.join(idle)}.")
