"""Collect what the report shows: run or read the runs, check proofs and claims, say where everything comes from.

Each function gathers one kind of record; `gather_evidence` calls them all. What a function needs and does not find
stays empty, and the page says so.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from iapb import decide_effects, find_scene, load_scene
from iapb.run import Run
from iapb.scene import Scene
from reports.figures import RECIPES
from reports.figures.fig03_energy_loss import arm_energies
from reports.pages.ledger import ledger, verdicts
from reports.pages.records import Evidence, SceneEffect, StoredFile
from reports.provenance import collect_provenance
from reports.runner import Runner
from reports.store_index import entry_of

Stage = Callable[[str], None]

# The device of Figures 12 and 13, emulated: one step of delay each way (two at 512 Hz), the encoders' resolution and
# a little friction in the joints. The paper gives none of these numbers; its device is described as nearly ideal.
EMULATED_DEVICE: Mapping[str, Any] = {
    "device.delay": 1, "device.position_resolution": [1e-5, 1e-5, 1e-4], "device.damping": [0.5, 0.5, 1e-3],
}
# name among the report's inputs -> world, rendering
CORNER_RUNS = {
    "corner/ideal": ("ideal", "full"), "corner/IAPB": ("IAPB", "full"), "corner/PB": ("PB", "full"),
    "corner/CBuc": ("CBuc", "full"), "corner/IAPB-saturate": ("IAPB", "saturate"),
    "corner/IAPB-scale": ("IAPB", "scale"), "corner/IAPB-spread": ("IAPB", "spread"),
}
DEVICE_RUNS = {
    "device/IAPB": ("IAPB", "full"), "device/IAPB-LM": ("IAPB", "spread"), "device/PB": ("PB", "full"),
}
GROUP_RUNS = {"group/IAPB": ("IAPB", "full")}
EFFECT_SCENES = ("peg_corner", "peg_hole", "two_link_arm_a")


def gather_evidence(runner: Runner, *, claims: bool = True, stage: Stage | None = None) -> Evidence:
    """Return everything the report shows.

    Parameters
    ----------
    runner : runs scenes, or reads the runs that exist.
    claims : whether to check the claims (the longest part).
    stage : called with a few words when a part begins.
    """
    tell = stage or (lambda words: None)
    tell("runs of the paper's figures")
    inputs: dict[str, Any] = {**paper_runs(runner), **scene_inputs(), "arm_energies": arm_energies()}
    tell("proofs")
    proofs = check_proofs()
    tell("claims")
    lines = check_ledger(runner) if claims else ()
    return Evidence(
        inputs=inputs, verdicts=verdicts(lines), claims=lines, proofs=proofs, effects=effect_tables(),
        provenance=collect_provenance(), manifest=manifest(runner),
    )


def paper_runs(runner: Runner) -> dict[str, Run]:
    """Return the runs behind the paper's figures, by the names that the figures use."""
    corner = load_scene(find_scene("peg_corner"))
    scenes: tuple[tuple[Scene, dict[str, tuple[str, str]]], ...] = (
        (corner, CORNER_RUNS), (corner.with_values(dict(EMULATED_DEVICE)), DEVICE_RUNS),
        (load_scene(find_scene("arm_pushing")), GROUP_RUNS),
    )
    return {name: runner(scene, *how) for scene, runs in scenes for name, how in runs.items()}


def scene_inputs() -> dict[str, dict[str, Any]]:
    """Return the resolved scenes that the drawings ask for."""
    names = {name for recipe in RECIPES for name in recipe.needs if name.startswith("scene/")}
    return {name: load_scene(find_scene(name.removeprefix("scene/"))).resolved() for name in sorted(names)}


def check_proofs() -> tuple[Any, ...]:
    """Return the record of every proof, checked now."""
    from verification.proofs import all_proofs, check

    return tuple(check(name) for name in all_proofs())


def check_ledger(runner: Runner) -> tuple[Any, ...]:
    """Return the lines of the ledger, every claim checked over its range with runs from the store."""
    from verification.claims import check_claims

    return ledger(check_claims(lambda scene, world, rendering: runner(scene, world, rendering, keep=False)))


def effect_tables() -> dict[str, tuple[SceneEffect, ...]]:
    """Return the effects of a few scenes: what is on, and why."""
    return {name: tuple(SceneEffect(effect.name, effect.active, effect.reason, "", effect.left_out)
                        for effect in decide_effects(load_scene(find_scene(name)))) for name in EFFECT_SCENES}


def manifest(runner: Runner) -> tuple[StoredFile, ...]:
    """Return every run file that was used, with its keys and the command that makes it again."""
    return tuple(_stored(label, path) for label, path in runner.used.items() if path.exists())


def _stored(label: str, path: Path) -> StoredFile:
    entry = entry_of(path)
    return StoredFile(label, f"runs/{path.name}", entry.run_key, entry.content_hash, "iapb reproduce",
                      path.stat().st_size)
