"""Event-driven truth for the project's scenes: smooth motion by a high-order integrator, events found by its roots.

Between events M a = f − B − G + Jᵀλ with the closed contacts held (J a + J̇v = 0, λ >= 0); an event is a gap that closes
or a λ that ends. All closed contacts take part in an impact by the Newton LCP. With a four-channel coupling the
device moves along (paper section VI): its forces are continuous here, and an impulse on the tool is one
on the device at the same instant. This is what the "ideal" world's steps must converge to, for scenes whose
impacts do not accumulate within the duration asked for. Configurations with quaternions or (cos, sin) move by their
rate dq/dt, and are brought back to length one wherever they are looked at.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.errors import ArgumentError, SolverError
from iapb.scene import Scene
from iapb.scene.mechanism import one_restitution
from iapb.system import System
from reference.complementarity.laws import newton_lcp
from reference.complementarity.problem import ImpactProblem
from reference.configurations import configuration_rate, of_length_one
from reference.contact_rows import find_rows, identities
from reference.rigid_step import nearest_velocity

Floats = NDArray[np.float64]
Contact = tuple[int, int, int]

# Asked of the integrator: far below the steps' errors (1e-3 to 1e-6), above the rounding of its own differences.
_ACCURACY = 1e-11
_CLOSED = 1e-8  # gap [m] below which a contact is closed at an event: scenes place touching shapes to 1e-9
_AT_REST = 1e-9  # normal velocity [m/s] below which a closed contact rests
_RELEASED = 1e-8  # share of the largest force below which a contact force has ended: the event's root carries 1e-11
_DIFFERENCE = 1e-6  # step [s] of the central difference J̇v: truncation and rounding both near 1e-10


@dataclass(frozen=True)
class SceneTruth:
    """The motion: v and q by time, and the instants of its events.

    segments : (start, stop, solution) with solution(t) -> (q, v, device q, device v)
    coordinates, velocities : lengths of q and v
    """

    coordinates: int
    velocities: int
    segments: tuple[tuple[float, float, Callable[[float], Floats]], ...]
    events: tuple[float, ...]

    @property
    def end(self) -> float:
        """Time up to which it is known [s]."""
        return self.segments[-1][1]

    def state(self, time: Floats) -> tuple[Floats, Floats]:
        """q and v (n, d) at the times (n,), after an event that falls on one."""
        starts = np.array([start for start, _, _ in self.segments])
        found = np.array([
            self.segments[max(0, int(np.searchsorted(starts, t, side="right")) - 1)][2](float(t)) for t in time
        ])  # fmt: skip
        nq = self.coordinates
        return found[:, :nq], found[:, nq : nq + self.velocities]


@dataclass
class _Motion:
    """The scene's equations; `held` are the contacts that stay closed in the present segment."""

    scene: Scene
    coupled: bool
    system: System = field(init=False)
    restitution: float = field(init=False)
    held: list[Contact] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.system = System(self.scene)
        mechanism = self.system.mechanism
        if self.coupled and mechanism.nq != mechanism.nv:
            raise ArgumentError("scene", self.scene.name, "with a coupling, a scene whose coordinates may be added")
        self.d, self.nq = mechanism.nv, mechanism.nq
        self.restitution = one_restitution(self.scene, self.system.pairs)
        self.tool = slice(*self.system.tool_dofs)
        self.device = self.system.device_mechanism() if self.coupled else None
        settings = self.scene.device
        self.drag = np.asarray(settings.damping if settings is not None and settings.damping else 0.0)

    def split(self, state: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """q, v, device q, device v of a state; q of length one where it turns."""
        nq, t = self.nq, self.tool.stop - self.tool.start if self.coupled else 0
        both = nq + self.d
        q = of_length_one(self.system.mechanism, state[:nq])
        return q, state[nq:both], state[both : both + t], state[both + t :]

    def rows(self, q: Floats, v: Floats) -> dict[Contact, tuple[float, Floats]]:
        """Gap and row (d,) of every candidate contact."""
        found = find_rows(self.system, q, v, np.inf)
        names = identities(found.geometry, range(len(found.gap)))
        return {name: (float(found.gap[i]), found.jacobian[i]) for i, name in enumerate(names)}

    def force(self, state: Floats) -> Floats:
        """Applied − B − G (d,), the coupling included."""
        mechanism, (q, v, device_q, device_v) = self.system.mechanism, self.split(state)
        force = -mechanism.bias(q, v) - mechanism.gravity(q, self.system.gravity)
        if self.scene.hand is not None:
            force += self._hand(mechanism, q, self.d)
        if self.coupled:
            force[self.tool] += self._pull(device_q - q[self.tool], device_v - v[self.tool])
        return force

    def _hand(self, mechanism: Any, q: Floats, size: int) -> Floats:
        hand = self.scene.hand
        if hand is None:
            return np.zeros(size)
        body = mechanism.index(hand.body)
        rotations, origins = mechanism.placements(q)
        point = origins[body] + rotations[body] @ np.array([*hand.point, 0.0])[:3]
        wrench = np.zeros(6)
        wrench[[0, 1, 5] if len(hand.force) == 3 else slice(None)] = hand.force
        turning = mechanism.frame_jacobian(q, body)[3:].T @ wrench[3:]
        return np.asarray(mechanism.point_jacobian(q, body, point).T @ wrench[:3] + turning, np.float64)

    def _pull(self, distance: Floats, speed: Floats) -> Floats:
        gains = self.scene.couplings.four_channel
        if gains is None:
            raise ArgumentError("scene", self.scene.name, "a scene with couplings.four_channel")
        return np.asarray(gains.stiffness) * distance + np.asarray(gains.damping) * speed

    def acceleration(self, state: Floats) -> tuple[Floats, Floats]:
        """a (d,) with the held contacts held, and their λ (k,) [N], of either sign."""
        q, v, _, _ = self.split(state)
        mass = self.system.mechanism.mass_matrix(q)
        free: Floats = np.asarray(np.linalg.solve(mass, self.force(state)), np.float64)
        if not self.held:
            return free, np.zeros(0)
        rows, drift = self._held_rows(q, v)
        response = np.linalg.solve(mass, rows.T)
        push: Floats = np.asarray(np.linalg.lstsq(rows @ response, -(rows @ free + drift))[0], np.float64)
        return np.asarray(free + response @ push, np.float64), push

    def _held_rows(self, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Rows (k, d) of the held contacts and J̇v (k,), by central difference along the motion."""
        here = self.rows(q, v)
        ahead, behind = (self.rows(self.system.mechanism.integrate(q, v, s * _DIFFERENCE), v) for s in (1.0, -1.0))
        rows = np.array([here[name][1] for name in self.held])
        turn = [(ahead[n][1] - behind[n][1]) @ v / (2.0 * _DIFFERENCE) for n in self.held]
        return rows, np.array(turn)

    def rate(self, _time: float, state: Floats) -> Floats:
        """Derivative of the state."""
        q, v, device_q, device_v = self.split(state)
        acceleration, push = self.acceleration(state)
        if self.device is None:
            return np.concatenate([configuration_rate(self.system.mechanism, q, v), acceleration])
        contact = (np.array([self.rows(q, v)[n][1] for n in self.held]).T @ push) if self.held else np.zeros(self.d)
        force = self._hand(self.device, device_q, len(device_q)) + contact[self.tool]
        force += self._pull(q[self.tool] - device_q, v[self.tool] - device_v) - self.device.bias(device_q, device_v)
        force -= self.drag * device_v
        moved = np.linalg.solve(self.device.mass_matrix(device_q), force)
        return np.concatenate([v, acceleration, device_v, moved])

    def strike(self, state: Floats) -> Floats:
        """The state after the impact of all closed contacts that approach, and which contacts are held from now on."""
        q, v, device_q, device_v = (part.copy() for part in self.split(state))
        closed = {n: row for n, (gap, row) in self.rows(q, v).items() if gap <= _CLOSED or n in self.held}
        names, rows = list(closed), np.array(list(closed.values())).reshape(len(closed), self.d)
        mass = self.system.mechanism.mass_matrix(q)
        if (rows @ v < -_AT_REST).any():
            outcome = newton_lcp(ImpactProblem.from_impact(mass, rows, v, self.restitution))
            v = outcome.velocity
            if self.device is not None:
                impulse = (rows.T @ outcome.impulse)[self.tool]
                device_v += np.linalg.solve(self.device.mass_matrix(device_q), impulse)
        after = np.concatenate([q, v, device_q, device_v])
        self._hold(after, [n for n, speed in zip(names, rows @ v, strict=True) if abs(speed) <= _AT_REST])
        return after

    def _hold(self, state: Floats, resting: list[Contact]) -> None:
        """Keep those resting contacts whose complementary acceleration pushes."""
        self.held = resting
        if not resting:
            return
        q, v, _, _ = self.split(state)
        rows, drift = self._held_rows(q, v)
        mass = self.system.mechanism.mass_matrix(q)
        free: Floats = np.asarray(np.linalg.solve(mass, self.force(state)), np.float64)
        pushed = nearest_velocity(mass, free, rows, -drift).impulse
        least = _RELEASED * float(np.abs(self.force(state)).max(initial=0.0))
        self.held = [n for n, p in zip(resting, pushed, strict=True) if p > least]


def scene_truth(scene: Scene, duration: float, coupled: bool = False, most_events: int = 60) -> SceneTruth:
    """Return the event-driven motion of a scene for `duration` [s]; `coupled` with the four-channel coupling's device.

    Raises
    ------
    ArgumentError
        A coupling in a scene whose coordinates may not be added, or without the gains of the coupling.
    SolverError
        More events than `most_events`: they accumulate, or chatter.
    """
    motion = _Motion(scene, coupled)
    start = motion.system.make_state()
    device = [start.q[motion.tool], start.v[motion.tool]] if coupled else []
    state, now = np.concatenate([start.q, start.v, *device]), 0.0
    segments: list[tuple[float, float, Callable[[float], Floats]]] = []
    events: list[float] = []
    for _ in range(most_events):
        state = motion.strike(state)
        solution = _until_event(motion, state, now, duration)
        segments.append((now, float(solution.t[-1]), solution.sol))
        now, state = float(solution.t[-1]), solution.y[:, -1]
        if now >= duration:
            return SceneTruth(motion.nq, motion.d, tuple(segments), tuple(events))
        events.append(now)
    raise SolverError(f"{scene.name}: more than {most_events} events before {now:.4g} s: they accumulate")


def _until_event(motion: _Motion, state: Floats, now: float, duration: float) -> Any:
    """Integrate to the next event, or to the end."""
    from scipy.integrate import solve_ivp

    def closing(time: float, y: Floats) -> float:
        if time == now:  # contacts that the impact has just opened: their gap is a rounding of zero
            return 1.0
        q, v, _, _ = motion.split(y)
        return min((gap for n, (gap, _) in motion.rows(q, v).items() if n not in motion.held), default=1.0)

    def releasing(_time: float, y: Floats) -> float:
        return float(motion.acceleration(y)[1].min(initial=1.0))

    found: tuple[Any, Any] = (closing, releasing)
    for event in found:  # scipy reads these attributes
        event.terminal, event.direction = True, -1.0
    return solve_ivp(
        motion.rate, (now, duration), state, "DOP853", rtol=_ACCURACY, atol=_ACCURACY, events=found,
        dense_output=True, max_step=duration / 20.0,
    )  # fmt: skip
