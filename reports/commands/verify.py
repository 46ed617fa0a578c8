"""`iapb verify`: test an impact resolver against every law."""

from __future__ import annotations

from typing import Annotated

import typer

from iapb.names import function_named
from reports.show import Answer, Json, stage_progress
from verification import check_passivity
from verification.laws import CONTRACTS
from verification.laws.kit import CALL_LIMIT, IMPACTS

ENGINE = "iapb:resolve_impact"
# with --json
LAW_FIELDS = ("law", "statement", "checked", "failures", "largest", "fault")


def verify(
    resolver: Annotated[
        str,
        typer.Option(
            help="package.module:function, called as (mass_matrix, contact_jacobian, velocity, restitution); with "
            "--contract frictional as (mass_matrix, contact_jacobian, tangents, velocity, restitution, friction)."
        ),
    ] = ENGINE,
    contract: Annotated[
        str, typer.Option(help=f"Contract of the resolver: {', '.join(CONTRACTS)}.")
    ] = "equality",
    laws: Annotated[
        list[str] | None,
        typer.Option(help="Only these laws, by name: kinetic_energy,pushing; may be repeated."),
    ] = None,
    impacts: Annotated[
        int, typer.Option(min=1, help="Random impacts; 200 give a first answer in seconds.")
    ] = IMPACTS,
    seed: Annotated[
        int, typer.Option(min=0, max=2**63 - 1, help="Seed of the random impacts.")
    ] = 0,
    unequal: Annotated[
        bool, typer.Option("--unequal", help="Also pass one restitution per contact.")
    ] = False,
    own_process: Annotated[
        bool,
        typer.Option(
            "--own-process",
            help=f"Call the resolver in a process of its own; a call over {CALL_LIMIT:g} s is ended.",
        ),
    ] = False,
    json_: Json = False,
) -> Answer:
    """Test an impact resolver against every law; print the verdict, the worst case and a shrunk
    counterexample."""
    tested = function_named("--resolver", resolver)
    named = [name for given in laws or () for name in given.split(",") if name]
    with stage_progress() as progress:
        report = check_passivity(
            tested,
            contract=contract,
            laws=named if laws else None,
            impacts=impacts,
            seed=seed,
            unequal_restitution=unequal,
            own_process=own_process,
            progress=lambda *done: progress(_stage(done[1], impacts), *done),
        )
    names = ("resolver", "contract", "impacts", "seed", "passed")
    facts = {name: getattr(report, name) for name in names}
    facts["unfinished"] = report.unfinished
    facts["report"] = str(report)
    facts["laws"] = [{name: getattr(one, name) for name in LAW_FIELDS} for one in report.verdicts]
    return Answer(facts, [str(report)], 0 if report.passed else 1)


def _stage(total: int, impacts: int) -> str:
    """Name of the stage of the kit with this total."""
    return "impacts" if total == impacts else "seconds of the search for a counterexample"
