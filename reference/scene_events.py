"""Event-driven reference motion of scenes: smooth motion by a high-order integrator, events by root
finding.

Between events M a = f − B − G + Jᵀλ, with lasting contacts kept closed (J a + J̇v = 0). An event is
a gap that closes or a lasting contact that opens. All closed contacts take part in an impact by the
Newton LCP. With a four-channel coupling the device is integrated too (paper section VI): its forces
are continuous here, and an impulse on the tool acts on the device at the same instant. The steps of
the "ideal" world must converge to this motion. Configurations with quaternions or (cos, sin) are
integrated by their rate dq/dt and normalised before each use.

These rules keep rounding from making decisions (`Tolerances` has the values):

- A contact is *closed* if its gap is at most `closed`, and *strikes* if it approaches faster than
  `at_rest`.
- A closed contact *lasts* if the complementary acceleration keeps it closed (a of 0 <= λ ⟂ J a +
  J̇v >= 0 over the contacts at rest), with or without force. Single λ do not count, so redundant
  and unloaded contacts last as well.
- *Chatter and Zeno*: a contact that separates too slowly to rise by BOUNCE also lasts, and its
  velocity is set to zero. So a sequence of shrinking bounces is finite.
- A contact *lets go* if the complementary acceleration would open it by more than the share
  `released` of the accelerations involved.
- A contact that *grazes* is no event: no velocity jumps, and no contact starts or stops to last.
- A contact that has just opened may close again only after its gap was twice `closed`, or if it
  overlaps by `closed`.

Every motion is computed three times: with the tolerances, with three times smaller ones and with
three times larger ones (BOUNCE is the same), and with different steps. If the numbers of events
differ, a decision depends on a tolerance, and an error says that there is no reference. Otherwise
the largest differences, plus the neglected displacement of bounces, are the `bound` of the result.
It is an estimate, not a certified enclosure.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from iapb.errors import ArgumentError, SolverError
from iapb.scene import Scene
from iapb.scene.mechanism import wrench_of
from iapb.system import System
from reference import Floats
from reference.complementarity.laws import newton_lcp
from reference.complementarity.problem import ImpactProblem
from reference.contact_rows import find_rows, mechanics_of
from reference.rigid_body import PinocchioMechanism, at_lever, model_of
from reference.rigid_step import nearest_velocity

Contact = tuple[int, int, int]


class Tolerances(NamedTuple):
    """Tolerances of one computation."""

    #: tolerance of the integrator, far below the errors of time stepping (1e-3 to 1e-6)
    accuracy: float = 1e-11
    closed: float = 1e-8  #: largest gap [m] of a closed contact: scenes touch to 1e-9, and event roots err by 1e-11
    at_rest: float = 1e-9  #: largest normal velocity [m/s] of a contact at rest: a hundred times the integrator's error
    released: float = 1e-8  #: share of the accelerations below which an acceleration counts as zero
    steps: int = 20  #: least number of steps in the whole duration


COMPUTATIONS = (
    Tolerances(),
    Tolerances(1e-11, 3e-9, 3e-10, 3e-9, 31),
    Tolerances(1e-10, 3e-8, 3e-9, 3e-8, 23),
)
# largest height [m] of a neglected bounce; above twice every `closed`, so that other bounces open
BOUNCE = 1e-7
# of `released`: threshold right after an event, lower so that a contact that let go does not last
# again
_KEPT = 0.1
# singular value, relative to the largest, below which held rows depend on one another
_DEPENDENT = 1e-9
# Largest time [s] and largest path [m, rad] of the fourth-order differences for J̇v: rounding and
# truncation are both near 1e-12, of |v|² where that is large.
_DIFFERENCE = 1e-4
_PATH = 1e-3
_COMPARED = 11  # instants between two events at which computations are compared
_AT_ONCE = 100  # most impacts at one instant: Newton's law can leave contacts that approach


class Bound(NamedTuple):
    """Error estimate of the motion: the largest differences between the computations plus the
    integrator's accuracy."""

    position: float  #: [m, rad], with the neglected bounces
    velocity: float  #: [m/s, rad/s], with the neglected bounces
    instant: float  #: of the events [s]


