"""`iapb check SCENE`: what would make a run of the scene worthless, before it is run."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import Annotated, Any

import typer

from iapb.checks import Caution, Start, check_scene, settled, step_limits
from iapb.scene import Scene
from reference.worlds import find_world
from reports.commands.run import DISTRUSTED, SceneName, Values, scene_given


def check(
    scene: SceneName,
    world: Annotated[str, typer.Option(help="World that the scene is to run in; see iapb run.")] = "IAPB",
    set_: Values = None,
    json_: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Warn of what would make a run of SCENE worthless, each with its number and what to set; end with 3 then."""
    source, remarks = settled(scene_given(scene, set_))
    law = find_world(world).law
    cautions = check_scene(source, law)
    limits = step_limits(Start(source), getattr(law, "integrator", "semi_implicit_euler"))
    if json_:
        print(json.dumps({
            "scene": source.name, "world": world, "remarks": remarks, "limits": limits and _finite(asdict(limits)),
            "warnings": [caution._asdict() for caution in cautions]}, indent=1, ensure_ascii=False))
    else:
        _print(source, remarks, limits, cautions)
    if cautions:
        raise typer.Exit(DISTRUSTED)


def _finite(values: dict[str, Any]) -> dict[str, Any]:
    """JSON has no infinity: a rate that no number is large enough for becomes null."""
    return {name: None if value == math.inf else value for name, value in values.items()}


def _print(source: Scene, remarks: tuple[str, ...], limits: Any, cautions: tuple[Caution, ...]) -> None:
    for remark in remarks:
        print(f"{remark}.")
    if limits is not None:
        print(f"At {source.rate:g} Hz the step holds contact.stiffness <= {limits.stiffness:.3g} N/m and "
              f"contact.damping <= {limits.damping:.3g} N s/m, each beside the other as given; least at "
              f"{limits.where}, effective mass {limits.mass:.3g} kg.")
    for caution in cautions:
        print(f"Warning: {caution}.")
    if not cautions:
        print(f"Nothing wrong with {source.name} was found.")
