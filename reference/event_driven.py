"""Event-driven simulation, exact up to rounding, for constant mass and force, and linear gaps.

Between events the accelerations are constant, so every gap is a parabola in time and its next zero
has a closed form. There is no step size and no tolerance in time. This covers the bouncing ball,
the block that slides into a corner without rotating, and balls in a row (cradle). Time stepping
must converge to this motion.

At an event, all closed contacts take part in one impact by a law of
`reference.complementarity.laws`. Between events, closed contacts at rest stay closed as long as
they push (the complementarity problem of accelerations).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from iapb.errors import ArgumentError
from reference import Floats
from reference.complementarity.laws import Outcome, newton_lcp
from reference.complementarity.problem import ImpactProblem
from reference.rigid_step import nearest_velocity

# Gaps and speeds at an event have the rounding error of a parabola's root, 1e-16 relative; the
# tolerances are larger.
_CLOSED = 1e-11  # of the largest coordinate: a gap below this is closed
_AT_REST = 1e-11  # of the largest speed so far: a normal velocity below this counts as zero


@dataclass(frozen=True)
class LinearSystem:
    """M (d, d), constant force f (d,), gaps = rows q + start with rows (c, d), start (c,),
    restitution e."""

    mass_matrix: Floats
    force: Floats
    rows: Floats
    start: Floats
    restitution: float

    def __post_init__(self) -> None:
        for name in ("mass_matrix", "force", "rows", "start"):
            object.__setattr__(self, name, np.array(getattr(self, name), np.float64))
        d = len(self.force)
        c = len(self.start)
        if self.rows.shape != (c, d) or self.mass_matrix.shape != (d, d):
            raise ArgumentError(
                "rows", self.rows.shape, f"shape ({c}, {d}), mass_matrix ({d}, {d})"
            )

    def gap(self, q: Floats) -> Floats:
        """Return the gaps (c,) [m]."""
        return self.rows @ q + self.start


@dataclass(frozen=True)
class ExactTrajectory:
    """Arcs between events, which are parabolas."""

    event_time: Floats  #: (k,) start of each arc [s], the first 0
    q: Floats  #: (k, d) there
    v: Floats  #: (k, d) there, after the impact
    a: Floats  #: (k, d) on the arc
    impulse: Floats  #: (k, c) of the impact at the start of each arc [N s]
    end: float  #: time up to which the motion is known [s]

    def state(self, time: ArrayLike) -> tuple[Floats, Floats]:
        """Return q and v (n, d) at the times (n,); at the instant of an event, those after it."""
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
    """Return the motion from q, v (d,) for `duration` [s]; its arcs are exact at every time up to
    rounding.

    Parameters
    ----------
    system : constant mass matrix and force, gaps that are linear in q
    q, v : (d,) at the start, [m | rad] and their rates
    law : impact law; by default Newton's as a linear complementarity problem
    most_events : number of events after which the motion ends early, as where impacts accumulate (a
        ball that comes to rest); `end` is its last time
    """
    at = np.array(q, np.float64)
    moving = np.array(v, np.float64)
    now = 0.0
    free = np.asarray(np.linalg.solve(system.mass_matrix, system.force), np.float64)
    speed = float(np.abs(moving).max(initial=0.0))
    arcs = []
    for _ in range(most_events):
        gaps = system.gap(at)
        impulse = np.zeros(len(system.start))
        closed = gaps <= _CLOSED * (1.0 + np.abs(at).max())
        rows = system.rows[closed]
        if (rows @ moving < -_AT_REST * speed).any():
            outcome = law(
                ImpactProblem.from_impact(system.mass_matrix, rows, moving, system.restitution)
            )
            moving = outcome.velocity
            impulse[closed] = outcome.impulse
        # resting contacts are kept from closing
        resting = closed & (np.abs(system.rows @ moving) <= _AT_REST * speed)
        a = nearest_velocity(
            system.mass_matrix, free, system.rows, np.where(resting, 0.0, -np.inf)
        ).velocity
        arcs.append((now, at, moving, a, impulse))
        parabolas = np.stack(
            [np.where(closed, 0.0, gaps), system.rows @ moving, system.rows @ a], axis=1
        )
        wait = min((_first_root(*parabola) for parabola in parabolas[~resting]), default=np.inf)
        if now + wait >= duration:
            now = duration
            break
        at = at + wait * (moving + 0.5 * wait * a)
        moving = moving + wait * a
        now = now + wait
        speed = max(speed, float(np.abs(moving).max()))
    time, qs, vs, accelerations, impulses = (np.array(part) for part in zip(*arcs, strict=True))
    return ExactTrajectory(time, qs, vs, accelerations, impulses, now)


def _first_root(gap: float, rate: float, curvature: float) -> float:
    """Return the least t > 0 at which gap + rate t + curvature t²/2 passes zero downwards, or
    infinity."""
    if gap == 0.0:  # it separates now (rate > 0) and returns if the curvature is negative
        return -2.0 * rate / curvature if curvature < 0.0 and rate > 0.0 else np.inf
    discriminant = rate * rate - 2.0 * curvature * gap
    if discriminant < 0.0 or (rate >= 0.0 and curvature >= 0.0):
        return np.inf
    root = np.sqrt(discriminant)
    if rate <= 0.0:
        return 2.0 * gap / (root - rate) if root - rate > 0.0 else np.inf
    return (rate + root) / -curvature
