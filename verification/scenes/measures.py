"""Quantities of the trajectory claims, from one or two traces of the peg. Lengths in metres, angles
in radians.

A `Trace` is the part of a run that the claims use. It is small, so that hundreds fit in memory, and
plain, so that a test can write one by hand.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from iapb.run import Run
from reference import Floats

COORDINATES = ("x", "y", "rotation")
HALF_SIZE = (0.0105, 0.00525)  # of the peg of Fig. 4 [m]

# The device has settled if it is slower than this in every coordinate: 1 mm/s and 0.01 rad/s are
# below a hundredth of the peg's speed at contact (0.15 m/s), and a corner of the peg then moves by
# less than 3 micrometres per step.
SETTLED_SPEED = np.array([1e-3, 1e-3, 1e-2])

# A corner has left its wall if it is further away than this [m]: a twentieth of the
# static penetration F_h / K, above the jitter of resting contacts
LIFTED = 1e-5
# a corner touches the wall again below this [m]; rigid worlds keep contacts at zero up to rounding
TOUCHING = 1e-6


@dataclass(frozen=True)
class Trace:
    """Trajectory, forces, contacts and impacts of one run; n steps, 3 coordinates (x, y, theta).

    Attributes
    ----------
    time : (n + 1,) [s]
    device, tool : (n + 1, 3) positions [m, rad]; device_velocity : (n + 1, 3)
    device_force : (n, 3) force of the device's actuators [N, N m]
    hand_force : (n, 3) [N, N m]
    penetration : (n,) deepest overlap in the step [m], zero without overlap
    new_contact : (n,) whether a contact began in the step
    impact_step : (k,) steps with a collision; energy_lost : (k,) [J]; impact_scale : (k,) share s
        of the impulse
    misfit : (k,) largest |J v⁺ + e′ J v⁻| of an impact with e′ = s (1 + e) − 1, relative to the
        largest |J v⁻|
    kinetic_energy : (n + 1,) of the tool [J]
    """

    time: Floats
    device: Floats
    tool: Floats
    device_velocity: Floats
    device_force: Floats
    hand_force: Floats
    penetration: Floats
    new_contact: NDArray[np.bool_]
    impact_step: NDArray[np.int64]
    energy_lost: Floats
    impact_scale: Floats
    misfit: Floats
    kinetic_energy: Floats

    @property
    def dt(self) -> float:
        """Step [s]."""
        return float(self.time[1] - self.time[0])

    @property
    def first_contact(self) -> int:
        """Index of the step with the first contact; the number of steps if there is no contact."""
        steps = np.flatnonzero(self.new_contact)
        return int(steps[0]) if len(steps) else len(self.new_contact)


def trace_of(run: Run) -> Trace:
    """Return the trace of a run of the peg."""
    step = np.repeat(np.arange(run.steps), np.diff(run.contacts.offsets))
    penetration = np.zeros(run.steps)
    new_contact = np.zeros(run.steps, np.bool_)
    np.maximum.at(penetration, step, np.maximum(-run.contacts.gap, 0.0))
    np.logical_or.at(new_contact, step, run.contacts.is_new)
    body = run.scene_resolved["bodies"][0]
    inertia = np.array([body["mass"], body["mass"], body["inertia"]])
    return Trace(
        run.time,
        run.device_q,
        run.q,
        run.device_v,
        run.device_force,
        run.hand_force,
        penetration,
        new_contact,
        run.impacts.step,
        run.impacts.energy_lost,
        run.impacts.scale,
        np.array([*_misfits(run)]),
        0.5 * (run.v**2) @ inertia,
    )


def colliding_rows(run: Run, step: int, v: Floats) -> Floats:
    """Return the rows of J of the recorded contacts of a step that collide at the velocity v; it
    uses no resolver."""
    here = slice(*run.contacts.offsets[step : step + 2])
    slow = run.scene_resolved["contact"]["approach_velocity"]
    (x, y) = (run.contacts.point[here, :2] - run.q[step, :2]).T
    n = run.contacts.normal[here]
    rows = np.column_stack([n[:, 0], n[:, 1], x * n[:, 1] - y * n[:, 0]])
    return np.asarray(rows[rows @ v < -slow])


def _misfits(run: Run) -> Iterator[float]:
    log = run.impacts
    e = run.scene_resolved["contact"]["restitution"]
    for step, before, after, share in zip(
        log.step, log.v_minus, log.v_plus, log.scale, strict=True
    ):
        rows = colliding_rows(run, step, before)
        off = rows @ (after + (share * (1.0 + e) - 1.0) * before)
        approach = rows @ before
        yield float(np.max(np.abs(off)) / np.max(np.abs(approach))) if len(rows) else 0.0


def settled_at(trace: Trace, factor: float = 1.0) -> int:
    """Return the state after which the device stays slower than factor * SETTLED_SPEED; len(time)
    if never."""
    moving = np.flatnonzero(np.any(np.abs(trace.device_velocity) > factor * SETTLED_SPEED, axis=1))
    return int(moving[-1]) + 1 if len(moving) else 0


def settling_time(trace: Trace) -> float | None:
    """Return the time [s] from the first contact until the device settles; None if it does not
    settle."""
    state = settled_at(trace)
    if state >= len(trace.time):
        return None
    return max(
        float(trace.time[state] - trace.time[min(trace.first_contact, len(trace.time) - 1)]), 0.0
    )


def settling_times(trace: Trace) -> Floats:
    """Return the times [s] from first contact until the device stays below 0.5, 1, 2 SETTLED_SPEED,
    or to the end."""
    last = len(trace.time) - 1
    states = [min(settled_at(trace, factor), last) for factor in (0.5, 1.0, 2.0)]
    return np.maximum(trace.time[states] - trace.time[min(trace.first_contact, last)], 0.0)


def comparison_window(traces: Sequence[Trace]) -> slice:
    """Return the states from the first contact in any world until all worlds have settled, or until
    the runs end."""
    length = len(traces[0].time)
    start = min(min(trace.first_contact for trace in traces), length - 2)
    return slice(start, max(start + 2, min(max(map(settled_at, traces)) + 1, length)))


def root_mean_square(trace: Trace, ideal: Trace, window: slice) -> Floats:
    """Return the RMS distance between the two device trajectories per coordinate (3,)."""
    return np.sqrt(np.mean((trace.device[window] - ideal.device[window]) ** 2, axis=0))


def force_distance(trace: Trace, ideal: Trace, window: slice, steps: int) -> Floats:
    """Return the mean distance between the forces of the actuators, each averaged over the last
    `steps` steps (3,)."""
    apart = np.vstack([np.zeros((steps - 1, 3)), trace.device_force - ideal.device_force])
    return np.asarray(
        np.mean(np.abs(sliding_window_view(apart, steps, axis=0).mean(axis=-1))[window], axis=0)
    )


def peak_force(trace: Trace) -> Floats:
    """Return the largest force of the device's actuators per coordinate (3,) [N, N m]."""
    return np.max(np.abs(trace.device_force), axis=0, initial=0.0)


