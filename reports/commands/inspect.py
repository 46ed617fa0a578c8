"""`iapb inspect FILE`: describe a run file (a simulation, or an impact that broke a law) from its contents alone."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from iapb.run import Run
from reports.commands.as_json import Json, print_json
from reports.commands.run import describe, run_as_json
from reports.counterexamples import recheck_command
from reports.store.impact import BrokenImpact, read_broken_impact
from reports.store.runs import read_provenance, read_stored


def inspect(
    file: Annotated[Path, typer.Argument(help="A run file (.h5, or .h5.partial of an interrupted run).")],
    impacts: Annotated[int, typer.Option(min=0, help="How many impacts to list.")] = 10,
    json_: Json = False,
) -> None:
    """Describe a run: scene, law, collisions, energy, effects, provenance and hashes."""
    run, entry = read_stored(file)
    broken = read_broken_impact(file)
    if json_:
        print_json(_as_json(run, impacts) | {
            "broken law": broken and {"law": broken.law, "resolver": broken.resolver, "statement": broken.statement,
                                      "residual": broken.value, "allowed": broken.tolerance, "test": broken.test},
            "provenance": read_provenance(file), "run_key": entry.run_key, "content_hash": entry.content_hash})
        return
    if broken is None:
        describe(run, existed=True)
        print("Complete." if run.complete else f"Partial: {run.stopped or 'interrupted'}.")
    else:
        describe_impact(broken, file)
    if impacts and len(run.impacts.step):
        _list_impacts(run, impacts)
    if run.steps:  # a run can be stopped before its first step is done
        print("\nEnergy at the end [J] (iapb.mechanics.energy):")
        for name, values in run.energy.items():
            print(f"  {name:<22}{values[-1]: .6e}")
    if run.effects:
        print("\nEffects that were on:")
    for effect in run.effects:
        if effect.active:
            print(f"  {effect.name}: {effect.reason}")
    print("\nProvenance:")
    for name, text in read_provenance(file).items():
        print(f"  {name}: {text.splitlines()[0] if text else ''}")
    print(f"\nrun key      {entry.run_key}\ncontent hash {entry.content_hash}")


def _as_json(run: Run, count: int) -> dict[str, Any]:
    """Return the run, its first impacts, its energy at the end and its effects as plain values."""
    table = run.impacts
    names = ("rows", "rank", "energy_lost", "scale", "clamp", "approaching")
    listed = [{"time": run.time[table.step[i]]} | {name: getattr(table, name)[i] for name in names}
              for i in range(min(count, len(table.step)))]
    energy = {name: values[-1] for name, values in run.energy.items()} if run.steps else {}
    return run_as_json(run) | {"impacts": listed, "energy": energy, "effects": run.effects}


def _list_impacts(run: object, count: int) -> None:
    table = run.impacts  # type: ignore[attr-defined]
    shown = Table(title=f"The first {min(count, len(table.step))} of {len(table.step)} impacts")
    for heading in ("time [s]", "rows", "rank", "energy lost [J]", "device scale", "clamp", "closing"):
        shown.add_column(heading, justify="right")
    for i in range(min(count, len(table.step))):
        shown.add_row(f"{run.time[table.step[i]]:.5f}", str(table.rows[i]), str(table.rank[i]),  # type: ignore[attr-defined]
                      f"{table.energy_lost[i]:.4e}", f"{table.scale[i]:.4f}", f"{table.clamp[i]:.6f}",
                      str(table.approaching[i]))
    Console().print(shown)


def describe_impact(broken: BrokenImpact, file: Path) -> None:
    """Print which law was broken, by which resolver, how it was found, and a test to paste."""
    case = broken.struck.case
    print(f"An impact of {broken.resolver} that breaks a law, {broken.law}: {broken.statement}.")
    print(f"Residual {broken.value:.6g}, allowed {broken.tolerance:.6g}.")
    if broken.struck.complaint:
        print(f"The resolver: {broken.struck.complaint}.")
    print(f"{case.contacts} rows on {case.coordinates} coordinates ({case.family or 'no family'}), in bare numbers.")
    origin = broken.found
    print(f"Found as case {origin['index']} of the part {origin['part']!r}, seed {origin['request']['seed']}. "
          f"Judged again by: {recheck_command(file, origin['request']['resolver'])}")
    given = {"mass matrix M": case.mass_matrix, "contact Jacobian J": case.contact_jacobian,
             "velocity before": case.velocity, "restitution": case.given_restitution(),
             "velocity after": broken.struck.velocity_after}  # fmt: skip
    for name, values in given.items():
        print(f"\n{name}:\n{np.array2string(np.asarray(values), precision=6, prefix='  ', max_line_width=110)}")
    print(f"\nAs a test, every digit:\n\n{broken.test}\n")
