"""`iapb inspect FILE`: describe a run file from its contents alone."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iapb.run import Run
from reports.commands.run import describe, run_as_json
from reports.show import Answer, Json
from reports.store.runs import RunEntry, opened_run, read_provenance
from verification.table import Table, titled

# A listed impact: attribute of the run's table -> key in JSON and heading of the column
_IMPACT = {
    "rows": "rows",
    "rank": "rank",
    "energy_lost": "energy lost [J]",
    "scale": "device scale",
    "clamp": "clamp",
    "approaching": "closing",
}


def inspect(
    file: Annotated[
        Path, typer.Argument(help="A run file (.h5, or .h5.partial of an interrupted run).")
    ],
    impacts: Annotated[int, typer.Option(min=0, help="How many impacts to list.")] = 10,
    json_: Json = False,
) -> Answer:
    """Describe a run: scene, law, collisions, energy, effects, provenance and hashes."""
    with opened_run(file) as (run, entry):
        return _run(run, entry, read_provenance(file), impacts)


def _run(run: Run, entry: RunEntry, provenance: dict[str, str], impacts: int) -> Answer:
    """Describe a run whose arrays are in its file."""
    table = run.impacts
    listed = [
        {"time": run.time[step]} | {name: getattr(table, name)[i] for name in _IMPACT}
        for i, step in enumerate(table.step[:impacts])
    ]
    energy = {name: values[-1] for name, values in run.energy.items()} if run.steps else {}
    lines: list[str | Table] = [
        *describe(run, existed=True),
        "Complete." if run.complete else f"Partial: {run.stopped or 'interrupted'}.",
    ]
    if listed:
        rows = [tuple(one.values()) for one in listed]
        lines += [
            f"The first {len(rows)} of {len(table.step)} impacts",
            titled(("time [s]", *_IMPACT.values()), rows, digits=5),
        ]
    if energy:  # a run can be stopped before its first step is done
        lines += [
            "\nEnergy at the end [J] (iapb.mechanics.energy):",
            *(f"  {name:<22}{value: .6e}" for name, value in energy.items()),
        ]
    if run.effects:
        lines += [
            "\nEffects that were on:",
            *(f"  {effect.name}: {effect.reason}" for effect in run.effects if effect.active),
        ]
    lines += [
        "\nProvenance:",
        *(f"  {name}: {''.join(text.splitlines()[:1])}" for name, text in provenance.items()),
    ]
    lines.append(f"\nrun key      {entry.run_key}\ncontent hash {entry.content_hash}")
    return Answer(
        run_as_json(run)
        | {
            "impacts": listed,
            "energy": energy,
            "effects": run.effects,
            "provenance": provenance,
            "run_key": entry.run_key,
            "content_hash": entry.content_hash,
        },
        lines,
    )
