"""Random trees and real robots against Pinocchio: how far apart, over many random states.

A robot is read twice from its URDF file, by the engine's reader and by Pinocchio's own.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from iapb.mechanics.mechanism import Mechanism
from reference.random_mechanisms import random_mechanism, random_state
from reference.rigid_body import PinocchioMechanism, model_from_urdf, model_of
from verification.finding import Column, Failure, Table, check_depth, of_each, table_of
from verification.mechanics.engine_differences import compare

# Relative to the largest entry; two algorithms over chains of 30 links, each exact to some 1e-14.
AGREEMENT = 1e-11
STATES = 100
TREE_SIZES = (1, 2, 4, 8, 16, 30)
TREES = {"quick": 3, "full": 50}  # of each size
SEED = 20050602
ROBOTS = Path(__file__).parents[3] / "shared" / "robots"

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
    f"{AGREEMENT:g} of the reference's largest entry (a bias or potential energy that nearly vanishes: the size of "
    "the terms that it sums): two algorithms, each exact to some 1e-14"
)


def compare_trees(
    depth: str = "quick", seed: int = SEED, failures: list[Failure] | None = None
) -> Table:
    """Compare random trees of every joint kind, nearly singular inertias among them, at 100 states each."""
    check_depth(depth)
    rows = of_each(TREE_SIZES, lambda joints: [_trees(joints, TREES[depth], seed)], failures,
                   lambda joints: f"trees of {joints}")  # fmt: skip
    statement = (
        "Mass matrix, Jacobians, forces, energies and momentum of random trees are those of Pinocchio."
    )
    return replace(judged(table_of(COLUMNS, rows)), note=f"{statement} Tolerance: {TOLERANCE}.")


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
    folder : default `shared/robots` beside the checkout; where it is absent the finding says that it was skipped
    depth : both depths are the same here
    """
    check_depth(depth)
    files, skipped = robot_files(folder)
    rows = of_each(product(files, (False, True)), lambda case: [_robot(*case, seed)], failures,
                   lambda case: case[0].stem)  # fmt: skip
    statement = "Robots read by the engine are those that Pinocchio reads, in every quantity."
    table = judged(table_of(COLUMNS, rows))
    return replace(table, note=skipped or f"{statement} Tolerance: {TOLERANCE}.")


def robot_files(folder: str | Path | None = None) -> tuple[list[Path], str]:
    """Return the URDF files of a folder, and why there are none where there are none."""
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
    """The largest difference of each quantity over random states."""
    found = [compare(mechanism, model, *random_state(rng, mechanism)) for _ in range(STATES)]
    return {name: max(differences[name] for differences in found) for name in found[0]}


def largest_of(found: list[dict[str, float]]) -> dict[str, float]:
    """The largest difference of each quantity over mechanisms, and the worst of them all."""
    largest: dict[str, float] = {}
    for differences in found:
        for name, value in differences.items():
            largest[name] = max(value, largest.get(name, 0.0))
    return {**largest, "worst": max(largest.values(), default=0.0)}


def judged(table: Table) -> Table:
    """Every quantity within AGREEMENT."""
    return replace(table, holds=tuple(bool(worst <= AGREEMENT) for worst in table.column("worst")))