@dataclass(frozen=True)
class SceneTruth:
    """The motion: q and v over time, the instants of its events, and its error estimate."""

    coordinates: int  #: length of q
    velocities: int  #: length of v
    #: start, stop, t -> (q, v, device's q and v)
    segments: tuple[tuple[float, float, Callable[[float], Floats]], ...]
    events: tuple[float, ...]  #: [s]
    bound: Bound = Bound(np.nan, np.nan, np.nan)  #: estimate of the errors

    @property
    def end(self) -> float:
        """Time up to which the motion is known [s]."""
        return self.segments[-1][1]

    def state(self, time: Floats) -> tuple[Floats, Floats]:
        """Return q and v (n, d) at the times (n,); at the instant of an event, those after it."""
        at = np.searchsorted([start for start, _, _ in self.segments], time, side="right") - 1
        found = np.array(
            [self.segments[max(0, k)][2](float(t)) for k, t in zip(at, time, strict=True)]
        )
        nq = self.coordinates
        return found[:, :nq], found[:, nq : nq + self.velocities]


class _Here(NamedTuple):
    """v (d,), M (d, d), M⁻¹f (d,), and rows (c, d) and J̇v (c,) of the given contacts."""

    v: Floats
    mass: Floats
    free: Floats
    rows: Floats
    drift: Floats


