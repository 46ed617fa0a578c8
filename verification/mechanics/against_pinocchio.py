"""Differences between the engine and Pinocchio: mechanisms over many random states, and impacts of independent rows.

The mechanisms are random trees, trees with one kind of joint, the scenes, the project's robots and random URDF texts.
Robots of other projects need a folder that is not part of this project. The engine and Pinocchio each read the URDF
texts themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from iapb import resolve_impact
from iapb.mechanics.joints import KINDS
from iapb.mechanics.mechanism import Mechanism
from iapb.scene import load_scene
from iapb.scene.mechanism import mechanism_of
from reference.random_mechanisms import random_mechanism, random_state
from reference.rigid_body import PinocchioMechanism, impulse_dynamics, model_from_urdf, model_of
from verification.check import Check, Study
from verification.finding import NOT_TESTABLE, Part, verdict_of_law
from verification.mechanics.engine_differences import compare
from verification.mechanics.random_urdf import random_urdf
from verification.table import Row, Table

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
Pairs = list[tuple[Mechanism, PinocchioMechanism]]

# column of the table -> the quantities whose largest difference it has
QUANTITIES = {
    "mass matrix": ("mass_matrix",), "placements and Jacobians": ("placement", "frame_jacobian", "point_jacobian"),
    "bias": ("bias",), "gravity": ("gravity",), "inverse dynamics": ("inverse_dynamics",),
    "energies": ("kinetic_energy", "potential_energy"), "momentum": ("momentum",),
}  # fmt: skip
TOLERANCE = (
    f"{AGREEMENT:g} of the reference's largest entry, for two algorithms that are each accurate to about 1e-14. A bias "
    "or potential energy that nearly vanishes is compared with the size of the terms in its sum"
)
TREES_SET, OTHERS = "random trees", "robots beside the checkout"
_SETS = {
    TREES_SET: "random trees of 1 to 30 bodies, with every joint type and nearly singular inertias",
    "joint kinds": "trees with one joint type each",
    "scenes": "mechanisms of the shipped scenes",
    "URDF texts": "sets of URDF texts (the project's robot and random ones with every joint type), read by two parsers",
    OTHERS: "robots of other projects, with a fixed and a floating base",
}


@dataclass(frozen=True)
class Case:
    """Mechanisms of one row: `make` returns them with Pinocchio's models, from the generator with the given seed."""

    set: str
    label: str
    base: str
    seed: int | list[int]
    make: Callable[[np.random.Generator], Pairs]

    def __str__(self) -> str:
        return f"{self.set}, {self.label}"


def robot_files(folder: str | Path | None = None) -> tuple[list[Path], str]:
    """Return the URDF files of a folder, and "" or, if there are no files, the reason."""
    place = ROBOTS if folder is None else Path(folder)
    files = sorted(place.glob("*.urdf"))
    return files, "" if files else f"no URDF files in {place.name}/, which is not part of the project"


def _cases(study: Study) -> Iterator[Case]:
    count, written = TREES[study.depth], WRITTEN[study.depth]
    for n in TREE_SIZES:
        yield Case(TREES_SET, f"trees of {n}", "random", [SEED, n], partial(_trees, n, count, tuple(KINDS)))
    for kind, n in product(KINDS, KIND_SIZES):
        kinds = (kind,) if KINDS[kind].nv else (kind, "revolute")  # a tree of fixed joints alone has nothing to compare
        yield Case("joint kinds", f"{n} {kind}", "random", [SEED, n], partial(_trees, n, 1, kinds))
    for path in sorted(SHIPPED.glob("*.yaml")):
        yield Case("scenes", path.stem, "of the scene", SEED, partial(_scene, path))
    bases = {"fixed": False, "floating": True}
    for path, (base, floating) in product(sorted((SHIPPED / "robots").glob("*.urdf")), bases.items()):
        yield Case("URDF texts", path.stem, base, [SEED, floating], partial(_read, [path], floating))
    for n, (base, floating) in product(WRITTEN_SIZES, bases.items()):
        label = f"{written} random texts of {n} joints"
        yield Case("URDF texts", label, base, [SEED, floating], partial(_written, n, written, floating))
    for path, (base, floating) in product(robot_files()[0], bases.items()):
        yield Case(OTHERS, path.stem, base, [SEED, floating], partial(_read, [path], floating))


def _trees(joints: int, count: int, kinds: tuple[str, ...], rng: np.random.Generator) -> Pairs:
    trees = [random_mechanism(rng, joints, kinds) for _ in range(count)]
    return [(tree, model_of(tree)) for tree in trees if tree.nv]


def _scene(path: Path, _: np.random.Generator) -> Pairs:
    mechanism = mechanism_of(load_scene(path))
    return [(mechanism, model_of(mechanism))] if mechanism.nv else []


def _read(files: list[Path], floating: bool, _: np.random.Generator) -> Pairs:
    return [(Mechanism.from_urdf(file, floating), model_from_urdf(file, floating)) for file in files]


