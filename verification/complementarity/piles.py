"""Dense piles of spheres, in which assumption (i) fails: (21) treats every colliding row as an
equality.

The spheres touch on a close-packed lattice. Only a share of the contacts is kept, as in reality by
slightly different diameters. The pile falls on the floor at 1 m/s with a small random velocity of
each sphere. All impacts have e = 0 (e does not matter, see `agreement`).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from iapb import resolve_impact
from reference.complementarity.laws import newton_lcp
from reference.complementarity.problem import ImpactProblem
from verification.check import Check, Study
from verification.finding import Part
from verification.impacts import ImpactCase
from verification.table import Row, Table

SPHERES = {"quick": (4, 8, 16, 32, 64), "full": (4, 8, 16, 32, 64, 128, 256)}
KEPT = (0.5, 0.75, 1.0)  # shares of the lattice's contacts
# spheres of all piles of one size and share: large piles are fewer
DRAWN = {"quick": 64, "full": 512}
PULLS = 1e-12  # share of the largest impulse below which a negative impulse is rounding
AGREES = 1e-11  # distance of the velocities, relative to |v⁻|
_LATTICE = np.array(
    [[1.0, 0.0, 0.0], [0.5, np.sqrt(3.0) / 2.0, 0.0], [0.5, np.sqrt(3.0) / 6.0, np.sqrt(2.0 / 3.0)]]
)


def sphere_pile(spheres: int, kept: float, rng: np.random.Generator) -> ImpactCase:
    """Return a falling pile of spheres of diameter 1; `kept` is the share of touching pairs that
    have a contact."""
    side = int(np.ceil(spheres ** (1.0 / 3.0)))
    cells = np.array([(i, j, k) for k in range(side) for j in range(side) for i in range(side)])[
        :spheres
    ]
    places = cells @ _LATTICE
    rows = []
    for a in range(spheres):
        for b in range(a):
            apart = places[a] - places[b]
            if np.linalg.norm(apart) < 1.0 + 1e-9 and rng.random() < kept:
                row = np.zeros((spheres, 3))
                row[a] = apart
                row[b] = -apart
                rows.append(row.ravel())
        if cells[a, 2] == 0:
            floor = np.zeros((spheres, 3))
            floor[a, 2] = 1.0
            rows.append(floor.ravel())
    velocity = 0.3 * rng.normal(size=(spheres, 3)) - [0.0, 0.0, 1.0]
    masses = np.diag(np.repeat(rng.uniform(0.5, 2.0, spheres), 3))
    name = f"{spheres} spheres, {kept:.0%} of contacts kept"
    return ImpactCase(masses, np.array(rows), velocity.ravel(), 0.0, name)


def piles_of(depth: str, spheres: int) -> Iterator[ImpactCase]:
    """Yield the piles of one size, with the rows of the contacts that approach."""
    for kept in KEPT:
        for k in range(max(1, DRAWN[depth] // spheres)):
            pile = sphere_pile(
                spheres, kept, np.random.default_rng([19, spheres, round(100 * kept), k])
            )
            closing = pile.contact_jacobian @ pile.velocity < 0.0
            yield ImpactCase(
                pile.mass_matrix, pile.contact_jacobian[closing], pile.velocity, 0.0, pile.family
            )


def sphere_piles(depth: str) -> Iterator[ImpactCase]:
    """Yield the piles of all sizes."""
    for spheres in SPHERES[depth]:
        yield from piles_of(depth, spheres)


def _row(study: Study, spheres: int) -> Row:
    """Resolve the piles of one size by (21), by impulses that only push, and by complementarity."""
    contacts = []
    agreeing = [0]
    pulls = []
    pushed = []
    for case in piles_of(study.depth, spheres):
        given = (*case.arrays, 0.0)
        equal = resolve_impact(*given)
        push = resolve_impact(*given, method="poisson").velocity
        law = newton_lcp(ImpactProblem.from_impact(*given)).velocity
        contacts.append(case.contacts)
        if case.distance(equal.velocity, law) <= AGREES:
            agreeing.append(case.contacts)
        p = equal.impulses
        pulls.append(float(np.mean(p < -PULLS * np.abs(p).max(initial=0.0))))
        pushed.append(case.distance(push, law))
    return {
        "spheres": spheres,
        "piles": len(contacts),
        "contacts, mean": float(np.mean(contacts)),
        "agree": len(agreeing) - 1,
        "most contacts that agree": max(agreeing),
        "share of impulses that pull": float(np.mean(pulls)),
        "pushing only, from the LCP": max(pushed),
    }


def _targets(table: Table) -> Iterator[Part]:
    most = max(table["pushing only, from the LCP"], default=None)
    yield Part.on("impulses that only push, from the LCP, of |v⁻|", most, AGREES)


PILES = Check(
    key="piles",
    question="Up to how many contacts does (21) agree, and how many of its impulses pull?",
    cases=lambda study: SPHERES[study.depth],
    row=_row,
    targets=_targets,
)
