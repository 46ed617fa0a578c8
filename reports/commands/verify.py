"""`iapb verify`: test an impact resolver; `--full`: with the full campaign."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from iapb.by_name import function_named
from iapb.compiling import compiling_told, to_stderr
from reports.campaign import KEPT_PER_LAW, Campaign
from reports.counterexamples import ENGINE, CampaignRequest, recheck_command
from reports.counterexamples import recheck as judge_again
from reports.show import Answer, Json, stage_progress
from verification import check_passivity
from verification.laws import CONTRACTS
from verification.laws.bounds import LawCount
from verification.laws.campaign import IMPACTS, OF_ONE_CALL, ONE_IN, PARTS, plan
from verification.laws.kit import IMPACTS as KIT_IMPACTS
from verification.laws.worlds import judge_world

ENGINE_CONDITION, ANY_CONDITION = 1e10, 1e8  # largest κ(M) in tests of the engine, of any other resolver
WORLD_SCENES = 100  # random scenes of --world
LAW_FIELDS = ("law", "statement", "checked", "failures", "severe", "largest", "fault")  # with --json
_SHOWN = 20  # counterexamples listed; all are in their folder


def verify(
    resolver: Annotated[str, typer.Option(
        help="package.module:function, called as (mass_matrix, contact_jacobian, velocity, restitution); with "
             "--contract frictional as (mass_matrix, contact_jacobian, tangents, velocity, restitution, friction).")]
    = ENGINE,
    contract: Annotated[str, typer.Option(help=f"Contract of the resolver: {', '.join(CONTRACTS)}.")] = "equality",
    laws: Annotated[list[str] | None, typer.Option(
        help="Only these laws, by name: kinetic_energy,pushing; may be repeated.")] = None,
    impacts: Annotated[int | None, typer.Option(min=1, help="Random impacts; default 5000, with --full 1,000,000.")]
    = None,
    seed: Annotated[int, typer.Option(min=0, max=2**63 - 1, help="Seed of the random impacts.")] = 0,
    unequal: Annotated[bool, typer.Option("--unequal", help="Also pass one restitution per contact.")] = False,
    full: Annotated[bool, typer.Option("--full", help="A million impacts and thousands of trajectories; a "
                                       "stopped campaign continues.")] = False,
    trajectories: Annotated[int, typer.Option(min=0, help="Random scenes of --full.")] = 5000,
    workers: Annotated[int, typer.Option(min=1, max=512, help="Processes of --full.")] = 1,
    out: Annotated[Path, typer.Option(help="Folder of the batches of --full.")] = Path("out/verify"),
    recheck: Annotated[Path | None, typer.Option(help="Judge a stored counterexample again.")] = None,
    allow_code: Annotated[bool, typer.Option(
        "--allow-code", help="With --recheck: import and call the resolver named in the file.")] = False,
    world: Annotated[str | None, typer.Option(
        help="Put a world to the laws of trajectories on random scenes instead: mujoco, or your engine as "
             "module:engine.")] = None,
    json_: Json = False,
) -> Answer:
    """Test an impact resolver against every law; print the verdict, the worst case and a shrunk counterexample."""
    if world is not None:
        return _of_world(world, seed)
    if (contract != "equality" or laws) and (full or recheck is not None):
        raise typer.BadParameter("not with --full or --recheck", param_hint="--contract, --laws")
    if recheck is not None:
        return _rechecked(recheck, allow_code)
    if full:
        return _campaign(resolver, impacts or 1_000_000, trajectories, seed, workers, out)
    tested = function_named("--resolver", resolver)
    named = [name for given in laws or () for name in given.split(",") if name]
    with stage_progress() as progress:
        report = check_passivity(tested, contract=contract, laws=named if laws else None,
                                 impacts=impacts or KIT_IMPACTS, seed=seed, unequal_restitution=unequal,
                                 progress=partial(progress, "impacts"))  # fmt: skip
    facts = {name: getattr(report, name) for name in ("resolver", "contract", "impacts", "seed", "passed")} | {
        "unfinished": report.unfinished, "report": str(report),
        "laws": [{name: getattr(one, name) for name in LAW_FIELDS} for one in report.verdicts]}  # fmt: skip
    return Answer(facts, [str(report)], 0 if report.passed else 1)


def _campaign(resolver: str, impacts: int, trajectories: int, seed: int, workers: int, out: Path) -> Answer:
    """Compute the missing batches and list every law. A resolver of somebody else's is tested on impacts only."""
    ours = resolver == ENGINE
    bounds, condition = ("FACTORED", ENGINE_CONDITION) if ours else ("KIT", ANY_CONDITION)
    request = CampaignRequest(resolver, bounds, condition, impacts, trajectories, seed, workers)
    request.subject()  # raises here, not in a worker, if the name cannot be imported
    batches, campaign = plan(impacts, trajectories, PARTS if ours else (IMPACTS,)), Campaign(out, request)
    there = sum(campaign.path_of(batch).is_file() for batch in batches)
    lines, stopped = [f"{len(batches)} batches in {campaign.folder}, {there} of them done before."], False
    try:
        with stage_progress() as progress:
            campaign.run(batches, progress)
    except KeyboardInterrupt:
        stopped = True
        lines.append("Stopped; the same command continues. So far:")
    counts, found, seconds = campaign.counts(batches), campaign.counterexamples(), campaign.seconds(batches)
    for part, laws in counts.items():
        lines += [f"{part}:", *(f"  {_kept(not one.failures)} {count_in_words(one)}" for one in laws.values())]
    lines += [f"Of the laws of impacts, {', '.join(OF_ONE_CALL)} are put to every one; each other to one in {ONE_IN}.",
              f"{seconds / 60.0:.1f} minutes of work in all."]
    if found:
        lines.append(f"{len(found):,} files (of one law at most {KEPT_PER_LAW:,}) show what broke a law. Impacts and "
                     "trajectories are runs, for iapb inspect FILE. Judged again by:")
    lines += [f"  {recheck_command(path, resolver)}" for path in found[:_SHOWN]]
    passed = not any(one.failures for laws in counts.values() for one in laws.values())
    return Answer({"resolver": resolver, "folder": campaign.folder, "batches": len(batches), "found": there,
                   "seconds": seconds, "counterexamples": found, "passed": passed,
                   "laws": {part: list(laws.values()) for part, laws in counts.items()}},
                  lines, 130 if stopped else int(not passed))


