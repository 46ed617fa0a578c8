"""The few numbers under the trajectory figures, each from one or two runs. Lengths in metres, angles in radians."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iapb.run import Run

Floats = NDArray[np.float64]

# A peg slower than this (and turning slower than this) counts as settled: a tenth of its speed at contact, where
# the eye no longer sees it move [m/s], [rad/s].
SETTLED_SPEED = np.array([1e-3, 1e-3, 1e-2])


def tool_positions(run: Run) -> Floats:
    """Return the tool's coordinates (n + 1, d_t); planar and one-dof joints have as many as they have velocities."""
    return run.q[:, slice(*run.tool_coordinates)]


def distance_between(run: Run, other: Run) -> Floats:
    """Return the root mean square difference of the two device trajectories, per coordinate (d_t,)."""
    count = min(len(run.device_q), len(other.device_q))
    return np.sqrt(np.mean((run.device_q[:count] - other.device_q[:count]) ** 2, axis=0))


def deepest_penetration(run: Run) -> float:
    """Return the largest penetration of any contact [m]."""
    gaps = run.contacts.gap
    return float(max(-gaps.min(), 0.0)) if len(gaps) else 0.0


def settling_time(run: Run) -> float | None:
    """Return when the device was last faster than SETTLED_SPEED [s]; None if it still is at the end."""
    moving = np.flatnonzero(np.any(np.abs(run.device_v) > SETTLED_SPEED[: run.device_v.shape[1]], axis=1))
    if not len(moving):
        return 0.0
    return None if moving[-1] == len(run.time) - 1 else float(run.time[moving[-1] + 1])


def peak_force(run: Run) -> Floats:
    """Return the largest force that the device's actuators applied, per coordinate (d_t,) [N, N m]."""
    return np.max(np.abs(run.device_force), axis=0, initial=0.0)


def widest_separation(run: Run) -> Floats:
    """Return the largest difference between tool and device, per coordinate (d_t,)."""
    return np.max(np.abs(tool_positions(run) - run.device_q), axis=0)
