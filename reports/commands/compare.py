"""`iapb compare`: a scene in several worlds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iapb.errors import MissingDependencyError
from iapb.lazy import needed
from reports.commands.run import Values, scene_given
from reports.commands.solvers import as_json_file, facts_of, judgements
from reports.figures.worlds import worlds_svg
from reports.show import Answer, Json, sentence, stage_progress
from reports.store.io import write_whole
from verification.finding import Finding
from verification.table import Table, titled
from verification.worlds import compare_worlds

FOLDER = Path("out/compare")


def compare(
    scene: Annotated[
        str,
        typer.Argument(help="A scene file, or the name of a scene that comes with the project."),
    ],
    worlds: Annotated[
        str | None,
        typer.Option(
            help="Worlds to run; default: IAPB,PB,ideal, and those with friction if SCENE has some."
        ),
    ] = None,
    against: Annotated[
        str | None,
        typer.Option(
            help="The world that the others are compared with; default: ideal, or ideal-friction if SCENE has friction."
        ),
    ] = None,
    set_: Values = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="File of the results, .json; default: in out/compare. The figure stands beside it."
        ),
    ] = None,
    json_: Json = False,
) -> Answer:
    """Compare worlds on SCENE: distances, energy, time, and IAPB's impacts with the LCP's."""
    place = as_json_file(out)
    with stage_progress() as progress:
        found = compare_worlds(
            scene_given(scene, set_),
            worlds.split(",") if worlds else None,
            against,
            progress=progress,
        )
    place = place or FOLDER / f"{found.details['scene']}.json"
    lines = [*_scene_lines(found), *judgements(found)]
    try:
        needed("matplotlib", "The figure")
    except MissingDependencyError as missing:  # the numbers are worth printing without it
        lines.append(str(missing))
    else:
        figure = place.with_suffix(".svg")
        drawn = worlds_svg(
            found.tables["worlds"], found.tables["over time"], found.details["against"]
        )
        write_whole(figure, drawn)
        lines.append(f"Figure: {figure}")
    answer = Answer(facts_of(found), [*lines, f"Stored in {place}"], 1 if found.failures else 0)
    write_whole(place, answer.text(json_=True))
    return answer


def _scene_lines(found: Finding) -> list[str | Table]:
    """Return one page of text: distances, energy and time by world."""
    table = found.tables["worlds"]
    against = found.details["against"]
    far = titled(
        (
            "world",
            "apart, rms [mm]",
            "most [mm]",
            "end [mm]",
            "velocity, rms [mm/s]",
            "impulse, rms [N s]",
            "end [N s]",
        ),
        [
            (
                "own error" if row["world"] == against else row["world"],
                *(1e3 * row[f"configuration, {size}"] for size in ("rms", "most", "end")),
                1e3 * row["velocity, rms"],
                row["impulse, rms"],
                row["impulse, end"],
            )
            for row in sorted(table.records(), key=lambda row: bool(row["world"] == against))
            if row["configuration, rms"] is not None
        ],
        3,
    )
    rest = (
        "world",
        "energy lost",
        "most above start and work",
        "deepest overlap",
        "impacts",
        "time per step",
        "times the fastest",
    )
    ignoring = (
        sentence(f"{row['world']} ignores {row['ignores']}.")
        for row in table.records()
        if row["ignores"]
    )
    return [
        found.title,
        sentence(found.answer),
        *ignoring,
        "",
        f"Distance from {against} (impulse: {found.details['impulse']})",
        far,
        "",
        "Energy, penetration, time",
        table.select(rest),
        "",
    ]
