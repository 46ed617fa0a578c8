"""`iapb verify`: the passivity kit on anybody's impact resolver; `--full`: every law at length, resumable."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

ENGINE = "iapb:resolve_impact"


def verify(
    resolver: Annotated[str, typer.Option(
        help="package.module:function, called as (mass_matrix, contact_jacobian, velocity, restitution).")]
    = ENGINE,
    impacts: Annotated[int | None, typer.Option(min=1, help="Random impacts; default 5000, with --full 1,000,000.")]
    = None,
    seed: Annotated[int, typer.Option(min=0, max=2**63 - 1, help="Seed of the draw.")] = 0,
    unequal: Annotated[bool, typer.Option("--unequal", help="Also give it a restitution per contact.")] = False,
    full: Annotated[bool, typer.Option("--full", help="A million impacts and thousands of trajectories; what was done "
                                       "before is kept, and can be gone on with after a stop.")] = False,
    trajectories: Annotated[int, typer.Option(min=0, help="Random scenes of --full.")] = 5000,
    workers: Annotated[int, typer.Option(min=1, max=512, help="Processes of --full.")] = 1,
    out: Annotated[Path, typer.Option(help="Folder of the batches of --full.")] = Path("out/verify"),
    recheck: Annotated[Path | None, typer.Option(help="Judge a stored counterexample again.")] = None,
    simulator: Annotated[list[str] | None, typer.Option(
        help="Instead, an engine on the fixed scenes: mujoco, drake, ... or all; may be repeated.")] = None,
    scene: Annotated[list[str] | None, typer.Option(
        help="With --simulator: only this fixed scene; may be repeated.")] = None,
) -> None:
    """Test an impact resolver against every law; print the verdict, the worst case and a shrunk counterexample."""
    if scene and not simulator:
        raise typer.BadParameter("give an engine with --simulator", param_hint="--scene")
    if simulator:
        from reports.commands.verify_simulator import verify_simulators

        verify_simulators(simulator, scene or ())
        return
    if recheck is not None:
        from reports.commands.verify_full import print_recheck

        passed = print_recheck(recheck)
    elif full:
        from reports.commands.verify_full import verify_full

        passed = verify_full(resolver, impacts or 1_000_000, trajectories, seed, workers, out)
    else:
        passed = _kit(resolver, impacts, seed, unequal)
    if not passed:
        raise typer.Exit(1)


def _kit(resolver: str, impacts: int | None, seed: int, unequal: bool) -> bool:
    from reports.by_name import function_named
    from reports.commands.progress import stage_progress
    from verification import check_passivity
    from verification.properties.kit import IMPACTS

    tested = function_named("--resolver", resolver)
    with stage_progress() as progress:
        report = check_passivity(tested, impacts=impacts or IMPACTS, seed=seed, unequal_restitution=unequal,
                                 progress=lambda done, total: progress("impacts", done, total))
    print(report)
    return report.passed
