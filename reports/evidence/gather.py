"""All evidence of a report, stage by stage, and the sentence of the first page that each stage earns."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from reports.evidence import (
    accuracy,
    claims,
    counterexamples,
    cross_checks,
    effects,
    hard_cases,
    proofs,
    properties,
    runs,
)
from reports.evidence.depends import depends_of
from reports.evidence.manifest import manifest
from reports.evidence.stage import Stage, evidence_version
from reports.evidence.topics import TOPICS, compute_topic, failed_topic
from reports.evidence.verdicts import verdicts
from reports.figures.figure import Numbers
from reports.pages.records import (
    Claim,
    Counterexample,
    CrossCheck,
    Evidence,
    HardCase,
    Property,
    SceneEffect,
    Topic,
)
from reports.provenance import PEERS, collect_provenance
from reports.runner import Runner

Progress = Callable[[str, int, int], None]

# what draws random numbers -> module with its SEED
SEEDS = {
    "claims": "verification.claims.study", "properties": "reports.evidence.properties",
    "proofs": "verification.proofs.statements.exact_instances", "robots": "verification.mechanics.robots",
    "power balance": "verification.mechanics.power_balance",
    "coordinates": "verification.mechanics.coordinate_invariance",
}  # fmt: skip
SHOWN_SCENES = ("peg_corner", "peg_hole", "wall_1d", "two_link_arm_a", "two_link_arm_b", "arm_pushing")


def gather(out: Path, depth: str, progress: Progress) -> Evidence:
    """Compute or read everything that the report shows; `out` receives runs/ and tables/."""
    runner = Runner(out / "runs")
    kept = _Kept(out / "tables", depth, progress, runner)
    scenes = {name: runs.shipped_scene(name).resolved() for name in SHOWN_SCENES}
    inputs: dict[str, Any] = dict(runs.figure_runs(runner, kept.of("runs of the figures")))
    inputs |= {f"scene/{name}": scene for name, scene in scenes.items()}
    inputs["arm_energies"] = _arm_energies()
    from verification.proofs.statement import ProofRecord

    ledger = kept.stage("claims", tuple[Claim, ...], lambda done: claims.compute(runner, depth, done))
    proved = kept.stage("proofs", tuple[ProofRecord, ...], proofs.compute)
    laws = kept.stage("properties", tuple[Property, ...], properties.compute)
    broken = kept.stage("counterexamples", tuple[Counterexample, ...], counterexamples.compute)
    bulk = kept.stage("bulk impacts", Numbers, lambda done: properties.bulk(depth, done))
    checks = kept.stage("cross-checks", tuple[CrossCheck, ...], cross_checks.compute)
    hard = kept.stage("hard cases", tuple[HardCase, ...], lambda done: hard_cases.compute(runner, done))
    timed = kept.stage("accuracy", Numbers, accuracy.compute)
    topics = tuple(_topic(kept, name, runner, depth) for name in TOPICS)
    inputs |= {"work_precision": timed, "energy_gains": bulk, hard_cases.INPUT: hard_cases.summary(hard)}
    needed = kept.stage("effects", dict[str, tuple[SceneEffect, ...]], effects.compute)
    inputs[effects.INPUT] = effects.summary(needed)
    evidence = Evidence(
        inputs=inputs, scenes=scenes, claims=ledger, proofs=proved, properties=laws, counterexamples=broken,
        cross_checks=checks, hard_cases=hard, effects=needed, topics=topics,
        provenance=provenance(), manifest=manifest(runner.used, kept.stages, out), bulk=bulk,
    )  # fmt: skip
    return _with_verdicts(evidence)


def _topic(kept: _Kept, name: str, runner: Runner, depth: str) -> Topic:
    """One topic; where it fails the others are still worth their hours, and the next time only this one is tried."""
    try:
        topic: Topic = kept.stage(name, Topic, lambda done: compute_topic(name, runner, depth, done))
    except Exception as failure:
        topic = failed_topic(name, failure, kept.folder)
    return topic


def provenance() -> dict[str, str]:
    """Where the report comes from: the facts of every result, all seeds, the sources, and what is compared with."""
    from importlib import import_module

    seeds = [f"{name} {import_module(module).SEED}" for name, module in SEEDS.items()]
    return collect_provenance(seeds=seeds, packages=PEERS) | {"sources": evidence_version()}


def _with_verdicts(evidence: Evidence) -> Evidence:
    from dataclasses import replace

    return replace(evidence, verdicts=verdicts(evidence))


def _arm_energies() -> Mapping[str, Any]:
    from reports.figures.fig03_energy_loss import arm_energies

    return arm_energies()


class _Kept:
    """Stages of one folder and depth, in the order in which they were asked for."""

    def __init__(self, folder: Path, depth: str, progress: Progress, runner: Runner) -> None:
        self.folder, self.depth, self.progress, self.runner = folder, depth, progress, runner
        self.stages: list[Stage] = []

    def of(self, title: str) -> Callable[[int, int], None]:
        """Progress of one stage."""
        return lambda done, total: self.progress(title, done, total)

    def stage(self, name: str, kind: Any, compute: Callable[[Callable[[int, int], None]], Any]) -> Any:
        """The records of a stage, computed if they are not there."""
        stage = Stage(self.folder, name.replace(" ", "_"), kind, {"depth": self.depth}, depends_of(name))
        records = stage.get_or_compute(lambda: compute(self.of(name)), self.runner)
        self.progress(name, 1, 1)
        self.stages.append(stage)
        return records
