"""Differences between the engine and Pinocchio: mechanisms over many random states, and impacts of
independent rows; and between the engine and the references: mechanics and contacts of a scene.

The mechanisms are random trees, trees with one kind of joint, the scenes and the project's robots.
Robots of other projects need a folder that is not part of this project. The engine and Pinocchio
each read the URDF texts themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iapb import resolve_impact
from iapb.mechanics.joints import KINDS
from iapb.mechanics.mechanism import Mechanism
from iapb.scene import load_scene
from iapb.scene.mechanism import mechanism_of
from reference import Floats
from reference.random_mechanisms import random_mechanism, random_state
from reference.rigid_body import (
    PinocchioMechanism,
    at_lever,
    impulse_dynamics,
    model_from_urdf,
    model_of,
)
from verification.check import Check, Study
from verification.finding import Part
from verification.impacts import EPS, draw_case
from verification.table import Row, Table

# Relative to the largest entry. For chains of 30 links each algorithm is accurate to about 1e-14.
AGREEMENT = 1e-11
EARTH = (0.0, 0.0, -9.81)  # [m/s^2]
STATES = 100
TREE_SIZES = (1, 2, 4, 8, 16, 30)
TREES = {"quick": 3, "full": 50}  # trees of each size
SEED = 20050602
ROBOTS = Path(__file__).parents[3] / "shared" / "robots"
SHIPPED = Path(__file__).parents[2] / "scenes"
KIND_SIZES = (1, 6)  # number of joints of a tree with one kind of joint
Pairs = list[tuple[Mechanism, PinocchioMechanism]]

TREES_SET = "random trees"
OTHERS = "robots beside the checkout"
_SETS = {
    TREES_SET: "random trees of up to 30 bodies",
    "joint kinds": "trees with one joint type each",
    "scenes": "mechanisms of the scenes",
    "URDF texts": "URDF texts",
    OTHERS: "robots of other projects",
}


@dataclass(frozen=True)
class Case:
    """Mechanisms of one row; `make` returns them with Pinocchio's models."""

    set: str
    label: str
    base: str
    seed: int | list[int]
    make: Callable[[np.random.Generator], Pairs]

    def __str__(self) -> str:
        return f"{self.set}, {self.label}"


def shipped_robots() -> list[Path]:
    """Return the URDF files of the project."""
    return sorted((SHIPPED / "robots").glob("*.urdf"))


def robot_files() -> list[Path]:
    """Return the URDF files of robots of other projects; none without their folder."""
    return sorted(ROBOTS.glob("*.urdf"))


def _cases(study: Study) -> Iterator[Case]:
    count = TREES[study.depth]
    for n in TREE_SIZES:
        yield Case(
            TREES_SET, f"trees of {n}", "random", [SEED, n], partial(_trees, n, count, tuple(KINDS))
        )
    for kind, n in product(KINDS, KIND_SIZES):
        # a tree of fixed joints alone has nothing to compare
        kinds = (kind,) if KINDS[kind].nv else (kind, "revolute")
        yield Case("joint kinds", f"{n} {kind}", "random", [SEED, n], partial(_trees, n, 1, kinds))
    for path in sorted(SHIPPED.glob("*.yaml")):
        yield Case("scenes", path.stem, "of the scene", SEED, partial(_scene, path))
    bases = {"fixed": False, "floating": True}
    robots = {"URDF texts": shipped_robots(), OTHERS: robot_files()}
    for name, files in robots.items():
        for path, (base, floating) in product(files, bases.items()):
            yield Case(name, path.stem, base, [SEED, floating], partial(_read, path, floating))


def _trees(joints: int, count: int, kinds: tuple[str, ...], rng: np.random.Generator) -> Pairs:
    trees = [random_mechanism(rng, joints, kinds) for _ in range(count)]
    return [(tree, model_of(tree)) for tree in trees if tree.nv]


def _scene(path: Path, _: np.random.Generator) -> Pairs:
    mechanism = mechanism_of(load_scene(path))
    return [(mechanism, model_of(mechanism))] if mechanism.nv else []


def _read(file: Path, floating: bool, _: np.random.Generator) -> Pairs:
    return [(Mechanism.from_urdf(file, floating), model_from_urdf(file, floating))]


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
        yield {
            "set": case.set,
            "mechanism": label,
            "base": case.base,
            "velocities": max(mechanism.nv for mechanism, _model in pairs),
            "states": STATES * len(pairs),
            **largest,
            "worst": max(largest.values()),
        }


def compare(
    mechanism: Mechanism,
    reference: PinocchioMechanism,
    q: Floats,
    v: Floats,
    gravity: ArrayLike = EARTH,
) -> dict[str, float]:
    """Return the largest difference of each quantity, relative to the reference's largest entry.

    Some quantities use another scale. The potential energy, whose zero is a convention, is relative
    to the sum of m |g| |c|. A bias may nearly vanish (a centre of mass almost on its axis, a body
    that hardly turns), so its scale is at least the size of the terms in its sum. These are m |c|
    w^2 with the fastest rate w, because the rounding of the world positions c affects every lever
    arm, and v x m v, which is zero but is computed from terms of the size of twice the kinetic
    energy. Point Jacobians are compared at a point one metre off each body's origin.
    """
    dv = np.cos(np.arange(mechanism.nv))
    lifted = float(np.linalg.norm(gravity)) * _spread(mechanism, q)

    def apart(name: str, *given: Any, floor: float = 0.0) -> float:
        ours, theirs = (getattr(each, name)(*given) for each in (mechanism, reference))
        return relative_difference(ours, theirs, floor)

    return {
        "mass matrix": apart("mass_matrix", q),
        "placements and Jacobians": _bodies_apart(mechanism, reference, q),
        "bias": apart("bias", q, v, floor=_swung(mechanism, q, v)),
        "gravity": apart("gravity", q, gravity),
        "inverse dynamics": apart("inverse_dynamics", q, v, dv, gravity),
        "energies": max(
            apart("kinetic_energy", q, v), apart("potential_energy", q, gravity, floor=lifted)
        ),
        "momentum": apart("centroidal_momentum", q, v),
    }