def _kept(passed: bool) -> str:
    return "kept  " if passed else "BROKEN"


def count_in_words(count: LawCount) -> str:
    """Return as text how many of the cases broke a law, and the worst residual as a share of its tolerance."""
    worst = count.worst
    nearest = "" if worst is None else f"; worst {worst.words}"
    return f"{count.law}: {count.failures:,} of {count.checked:,} break it{nearest}"


def _rechecked(path: Path, allow_code: bool) -> Answer:
    """Judge a stored counterexample again, by every law."""
    with compiling_told(to_stderr):
        judged = tuple(judge_again(path, allow_code))
    passed = all(residual.passed for _, residual in judged)
    laws = [{"law": law, "passed": residual.passed, "value": residual.value, "tolerance": residual.tolerance}
            for law, residual in judged]
    return Answer({"laws": laws, "passed": passed},
                  [f"  {_kept(residual.passed)} {law}: {residual.words}"
                   for law, residual in judged], int(not passed))


def _of_world(world: str, seed: int) -> Answer:
    """Put a world to the laws of trajectories on random scenes."""
    with stage_progress() as progress:
        counts, left_out = judge_world(world, WORLD_SCENES, seed, partial(progress, "random scenes"))
    judged = WORLD_SCENES - left_out
    ignoring = f"; {left_out} others have something that it ignores" if left_out else ""
    lines = [f"{world} on {judged} random scenes{ignoring}."]
    for count in counts:
        mark = "BROKEN" if count.failures else "kept  "
        worst = f"; worst {count.worst.words}" if count.worst else ""
        lines.append(f"  {mark} {count.law}: {count.failures:,} of {count.checked:,} break it{worst}")
    passed = judged > 0 and not any(count.failures for count in counts)
    facts = {"world": world, "scenes": judged, "left_out": left_out, "passed": passed, "laws": counts}
    return Answer(facts, lines, int(not passed))