class _Motion:
    """The scene's equations of motion. `held` are the lasting contacts of this segment; `leaving`
    have just opened."""

    widest = 0.0  # largest gap [m] that counted as closed in an impact
    bounced = 0.0  # path [m] of the neglected bounces
    flight = np.inf  # least time [s] for which a contact that has just opened stays open

    def __init__(
        self, scene: Scene, coupled: bool, tolerances: Tolerances, duration: float
    ) -> None:
        self.scene = scene
        self.coupled = coupled
        self.tolerances = tolerances
        self.duration = duration
        self.system = System(scene)
        self.held = list[Contact]()
        self.leaving = list[Contact]()
        mechanism = self.system.mechanism
        self.gains = cast(Any, scene.couplings.four_channel)
        if scene.hand is not None and scene.hand.changes:
            raise ArgumentError(
                "scene", scene.name, "a scene whose hand's force does not change over time"
            )
        if coupled and mechanism.nq != mechanism.nv:
            raise ArgumentError("scene", scene.name, "a scene without quaternions, or no coupling")
        if coupled and self.gains is None:
            raise ArgumentError("scene", scene.name, "a scene with couplings.four_channel")
        self.mechanics = mechanics_of(self.system)
        self.d = mechanism.nv
        self.nq = mechanism.nq
        values = self.system.restitutions
        if len(values) > 1:
            found = f"one restitution for all contacts; here {values[0]:g} to {values[-1]:g}"
            raise ArgumentError("scene", scene.name, found)
        self.restitution = float(values[0]) if len(values) else scene.contact.restitution
        self.tool = slice(*self.system.tool_dofs)
        self.device = model_of(self.system.device_mechanism()) if coupled else None
        self.drag = np.asarray((scene.device and scene.device.damping) or 0.0)

    def split(self, state: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Return q, v, device q, device v of a state, with q normalised."""
        nq = self.nq
        t = self.tool.stop - self.tool.start if self.coupled else 0
        both = nq + self.d
        q = self.mechanics.normalize(state[:nq])
        return q, state[nq:both], state[both : both + t], state[both + t :]

    def rows(self, q: Floats, v: Floats) -> dict[Contact, tuple[float, Floats]]:
        """Return gap and row (d,) of every candidate contact."""
        found = find_rows(self.system, q, v, np.inf)
        names = (
            column.tolist()
            for column in (found.geometry.shape_a, found.geometry.shape_b, found.geometry.feature)
        )
        return dict(
            zip(
                zip(*names, strict=True),
                zip(found.gap.tolist(), found.jacobian, strict=True),
                strict=True,
            )
        )

    def _hand(self, mechanics: PinocchioMechanism, q: Floats) -> Floats:
        hand = self.scene.hand
        if hand is None:
            return np.zeros(mechanics.nv)
        axes, _, rows = (found[mechanics.index(hand.body)] for found in mechanics.bodies(q))
        moved = at_lever(rows, axes @ np.array([*hand.point, 0.0])[:3])
        wrench = wrench_of(self.scene, 0.0)
        return np.asarray(moved.T @ wrench[:3] + rows[3:].T @ wrench[3:], np.float64)

    def _pull(self, distance: Floats, speed: Floats) -> Floats:
        return np.asarray(self.gains.stiffness) * distance + np.asarray(self.gains.damping) * speed

    def _here(self, state: Floats, names: list[Contact]) -> _Here:
        """Return dynamics and rows of the named contacts in a state, with J̇v by fourth-order
        differences."""
        q, v, device_q, device_v = self.split(state)
        force = self._hand(self.mechanics, q) - self.mechanics.inner_forces(
            q, v, self.system.gravity
        )
        force -= self.system.joint_damping * v
        if self.coupled:
            force[self.tool] += self._pull(device_q - q[self.tool], device_v - v[self.tool])
        mass = self.mechanics.mass_matrix(q)
        free = np.asarray(np.linalg.solve(mass, force), np.float64)
        if not names:
            return _Here(v, mass, free, np.zeros((0, self.d)), np.zeros(0))

        def turning(h: float) -> Floats:
            ahead, behind = (
                self.rows(self.mechanics.integrate(q, v, s * h), v) for s in (1.0, -1.0)
            )
            return np.array([(ahead[n][1] - behind[n][1]) @ v / (2.0 * h) for n in names])

        found = self.rows(q, v)
        h = min(_DIFFERENCE, _PATH / max(float(np.abs(v).max()), 1.0))
        drift = (4.0 * turning(h) - turning(2.0 * h)) / 3.0
        return _Here(v, mass, free, np.array([found[n][1] for n in names]), drift)

    def rate(self, _time: float, state: Floats) -> Floats:
        """Return the derivative of the state, with the lasting contacts kept closed by forces of
        either sign."""
        q, v, device_q, device_v = self.split(state)
        here = self._here(state, self.held)
        change = _least_change(here.mass, here.rows, -(here.rows @ here.free + here.drift))
        if self.device is None:
            return np.concatenate([self.mechanics.rate(q, v), here.free + change])
        force = self._hand(self.device, device_q) + (here.mass @ change)[self.tool]
        force += self._pull(q[self.tool] - device_q, v[self.tool] - device_v) - self.device.bias(
            device_q, device_v
        )
        force -= self.drag * device_v
        moved = np.linalg.solve(self.device.mass_matrix(device_q), force)
        return np.concatenate([v, here.free + change, device_v, moved])

    def strike(self, state: Floats) -> tuple[Floats, bool]:
        """Return the state after an impact of all closed contacts, and whether it is an event;
        update `held`."""
        q, v, device_q, device_v = (part.copy() for part in self.split(state))
        found = self.require_no_overlap(q, v)
        names = [
            n for n, (gap, _) in found.items() if gap <= self.tolerances.closed or n in self.held
        ]
        rows = np.array([found[n][1] for n in names]).reshape(len(names), self.d)
        self.widest = max([self.widest, *(found[n][0] for n in names)])
        mass = self.mechanics.mass_matrix(q)
        impacts = 0
        before = self.held

        def pushed(impulse: Floats) -> Floats:
            """Return the device's velocity after a generalized impulse on the tool."""
            if self.device is None:
                return device_v
            return np.asarray(
                device_v + np.linalg.solve(self.device.mass_matrix(device_q), impulse[self.tool])
            )

        while (rows @ v < -self.tolerances.at_rest).any():
            impacts += 1
            if impacts > _AT_ONCE:
                raise SolverError(
                    f"{self.scene.name}: no reference: more than {_AT_ONCE} impacts at one instant"
                )
            outcome = newton_lcp(ImpactProblem.from_impact(mass, rows, v, self.restitution))
            v = outcome.velocity
            device_v = pushed(rows.T @ outcome.impulse)
        lasting = self._lasting(np.concatenate([q, v, device_q, device_v]), names)
        self.held = [n for n, stays in zip(names, lasting, strict=True) if stays]
        self.leaving = [n for n, stays in zip(names, lasting, strict=True) if not stays]
        change = _least_change(mass, rows[lasting], -rows[lasting] @ v)
        after = np.concatenate([q, v + change, device_q, pushed(mass @ change)])
        return after, impacts > 0 or set(before) != set(self.held)

    def require_no_overlap(self, q: Floats, v: Floats) -> dict[Contact, tuple[float, Floats]]:
        """Return the rows; raise SolverError if a contact overlaps (a missed event, or an overlap
        at the start)."""
        found = self.rows(q, v)
        deepest = min((gap for gap, _ in found.values()), default=0.0)
        if deepest < -3.0 * self.tolerances.closed:
            raise SolverError(
                f"{self.scene.name}: no reference: rigid contacts overlap by {-deepest:.1e} m"
            )
        return found

    def _lasting(self, state: Floats, names: list[Contact]) -> NDArray[np.bool_]:
        """Return which closed contacts (c,) last: those that do not open, and those whose bounce is
        below BOUNCE."""
        here = self._here(state, names)
        speed = here.rows @ here.v
        resting = np.abs(speed) <= self.tolerances.at_rest
        while True:
            away = _away(here, resting)
            back = ~resting & (speed > 0.0) & (speed**2 <= -2.0 * away * BOUNCE)
            if not back.any():
                falling = ~resting & (away < 0.0)
                self.flight = float((speed[falling] / -away[falling]).min(initial=np.inf)) * 2.0
                return resting & (away <= _KEPT * self._least(here))
            # each bounce has e² times the height of the last one
            heights = speed[back] ** 2 / (-2.0 * away[back])
            shrinking = max(1.0 - self.restitution**2, np.finfo(float).tiny)
            self.bounced += float(
                np.minimum(2.0 * heights / shrinking, speed[back] * self.duration).sum()
            )
            resting |= back

    def _least(self, here: _Here) -> Floats:
        """Return thresholds (c,) [m/s²] of opening: `released` times those of forces and v/T, plus
        `at_rest`/T."""
        root = np.linalg.cholesky(here.mass)
        size = np.linalg.norm(root.T @ here.free) + np.linalg.norm(root.T @ here.v) / self.duration
        reach = np.linalg.norm(np.linalg.solve(root, here.rows.T), axis=0)
        return np.asarray(
            self.tolerances.released * size * reach + self.tolerances.at_rest / self.duration
        )

    def pushing(self, state: Floats) -> float:
        """Return a margin [m/s²] that is positive while no held contact would open if it were
        free."""
        if not self.held:
            return 1.0
        here = self._here(state, self.held)
        return float((self._least(here) - _away(here, np.ones(len(self.held), np.bool_))).min())

    def closing(self, state: Floats) -> float:
        """Return the least gap [m] of the contacts that may close; one that has just opened may
        overlap by `closed`."""
        q, v, _, _ = self.split(state)
        return min(
            (
                gap + (self.tolerances.closed if n in self.leaving else 0.0)
                for n, (gap, _) in self.rows(q, v).items()
                if n not in self.held
            ),
            default=1.0,
        )

    def opening(self, state: Floats) -> float:
        """Return the largest gap [m] of contacts that have just opened, minus the gap at which they
        count as open."""
        if not self.leaving:
            return -1.0
        q, v, _, _ = self.split(state)
        found = self.rows(q, v)
        return max(found[n][0] for n in self.leaving) - 2.0 * self.tolerances.closed


def _away(here: _Here, resting: NDArray[np.bool_]) -> Floats:
    """Return the opening accelerations (c,) [m/s²] of the contacts, with resting contacts kept from
    closing."""
    bound = np.where(resting, -here.drift, -np.inf)
    return (
        here.rows @ nearest_velocity(here.mass, here.free, here.rows, bound).velocity + here.drift
    )


def _least_change(mass: Floats, rows: Floats, target: Floats) -> Floats:
    """Return the least change (d,) of velocity or acceleration, in the kinetic metric, with rows @
    change = target."""
    if not len(rows):
        return np.zeros(len(mass))
    root = np.linalg.cholesky(mass)
    lengths = np.linalg.norm(rows, axis=1)
    unit = np.where(lengths > 0.0, lengths, 1.0)
    whitened = np.linalg.solve(root, (rows / unit[:, None]).T).T
    change = np.linalg.lstsq(whitened, target / unit, rcond=_DEPENDENT)[0]
    return np.asarray(np.linalg.solve(root.T, change), np.float64)


def scene_truth(
    scene: Scene,
    duration: float,
    coupled: bool = False,
    most_events: int = 200,
    start: tuple[Floats, Floats] | None = None,
    computations: tuple[Tolerances, ...] = COMPUTATIONS,
) -> SceneTruth:
    """Return the event-driven motion of a scene for `duration` [s]; `coupled` adds the four-channel
    coupling's device.

    start : q and v at time zero; default: the scene's start
    computations : the first one is returned and the others bound its error; with only one, a
        decision that depends on a tolerance is not detected

    Raises
    ------
    ArgumentError
        `coupled` is used with quaternion or (cos, sin) coordinates, or without gains of the
        coupling.
    SolverError
        There is no reference: contacts overlap at the start, events exceed `most_events`, or depend
        on a tolerance.
    """
    motions = [_Motion(scene, coupled, tolerances, duration) for tolerances in computations]
    first, *others = (_compute(motion, most_events, start) for motion in motions)
    counts = sorted({len(truth.events) for truth in (first, *others)})
    if len(counts) > 1:
        raise SolverError(
            f"{scene.name}: no reference: {counts[0]} or {counts[-1]} events, by tolerance"
        )
    q, v = first.state(np.linspace(0.0, duration, 10 * _COMPARED))
    sizes = (max(1.0, float(np.abs(q).max())), max(1.0, float(np.abs(v).max())), duration)
    floor = [computations[0].accuracy * size for size in sizes]
    floor[0] += motions[0].widest + motions[0].bounced
    floor[1] += motions[0].bounced / duration
    worst = np.max([(0.0, 0.0, 0.0), *(_apart(first, other) for other in others)], axis=0).tolist()
    return replace(first, bound=Bound(*(a + b for a, b in zip(floor, worst, strict=True))))


def _compute(motion: _Motion, most_events: int, start: tuple[Floats, Floats] | None) -> SceneTruth:
    """Compute the motion with one set of tolerances."""
    q, v = start or motion.system.start
    device = [q[motion.tool], v[motion.tool]] if motion.coupled else []
    state = np.concatenate([q, v, *device])
    now = 0.0
    duration = motion.duration
    segments: list[tuple[float, float, Callable[[float], Floats]]] = []
    events: list[float] = []
    for _ in range(most_events):
        state, happened = motion.strike(state)
        if happened and segments:
            events.append(now)
        opened = True
        while opened and now < duration:
            solution = _until_event(motion, state, now)
            segments.append((now, float(solution.t[-1]), solution.sol))
            now = float(solution.t[-1])
            state = solution.y[:, -1]
            opened = bool(len(solution.t_events[2]))
            if opened:
                found = motion.rows(*motion.split(state)[:2])
                still = 2.0 * motion.tolerances.closed * (1.0 - _KEPT)
                motion.leaving = [n for n in motion.leaving if found[n][0] < still]
        if now >= duration:
            for (
                begin,
                stop,
                solution,
            ) in segments:  # an event that the integrator missed leaves an overlap
                for time in np.linspace(begin, stop, _COMPARED):
                    motion.require_no_overlap(*motion.split(solution(float(time)))[:2])
            return SceneTruth(motion.nq, motion.d, tuple(segments), tuple(events))
    raise SolverError(
        f"{motion.scene.name}: no reference: impacts accumulate, {most_events} before {now:.4g} s"
    )


def _until_event(motion: _Motion, state: Floats, now: float) -> Any:
    """Integrate to the next event, or to the end."""
    from scipy.integrate import solve_ivp

    found: list[Any] = []
    for event, direction in ((motion.closing, -1.0), (motion.pushing, -1.0), (motion.opening, 1.0)):
        found.append(lambda _time, y, event=event: event(y))
        # scipy reads these attributes
        found[-1].terminal = True
        found[-1].direction = direction
    accuracy = motion.tolerances.accuracy
    longest = motion.duration / motion.tolerances.steps
    # no step may skip a whole bounce: after a quarter of its time it has 3/4 of its height
    if motion.leaving:
        longest = min(longest, 0.25 * motion.flight)
    solution = solve_ivp(
        motion.rate,
        (now, motion.duration),
        state,
        "DOP853",
        rtol=accuracy,
        atol=accuracy,
        events=found,
        dense_output=True,
        max_step=longest,
    )
    if solution.status < 0:
        raise SolverError(
            f"{motion.scene.name}: no reference after {solution.t[-1]:.4g} s: {solution.message}"
        )
    return solution


def _apart(one: SceneTruth, other: SceneTruth) -> tuple[float, float, float]:
    """Return the largest differences of two computations: of q at equal times, of v between equal
    events, of events."""
    position = velocity = instant = 0.0
    mine, theirs = ((0.0, *truth.events, truth.end) for truth in (one, other))
    for k in range(len(mine) - 1):
        times = [
            np.linspace(at[k], at[k + 1], _COMPARED, endpoint=k == len(mine) - 2)
            for at in (mine, theirs)
        ]
        (q, v), (q_other, v_other) = (truth.state(np.concatenate(times)) for truth in (one, other))
        instant = max(instant, abs(mine[k] - theirs[k]))
        position = max(position, float(np.abs(q - q_other).max()))
        velocity = max(velocity, float(np.abs(v[:_COMPARED] - v_other[_COMPARED:]).max()))
    return position, velocity, instant
