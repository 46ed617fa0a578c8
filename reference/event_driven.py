"""Event-driven simulation, exact up to rounding, for constant mass and force, springs, and linear gaps.

Between events the accelerations are constant, so every gap is a parabola in time and its next zero has a closed form.
There is no step size and no tolerance in time. This covers the bouncing ball, the block that slides into a corner
without rotating, and balls in a row (cradle). Time stepping must converge to this motion.

With springs, M a = f − K q + Jᵀλ, and each arc is a sum of modes: sines, or parabolas at frequency zero. Gaps and
contact forces then have a bounded second derivative. So the next zero is approached from the left by steps that cannot
pass it (conservative advancement), up to rounding.

At an event, all closed contacts take part in one impact by a law of `reference.complementarity.laws`. Between events,
closed contacts at rest stay closed as long as they push (the complementarity problem of accelerations).
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

# Gaps and speeds at an event have the rounding error of a parabola's root, 1e-16 relative; the tolerances are larger.
_CLOSED = 1e-11  # of the largest coordinate: a gap below this is closed
_AT_REST = 1e-11  # of the largest speed so far: a normal velocity below this counts as zero
_WEAK = 1e-10  # share below which a contact force, an acceleration or a singular value of rows counts as zero
_NO_SPRING = 1e-13  # of the largest ω²: below this a mode has no spring
_INSTANT = 4.0 * float(np.finfo(np.float64).eps)  # of the time: a shorter step means that the zero is reached


@dataclass(frozen=True)
class LinearSystem:
    """M (d, d), constant force f (d,), gaps = rows q + start with rows (c, d), start (c,), restitution e.

    stiffness : K (d, d), symmetric and positive semidefinite, of springs with the force −K q; None without springs.
        The force f includes the effect of their rest position.
    """

    mass_matrix: Floats
    force: Floats
    rows: Floats
    start: Floats
    restitution: float
    stiffness: Floats | None = None

    def __post_init__(self) -> None:
        for name in ("mass_matrix", "force", "rows", "start"):
            object.__setattr__(self, name, np.array(getattr(self, name), np.float64))
        d, c = len(self.force), len(self.start)
        if self.rows.shape != (c, d) or self.mass_matrix.shape != (d, d):
            raise ArgumentError("rows", self.rows.shape, f"shape ({c}, {d}), mass_matrix ({d}, {d})")
        if self.stiffness is not None:
            object.__setattr__(self, "stiffness", _checked_stiffness(self.stiffness, d))

    def gap(self, q: Floats) -> Floats:
        """Return the gaps (c,) [m]."""
        return self.rows @ q + self.start


def _checked_stiffness(stiffness: ArrayLike, d: int) -> Floats:
    K = np.array(stiffness, np.float64)
    if K.shape != (d, d) or not np.allclose(K, K.T, rtol=1e-12, atol=0.0):
        raise ArgumentError("stiffness", K.shape, f"a symmetric matrix ({d}, {d})")
    values = np.linalg.eigvalsh(K)
    if values.min(initial=0.0) < -_NO_SPRING * np.abs(values).max(initial=0.0):
        raise ArgumentError("stiffness", values.min(), "a matrix without negative eigenvalues: a spring pulls back")
    return K


@dataclass(frozen=True)
class Modes:
    """An arc with springs: q = q₀ + B z with z'' = −ω² z + c and z(0) = 0.

    basis : B (d, m), with BᵀM B = 1, BᵀK B = ω²; frequency : ω (m,) [rad/s]; rate : z'(0); push : c
    """

    basis: Floats
    frequency: Floats
    rate: Floats
    push: Floats

    def at(self, time: Floats | float) -> tuple[Floats, Floats, Floats]:
        """Return z, z' and z'' (n, m) at times (n,) since the start of the arc."""
        t = np.asarray(time, np.float64)[..., None]
        w = self.frequency
        still = w == 0.0
        unit = np.where(still, 1.0, w)
        sine, cosine, half = np.sin(w * t), np.cos(w * t), np.sin(0.5 * w * t)
        s = np.where(still, t, sine / unit)
        p = np.where(still, 0.5 * t * t, 2.0 * half * half / unit**2)  # (1 − cos ωt) / ω²
        moved, rate = s * self.rate + p * self.push, cosine * self.rate + s * self.push
        return moved, rate, cosine * self.push - w * sine * self.rate

    def largest(self, order: int) -> Floats:
        """Return bounds (m,) of |dⁿz/dtⁿ| for n = `order` >= 2, valid at all times."""
        return np.hypot(self.push, self.frequency * self.rate) * self.frequency ** (order - 2)


