"""Differences between the engine's mechanisms and Pinocchio's over many random states.

The mechanisms are random trees, trees with one kind of joint, the scenes, the project's robots and random URDF texts.
Robots of other projects need a folder that is not part of this project. The engine and Pinocchio each read the URDF
texts themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from iapb.mechanics.joints import KINDS
from iapb.mechanics.mechanism import Mechanism
from iapb.scene import load_scene
from iapb.scene.mechanism import mechanism_of
from reference.random_mechanisms import random_mechanism, random_state
from reference.rigid_body import PinocchioMechanism, model_from_urdf, model_of
from verification.finding import (
    NOT_TESTABLE,
    WORDS,
    Column,
    Failure,
    Part,
    Table,
    check_depth,
    of_each,
    table_of,
    titled,
    verdict_of_law,
)
from verification.mechanics.engine_differences import compare
from verification.mechanics.random_urdf import random_urdf

# Relative to the largest entry. For chains of 30 links each algorithm is accurate to about 1e-14.
AGREEMENT = 1e-11
STATES = 100
TREE_SIZES = (1, 2, 4, 8, 16, 30)
TREES = {"quick": 3, "full": 50}  # trees of each size
SEED = 20050602
ROBOTS = Path(__file__).parents[3] / "shared" / "robots"
SHIPPED = Path(__file__).parents[2] / "scenes"
KIND_SIZES = (1, 6)  # number of joints of a tree with one kind of joint
WRITTEN = {"quick": 4, "full": 40}  # URDF texts of each size
WRITTEN_SIZES = (3, 8, 20)
Reader = Callable[[Path, bool], PinocchioMechanism]

QUANTITIES = (
    "mass_matrix", "point_jacobian", "frame_jacobian", "bias", "gravity", "inverse_dynamics", "kinetic_energy",
    "potential_energy", "momentum", "placement",
)  # fmt: skip
COLUMNS = (
    Column("mechanism", condition=True),
    Column("base", condition=True),
    Column("bodies", condition=True),
    Column("velocities", condition=True),
    Column("states", condition=True),
    *(Column(name, "relative difference") for name in QUANTITIES),
    Column("worst", "relative difference"),
)
TOLERANCE = (
    f"{AGREEMENT:g} of the reference's largest entry, for two algorithms that are each accurate to about 1e-14. A bias "
    "or potential energy that nearly vanishes is compared with the size of the terms in its sum"
)


def compare_trees(
    depth: str = "quick", seed: int = SEED, failures: list[Failure] | None = None
) -> Table:
    """Compare random trees of every joint kind, some with nearly singular inertias, at 100 states each."""
    check_depth(depth)
    rows = of_each(TREE_SIZES, lambda joints: [_trees(joints, TREES[depth], seed)], failures,
                   lambda joints: f"trees of {joints}")  # fmt: skip
    statement = (
        "Mass matrix, Jacobians, forces, energies and momentum of random trees are those of Pinocchio."
    )
    return judged(table_of(COLUMNS, rows, note=f"{statement} Tolerance: {TOLERANCE}."))


def _trees(joints: int, count: int, seed: int) -> dict[str, Any]:
    rng = np.random.default_rng([seed, joints])
    trees = [random_mechanism(rng, joints) for _ in range(count)]
    found = [worst_of(tree, model_of(tree), rng) for tree in trees if tree.nv]
    return {"mechanism": f"{len(found)} trees of {joints}", "base": "random", "bodies": joints,
            "velocities": max((tree.nv for tree in trees), default=0),
            "states": STATES * len(found), **largest_of(found)}  # fmt: skip


def compare_robots(
    folder: str | Path | None = None, depth: str = "quick", seed: int = SEED, failures: list[Failure] | None = None
) -> Table:
    """Compare every URDF file of a folder, with a fixed and with a floating base, at 100 states each.

    Parameters
    ----------
    folder : default `shared/robots` beside the checkout; if it is absent, the finding says that it was skipped
    depth : has no effect here
    """
    check_depth(depth)
    files, skipped = robot_files(folder)
    rows = of_each(product(files, (False, True)), lambda case: [_robot(*case, seed)], failures,
                   lambda case: case[0].stem)  # fmt: skip
    statement = "Robots read by the engine are those that Pinocchio reads, in every quantity."
    return judged(table_of(COLUMNS, rows, note=skipped or f"{statement} Tolerance: {TOLERANCE}."))


def robot_files(folder: str | Path | None = None) -> tuple[list[Path], str]:
    """Return the URDF files of a folder, and "" or, if there are no files, the reason."""
    place = ROBOTS if folder is None else Path(folder)
    files = sorted(place.glob("*.urdf"))
    return files, "" if files else f"no URDF files in {place.name}/, which is not part of the project"


def _robot(path: Path, floating: bool, seed: int) -> dict[str, Any]:
    mechanism, model = Mechanism.from_urdf(path, floating), model_from_urdf(path, floating)
    rng = np.random.default_rng([seed, floating])
    return {"mechanism": path.stem, "base": "floating" if floating else "fixed",
            "bodies": len(mechanism.bodies), "velocities": mechanism.nv, "states": STATES,
            **largest_of([worst_of(mechanism, model, rng)])}  # fmt: skip


def worst_of(mechanism: Mechanism, model: PinocchioMechanism, rng: np.random.Generator) -> dict[str, float]:
    """Return the largest difference of each quantity over random states."""
    found = [compare(mechanism, model, *random_state(rng, mechanism)) for _ in range(STATES)]
    return {name: max(differences[name] for differences in found) for name in found[0]}


def largest_of(found: list[dict[str, float]]) -> dict[str, float]:
    """Return the largest difference of each quantity over mechanisms, and the largest of all."""
    largest: dict[str, float] = {}
    for differences in found:
        for name, value in differences.items():
            largest[name] = max(value, largest.get(name, 0.0))
    return {**largest, "worst": max(largest.values(), default=0.0)}


def judged(table: Table) -> Table:
    """Judge each row: every difference must be at most AGREEMENT."""
    return table.judged(lambda row: bool(row["worst"] <= AGREEMENT))


def compare_kinds(
    depth: str = "quick", seed: int = SEED, failures: list[Failure] | None = None
) -> Table:
    """Compare trees with one kind of joint."""
    check_depth(depth)
    rows = of_each(product(KINDS, KIND_SIZES), lambda case: _kind(*case, seed), failures)
    statement = "Each kind of joint, alone and in a tree of its own kind, is that of Pinocchio."
    return judged(table_of(COLUMNS, rows, note=f"{statement} Tolerance: {TOLERANCE}."))


def _kind(kind: str, joints: int, seed: int) -> Iterator[dict[str, Any]]:
    rng = np.random.default_rng([seed, joints])
    kinds = (kind,) if KINDS[kind].nv else (kind, "revolute")  # a tree of fixed joints alone has nothing to compare
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
    return judged(table_of(COLUMNS, rows, note=f"{statement} Tolerance: {TOLERANCE}."))


def scene_mechanisms() -> Iterator[tuple[str, Mechanism]]:
    """Yield name and mechanism of each scene with at least one degree of freedom."""
    for path in sorted(SHIPPED.glob("*.yaml")):
        mechanism = mechanism_of(load_scene(path))
        if mechanism.nv:
            yield path.stem, mechanism


def compare_written(
    depth: str = "quick", seed: int = SEED, reader: Reader = model_from_urdf, failures: list[Failure] | None = None
) -> Table:
    """Compare the project's robots and random URDF texts, as read by the engine and by Pinocchio's parser."""
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
    return judged(table_of(COLUMNS, rows, note=f"{statement} Tolerance: {TOLERANCE}."))


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


_SETS = {
    "random trees": "random trees of 1 to 30 bodies, with every joint type and nearly singular inertias",
    "joint kinds": "trees with one joint type each",
    "scenes": "mechanisms of the shipped scenes",
    "URDF texts": "sets of URDF texts (the project's robot and random ones with every joint type), read by two parsers",
    "robots": "robots of other projects, with a fixed and a floating base",
}


def agreement(name: str, compared: Table) -> Part:
    """Return the part on one set of mechanisms: their largest difference from Pinocchio."""
    rows = compared.records()
    if not rows:
        sentence = f"Robots of other projects are not compared: {compared.note}."
        return Part(sentence, NOT_TESTABLE, optional=True)
    states = sum(row["states"] for row in rows)
    count = states // STATES if name == "random trees" else len({row["mechanism"] for row in rows})
    most = max(QUANTITIES, key=lambda quantity: max(row[quantity] for row in rows)).replace("_", " ")
    return Part(
        f"{count} {_SETS[name]}: in {states:,} random states no quantity differs from Pinocchio's by more than "
        f"{max(row['worst'] for row in rows):.1e} of the largest entry (tolerance {AGREEMENT:g}). The {most} differs "
        "most.",
        verdict_of_law(compared.holds))  # fmt: skip


def pinocchio_table(compared: Mapping[str, Table]) -> Table:
    """Return one row per mechanism of every set: the largest relative difference of each quantity."""
    merged = {"placements and Jacobians": ("placement", "frame_jacobian", "point_jacobian"),
              "energies": ("kinetic_energy", "potential_energy")}  # fmt: skip
    columns = ("set", "mechanism", "base", "velocities", "states", "mass matrix", "placements and Jacobians", "bias",
               "gravity", "inverse dynamics", "energies", "momentum", "worst", "holds")  # fmt: skip
    rows = []
    for name, table in compared.items():
        words = "robots beside the checkout" if name == "robots" else name
        for row, held in zip(table.records(), table.holds, strict=True):
            largest = {title: max(row[quantity] for quantity in quantities) for title, quantities in merged.items()}
            found = {key.replace("_", " "): value for key, value in row.items()} | largest
            rows.append((words, *(found[title] for title in columns[1:-1]), WORDS[held]))
    return titled(columns, rows, digits=2, note=f"Largest difference over all states. Tolerance: {TOLERANCE}.")
