"""`iapb effects SCENE`: which effects a scene calls for, why, and what leaving one out would change."""

from __future__ import annotations

from typing import Annotated

import typer


def effects(
    scene: Annotated[str, typer.Argument(help="A scene file, or the name of a scene that comes with the project.")],
    world: Annotated[str | None, typer.Option(
        help="Decide for one world (ideal, IAPB, PB, CBuc, IAPB-friction); else an effect is on if some world needs "
             "it.")] = None,
    rendering: Annotated[str, typer.Option(help="full, saturate, scale or spread.")] = "full",
) -> None:
    """List every effect of SCENE: on or off, the reason, and what leaving it out would change."""
    from iapb import decide_effects, find_scene, load_scene

    source = load_scene(find_scene(scene))
    if world is None:
        found = decide_effects(source)
    else:
        from reference.worlds import find_world

        chosen = find_world(world, rendering)
        found = decide_effects(source, chosen.law.name, chosen.coupling_in(source).name, rendering)
    on = [effect for effect in found if effect.active]
    print(f"Effects of {source.name}" + (f" in {world}" if world else "") + ": what is on, and what it prevents")
    for effect in on:
        print(f"  {effect.name:<20}{effect.reason}\n{'':<22}without it: {effect.left_out}")
    print("Off, because")
    for effect in found:
        if not effect.active:
            print(f"  {effect.name:<20}{effect.reason}")
    print(f"{len(on)} of {len(found)} effects are on; the others cost nothing.")
