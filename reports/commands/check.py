"""`iapb check SCENE`: find problems that would make a run of the scene worthless, before the run."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from iapb.advice.checks import Caution, Start, check_scene, settled, step_limits
from iapb.scene import Scene
from reference.worlds import find_world
from reports.commands.as_json import Json, print_json
from reports.commands.run import DISTRUSTED, SceneName, Values, cost_in_words, scene_given


def check(
    scene: SceneName,
    world: Annotated[str, typer.Option(help="World of the run; see iapb run.")] = "IAPB",
    set_: Values = None,
    json_: Json = False,
) -> None:
    """Warn of problems that would make a run of SCENE worthless, with values to set; end with 3 then."""
    source, remarks = settled(scene_given(scene, set_))
    law = find_world(world).law
    law = law.within(source) if hasattr(law, "within") else law
    cautions, (said, refused) = check_scene(source, law), cost_in_words(source, law)
    if refused:
        cautions = (*cautions, Caution("size", source.name, said))
    elif said:
        remarks = (*remarks, f"{source.name} in {world}: {said}")
    explicit = source.contact.forces == "paper"  # implicit contact has no such limits
    limits = step_limits(Start(source), getattr(law, "integrator", "semi_implicit_euler")) if explicit else None
    if json_:
        print_json({"scene": source.name, "world": world, "remarks": remarks, "limits": limits, "warnings": cautions})
    else:
        _print(source, remarks, limits, cautions)
    if cautions:
        raise typer.Exit(DISTRUSTED)


def _print(source: Scene, remarks: tuple[str, ...], limits: Any, cautions: tuple[Caution, ...]) -> None:
    for remark in remarks:
        print(f"{remark}.")
    if limits is not None:
        print(f"At {source.rate:g} Hz the step holds contact.stiffness <= {limits.stiffness:.3g} N/m and "
              f"contact.damping <= {limits.damping:.3g} N s/m, each with the other unchanged; critical "
              f"contacts: {limits.where}, effective mass {limits.mass:.3g} kg.")
    for caution in cautions:
        print(f"Warning: {caution}.")
    if not cautions:
        print(f"Nothing wrong with {source.name} was found.")