def unbalanced_force(trace: Trace, window: slice) -> Floats:
    """Return the mean |F + F_hand| of the actuators in contact, outside steps with a collision (3,)
    [N, N m]; for x the tool touches the right wall, for y the floor, for rotation either."""
    right, floor = (np.min(corner_gaps(trace.tool)[k::2], axis=0)[:-1] <= TOUCHING for k in (0, 1))
    counted = np.column_stack([right, floor, right | floor])
    counted[trace.impact_step] = False
    apart = np.abs(trace.device_force + trace.hand_force)[window] * counted[window]
    return np.asarray(np.sum(apart, axis=0) / np.maximum(np.sum(counted[window], axis=0), 1))


def deepest_penetration(trace: Trace) -> float:
    """Return the largest overlap of tool and walls [m]."""
    return float(np.max(trace.penetration, initial=0.0))


def device_overlap(trace: Trace) -> float:
    """Return the largest overlap of the device's peg and the walls [m]: the violation of the
    constraints."""
    return -float(np.min(corner_gaps(trace.device), initial=0.0))


def separation_by_impacts(trace: Trace) -> Floats:
    """Return by how much device and tool part in a step with a collision, at most, per coordinate
    (3,)."""
    parted = np.abs(np.diff(trace.tool - trace.device, axis=0))
    return np.max(parted[trace.impact_step], axis=0, initial=0.0)


def largest_separation(trace: Trace) -> Floats:
    """Return the largest difference between tool and device per coordinate (3,)."""
    return np.max(np.abs(trace.tool - trace.device), axis=0)


def bounces(trace: Trace) -> int:
    """Return the number of times that a corner of the device's peg leaves a wall after touching
    it."""
    count = 0
    for gap in corner_gaps(trace.device):
        events = np.where(gap <= TOUCHING, 1, np.where(gap > LIFTED, -1, 0))
        events = events[events != 0]
        count += int(np.sum((events[:-1] == 1) & (events[1:] == -1)))
    return count


def corner_gaps(positions: Floats) -> list[Floats]:
    """Return the gap of each of the four corners to the right wall (x = 0) and to the floor (y = 0)
    over time [m]."""
    x, y, theta = positions.T
    c = np.cos(theta)
    s = np.sin(theta)
    (w, h) = HALF_SIZE
    corners = ((-w, -h), (-w, h), (w, -h), (w, h))
    return [gap for a, b in corners for gap in (x + a * c - b * s, -(y + a * s + b * c))]


def share_limited(trace: Trace) -> float:
    """Return the share of the impacts that the device's limits reduce."""
    return float(np.mean(trace.impact_scale < 1.0)) if len(trace.impact_scale) else 0.0
