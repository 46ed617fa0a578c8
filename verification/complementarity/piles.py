"""Dense piles, in which assumption (i) fails: (21) treats every colliding row as an equality.

The spheres touch on a close-packed lattice. Only a share of the contacts is kept, as in reality by
slightly different diameters. The pile falls on the floor at 1 m/s with a small random velocity of
each sphere. The velocity of (21) is compared with that of impulses that only push: the engine's
`method="poisson"`, which for equal e is Newton's LCP. By statement 1 of `agreement` the two
velocities are equal if and only if some p >= 0 gives the velocity of (21); for small piles
non-negative least squares tests this too. All impacts have e = 0 (statement 2: e does not matter).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from iapb import resolve_impact
from iapb.errors import SolverError
from reference.complementarity.laws import EXPLAINED, newton_lcp, pulling_share
from reference.complementarity.problem import ImpactProblem
from reference.datasets import DatasetError, problem_files, read_problem
from verification.check import Check, Study
from verification.clock import timed
from verification.complementarity.agreement import PUSHED
from verification.finding import Part, verdict_of_share
from verification.impacts import ImpactCase
from verification.table import Row, Table

SPHERES = {"quick": (4, 8, 16, 32, 64), "full": (4, 8, 16, 32, 64, 128, 256)}
KEPT = (0.5, 0.75, 1.0)  # shares of the lattice's contacts
DRAWN = {
    "quick": 64,
    "full": 512,
}  # number of spheres of all piles of one size and share: large piles are fewer
ASKED = 64  # number of spheres up to which non-negative least squares is used too
LARGEST = {"quick": 200, "full": 600}  # largest number of contacts of a recorded pile
LEAST_RECORDED = 20  # least number of contacts of a recorded pile
PULLS = 1e-12  # share of the largest impulse below which a negative impulse is rounding
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
    name = f"{spheres} spheres, {kept:.0%} of contacts kept"
    return ImpactCase(masses, np.array(rows), velocity.ravel(), 0.0, name)


def recorded_piles(folder: Path | str, largest: int) -> Iterator[ImpactCase]:
    """Yield recorded piles of others: the normal part of symmetric problems with at most `largest`
    contacts.

    The velocity is the least-squares solution of least norm for the offset in the file.
    """
    for path in problem_files(folder):
        try:
            stored = read_problem(path).problem
            step = stored.contact_size
            problem = ImpactProblem.from_delassus(
                stored.delassus[::step, ::step], stored.offset[::step]
            )
            if LEAST_RECORDED <= problem.size <= largest:
                velocity = np.linalg.lstsq(problem.factor, problem.offset)[0]
                yield ImpactCase(
                    np.eye(problem.size), problem.factor, velocity, 0.0, f"recorded: {path.name}"
                )
        except (DatasetError, SolverError):  # the study of problem files lists these files
            continue


def groups_of(
    depth: str, folders: Iterable[Path | str], seed: int = 19
) -> Iterator[tuple[str, list[ImpactCase]]]:
    """Yield our own piles, one group for each size and share of the contacts, and each recorded
    pile of the folders."""
    for spheres, kept in product(SPHERES[depth], KEPT):
        seeds = (
            [seed, spheres, round(100 * kept), k] for k in range(max(1, DRAWN[depth] // spheres))
        )
        piles = [sphere_pile(spheres, kept, np.random.default_rng(each)) for each in seeds]
        yield piles[0].family, piles
    for folder in folders:
        yield from ((case.family, [case]) for case in recorded_piles(folder, LARGEST[depth]))


def group_rows(study: Study, group: tuple[str, list[ImpactCase]]) -> Iterator[Row]:
    """Yield a row for the approaching and one for the touching contacts of a group of piles."""
    for rows in ("approaching", "touching"):
        found = [compare_pile(case, rows) for case in group[1]]
        yield {
            "pile": group[0],
            "rows": rows,
            "piles": len(found),
            **{name: summed([one[name] for one in found]) for name, summed in SUMMED_UP.items()},
        }


def compare_pile(case: ImpactCase, rows: str = "approaching") -> Row:
    """Resolve one pile by (21) and by impulses that only push, and return its entry in each column
    of SUMMED_UP.

    It agrees if some p >= 0 gives the velocity of (21). Non-negative least squares contradicts
    this, where it is asked.
    """
    mass, v = case.mass_matrix, case.velocity
    given = (
        case.contact_jacobian[case.contact_jacobian @ v < 0.0]
        if rows == "approaching"
        else case.contact_jacobian
    )
    equal, equality = timed(partial(resolve_impact, mass, given, v, 0.0))
    push, pushing = timed(partial(resolve_impact, mass, given, v, 0.0, method="poisson"))
    law, p = newton_lcp(ImpactProblem.from_impact(mass, given, v, 0.0)).velocity, equal.impulses
    distance = case.distance(equal.velocity, push.velocity)
    agrees, asked = distance <= PUSHED, len(given) <= 4 * ASKED and len(v) <= 3 * ASKED
    pulls = float(np.mean(p < -PULLS * np.abs(p).max(initial=0.0))) if len(p) else 0.0
    contradicted = (
        asked and (pulling_share(given, equal.generalized_impulse, mass) <= EXPLAINED) != agrees
    )
    values = (
        len(given),
        len(given) - equal.rank,
        agrees,
        len(given) * agrees,
        pulls,
        float(-p[p < 0.0].sum() / (np.abs(p).sum() or 1.0)),
        distance,
        case.distance(push.velocity, law),
        1e6 * equality,
        1e6 * pushing,
        contradicted,
        push.energy_change / (0.5 * case.speed**2),
    )
    return dict(zip(SUMMED_UP, values, strict=True))


def _mean(values: list[float]) -> float:
    return float(np.mean(values))


def _median(values: list[float]) -> float:
    return float(np.median(values))


TIMES = ("time of (21) [µs]", "time of pushing [µs]")
SUMMED_UP: dict[str, Callable[[list[Any]], Any]] = {  # column -> its value for a group of piles
    "contacts": _mean,
    "redundant": _mean,
    "share that agrees": _mean,
    "most contacts that agree": max,
    "share of impulses that pull": _mean,
    "negative share of p": _mean,
    "median distance from the LCP": _median,
    "pushing from the LCP": max,
    **dict.fromkeys(TIMES, _median),
    "contradicted by least squares": sum,
    "largest change of KE": max,
}


def _says(table: Table) -> Part:
    rows, piles, limit = (
        table.records(),
        sum(table["piles"]),
        max(table["most contacts that agree"]),
    )
    agree = sum(row["piles"] * row["share that agrees"] for row in rows)
    beyond = [row for row in rows if row["contacts"] > limit] or rows
    pulling = 100.0 * float(
        np.average(
            [row["share of impulses that pull"] for row in beyond],
            weights=[row["piles"] for row in beyond],
        )
    )
    return Part.of(
        "In impacts on dense piles, can pushing impulses (p >= 0) give the velocity of (21)?",
        f"in {agree:.0f} of {piles} "
        f"impacts{f', the largest with {limit} contacts' if agree else ''}. In impacts "
        f"with more than {limit} contacts, {pulling:.0f} % of the impulses of (21) pull. The "
        f"world IAPB-push "
        '(method "poisson") lets impulses only push; its velocities differ from the LCP\'s by at most '
        f"{max(table['pushing from the LCP']):.0e} |v⁻|",
        "in all impacts",
        verdict_of_share(agree / piles),
        "piles",
        miss=f"in sphere piles with more than {limit} contacts, {pulling:.0f} % of the impulses pull instead of push",
    )


def piles(folders: Iterable[Path | str]) -> Check:
    """Return the check on our own piles and on the recorded piles of some folders."""
    return Check(
        key="piles",
        question="",
        cases=lambda study: groups_of(study.depth, folders),
        row=group_rows,
        says=_says,
        timed=TIMES,
        digits=3,
        note="Equation (21) against impulses that only push (as in the world IAPB-push), at e = 0. Each pile is "
        "resolved twice, with the rows of the approaching and of all touching contacts. A random "
        "share of the contacts "
        "is kept, to vary redundancy; contacts and redundant rows are means. A pile agrees if "
        "some p >= 0 gives the "
        "velocity of (21). Distances are in the kinetic metric, relative to |v⁻|. Times include "
        "the call from Python.",
    )
