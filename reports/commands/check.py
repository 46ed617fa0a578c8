"""`iapb check SCENE`: find problems that would make a run of the scene worthless, before the
run."""

from __future__ import annotations

from typing import Annotated

import typer

from iapb.advice.checks import Caution, Start, check_scene, step_limits
from iapb.system import system_of
from iapb.worlds import find_world
from reports.commands.run import DISTRUSTED, SceneName, Values, cost_in_words, scene_given
from reports.show import Answer, Json


def check(
    scene: SceneName,
    world: Annotated[str, typer.Option(help="World of the run; see iapb run.")] = "IAPB",
    set_: Values = None,
    json_: Json = False,
) -> Answer:
    """Warn of problems that would make a run of SCENE worthless, with values to set; end with 3
    then."""
    source = scene_given(scene, set_)
    remarks = system_of(source).remarks
    found = find_world(world)
    law = found.law
    law = law.within(source) if hasattr(law, "within") else law
    cautions = check_scene(source, law, found.coupling)
    said, refused = cost_in_words(source, law)
    if refused:
        cautions = (*cautions, Caution("size", source.name, said))
    elif said:
        remarks = (*remarks, f"{source.name} in {world}: {said}")
    lines = [f"{remark}." for remark in remarks]
    limits = None
    if source.contact.forces == "paper":  # implicit contact has no such limits
        limits = step_limits(Start(source))
    if limits is not None:
        lines.append(
            f"At {source.rate:g} Hz the step holds contact.stiffness <= {limits.stiffness:.3g} "
            f"N/m and "
            f"contact.damping <= {limits.damping:.3g} N s/m, each with the other unchanged; "
            f"critical "
            f"contacts: {limits.where}, effective mass {limits.mass:.3g} kg."
        )
    lines += [f"Warning: {caution}." for caution in cautions] or [
        f"Nothing wrong with {source.name} was found."
    ]
    return Answer(
        {
            "scene": source.name,
            "world": world,
            "remarks": remarks,
            "limits": limits,
            "warnings": cautions,
        },
        lines,
        DISTRUSTED if cautions else 0,
    )
