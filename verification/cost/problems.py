"""Impacts that are timed: random ones, a patch of redundant contacts, and a pile of independent
ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from iapb.errors import IapbError
from verification.impacts import RANK_CUT, Family, ImpactCase, draw_of_rank

_DRAWS = 1000  # most draws of a patch
# largest difference of two equal changes of velocity, relative to |v⁻|, in the kinetic metric
_AGREE = 1e-9


def random_impact(d: int, c: int) -> ImpactCase:
    """Return a random impact with c rows, whose rank is two thirds of d (or c, if this is less), and
    e = 1/2."""
    rank = min(c, max(1, (2 * d) // 3))
    (case,) = draw_of_rank(Family(d, c, rank, 1e2), 1, d)
    return replace(case, restitution=0.5)


def patch(contacts: int, rng: np.random.Generator) -> ImpactCase:
    """Return an impact of a slightly rotating box on `contacts` points of its lower face: d = 6,
    rank at most 3.

    Points are drawn again until impulses that only push give the velocity of the equalities.
    Otherwise IAPB and the complementarity solvers would resolve the impact differently, and their
    times would not compare.
    """
    from scipy.optimize import nnls

    up = np.array([0.0, 0.0, 1.0])
    for _ in range(_DRAWS):
        points = np.column_stack([rng.uniform(-1.0, 1.0, (contacts, 2)), -0.5 * np.ones(contacts)])
        rows = np.column_stack([np.tile(up, (contacts, 1)), np.cross(points, up)])
        velocity = np.array([0.3, 0.1, -1.0, *rng.uniform(-0.2, 0.2, 3)])
        case = ImpactCase(np.diag([2.0, 2.0, 2.0, 0.5, 0.5, 0.8]), rows, velocity, 0.0, "patch")
        u = case.lower.T @ velocity
        change = -np.linalg.lstsq(case.rows, case.rows @ u, rcond=RANK_CUT)[0]
        if nnls(case.rows.T, change)[1] <= _AGREE * np.linalg.norm(u):
            return case
    raise IapbError(
        f"no patch of {contacts} contacts in {_DRAWS} draws on which impulses only push"
    )


def pile(contacts: int, rng: np.random.Generator) -> ImpactCase:
    """Return an impact of a stack of planar boxes with two contacts between neighbours, all
    approaching."""
    boxes = (contacts + 1) // 2
    below = np.eye(boxes) - np.eye(boxes, k=-1)
    rows = np.kron(below, [[0.0, 1.0, -1.0], [0.0, 1.0, 1.0]])[:contacts]
    velocity = np.zeros(3 * boxes)
    velocity[1::3] = -np.cumsum(rng.uniform(0.5, 1.0, boxes))
    velocity[2::3] = rng.uniform(-0.1, 0.1, boxes)
    return ImpactCase(np.diag(np.tile([1.0, 1.0, 2.0 / 3.0], boxes)), rows, velocity, 0.0, "pile")
