"""Theorem 2 along a trajectory: no impact raises the kinetic energy of the bodies that it strikes."""

from __future__ import annotations

from typing import Any

import numpy as np

from iapb.errors import ArgumentError
from reference.energy_gain import bulk_energy_gain
from reference.exact import relative_energy_gain
from verification.properties.bounds import FACTORED
from verification.properties.case import LawResidual
from verification.properties.trajectory_laws.trajectory import EPS, Floats, Trajectory


def impacts_take_energy(trajectory: Trajectory) -> LawResidual | None:
    """Largest relative gain over its bound 10 d ε √κ(M), of M restricted to the trees that were struck."""
    impacts = trajectory.run.impacts
    if not len(impacts.step):
        return None
    return LawResidual("impact_energy", max(_ratio(trajectory, k) for k in range(len(impacts.step))), 1.0)


def _ratio(trajectory: Trajectory, k: int) -> float:
    impacts = trajectory.run.impacts
    of = struck_coordinates(trajectory, impacts.impulse[k])
    before, after = impacts.v_minus[k][of], impacts.v_plus[k][of]
    if not before.any():
        return np.inf if after.any() else 0.0
    mass = trajectory.masses[impacts.step[k]][np.ix_(of, of)]
    values = np.linalg.eigvalsh(mass)
    allowed = FACTORED.factor * len(of) * EPS * float(np.sqrt(values[-1] / values[0]))
    return _gain(mass, before, after) / allowed


def _gain(mass: Floats, before: Floats, after: Floats) -> float:
    """Relative gain in double-double; in exact rationals for speeds out of its range, of a run that flies apart."""
    try:
        gain, bound = bulk_energy_gain(mass, before, after)
    except ArgumentError:
        return relative_energy_gain(mass, before, after)
    return float(gain[0]) if np.isfinite(bound[0]) else np.inf


def struck_coordinates(trajectory: Trajectory, impulse: Floats) -> Any:
    """Coordinates of all trees with an impulse; all of them where there is none."""
    chosen = [np.arange(a, b) for a, b in trajectory.system.mechanism.tree_dofs if np.any(impulse[a:b])]
    return np.concatenate(chosen) if chosen else np.arange(len(impulse))
