"""Quantities of the trajectory claims, computed from one or two traces. Lengths in metres, angles in radians."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from verification.scenes.trace import HALF_SIZE, Trace

Floats = NDArray[np.float64]

# The device has settled if it is slower than this in every coordinate: 1 mm/s and 0.01 rad/s are below a hundredth of
# the peg's speed at contact (0.15 m/s), and a corner of the peg then moves by less than 3 micrometres per step.
SETTLED_SPEED = np.array([1e-3, 1e-3, 1e-2])

# A corner has left its wall if it is further away than this [m]: a twentieth of the
# static penetration F_h / K, above the jitter of resting contacts
LIFTED = 1e-5
TOUCHING = 1e-6  # a corner touches the wall again below this [m]; rigid worlds keep contacts at zero up to rounding


def settled_at(trace: Trace) -> int:
    """Return the index of the state after which the device stays slower than SETTLED_SPEED; len(time) if never."""
    moving = np.flatnonzero(np.any(np.abs(trace.device_velocity) > SETTLED_SPEED, axis=1))
    return int(moving[-1]) + 1 if len(moving) else 0


def settling_time(trace: Trace) -> float | None:
    """Return the time [s] from the first contact until the device settles; None if it does not settle."""
    state = settled_at(trace)
    if state >= len(trace.time):
        return None
    return max(float(trace.time[state] - trace.time[min(trace.first_contact, len(trace.time) - 1)]), 0.0)


def comparison_window(traces: Sequence[Trace]) -> slice:
    """Return the states from the first contact in any world until all worlds have settled, or until the runs end."""
    length = len(traces[0].time)
    start = min(min(trace.first_contact for trace in traces), length - 2)
    return slice(start, max(start + 2, min(max(map(settled_at, traces)) + 1, length)))


def root_mean_square(trace: Trace, ideal: Trace, window: slice) -> Floats:
    """Return the RMS distance between the two device trajectories per coordinate (3,)."""
    return np.sqrt(np.mean((trace.device[window] - ideal.device[window]) ** 2, axis=0))


def largest_distance(trace: Trace, ideal: Trace, window: slice) -> Floats:
    """Return the largest distance between the two device trajectories per coordinate (3,)."""
    return np.max(np.abs(trace.device[window] - ideal.device[window]), axis=0)


def momentum_distance(trace: Trace, ideal: Trace, window: slice) -> Floats:
    """Return the RMS distance between the accumulated impulses of the actuators, per coordinate [N s, N m s].

    Forces are compared through their time integral. If a force peak of one step comes one step later, the integrals
    differ little, while the forces differ by the whole peak.
    """
    given = np.cumsum(trace.device_force - ideal.device_force, axis=0) * ideal.dt
    return np.sqrt(np.mean(given[window] ** 2, axis=0))


def peak_force(trace: Trace) -> Floats:
    """Return the largest force of the device's actuators per coordinate (3,) [N, N m]."""
    return np.max(np.abs(trace.device_force), axis=0, initial=0.0)


def resting_force(trace: Trace) -> Floats | None:
    """Return the mean actuator force after settling (3,) [N, N m]; None if the device does not settle."""
    state = settled_at(trace)
    return None if state >= len(trace.device_force) else np.mean(trace.device_force[state:], axis=0)


def deepest_penetration(trace: Trace) -> float:
    """Return the largest overlap of tool and walls [m]."""
    return float(np.max(trace.penetration, initial=0.0))


def largest_separation(trace: Trace) -> Floats:
    """Return the largest difference between tool and device per coordinate (3,)."""
    return np.max(np.abs(trace.tool - trace.device), axis=0)


def bounces(trace: Trace) -> int:
    """Return the number of times that a corner of the device's peg leaves a wall after touching it."""
    return sum(_departures(gap) for gap in corner_gaps(trace.device))


def corner_gaps(positions: Floats) -> list[Floats]:
    """Return the gap of each of the four corners to the right wall (x = 0) and to the floor (y = 0) over time [m]."""
    x, y, theta = positions.T
    c, s = np.cos(theta), np.sin(theta)
    gaps = []
    for sign_a in (-1.0, 1.0):
        for sign_b in (-1.0, 1.0):
            a, b = sign_a * HALF_SIZE[0], sign_b * HALF_SIZE[1]
            gaps += [x + a * c - b * s, -(y + a * s + b * c)]
    return gaps


def _departures(gap: Floats) -> int:
    """Return the number of times that the gap exceeds LIFTED after it was at most TOUCHING."""
    events = np.where(gap <= TOUCHING, 1, np.where(gap > LIFTED, -1, 0))
    events = events[events != 0]
    return int(np.sum((events[:-1] == 1) & (events[1:] == -1)))


def share_limited(trace: Trace) -> float:
    """Return the share of the impacts that the device's limits reduce."""
    return float(np.mean(trace.impact_scale < 1.0)) if len(trace.impact_scale) else 0.0
