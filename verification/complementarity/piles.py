"""Dense piles, in which assumption (i) fails: (19)/(21) treats every colliding row as an equality.

The spheres touch on a close-packed lattice. Only a share of the contacts is kept, so that redundancy varies; in reality
slightly different diameters leave some contacts open. The pile falls on the floor at 1 m/s with a small random velocity
of each sphere. The velocity of (21) is compared with that of impulses that only push: the engine's `method="poisson"`,
which for equal e is Newton's LCP. By statement 1 of `agreement` the two velocities are equal if and only if some p >= 0
gives the velocity of (21); for small piles non-negative least squares tests this too. All impacts have e = 0, because
whether the laws agree does not depend on e (statement 2).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from iapb import resolve_impact
from iapb.errors import SolverError
from reference.complementarity.laws import newton_lcp, nonnegative_impulse
from reference.complementarity.problem import ImpactProblem
from reference.datasets import DatasetError, problem_files, read_problem
from verification.clock import timed
from verification.complementarity.agreement import REPRODUCED
from verification.finding import Failure, attempt
from verification.impacts import Floats, ImpactCase

SPHERES = {"quick": (4, 8, 16, 32, 64), "full": (4, 8, 16, 32, 64, 128, 256)}
KEPT = (0.5, 0.75, 1.0)  # shares of the lattice's contacts
DRAWN = {"quick": 64, "full": 512}  # number of spheres of all piles of one size and share: large piles are fewer
ASKED = 64  # number of spheres up to which non-negative least squares is used too
LARGEST = {"quick": 200, "full": 600}  # largest number of contacts of a recorded pile
LEAST_RECORDED = 20  # least number of contacts of a recorded pile
PULLS = 1e-12  # share of the largest impulse below which a negative impulse is rounding
_LATTICE = np.array([[1.0, 0.0, 0.0], [0.5, np.sqrt(3.0) / 2.0, 0.0], [0.5, np.sqrt(3.0) / 6.0, np.sqrt(2.0 / 3.0)]])


@dataclass(frozen=True)
class PileRow:
    """One pile, resolved by (21) and by impulses that only push; distances in the kinetic metric, relative to |v⁻|.

    name : name of the pile's group in the table; rows : "approaching" or "touching", the contacts that have a row
    redundant : number of contacts minus their rank; distance : distance of the two velocities
    pulling : share of the least-norm impulses that pull; pulling_share : their sum divided by the sum of all |p|
    asked : whether non-negative least squares finds a p >= 0 for the velocity of (21); None if it was not used
    lcp : distance of the velocity with pushing impulses from the reference's Newton LCP
    gain : change of energy with pushing impulses, divided by KE⁻
    equality, pushing : time of one impact [s], by (21) and with pushing impulses
    """

    name: str
    rows: str
    contacts: int
    redundant: int
    distance: float
    pulling: float
    pulling_share: float
    asked: bool | None
    lcp: float
    gain: float
    equality: float
    pushing: float

    @property
    def agrees(self) -> bool:
        """Whether some p >= 0 gives the velocity of (21)."""
        return self.distance <= REPRODUCED


def sphere_pile(spheres: int, kept: float, rng: np.random.Generator) -> ImpactCase:
    """Return a falling pile of spheres of diameter 1; `kept` is the share of touching pairs that have a contact."""
    side = int(np.ceil(spheres ** (1.0 / 3.0)))
    cells = np.array([(i, j, k) for k in range(side) for j in range(side) for i in range(side)])[:spheres]
    places, rows = cells @ _LATTICE, []
    for a in range(spheres):
        for b in range(a):
            apart = places[a] - places[b]
            if np.linalg.norm(apart) < 1.0 + 1e-9 and rng.random() < kept:
                row = np.zeros((spheres, 3))
                row[a], row[b] = apart, -apart
                rows.append(row.ravel())
        if cells[a, 2] == 0:
            floor = np.zeros((spheres, 3))
            floor[a, 2] = 1.0
            rows.append(floor.ravel())
    velocity = 0.3 * rng.normal(size=(spheres, 3)) - [0.0, 0.0, 1.0]
    masses = np.diag(np.repeat(rng.uniform(0.5, 2.0, spheres), 3))
    return ImpactCase(masses, np.array(rows), velocity.ravel(), 0.0, f"{spheres} spheres, {kept:.0%} of the contacts")


def recorded_piles(folder: Path | str, largest: int) -> Iterator[ImpactCase]:
    """Yield recorded piles of others: the normal part of symmetric problems with at most `largest` contacts.

    The velocity is the least-squares solution of least norm for the offset in the file.
    """
    for path in problem_files(folder):
        try:
            stored = read_problem(path).problem
            step = stored.contact_size
            problem = ImpactProblem.from_delassus(stored.delassus[::step, ::step], stored.offset[::step])
            if LEAST_RECORDED <= problem.size <= largest and not stored.two_sided.any():
                velocity = np.linalg.lstsq(problem.factor, problem.offset)[0]
                yield ImpactCase(np.eye(problem.size), problem.factor, velocity, 0.0, f"recorded: {path.name}")
        except (DatasetError, SolverError):  # the study of problem files lists these files
            continue


def compare_piles(
    depth: str = "quick", folders: Iterable[Path | str] = (), spheres: Sequence[int] | None = None, seed: int = 19,
    failures: list[Failure] | None = None,
) -> tuple[PileRow, ...]:
    """Resolve our own piles and the recorded piles of some folders, by (21) and by impulses that only push."""
    cases = [sphere_pile(n, kept, np.random.default_rng([seed, n, round(100 * kept), k]))
             for n in spheres or SPHERES[depth] for kept in KEPT for k in range(max(1, DRAWN[depth] // n))]  # fmt: skip
    cases += [case for folder in folders for case in recorded_piles(folder, LARGEST[depth])]
    found = []
    for number, case in enumerate(cases):
        for rows in ("approaching", "touching"):
            found.append(attempt(f"pile {number}: {case.family}, {rows}", partial(compare_pile, case, rows), failures))
    return tuple(row for row in found if row is not None)


def compare_pile(case: ImpactCase, rows: str = "approaching") -> PileRow:
    """Resolve one pile by (21) and by impulses that only push."""
    mass, v = case.mass_matrix, case.velocity
    given = case.contact_jacobian[case.contact_jacobian @ v < 0.0] if rows == "approaching" else case.contact_jacobian
    equal, equality = timed(partial(resolve_impact, mass, given, v, 0.0))
    push, pushing = timed(partial(resolve_impact, mass, given, v, 0.0, method="poisson"))
    kinetic = np.linalg.cholesky(mass).T
    speed, p = float(np.linalg.norm(kinetic @ v)), equal.impulses
    law = newton_lcp(ImpactProblem.from_impact(mass, given, v, 0.0)).velocity
    asked = len(given) <= 4 * ASKED and len(v) <= 3 * ASKED
    return PileRow(
        case.family, rows, len(given), len(given) - equal.rank,
        distance=_length(kinetic, equal.velocity - push.velocity) / speed,
        pulling=float(np.mean(p < -PULLS * np.abs(p).max(initial=0.0))) if len(p) else 0.0,
        pulling_share=float(-p[p < 0.0].sum() / (np.abs(p).sum() or 1.0)),
        asked=nonnegative_impulse(given, equal.generalized_impulse, mass).exists if asked else None,
        lcp=_length(kinetic, push.velocity - law) / speed, gain=push.energy_change / (0.5 * speed**2),
        equality=equality, pushing=pushing,
    )  # fmt: skip


def _length(kinetic: Floats, change: Floats) -> float:
    return float(np.linalg.norm(kinetic @ change))