def _written(links: int, count: int, floating: bool, rng: np.random.Generator) -> Pairs:
    texts = np.random.default_rng([SEED, links, 2])
    with TemporaryDirectory() as scratch:
        files = [Path(scratch) / f"random-{links}-{k}.urdf" for k in range(count)]
        for file in files:
            file.write_text(random_urdf(texts, links), encoding="utf-8")
        return _read(files, floating, rng)


def _rows(_: Study, case: Case) -> Iterator[Row]:
    rng = np.random.default_rng(case.seed)
    pairs = case.make(rng)
    largest: dict[str, float] = {}
    for mechanism, model in pairs:
        for _state in range(STATES):
            for name, value in compare(mechanism, model, *random_state(rng, mechanism)).items():
                largest[name] = max(value, largest.get(name, 0.0))
    if pairs:
        label = f"{len(pairs)} {case.label}" if case.set == TREES_SET else case.label
        yield {"set": case.set, "mechanism": label, "base": case.base,
               "velocities": max(mechanism.nv for mechanism, _model in pairs), "states": STATES * len(pairs),
               **{title: max(largest[name] for name in names) for title, names in QUANTITIES.items()},
               "worst": max(largest.values())}  # fmt: skip


def agreement(table: Table) -> Iterator[Part]:
    """Yield the part on each set of mechanisms: their largest difference from Pinocchio."""
    for name, words in _SETS.items():
        found = table.where(set=name)
        rows = found.records()
        if not rows:
            yield Part(f"Robots of other projects are not compared: {robot_files()[1]}.", NOT_TESTABLE, optional=True)
            continue
        states = sum(row["states"] for row in rows)
        count = states // STATES if name == TREES_SET else len({row["mechanism"] for row in rows})
        most = max(QUANTITIES, key=lambda title: max(row[title] for row in rows))
        yield Part(
            f"{count} {words}: in {states:,} random states no quantity differs from Pinocchio's by more than "
            f"{max(row['worst'] for row in rows):.1e} of the largest entry (tolerance {AGREEMENT:g}). The largest "
            f"difference is in: {most}.", verdict_of_law(found.holds))  # fmt: skip


AGAINST_PINOCCHIO = Check(
    key="against Pinocchio", question="Mass matrix, Jacobians, forces, energies and momentum are those of Pinocchio.",
    cases=_cases, row=_rows, holds=lambda row: bool(row["worst"] <= AGREEMENT), says=agreement, digits=2,
    note=f"Largest difference over all states. Tolerance: {TOLERANCE}.",
)  # fmt: skip

_EPS = float(np.finfo(float).eps)
_EASY, _HARDEST = 10.0, 1e6  # condition numbers κ(A): up to the first, plain rounding; beyond the second, not compared


def _impulse_dynamics(_: Study, impacts: int) -> Iterator[Row]:
    """Yield the largest differences of v⁺ between the engine and Pinocchio's impulseDynamics, kinetic metric."""
    rng = np.random.default_rng(2)
    shares, easy = [], []
    for _impact in range(impacts):
        d = int(rng.integers(1, 13))
        c = int(rng.integers(1, d + 1))
        root = rng.normal(size=(d, d))
        M = root @ root.T + 10.0 ** rng.uniform(-2, 1) * np.eye(d)
        J, v, e = rng.normal(size=(c, d)), rng.normal(size=d), float(rng.uniform(-1, 1))
        L = np.linalg.cholesky(M)
        condition = float(np.linalg.cond(np.linalg.solve(L, J.T)))
        if condition > _HARDEST:
            continue
        ours, theirs = resolve_impact(M, J, v, e).velocity, impulse_dynamics(M, J, v, e)
        error = float(np.linalg.norm(L.T @ (ours - theirs)) / np.linalg.norm(L.T @ v))
        shares.append(error / (100.0 * d * _EPS * condition**2))
        if condition <= _EASY:
            easy.append(error)
    for quantity, errors, tolerance, why in (
        ("v⁺ of independent rows, as a share of 100 d ε κ(A)²", shares, 1.0, "a hundred roundings per coordinate, "
         "times κ(A)², the condition of the Delassus matrix that it forms"),
        ("v⁺ where κ(A) ≤ 10, kinetic metric", easy, 1e-12, "plain rounding"),
    ):  # fmt: skip
        yield {"quantity": quantity, "cases": len(errors), "largest difference": max(errors), "tolerance": tolerance,
               "why this tolerance": why}  # fmt: skip


def _impacts_agree(table: Table) -> str:
    shares, easy = table.records()
    return (f"Impacts at independent contacts: v⁺ differs from that of Pinocchio's impulseDynamics by at most "
            f"{easy['largest difference']:.1e} of |v⁻| in {easy['cases']} well-conditioned cases, and by at most "
            f"{shares['largest difference']:.2g} of the rounding bound in {shares['cases']} cases.")  # fmt: skip


IMPULSE_DYNAMICS = Check(
    key="impulse dynamics", question="Do impacts at independent contacts agree with Pinocchio's impulseDynamics?",
    cases=lambda _: (2000,), row=_impulse_dynamics, says=_impacts_agree, prose=("why this tolerance",), digits=2,
    holds=lambda row: bool(row["largest difference"] <= row["tolerance"]),
)  # fmt: skip
