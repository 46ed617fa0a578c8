"""Event-driven simulation, exact up to rounding: constant mass and force, gaps linear in the coordinates.

Between events the accelerations are constant, so every gap is a parabola in time and its next zero is known in
closed form: no step size, no tolerance in time. Covers the bouncing ball, the block that slides into a corner
without turning, and balls in a row (cradle). It is the truth that time stepping must converge to.

At an event, all closed contacts take part in one impact by a law of `reference.complementarity.laws`; between events
closed contacts at rest stay closed as long as their force pushes (the complementarity problem of accelerations).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.errors import ArgumentError
from reference.complementarity.laws import Outcome, newton_lcp
from reference.complementarity.problem import ImpactProblem
from reference.rigid_step import nearest_velocity

Floats = NDArray[np.float64]

# Gaps and speeds at an event carry the rounding of a parabola's root: 1e-16 relative, some factors of ten kept.
_CLOSED = 1e-11  # of the largest coordinate: a gap below this is closed
_AT_REST = 1e-11  # of the largest speed so far: a normal velocity below this is none


@dataclass(frozen=True)
class LinearSystem:
    """M (d, d), constant force f (d,), gaps = rows q + start with rows (c, d), start (c,), restitution e."""

    mass_matrix: Floats
    force: Floats
    rows: Floats
    start: Floats
    restitution: float

    def __post_init__(self) -> None:
        for name in ("mass_matrix", "force", "rows", "start"):
            object.__setattr__(self, name, np.array(getattr(self, name), np.float64))
        d, c = len(self.force), len(self.start)
        if self.rows.shape != (c, d) or self.mass_matrix.shape != (d, d):
            raise ArgumentError("rows", self.rows.shape, f"shape ({c}, {d}), mass_matrix ({d}, {d})")

    def gap(self, q: Floats) -> Floats:
        """Gaps (c,) [m]."""
        return self.rows @ q + self.start


@dataclass(frozen=True)
class ExactTrajectory:
    """Parabolic arcs between events.

    event_time : (k,) start of each arc [s], the first 0; q, v : (k, d) there, after the impact; a : (k, d)
    impulse : (k, c) of the impact at the start of the arc [N s]; end : time up to which it is known [s]
    """

    event_time: Floats
    q: Floats
    v: Floats
    a: Floats
    impulse: Floats
    end: float

    def state(self, time: ArrayLike) -> tuple[Floats, Floats]:
        """Return q and v (n, d) at the times (n,), right after an event that falls on one."""
        t = np.atleast_1d(np.asarray(time, np.float64))
        if t.min(initial=0.0) < 0.0 or t.max(initial=0.0) > self.end:
            raise ArgumentError("time", time, f"times in [0, {self.end!r}] s")
        arc = np.searchsorted(self.event_time, t, side="right") - 1
        since = (t - self.event_time[arc])[:, None]
        v = self.v[arc] + since * self.a[arc]
        return self.q[arc] + since * (self.v[arc] + 0.5 * since * self.a[arc]), v


def event_driven(
    system: LinearSystem,
    q: ArrayLike,
    v: ArrayLike,
    duration: float,
    law: Callable[[ImpactProblem], Outcome] = newton_lcp,
    most_events: int = 1000,
) -> ExactTrajectory:
    """Return the motion from q, v (d,) for `duration` [s], or up to event number `most_events`.

    An accumulation of impacts (a ball coming to rest) ends it early: `end` then says how far it goes.

    Parameters
    ----------
    system : constant mass matrix and force, gaps that are linear in q
    q, v : (d,) at the start, [m | rad] and their rates
    duration : [s]
    law : impact law; by default Newton's as a linear complementarity problem
    most_events : after which the motion ends

    Returns
    -------
    ExactTrajectory
        parabolas between the events, so exact at every time.
    """
    q_now, v_now, now = np.array(q, np.float64), np.array(v, np.float64), 0.0
    speed, arcs = float(np.abs(v_now).max(initial=0.0)), []
    for _ in range(most_events):
        closed = system.gap(q_now) <= _CLOSED * (1.0 + np.abs(q_now).max())
        v_now, impulse = _impact(system, v_now, closed, _AT_REST * speed, law)
        acceleration, held = _acceleration(system, v_now, closed, _AT_REST * speed)
        arcs.append((now, q_now, v_now, acceleration, impulse))
        wait = _next_closing(system, q_now, v_now, acceleration, closed, held)
        if now + wait >= duration:
            return _arcs(arcs, duration)
        q_now = q_now + wait * (v_now + 0.5 * wait * acceleration)
        v_now, now = v_now + wait * acceleration, now + wait
        speed = max(speed, float(np.abs(v_now).max()))
    return _arcs(arcs, now)


def _impact(
    system: LinearSystem, v: Floats, closed: NDArray[np.bool_], at_rest: float, law: Callable[..., Outcome]
) -> tuple[Floats, Floats]:
    """Return v⁺ and the impulses (c,) where a closed contact approaches; v as it is otherwise."""
    impulse = np.zeros(len(closed))
    rows = system.rows[closed]
    if not (rows @ v < -at_rest).any():
        return v, impulse
    outcome = law(ImpactProblem.from_impact(system.mass_matrix, rows, v, system.restitution))
    impulse[closed] = outcome.impulse
    return outcome.velocity, impulse


def _acceleration(
    system: LinearSystem, v: Floats, closed: NDArray[np.bool_], at_rest: float
) -> tuple[Floats, NDArray[np.bool_]]:
    """Acceleration (d,) with resting contacts kept from closing further, and the contacts (c,) that rest."""
    resting = closed & (np.abs(system.rows @ v) <= at_rest)
    free = np.asarray(np.linalg.solve(system.mass_matrix, system.force), np.float64)
    bound = np.where(resting, 0.0, -np.inf)
    return nearest_velocity(system.mass_matrix, free, system.rows, bound).velocity, resting


def _next_closing(
    system: LinearSystem,
    q: Floats,
    v: Floats,
    acceleration: Floats,
    closed: NDArray[np.bool_],
    resting: NDArray[np.bool_],
) -> float:
    """Time [s] until the first gap closes: least positive root of gap + gamma t + α t²/2 that decreases."""
    gaps = np.where(closed, 0.0, system.gap(q))
    rates, curvatures = system.rows @ v, system.rows @ acceleration
    waits = [
        _first_root(gap, rate, curvature)
        for gap, rate, curvature in zip(gaps[~resting], rates[~resting], curvatures[~resting], strict=True)
    ]
    return min(waits, default=np.inf)


def _first_root(gap: float, rate: float, curvature: float) -> float:
    """Least t > 0 at which gap + rate t + curvature t²/2 passes zero downwards; infinity when it never does."""
    if gap == 0.0:  # it leaves now (rate > 0) and returns when gravity wins
        return -2.0 * rate / curvature if curvature < 0.0 and rate > 0.0 else np.inf
    discriminant = rate * rate - 2.0 * curvature * gap
    if discriminant < 0.0 or (rate >= 0.0 and curvature >= 0.0):
        return np.inf
    root = np.sqrt(discriminant)
    if rate <= 0.0:
        return 2.0 * gap / (root - rate) if root - rate > 0.0 else np.inf
    return (rate + root) / -curvature


def _arcs(arcs: list[tuple[float, Floats, Floats, Floats, Floats]], end: float) -> ExactTrajectory:
    time, q, v, a, impulse = (np.array(x) for x in zip(*arcs, strict=True))
    return ExactTrajectory(time, q, v, a, impulse, end)
