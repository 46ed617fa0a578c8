"""`iapb inspect FILE`: describe a run file (a simulation, or an impact that broke a law) from its contents alone."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from reports.commands.run import describe, run_as_json
from reports.counterexamples import recheck_command
from reports.show import Answer, Json
from reports.store.impact import BrokenImpact, read_broken_impact
from reports.store.runs import read_provenance, read_stored
from verification.table import Table, titled

# A listed impact: attribute of the run's table -> key in JSON and heading of the column
_IMPACT = {"rows": "rows", "rank": "rank", "energy_lost": "energy lost [J]", "scale": "device scale", "clamp": "clamp",
           "approaching": "closing"}  # fmt: skip


def inspect(
    file: Annotated[Path, typer.Argument(help="A run file (.h5, or .h5.partial of an interrupted run).")],
    impacts: Annotated[int, typer.Option(min=0, help="How many impacts to list.")] = 10,
    json_: Json = False,
) -> Answer:
    """Describe a run: scene, law, collisions, energy, effects, provenance and hashes."""
    run, entry = read_stored(file)
    broken, provenance, table = read_broken_impact(file), read_provenance(file), run.impacts
    listed = [{"time": run.time[step]} | {name: getattr(table, name)[i] for name in _IMPACT}
              for i, step in enumerate(table.step[:impacts])]
    energy = {name: values[-1] for name, values in run.energy.items()} if run.steps else {}
    lines: list[str | Table]
    if broken is None:
        lines = [*describe(run, existed=True), "Complete." if run.complete
                 else f"Partial: {run.stopped or 'interrupted'}."]
    else:
        lines = [*_impact_lines(broken, file)]
    if listed:
        rows = [tuple(one.values()) for one in listed]
        lines += [f"The first {len(rows)} of {len(table.step)} impacts",
                  titled(("time [s]", *_IMPACT.values()), rows, digits=5)]
    if energy:  # a run can be stopped before its first step is done
        lines += ["\nEnergy at the end [J] (iapb.mechanics.energy):",
                  *(f"  {name:<22}{value: .6e}" for name, value in energy.items())]
    if run.effects:
        lines += ["\nEffects that were on:",
                  *(f"  {effect.name}: {effect.reason}" for effect in run.effects if effect.active)]
    lines += ["\nProvenance:", *(f"  {name}: {''.join(text.splitlines()[:1])}" for name, text in provenance.items())]
    lines.append(f"\nrun key      {entry.run_key}\ncontent hash {entry.content_hash}")
    return Answer(run_as_json(run) | {
        "impacts": listed, "energy": energy, "effects": run.effects, "provenance": provenance,
        "run_key": entry.run_key, "content_hash": entry.content_hash,
        "broken law": broken and {"law": broken.law, "resolver": broken.resolver, "statement": broken.statement,
                                  "residual": broken.value, "allowed": broken.tolerance, "test": broken.test}}, lines)


def _impact_lines(broken: BrokenImpact, file: Path) -> Iterator[str]:
    """Yield which law was broken, by which resolver, how it was found, and a test to paste."""
    case, origin = broken.struck.case, broken.found
    yield f"An impact of {broken.resolver} that breaks a law, {broken.law}: {broken.statement}."
    yield f"Residual {broken.value:.6g}, allowed {broken.tolerance:.6g}."
    if broken.struck.complaint:
        yield f"The resolver: {broken.struck.complaint}."
    yield f"{case.contacts} rows on {case.coordinates} coordinates ({case.family or 'no family'}), in bare numbers."
    yield (f"Found as case {origin['index']} of the part {origin['part']!r}, seed {origin['request']['seed']}. "
           f"Judged again by: {recheck_command(file, origin['request']['resolver'])}")
    given = {"mass matrix M": case.mass_matrix, "contact Jacobian J": case.contact_jacobian,
             "velocity before": case.velocity, "restitution": case.given_restitution(),
             "velocity after": broken.struck.velocity_after}  # fmt: skip
    for name, values in given.items():
        yield f"\n{name}:\n{np.array2string(np.asarray(values), precision=6, prefix='  ', max_line_width=110)}"
    yield f"\nAs a test, every digit:\n\n{broken.test}\n"
