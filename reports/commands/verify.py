"""`iapb verify`: test an impact resolver (`--full`: with the full campaign) or an engine (`--simulator`)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from iapb.compiling import compiling_told, to_stderr
from reference.simulators import FIXED_SCENES, SIMULATORS, find_simulator, fixed_scene
from reports.by_name import function_named
from reports.campaign import KEPT_PER_LAW, Campaign
from reports.commands.answer import Answer, Json, facts_of
from reports.commands.progress import stage_progress
from reports.counterexamples import ENGINE, CampaignRequest, recheck, recheck_command
from verification import check_passivity
from verification.engines import SETTINGS, EngineRecord, compare_engines, sentence, verdict
from verification.laws import CONTRACTS
from verification.laws.bounds import LawCount
from verification.laws.campaign import IMPACTS, OF_ONE_CALL, ONE_IN, PARTS, plan
from verification.laws.kit import IMPACTS as KIT_IMPACTS
from verification.table import Table, titled

ENGINE_CONDITION, ANY_CONDITION = 1e10, 1e8  # largest κ(M) in tests of the engine, of any other resolver
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
    simulator: Annotated[list[str] | None, typer.Option(
        help="Test an engine on the fixed scenes instead: mujoco, drake, ... or all; may be repeated.")] = None,
    scene: Annotated[list[str] | None, typer.Option(
        help="With --simulator: only this fixed scene; may be repeated.")] = None,
    json_: Json = False,
) -> Answer | None:
    """Test an impact resolver against every law; print the verdict, the worst case and a shrunk counterexample."""
    if scene and not simulator:
        raise typer.BadParameter("give an engine with --simulator", param_hint="--scene")
    if (contract != "equality" or laws) and (full or simulator or recheck is not None):
        raise typer.BadParameter("not with --full, --simulator or --recheck", param_hint="--contract, --laws")
    if simulator:
        return verify_simulators(simulator, scene or ())
    if recheck is not None or full:
        with facts_of(json_) as facts:
            passed = print_recheck(recheck, allow_code, facts) if recheck is not None else verify_full(
                resolver, impacts or 1_000_000, trajectories, seed, workers, out, facts)
            facts["passed"] = passed
            if not passed:
                raise typer.Exit(1)
        return None
    named = [name for given in laws or () for name in given.split(",") if name]
    return _kit(resolver, contract, named if laws else None, impacts, seed, unequal)


def _kit(resolver: str, contract: str, laws: list[str] | None, impacts: int | None, seed: int,
         unequal: bool) -> Answer:  # fmt: skip
    tested = function_named("--resolver", resolver)
    with stage_progress() as progress:
        report = check_passivity(tested, contract=contract, laws=laws, impacts=impacts or KIT_IMPACTS, seed=seed,
                                 unequal_restitution=unequal,
                                 progress=lambda done, total: progress("impacts", done, total))
    facts = {"resolver": report.resolver, "contract": report.contract, "impacts": report.impacts, "seed": report.seed,
             "passed": report.passed, "unfinished": report.unfinished, "report": str(report),
             "laws": [{name: getattr(one, name) for name in LAW_FIELDS} for one in report.verdicts]}  # fmt: skip
    return Answer(facts, [str(report)], 0 if report.passed else 1)


def verify_full(resolver: str, impacts: int, trajectories: int, seed: int, workers: int, out: Path,
                facts: dict[str, Any]) -> bool:
    """Compute the missing batches, print a line per law, and return whether all laws hold.

    A resolver other than the engine's is tested on impacts only.
    """
    ours = resolver == ENGINE
    bounds, condition = ("FACTORED", ENGINE_CONDITION) if ours else ("KIT", ANY_CONDITION)
    request = CampaignRequest(resolver, bounds, condition, impacts, trajectories, seed, workers)
    request.subject()  # raises here, not in a worker, if the name cannot be imported
    batches, campaign = plan(impacts, trajectories, PARTS if ours else (IMPACTS,)), Campaign(out, request)
    there = sum(campaign.path_of(batch).is_file() for batch in batches)
    print(f"{len(batches)} batches in {campaign.folder}, {there} of them done before.", flush=True)
    try:
        with stage_progress() as progress:
            campaign.run(batches, progress)
    except KeyboardInterrupt:
        print("Stopped; the same command continues. So far:")
        _print_counts(campaign, batches)
        raise
    kept = _print_counts(campaign, batches)
    print(f"{campaign.seconds(batches) / 60.0:.1f} minutes of work in all.")
    found = campaign.counterexamples()
    facts.update(resolver=resolver, folder=campaign.folder, batches=len(batches), found=there,
                 seconds=campaign.seconds(batches), counterexamples=found,
                 laws={part: list(laws.values()) for part, laws in campaign.counts(batches).items()})
    if found:
        print(f"{len(found):,} files (of one law at most {KEPT_PER_LAW:,}) show what broke a law. Impacts and "
              "trajectories are runs, for iapb inspect FILE. Judged again by:")
    for path in found[:_SHOWN]:
        print(f"  {recheck_command(path, resolver)}")
    return kept


def _print_counts(campaign: Campaign, batches: tuple[object, ...]) -> bool:
    kept = True
    for part, laws in campaign.counts(batches).items():  # type: ignore[arg-type]
        print(f"{part}:")
        for count in laws.values():
            print(f"  {'BROKEN' if count.failures else 'kept  '} {count_in_words(count)}")
            kept = kept and not count.failures
    print(f"Of the laws of impacts, {', '.join(OF_ONE_CALL)} are put to every one; each other to one in {ONE_IN}.")
    return kept


def count_in_words(count: LawCount) -> str:
    """Return as text how many of the cases broke a law, and the worst residual as a share of its tolerance."""
    worst = count.worst
    nearest = "" if worst is None else f", worst {worst.value:.2e} of {worst.tolerance:.2e} ({worst.ratio:.3f} of it)"
    return f"{count.law}: {count.failures:,} of {count.checked:,} break it{nearest}"


def print_recheck(path: Path, allow_code: bool, facts: dict[str, Any]) -> bool:
    """Print every residual of a stored counterexample; return whether all laws hold now."""
    kept = True
    with compiling_told(to_stderr):
        judged = tuple(recheck(path, allow_code))
    facts["laws"] = [{"law": law, "passed": residual.passed, "value": residual.value, "tolerance": residual.tolerance}
                     for law, residual in judged]
    for law, residual in judged:
        print(f"  {'kept  ' if residual.passed else 'BROKEN'} {law}: {residual.value:.2e} of {residual.tolerance:.2e}")
        kept = kept and residual.passed
    return kept


def verify_simulators(simulators: Sequence[str], scenes: Sequence[str]) -> Answer:
    """Run the scenes in the simulators and return the results; `all` stands for every engine.

    Raises
    ------
    MissingDependencyError
        An engine that was asked for by name is not installed.
    """
    names = list(SIMULATORS) if "all" in simulators else list(dict.fromkeys(simulators))
    chosen = list(dict.fromkeys(scenes)) or list(FIXED_SCENES)
    for scene in chosen:
        fixed_scene(scene)  # a wrong name raises before anything runs
    for name in names:
        simulator = find_simulator(name)
        if "all" not in simulators:
            simulator.version()
    with stage_progress() as progress:
        records = compare_engines(names, chosen,
                                  progress=lambda done, total: progress("pairs of engine and scene", done, total))
    lines: list[str | Table] = []
    for name in names:
        for choice in SETTINGS:
            of_engine = [record for record in records if record.engine == name and record.choice == choice]
            lines.append(sentence(of_engine))
            if of_engine[0].missing:
                break
    present = [record for record in records if not record.missing]
    return Answer({"records": records}, [*lines, *(_details(present) if present else ())])


_NUMBERS = {"energy": "energy_error", "rise": "energy_gain", "momentum": "momentum_error", "velocity": "velocity_error",
            "depth [m]": "penetration", "drift [m]": "drift"}  # fmt: skip


def _details(records: Sequence[EngineRecord]) -> Iterator[str | Table]:
    """Yield the numbers of every engine and scene, the failures, and the settings."""
    rows = [(one.engine, one.scene, one.choice, verdict(one), *(getattr(one, name) for name in _NUMBERS.values()))
            for one in records]  # fmt: skip
    yield ""
    yield titled(("engine", "scene", "settings", "law", *_NUMBERS), rows, digits=2)
    yield from (f"{one.engine}, {one.scene}: {one.failure}" for one in records if one.failure)
    yield "\nSettings:"
    for settings in dict.fromkeys(f"{record.engine}: {record.settings}" for record in records):
        used = [record for record in records if f"{record.engine}: {record.settings}" == settings]
        yield f"  {settings}"
        yield f"    in {', '.join(dict.fromkeys(f'{record.scene} ({record.choice})' for record in used))}"
    yield from dict.fromkeys(f"  {record.title}: {record.note}." for record in records if record.note)
