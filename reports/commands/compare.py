"""`iapb compare`: IAPB beside complementarity, on random impacts, the project's scenes and problem files."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from iapb.errors import ArgumentError
from reference.datasets import problem_files
from reference.fclib import write_fclib
from reports.commands.progress import stage_progress
from verification.complementarity.findings import parts_of
from verification.complementarity.findings import problems as problem_parts
from verification.complementarity.problems import FACTORS, ProblemStudy, own_problems, study_problems
from verification.complementarity.study import ComparisonStudy
from verification.complementarity.study import compare as study_all
from verification.cost.step_cost import CostRow
from verification.finding import Failure


def compare(
    problems: Annotated[list[Path] | None, typer.Option(
        help="A folder of problem files (LCP, MLCP, FCLIB) for every solver. Repeatable.")] = None,
    only_problems: Annotated[bool, typer.Option(
        "--only-problems", help="Only the problem files, not the comparison on impacts.")] = False,
    full: Annotated[bool, typer.Option("--full", help="Ten times the impacts, more repeats.")] = False,
    export: Annotated[Path | None, typer.Option(
        help="Write our own problems to this folder as FCLIB files, and stop.")] = None,
) -> None:
    """Compare IAPB with complementarity: motion, energy, adhesion, extensions, time; and solvers on problem files."""
    if only_problems and not problems:
        raise typer.BadParameter("give a folder with --problems", param_hint="--only-problems")
    for folder in problems or ():
        _require_problems(folder)
    console = Console()
    if export is not None:
        export.mkdir(parents=True, exist_ok=True)
        with stage_progress() as progress:
            progress("our own problems", 0, 1)
            count = _export(export)
        print(f"{count} problems written to {export}")
        return
    with stage_progress() as progress:
        if only_problems:
            failures: list[Failure] = []
            studies = [study_problems(folder, progress=progress, failures=failures) for folder in problems or ()]
            found = [part for study in studies for part in problem_parts(study)]
            tables = [table for study in studies for table in _problem_tables(study)]
        else:
            study = study_all("full" if full else "quick", problems or (), progress=progress)
            found, tables, failures = list(parts_of(study)), _tables(study), list(study.failures)
    for table in tables:
        console.print(table)
    for part in found:
        console.print(f"• {part.sentence}", highlight=False)
    if failures:
        for one in failures:
            print(f"Not computed: {one.case}: {one.error}: {one.reason}")
        raise typer.Exit(1)


def _require_problems(folder: Path) -> None:
    if not problem_files(folder):
        kinds = ".lcp, .lcp.gz, .dat, .txt, .hdf5, .h5"
        raise ArgumentError("--problems", str(folder), f"a folder with problem files ({kinds})")


def _export(folder: Path) -> int:
    """Write the problems that the study always has, one file each."""
    problems = [stored.problem for stored in own_problems()]
    for problem in problems:
        title = problem.name.replace("μ", "mu")  # FCLIB's titles are ASCII
        name = re.sub(r"[^a-z0-9.]+", "_", title.lower())
        write_fclib(folder / f"{name}.hdf5", problem, title)
    return len(problems)


def _tables(study: ComparisonStudy) -> list[Table]:
    tables = [_map_table(study), _friction_table(study), _convergence_table(study), _cost_table(study)]
    return tables + [table for each in study.problems for table in _problem_tables(each)]


def _table(title: str, *headings: str) -> Table:
    table = Table(title=title)
    for i, heading in enumerate(headings):
        table.add_column(heading, justify="left" if i == 0 else "right", overflow="fold")
    return table


def _map_table(study: ComparisonStudy) -> Table:
    table = _table("IAPB and the Newton LCP (distances in the kinetic metric, of |v⁻|)", "impacts", "e", "redundant",
                   "cases", "agree", "pull", "artefact", "negative p", "typical", "largest", "extra loss")  # fmt: skip
    for cell in study.cells + study.scenes:
        typical = "" if cell.agree == 1.0 else f"{cell.typical:.2g}"
        table.add_row(cell.family, f"{cell.restitution:g}", str(cell.redundancy), str(cell.cases), _share(cell.agree),
                      _share(cell.adhesive), _share(cell.artefact), _share(cell.adhesive_share), typical,
                      f"{cell.farthest:.2g}", f"{max(cell.extra_loss, 0.0):.2g}")  # fmt: skip
    return table


def _friction_table(study: ComparisonStudy) -> Table:
    table = _table("Friction in the impact: IAPB, Coulomb's NCP, its relaxation CCP (energies of KE⁻)", "e", "μ",
                   "cases", "all push", "as NCP", "reduced", "unsolved", "NCP gains", "CCP gains", "most, IAPB",
                   "most, NCP", "most, CCP")  # fmt: skip
    for c in study.friction:
        table.add_row(f"{c.restitution:g}", f"{c.friction:g}", *(str(n) for n in (
            c.cases, c.pushing, c.same, c.reduced, c.unsolved, c.ncp_gains, c.ccp_gains)),
            f"{c.largest_gain:.0e}", f"{c.largest_gain_ncp:.2g}", f"{c.largest_gain_ccp:.2g}")  # fmt: skip
    return table


def _convergence_table(study: ComparisonStudy) -> Table:
    table = _table("The rigid world against event-driven truth: errors per step, coarse to fine", "scene", "device",
                   "until [s]", "events", "positions", "order", "velocities", "order")  # fmt: skip
    for row in study.convergence:
        table.add_row(row.scene, "yes" if row.coupled else "no", f"{row.duration:g}", str(row.events),
                      f"{row.position_coarse:.3g} to {row.position_fine:.3g}", f"{row.position_order:.2f}",
                      f"{row.velocity_coarse:.3g} to {row.velocity_fine:.3g}", f"{row.velocity_order:.2f}")  # fmt: skip
    return table


def _cost_table(study: ComparisonStudy) -> Table:
    solvers = list(dict.fromkeys(row.solver for row in study.impact_costs))
    table = _table("Time per impact [µs]: median (least to largest)", "impacts", "contacts", *solvers)
    cells = {(row.family, row.contacts, row.solver): row for row in study.impact_costs}
    for family, contacts in sorted({(row.family, row.contacts) for row in study.impact_costs}):
        table.add_row(family, str(contacts), *(_spread(cells[family, contacts, solver]) for solver in solvers))
    return table


def _spread(row: CostRow) -> str:
    if not row.repeats:
        return row.verdict
    median, least, largest = (f"{seconds * 1e6:.3g}" for seconds in (row.median, row.least, row.largest))
    return f"{median} ({least} to {largest})" + ("" if row.verdict == "solved" else f" {row.verdict}")


def _problem_tables(study: ProblemStudy) -> list[Table]:
    verdicts = _table(f"{study.folder}: every solver on every problem", "problem", "unknowns", "rank", "asymmetry",
                      *study.solvers, "spread")  # fmt: skip
    for line in study.lines:
        by = dict(line.verdicts)
        skew = f"{line.asymmetry:.1g}" if line.asymmetry else ""
        outcomes = (by.get(solver, "") for solver in study.solvers)
        verdicts.add_row(line.problem, str(line.unknowns), str(line.rank), skew, *outcomes, f"{line.spread:.0e}")
    for file in study.unread:
        verdicts.add_row(file.file, "", "", "", *("not read" for _ in study.solvers), "")
    return [verdicts, _profile_table(study)]


def _profile_table(study: ProblemStudy) -> Table:
    shown = [1.0, 3.0, 10.0, 100.0, 1e5]
    title = "Performance profile (Dolan and Moré): share solved within a factor of the fastest"
    table = _table(title, "kind", "solver", *(f"{factor:g}" for factor in shown))  # fmt: skip
    for kind, solver, share in study.profile:
        at = [share[np.searchsorted(FACTORS, factor, side="right") - 1] for factor in shown]
        table.add_row(kind, solver, *(_share(float(value)) for value in at))
    return table


def _share(value: float) -> str:
    return f"{100 * value:.0f} %"