@dataclass(frozen=True)
class ExactTrajectory:
    """Arcs between events: parabolas, or modes with springs.

    event_time : (k,) start of each arc [s], the first 0; q, v : (k, d) there, after the impact; a : (k, d)
    impulse : (k, c) of the impact at the start of each arc [N s]; end : time up to which the motion is known [s]
    """

    event_time: Floats
    q: Floats
    v: Floats
    a: Floats
    impulse: Floats
    end: float
    modes: tuple[Modes, ...] = ()

    def state(self, time: ArrayLike) -> tuple[Floats, Floats]:
        """Return q and v (n, d) at the times (n,); at the instant of an event, those after it."""
        t = np.atleast_1d(np.asarray(time, np.float64))
        if t.min(initial=0.0) < 0.0 or t.max(initial=0.0) > self.end:
            raise ArgumentError("time", time, f"times in [0, {self.end!r}] s")
        arc = np.searchsorted(self.event_time, t, side="right") - 1
        since = (t - self.event_time[arc])[:, None]
        if self.modes:
            moved = [self.modes[k].at(time)[:2] for k, time in zip(arc, since[:, 0], strict=True)]
            bases = [self.modes[k].basis for k in arc]
            q = [self.q[k] + B @ z for k, B, (z, _) in zip(arc, bases, moved, strict=True)]
            return np.array(q), np.array([B @ rate for B, (_, rate) in zip(bases, moved, strict=True)])
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

    An accumulation of impacts (a ball that comes to rest) ends the motion early; `end` is its last time.

    Parameters
    ----------
    system : constant mass matrix and force, gaps that are linear in q
    q, v : (d,) at the start, [m | rad] and their rates
    duration : [s]
    law : impact law; by default Newton's as a linear complementarity problem
    most_events : number of events after which the motion ends

    Returns
    -------
    ExactTrajectory
        The arcs between the events, which are exact at every time up to rounding.
    """
    q_now, v_now, now = np.array(q, np.float64), np.array(v, np.float64), 0.0
    speed, arcs = float(np.abs(v_now).max(initial=0.0)), list[_Arc]()
    for _ in range(most_events):
        closed = system.gap(q_now) <= _CLOSED * (1.0 + np.abs(q_now).max())
        v_now, impulse = _impact(system, v_now, closed, _AT_REST * speed, law)
        if system.stiffness is not None:
            modes, wait = _spring_arc(system, q_now, v_now, closed, _AT_REST * speed, duration - now)
            arcs.append((now, q_now, v_now, modes.basis @ modes.push, impulse, modes))
            if now + wait >= duration:
                return _arcs(arcs, duration)
            moved, rate, _ = modes.at(wait)
            q_now, v_now, now = q_now + modes.basis @ moved, modes.basis @ rate, now + wait
        else:
            acceleration, held = _acceleration(system, v_now, closed, _AT_REST * speed)
            arcs.append((now, q_now, v_now, acceleration, impulse, None))
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
    """Return v⁺ and the impulses (c,) of an impact; v and zeros if no closed contact approaches."""
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
    """Return the acceleration (d,) with resting contacts kept from closing, and the resting contacts (c,)."""
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
    """Return the time [s] until the first gap closes: the least positive decreasing root of gap + gamma t + α t²/2."""
    gaps = np.where(closed, 0.0, system.gap(q))
    rates, curvatures = system.rows @ v, system.rows @ acceleration
    waits = [
        _first_root(gap, rate, curvature)
        for gap, rate, curvature in zip(gaps[~resting], rates[~resting], curvatures[~resting], strict=True)
    ]
    return min(waits, default=np.inf)


def _first_root(gap: float, rate: float, curvature: float) -> float:
    """Return the least t > 0 at which gap + rate t + curvature t²/2 passes zero downwards, or infinity."""
    if gap == 0.0:  # it separates now (rate > 0) and returns if the curvature is negative
        return -2.0 * rate / curvature if curvature < 0.0 and rate > 0.0 else np.inf
    discriminant = rate * rate - 2.0 * curvature * gap
    if discriminant < 0.0 or (rate >= 0.0 and curvature >= 0.0):
        return np.inf
    root = np.sqrt(discriminant)
    if rate <= 0.0:
        return 2.0 * gap / (root - rate) if root - rate > 0.0 else np.inf
    return (rate + root) / -curvature


# --- springs ----------------------------------------------------------------------------------------------------
def _spring_arc(
    system: LinearSystem, q: Floats, v: Floats, closed: NDArray[np.bool_], at_rest: float, duration: float
) -> tuple[Modes, float]:
    """Return the arc that starts here, and the time [s] until a gap closes or a resting contact opens."""
    held = _held_by_springs(system, q, v, closed, at_rest)
    modes, K = _modes(system, q, v, held), np.asarray(system.stiffness, np.float64)
    gaps, B = np.where(closed, 0.0, system.gap(q)), modes.basis
    free = [k for k in range(len(closed)) if not _depends(system, held, k)]
    # contact forces of the held rows: Jᵀλ = M a − f + K q, affine in z
    pull = np.linalg.pinv(system.rows[held].T)
    push = pull @ (system.mass_matrix @ (B @ modes.push) - system.force + K @ q)
    changes = pull @ (K @ B - system.mass_matrix @ B * modes.frequency**2)
    push[push < _WEAK * np.abs(push).max(initial=0.0)] = 0.0
    values, slopes = np.concatenate([gaps[free], push]), np.vstack([system.rows[free] @ B, changes])
    return modes, _first_zero(values, slopes, modes, duration)


def _held_by_springs(
    system: LinearSystem, q: Floats, v: Floats, closed: NDArray[np.bool_], at_rest: float
) -> list[int]:
    """Return independent closed contacts that stay closed: they push, or neither acceleration nor jerk opens them."""
    M, K = system.mass_matrix, np.asarray(system.stiffness, np.float64)
    resting = np.flatnonzero(closed & (np.abs(system.rows @ v) <= at_rest))
    rows, free = system.rows[resting], np.asarray(np.linalg.solve(M, system.force - K @ q), np.float64)
    step = nearest_velocity(M, free, rows, np.zeros(len(resting)))
    scale = float(np.abs(rows).max(initial=0.0) * max(np.abs(free).max(), np.abs(step.velocity).max()))
    pushes = step.impulse > _WEAK * step.impulse.max(initial=0.0)
    level = ~pushes & (rows @ step.velocity <= _WEAK * scale)
    strong, weak = rows[pushes], rows[level]
    both = np.vstack([strong, -strong, weak])
    jerk = np.asarray(np.linalg.solve(M, -K @ v), np.float64)
    kept = nearest_velocity(M, jerk, both, np.zeros(len(both))).velocity
    opens = weak @ kept > _WEAK * float(np.abs(rows).max(initial=0.0) * np.abs(jerk).max())
    found: list[int] = resting[pushes].tolist()
    for k in resting[level][~opens].tolist():
        if not _depends(system, found, k):
            found.append(k)
    return found


def _depends(system: LinearSystem, held: list[int], row: int) -> bool:
    """Whether a row is a linear combination of the held rows, so that its gap is constant too."""
    rows = np.linalg.solve(np.linalg.cholesky(system.mass_matrix), system.rows[[*held, row]].T).T
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    return row in held or bool(np.linalg.svd(rows, compute_uv=False)[-1] < _WEAK) or len(rows) > rows.shape[1]


def _modes(system: LinearSystem, q: Floats, v: Floats, held: list[int]) -> Modes:
    """Return the modes of the motions that keep the held gaps constant."""
    from scipy.linalg import null_space

    cholesky, K = np.linalg.cholesky(system.mass_matrix), np.asarray(system.stiffness, np.float64)
    allowed = np.linalg.solve(cholesky, system.rows[held].T).T if held else np.zeros((0, len(q)))
    moving = np.linalg.solve(cholesky.T, null_space(allowed, rcond=_WEAK) if held else np.eye(len(q)))
    squares, shapes = np.linalg.eigh(moving.T @ K @ moving)
    squares[np.abs(squares) <= _NO_SPRING * np.abs(squares).max(initial=0.0)] = 0.0
    basis = moving @ shapes
    push = basis.T @ (system.force - K @ q)
    return Modes(basis, np.sqrt(np.maximum(squares, 0.0)), basis.T @ system.mass_matrix @ v, push)


def _first_zero(values: Floats, slopes: Floats, modes: Modes, duration: float) -> float:
    """Return the least t > 0 at which one of h = values + slopes z(t) passes zero downwards; inf if after `duration`.

    With |h''| <= C the zero is no nearer than the positive root of h + h' t − C t²/2. An h that starts at zero first
    rises with its first nonzero derivative; the bound of the next derivative gives a time up to which it is positive.
    """
    sizes = [np.abs(slopes) @ modes.largest(order) for order in (2, 3, 4)]
    _, rate, bend = modes.at(0.0)
    first, second = slopes @ rate, slopes @ bend
    third = slopes @ (-(modes.frequency**2) * rate)
    scales = np.abs(slopes) @ np.abs(rate), sizes[0], np.abs(slopes) @ (modes.frequency**2 * np.abs(rate))
    rises = [x > _WEAK * scale for x, scale in zip((first, second, third), scales, strict=True)]
    with np.errstate(divide="ignore", invalid="ignore"):
        starts = np.select(rises, [2.0 * first / sizes[0], 3.0 * second / sizes[1], 4.0 * third / sizes[2]], np.inf)
    starts = np.where(values > 0.0, 0.0, np.nan_to_num(starts, nan=np.inf))
    time = 0.0
    while time < duration:
        z, rate, _ = modes.at(time)
        h, slope = values + slopes @ z, slopes @ rate
        watched = starts <= time
        C = np.maximum(sizes[0], np.finfo(np.float64).tiny)
        root = np.sqrt(slope**2 + 2.0 * C * np.maximum(h, 0.0))
        near = np.where(slope < 0.0, root - slope, 1.0)
        waits = np.where(slope < 0.0, 2.0 * np.maximum(h, 0.0) / near, (slope + root) / C)
        wait = min(float(np.where(watched, waits, starts - time).min(initial=np.inf)), duration - time)
        if wait <= _INSTANT * time:
            return time
        time += wait
    return np.inf


_Arc = tuple[float, Floats, Floats, Floats, Floats, Modes | None]


def _arcs(arcs: list[_Arc], end: float) -> ExactTrajectory:
    time, q, v, a, impulse = (np.array([arc[k] for arc in arcs]) for k in range(5))
    return ExactTrajectory(time, q, v, a, impulse, end, tuple(arc[5] for arc in arcs if arc[5] is not None))