def _bodies_apart(mechanism: Mechanism, reference: PinocchioMechanism, q: Floats) -> float:
    """Return the largest difference of placements, of Jacobians, and of Jacobians of points."""
    order = [reference.index(name) for name in mechanism.names]
    axes, origins, rows = (each[order] for each in reference.bodies(q))
    rotations, positions = mechanism.placements(q)
    points = positions + (0.6, 0.0, -0.8)
    bodies = range(len(order))
    at_points = [at_lever(rows[b], points[b] - origins[b]) for b in bodies]
    return max(
        relative_difference(np.dstack([rotations, positions]), np.dstack([axes, origins])),
        relative_difference([mechanism.frame_jacobian(q, b) for b in bodies], rows),
        relative_difference([mechanism.point_jacobian(q, b, points[b]) for b in bodies], at_points),
    )


def _swung(mechanism: Mechanism, q: Floats, v: Floats) -> float:
    """Sum of m |c| w^2 [N], or of m v^2 [N m]: the size of the terms of a bias, whose sum may be
    near zero."""
    fastest = float(np.max(np.abs(v[mechanism.arrays.dof_rotates[: mechanism.nv]]), initial=0.0))
    return max(fastest**2 * _spread(mechanism, q), 2.0 * mechanism.kinetic_energy(q, v))


def _spread(mechanism: Mechanism, q: Floats) -> float:
    """Sum of m |c| [kg m]."""
    rotations, positions = mechanism.placements(q)
    bodies = zip(mechanism.bodies, rotations, positions, strict=True)
    return sum(
        body.mass * float(np.linalg.norm(p + R @ body.center_of_mass)) for body, R, p in bodies
    )


def relative_difference(ours: ArrayLike, theirs: ArrayLike, floor: float = 0.0) -> float:
    """Return the largest |ours - theirs|, divided by the larger of `floor` and the largest
    |theirs|."""
    scale = max(floor, float(np.max(np.abs(theirs), initial=0.0)))
    gap = float(np.max(np.abs(np.subtract(ours, theirs)), initial=0.0))
    return gap / scale if scale > 0.0 else gap


def _targets(table: Table) -> Iterator[Part]:
    for name, words in _SETS.items():
        found = table.where(set=name)
        if found.rows:
            worst = max(found["worst"])
            yield Part.on(f"{words}, from Pinocchio, of the largest entry", worst, AGREEMENT)


AGAINST_PINOCCHIO = Check(
    key="against Pinocchio",
    question="Are mass matrix, Jacobians, forces, energies and momentum those of Pinocchio?",
    cases=_cases,
    row=_rows,
    holds=lambda row: bool(row["worst"] <= AGREEMENT),
    targets=_targets,
)

# condition numbers κ(W): up to the first, plain rounding; beyond the second, not compared
_EASY = 1e2
_HARDEST = 1e12


def _difference(rng: np.random.Generator) -> tuple[float, float, float]:
    """Return κ(W) of a random impact of independent rows, the difference of v⁺ between the engine and
    Pinocchio's impulseDynamics in the kinetic metric, and 100 d ε κ(W)."""
    d = int(rng.integers(1, 13))
    case = draw_case(rng, 1e4, d, int(rng.integers(1, d + 1)), ("generic",))
    ours = resolve_impact(*case.given()).velocity
    condition = float(np.linalg.cond(case.rows)) ** 2
    bound = 100.0 * d * EPS * condition
    return condition, case.distance(ours, impulse_dynamics(*case.given())), bound


def _impulse_dynamics(_: Study, impacts: int) -> Iterator[Row]:
    """Yield the largest differences over random impacts."""
    rng = np.random.default_rng(2)
    drawn = np.array([_difference(rng) for _ in range(impacts)])
    condition, error, bound = drawn[drawn[:, 0] <= _HARDEST].T
    for quantity, found, tolerance in (
        ("v⁺ of independent rows, as a share of 100 d ε κ(W)", error / bound, 1.0),
        ("v⁺ where κ(W) ≤ 100, relative to |v⁻|", error[condition <= _EASY], 1e-12),
    ):
        yield {
            "quantity": quantity,
            "cases": len(found),
            "largest difference": float(found.max()),
            "tolerance": tolerance,
        }


def _impulse_targets(table: Table) -> Iterator[Part]:
    for row in table.records():
        yield Part.on(row["quantity"], row["largest difference"], row["tolerance"])


IMPULSE_DYNAMICS = Check(
    key="impulse dynamics",
    question="Do velocities after impacts at independent contacts agree with Pinocchio's?",
    cases=lambda _: (2000,),
    row=_impulse_dynamics,
    targets=_impulse_targets,
    holds=lambda row: bool(row["largest difference"] <= row["tolerance"]),
)
