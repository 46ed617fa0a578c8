"""Contact problems of our own, so that solvers have problems where no folder of them is: the hard cases, impacts of the
project's scenes, hyperstatic families, and patches with friction. The same ones every time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from iapb.errors import ArgumentError
from reference.complementarity.problem import ImpactProblem
from reference.datasets import StoredProblem
from verification.complementarity.cases import random_cases
from verification.complementarity.scene_cases import scene_impacts
from verification.cost.step_cost import patch, pile
from verification.finding import Failure, attempt
from verification.hard_cases import HARD_CASES, HardCase
from verification.impacts import Floats, ImpactCase

Maker = Callable[[str], "ImpactProblem"]  # from its name

# Of the catalogue, those with few contacts; a thousand copies of one row take the slowest solvers minutes.
HARD = ("nearly_parallel_normals", "printed_formula_gains", "hilbert_rows", "kahan_rows", "mass_ratio",
        "tiny_lever_arm", "face_at_three_points", "grazing", "subnormal_speeds", "light_direction",
        "bar_with_unequal_restitution")
HYPERSTATIC_CONTACTS = (8, 24, 64)
SCENES = ("peg_corner", "peg_hole_space", "three_link_arm_elastic", "arm_obstacles")
FAMILIES = ("face on floor", "corner", "tight hole", "random rows")
FRICTIONS = (0.1, 0.5, 1.0)
FRICTIONAL_CONTACTS = (1, 4, 12)
_SEED = 9


def own_problems(failures: list[Failure] | None = None) -> tuple[StoredProblem, ...]:
    """All of them, frictionless ones first; `failures` receives those that cannot be made."""
    makers: dict[str, Maker] = {f"hard case {name}": partial(_hard_case, name) for name in HARD}
    makers |= {f"impact of {name}": partial(_scene_impact, name) for name in SCENES}
    makers |= dict(_hyperstatic()) | dict(_with_friction())
    made = (attempt(name, partial(make, name), failures) for name, make in makers.items())
    return tuple(StoredProblem(problem, format="built here") for problem in made if problem is not None)


def _hard_case(hard: str, name: str) -> ImpactProblem:
    case = HARD_CASES[hard]()
    if not isinstance(case, HardCase):
        raise ArgumentError("HARD", hard, "the name of a hard impact")
    return ImpactProblem.from_impact(
        case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution, name=name
    )


def _scene_impact(scene: str, name: str) -> ImpactProblem:
    """The impact with the most contacts."""
    return _posed(max(scene_impacts(scene).cases, key=lambda case: case.contacts), name)


def _hyperstatic() -> Iterator[tuple[str, Maker]]:
    for case in random_cases(1, restitutions=(0.5,), families=FAMILIES, seed=_SEED):
        if case.redundancy:
            yield f"{case.family}, {case.redundancy} redundant of {case.contacts}", partial(_posed, case)
    for contacts in HYPERSTATIC_CONTACTS:
        for make in (patch, pile):
            case = make(contacts, np.random.default_rng([_SEED, contacts]))
            yield f"{make.__name__} of {contacts}", partial(_posed, case)


def _posed(case: ImpactCase, name: str) -> ImpactProblem:
    return ImpactProblem.from_impact(
        case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution, name=name
    )


def _with_friction() -> Iterator[tuple[str, Maker]]:
    """The box that lands on a patch, sliding, with dry friction; and a rod wedged between two walls."""
    for contacts in FRICTIONAL_CONTACTS:
        for mu in FRICTIONS:
            yield f"patch of {contacts}, μ = {mu:g}", partial(_rough_patch, contacts, mu)
    for mu in FRICTIONS:
        yield f"rod between walls, μ = {mu:g}", partial(_wedged_rod, mu)


def _rough_patch(contacts: int, mu: float, name: str) -> ImpactProblem:
    case = patch(contacts, np.random.default_rng([_SEED, contacts, 3]))
    rows = _with_tangents(case.contact_jacobian)
    return ImpactProblem.from_impact(case.mass_matrix, rows, case.velocity, 0.0, mu, name=name)


def _with_tangents(normals: np.ndarray) -> Floats:
    """Rows n, t, s of every contact at the patch's points: rows (k, 6) -> (3k, 6)."""
    rows = []
    for normal in normals:
        point = np.array([-normal[4], normal[3], -0.5])  # a point r has r × z = (y, −x, 0)
        rows += [normal, *(np.concatenate([t, np.cross(point, t)]) for t in np.eye(3)[:2])]
    return np.array(rows)


def _wedged_rod(mu: float, name: str) -> ImpactProblem:
    """A rod whose ends press on two facing walls as it turns: normals opposed, friction may hold it by itself."""
    points, normals = ((-0.6, -0.8), (0.6, 0.8)), ((1.0, 0.0), (-1.0, 0.0))
    rows = [_row(np.array(point), np.array(direction)) for point, (x, y) in zip(points, normals, strict=True)
            for direction in ((x, y, 0.0), (-y, x, 0.0), (0.0, 0.0, 1.0))]  # fmt: skip
    velocity = np.array([0.0, -0.4, 0.1, 0.0, 0.0, 0.7])
    mass = np.diag([1.0, 1.0, 1.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0])
    return ImpactProblem.from_impact(mass, np.array(rows), -velocity, 0.0, mu, name=name)


def _row(point: Floats, direction: Floats) -> Floats:
    """Velocity of a point (x, y) along a direction, as a row on (v, ω)."""
    return np.concatenate([direction, np.cross([*point, 0.0], direction)])
