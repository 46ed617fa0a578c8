"""Collect all evidence of a report, stage by stage."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import UTC, datetime
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from reports.evidence import claims, runs
from reports.evidence.depends import depends_of
from reports.evidence.stage import Stage, evidence_version
from reports.evidence.topics import TOPICS, compute_topic, failed_topic
from reports.figures.two_link_arm import arm_energies
from reports.pages.records import Evidence, FailedCases, StoredFile
from reports.provenance import PEERS, collect_provenance, machine_of
from reports.runner import Runner
from reports.store.io import opened
from reports.store.runs import read_provenance
from reports.uses import UsedRun
from verification import haptic_rate
from verification.cost import effects
from verification.cost.impacts import work_precision
from verification.finding import Failure, Finding, attempt
from verification.hard_cases import study as hard_cases
from verification.laws import topic as laws
from verification.proofs import check_all, on_proofs
from verification.proofs.coq_development import Theorem, theorems
from verification.proofs.show import ProofRecord
from verification.table import Table

Progress = Callable[[str, int, int], None]
Compute = Callable[[Callable[[int, int], None], list[Failure]], Any]  # progress, and a list for cases that raise

# study that draws random numbers -> module with its SEED
SEEDS = {
    "claims": "verification.check", "properties": "verification.laws.topic",
    "proofs": "verification.proofs.numbers", "robots": "verification.mechanics.against_pinocchio",
    "power balance": "verification.mechanics.power_balance",
    "coordinates": "verification.mechanics.coordinate_invariance",
}  # fmt: skip
ABSENT = "absent"  # a run that a stage was made from, whose file has been removed since
UNNAMED = "the report"  # the user of a run that no claim, topic or figure requested
SHOWN_SCENES = ("peg_corner", "peg_hole", "wall_1d", "two_link_arm_a", "two_link_arm_b", "arm_pushing")


def gather(out: Path, depth: str, progress: Progress) -> Evidence:
    """Compute or read everything that the report shows; runs/ and tables/ are written in `out`."""
    runner = Runner(out / "runs")
    kept = _Kept(out / "tables", depth, progress, runner)
    scenes = {name: runs.shipped_scene(name).resolved() for name in SHOWN_SCENES}
    inputs: dict[str, Any] = kept.attempt("runs of the figures", partial(runs.figure_runs, runner), {})
    inputs |= {f"scene/{name}": scene for name, scene in scenes.items()}
    inputs["arm_energies"] = arm_energies()

    ledger = kept.stage("claims", tuple[Finding, ...], partial(claims.compute, runner, depth, workers=claims.cores()))
    proved = kept.stage("proofs", tuple[ProofRecord, ...], check_all)
    in_coq = kept.stage("Coq development", tuple[Theorem, ...], theorems)
    broken = kept.stage("counterexamples", tuple[Finding, ...], laws.counterexamples)
    hard = kept.stage("hard cases", tuple[Finding, ...], partial(hard_cases.hard_cases, runner))
    timed = kept.stage("accuracy", Table, lambda done, lost: work_precision(progress=done, failures=lost), None)
    gains, properties, *others = (_topic(kept, name, runner, depth) for name in TOPICS)
    topics = (gains, kept.finding("proofs", proved, partial(on_proofs, development=in_coq)), properties,
              kept.finding("hard cases", hard, hard_cases.on_hard_cases), *others)  # fmt: skip
    topics = tuple(haptic_rate.quoting(topic, (*ledger, *topics)) if topic.key == haptic_rate.TOPIC.key else topic
                   for topic in topics)
    if kept.failures["claims"] and not ledger:
        topics = (failed_topic("claims", kept.failures["claims"][0]), *topics)
    inputs["work_precision"] = timed
    facts = provenance()
    needed = kept.stage("effects", dict[str, Table], effects.effects_of_scenes, {})
    shown = {name: needed[name] for name in effects.SCENES if name in needed}
    inputs |= {"effect_costs": effects.summary(shown), "effect_steps": effects.steps(needed),
               "machine": "{cpu}, report of {date}".format_map(facts)}
    return Evidence(
        inputs=inputs, scenes=scenes, claims=ledger, proofs=proved, counterexamples=broken, hard_cases=hard,
        effects=shown, topics=topics, failed=kept.failed(), provenance=facts,
        manifest=manifest(runner.used, kept.stages, out),
    )  # fmt: skip


def _topic(kept: _Kept, name: str, runner: Runner, depth: str) -> Finding:
    """Return a topic, or a substitute that says why the topic could not be computed."""
    topic: Finding | None = kept.stage(name, Finding, lambda done, _: compute_topic(name, runner, depth, done), None)
    return failed_topic(name, kept.failures[name][-1]) if topic is None else topic


def manifest(used: Mapping[str, UsedRun], stages: Iterable[Stage], out: Path) -> tuple[StoredFile, ...]:
    """Return one line per used run file and per table file, in the order of use; paths are relative to `out`."""
    files = []
    for run in used.values():
        path, users = out / "runs" / run.file, run.used_by or (UNNAMED,)
        status, made_on = (run.status, machine_of(read_provenance(path))) if path.is_file() else (ABSENT, "")
        files.append(StoredFile(run.name, f"runs/{run.file}", run.key, run.content_hash, run.command, run.size, users,
                                status, made_on))  # fmt: skip
    for stage in stages:
        with opened(stage.path, expected_format=None) as file:
            content = str(file.attrs["content_hash"])
        place, name = stage.path.relative_to(out).as_posix(), stage.name.replace("_", " ")
        files.append(StoredFile(name, place, stage.key, content, "iapb reproduce", stage.path.stat().st_size,
                                made_on=machine_of(read_provenance(stage.path))))  # fmt: skip
    return tuple(files)


def provenance() -> dict[str, str]:
    """Return the provenance of the report: date, machine and versions, all seeds, sources, and compared packages."""
    seeds = [f"{name} {import_module(module).SEED}" for name, module in SEEDS.items()]
    facts = collect_provenance(seeds=seeds, packages=PEERS)
    return {"date": datetime.now(UTC).date().isoformat()} | facts | {"sources": evidence_version()}


class _Kept:
    """The stages of one folder and depth, in the order in which they were requested, and the cases that failed."""

    def __init__(self, folder: Path, depth: str, progress: Progress, runner: Runner) -> None:
        self.folder, self.depth, self.progress, self.runner = folder, depth, progress, runner
        self.stages: list[Stage] = []
        self.failures: dict[str, list[Failure]] = {}

    def stage(self, name: str, kind: Any, compute: Compute, nothing: Any = ()) -> Any:
        """Return the records of a stage, stored or computed now; `nothing` if the stage cannot be computed at all."""
        stage = Stage(self.folder, name.replace(" ", "_"), kind, {"depth": self.depth}, depends_of(name))
        self.failures[name] = stage.failures

        def records(progress: Callable[[int, int], None], failures: list[Failure]) -> Any:
            found = stage.get_or_compute(lambda: compute(progress, failures), self.runner)
            self.stages.append(stage)
            return found

        return self.attempt(name, records, nothing)

    def finding(self, name: str, records: Sequence[Any], said: Callable[[Any, list[Failure]], Finding]) -> Finding:
        """Return the finding on the records of a stage; without records, return one that says why there are none."""
        failures = self.failures[name]
        return said(records, failures) if records or not failures else failed_topic(name, failures[0])

    def attempt(self, name: str, compute: Compute, nothing: Any) -> Any:
        """Return the result of `compute`, or `nothing` if it raises; KeyboardInterrupt is not caught."""
        failures = self.failures.setdefault(name, [])
        started = len(failures)
        found = attempt("all of it", lambda: compute(lambda *done: self.progress(name, *done), failures), failures)
        self.progress(name, 1, 1)
        return nothing if found is None and len(failures) > started else found

    def failed(self) -> tuple[FailedCases, ...]:
        """Return the failed cases of each stage, and write their tracebacks to a file beside the tables."""
        return tuple(case for name, failures in self.failures.items()
                     for case in failed_cases(self.folder, name, failures))  # fmt: skip


def failed_cases(folder: Path, name: str, failures: Sequence[Failure]) -> tuple[FailedCases, ...]:
    """Write the tracebacks of the failures of stage `name` to a file in `folder`, replacing an older file.

    Return the failed cases with that file; without failures, return () and leave no file.
    """
    path = folder / f"{name.replace(' ', '_')}-failed.txt"
    path.unlink(missing_ok=True)
    if not failures:
        return ()
    folder.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(f"{one.case}\n{one.traceback}" for one in failures), encoding="utf-8")
    return (FailedCases(name, tuple(failures), str(path)),)
