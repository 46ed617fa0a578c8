"""What the project can put before Pinocchio by itself: joint kinds alone, its scenes, its robots, URDF texts.

The robots of others (`robots.compare_robots`) need a folder that is not part of the project; these need nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from iapb.mechanics.joints import KINDS
from iapb.mechanics.mechanism import Mechanism
from reference.random_mechanisms import random_mechanism
from reference.rigid_body import PinocchioMechanism, model_from_urdf, model_of
from verification.finding import Failure, Table, check_depth, of_each, table_of
from verification.mechanics.random_urdf import random_urdf
from verification.mechanics.robots import (
    COLUMNS,
    SEED,
    STATES,
    TOLERANCE,
    judged,
    largest_of,
    worst_of,
)

KIND_SIZES = (1, 6)  # joints of a tree that has one kind only
WRITTEN = {"quick": 4, "full": 40}  # URDF texts of each size
WRITTEN_SIZES = (3, 8, 20)
SHIPPED = Path(__file__).parents[2] / "scenes"

Reader = Callable[[Path, bool], PinocchioMechanism]


def compare_kinds(
    depth: str = "quick", seed: int = SEED, failures: list[Failure] | None = None
) -> Table:
    """Compare trees that have one kind of joint only."""
    check_depth(depth)
    rows = of_each(product(KINDS, KIND_SIZES), lambda case: _kind(*case, seed), failures)
    statement = "Each kind of joint, alone and in a tree of its own kind, is that of Pinocchio."
    return replace(judged(table_of(COLUMNS, rows)), note=f"{statement} Tolerance: {TOLERANCE}.")


def _kind(kind: str, joints: int, seed: int) -> Iterator[dict[str, Any]]:
    rng = np.random.default_rng([seed, joints])
    kinds = (kind,) if KINDS[kind].nv else (kind, "revolute")  # a tree that is fixed has nothing to compare
    tree = random_mechanism(rng, joints, kinds)
    if tree.nv:
        yield _row(f"{joints} {kind}", "random", [(tree, model_of(tree))], rng)


def compare_scenes(
    depth: str = "quick", seed: int = SEED, failures: list[Failure] | None = None
) -> Table:
    """Compare the mechanism of every scene that comes with the project."""
    check_depth(depth)

    def rows_of(case: tuple[str, Mechanism]) -> list[dict[str, Any]]:
        name, mechanism = case
        return [_row(name, "of the scene", [(mechanism, model_of(mechanism))], np.random.default_rng(seed))]

    rows = of_each(scene_mechanisms(), rows_of, failures, lambda case: case[0])
    statement = "The mechanism of every scene is the one that Pinocchio makes of the same bodies."
    return replace(judged(table_of(COLUMNS, rows)), note=f"{statement} Tolerance: {TOLERANCE}.")


def scene_mechanisms() -> Iterator[tuple[str, Mechanism]]:
    """Yield the scenes that have something moving."""
    from iapb.scene import load_scene
    from iapb.scene.mechanism import mechanism_of

    for path in sorted(SHIPPED.glob("*.yaml")):
        mechanism = mechanism_of(load_scene(path))
        if mechanism.nv:
            yield path.stem, mechanism


def compare_written(
    depth: str = "quick", seed: int = SEED, reader: Reader = model_from_urdf, failures: list[Failure] | None = None
) -> Table:
    """Compare the project's own robots and random URDF texts, read by the engine and by Pinocchio's parser."""
    check_depth(depth)

    def rows_of(case: tuple[tuple[str, list[Path]], bool]) -> list[dict[str, Any]]:
        (label, files), floating = case
        rng = np.random.default_rng([seed, floating])
        pairs = [(Mechanism.from_urdf(file, floating), reader(file, floating)) for file in files]
        return [_row(label, "floating" if floating else "fixed", pairs, rng)]

    with TemporaryDirectory() as scratch:
        texts = (*_own(), *_written(Path(scratch), WRITTEN[depth], seed))
        rows = list(of_each(product(texts, (False, True)), rows_of, failures, lambda case: case[0][0]))
    statement = "A URDF text is read by the engine as Pinocchio's own parser reads it."
    return replace(judged(table_of(COLUMNS, rows)), note=f"{statement} Tolerance: {TOLERANCE}.")


def _own() -> Iterator[tuple[str, list[Path]]]:
    for path in sorted((SHIPPED / "robots").glob("*.urdf")):
        yield path.stem, [path]


def _written(folder: Path, count: int, seed: int) -> Iterator[tuple[str, list[Path]]]:
    for links in WRITTEN_SIZES:
        rng, files = np.random.default_rng([seed, links, 2]), []
        for k in range(count):
            files.append(folder / f"random-{links}-{k}.urdf")
            files[-1].write_text(random_urdf(rng, links), encoding="utf-8")
        yield f"{count} random texts of {links} joints", files


def _row(
    label: str, base: str, pairs: list[tuple[Mechanism, PinocchioMechanism]], rng: np.random.Generator
) -> dict[str, Any]:
    sizes = [(len(mechanism.bodies), mechanism.nv) for mechanism, _ in pairs]
    return {"mechanism": label, "base": base, "bodies": max(size[0] for size in sizes),
            "velocities": max(size[1] for size in sizes), "states": STATES * len(pairs),
            **largest_of([worst_of(mechanism, model, rng) for mechanism, model in pairs])}  # fmt: skip
