"""Motion that no contact sees is kept: f(v + z) = f(v) + z for every z with J z = 0."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from verification.properties.bounds import Bounds
from verification.properties.case import Floats, ImpactCase, LawResidual, Resolver, outcome, own_outcome

_SEED = 20050621  # the same z for the same case, so that a failure repeats


def unseen_motion(case: ImpactCase) -> Floats:
    """A z of kinetic size |u| with J z = 0, orthogonal to the row space of A."""
    w = np.random.default_rng(_SEED).normal(size=case.coordinates)
    w -= case.row_space.T @ (case.row_space @ w)
    w -= case.row_space.T @ (case.row_space @ w)
    size = float(np.linalg.norm(w))
    return np.linalg.solve(case.lower.T, w * (case.speed / size)) if size > 1e-8 else np.zeros_like(w)


def free_motion_is_kept(case: ImpactCase, resolver: Resolver, bounds: Bounds) -> LawResidual | None:
    """Distance of f(v + z) from f(v) + z."""
    if not case.is_separated or case.speed == 0.0 or len(case.row_space) == case.coordinates:
        return None
    z = unseen_motion(case)
    moved = outcome(resolver, replace(case, velocity=case.velocity + z))
    return LawResidual("free_motion", case.distance(moved, own_outcome(resolver, case) + z), bounds.comparison(case))
