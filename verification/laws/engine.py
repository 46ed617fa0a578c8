"""Laws that need more than an impact resolver: a row budget, device limits, a wall or a device held
by the hand, inputs of any size.

Each law draws its own cases and judges its own kind of subject; the last name in `@law` is the
engine's subject. To add a law, write its functions here, and add a planted fault to `planted`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from iapb import resolve_impact
from iapb.contact.kernels.collide import largest_share
from iapb.contact.kernels.resting import normal_force
from iapb.errors import IapbError
from iapb.run import Run
from verification.impacts import EPS, Floats, ImpactCase, draw_case, draw_extreme_case
from verification.laws.bounds import FACTORED, KIT, Found, Law, LawCount, law, relative_gain
from verification.laws.resolver import Resolver, outcome
from verification.laws.scenes import ROOM, SceneCase, Values, draw_scene
from verification.stability.device_port import (
    COUPLER_WORLD,
    RADIUS,
    DeviceLoop,
    actuator_forces,
    leaked,
)

ENGINE_LAWS: dict[str, Law] = {}  # the seeds of random cases depend on the order: add at the end


# Anytime property: every truncation of the projector is passive, so a row budget never costs
# passivity.
@law(
    ENGINE_LAWS,
    "truncation",
    "an impact stopped after any number of rows is passive; after no row, no impulse",
    partial(draw_case, largest_condition=1e12),
    resolve_impact,
)
def every_budget_is_passive(case: ImpactCase, subject: Callable[..., Any]) -> Found:
    """Largest relative energy gain over all budgets; infinite if a budget of 0 rows still gives an
    impulse."""
    answers = [
        outcome(partial(subject, budget=budget), case)
        for budget in range(min(case.contacts, case.coordinates) + 1)
    ]
    worst = max(relative_gain(case.mass_matrix, case.velocity, v_plus) for v_plus in answers)
    idle = np.array_equal(answers[0], case.velocity)
    return worst if idle else np.inf, FACTORED.energy_gain(case)


# An impulse that the device cannot render (paper section VI). One factor for the whole group keeps
# tool and device passive, because it acts as an effective restitution in [−1, e]. Clipping each
# component separately does not.
@dataclass(frozen=True)
class LimitedImpact:
    """An impact, its full impulse, and a device of limited force with the same mass matrix as the
    tool."""

    impact: ImpactCase
    impulse: Floats  # (d,) [N s, N m s]
    dt: float
    force_limit: Floats  # (d,) [N, N m], infinite for no limit


# (impulse (d,), dt, force limit (d,)) -> (impulse that the tool gets (d,), force that the device
# applies (d,))
Renderer = Callable[[Floats, float, Floats], tuple[Floats, Floats]]


def draw_limited(rng: np.random.Generator) -> LimitedImpact:
    """Draw an impact and force limits between 0.01 and 10 times the force that its impulse needs,
    or infinite."""
    case = draw_case(rng)
    Q, u = case.row_space, case.u
    impulse = -(1.0 + case.restitution) * (case.lower @ (Q.T @ (Q @ u)))
    dt = float(rng.choice([1.0 / 512.0, 1e-3]))
    limit = (np.abs(impulse) / dt + 1e-9) * 10.0 ** rng.uniform(-2.0, 1.0, size=len(u))
    return LimitedImpact(case, impulse, dt, np.where(rng.random(len(u)) < 0.2, np.inf, limit))


def scaled(impulse: Floats, dt: float, force_limit: Floats) -> tuple[Floats, Floats]:
    """Scale the impulse as the engine does."""
    share = largest_share(impulse, np.arange(len(impulse)), len(impulse), dt, force_limit)
    return share * impulse, share * impulse / dt


def saturated(impulse: Floats, dt: float, force_limit: Floats) -> tuple[Floats, Floats]:
    """The paper's first strategy: the tool gets the full impulse, the device each component
    clipped. Not passive."""
    return impulse, np.clip(impulse / dt, -force_limit, force_limit)


def saturation_counterexample() -> LimitedImpact:
    """Return a point mass of 1 kg that hits an inclined wall with e = 0; its device can hardly push
    along y.

    The full impulse (0.12, 0.16) N s takes 2 % of the kinetic energy. The device renders only
    (0.12, 0.01) N s and gains 12 %.
    """
    normal, velocity = np.array([0.6, 0.8]), np.array([1.0, -1.0])
    case = ImpactCase(np.eye(2), normal[None], velocity, 0.0, "clipped component by component")
    return LimitedImpact(case, -normal * float(normal @ velocity), 1e-3, np.array([1000.0, 10.0]))


@law(
    ENGINE_LAWS,
    "device_limits",
    "an impulse scaled to the device's limits, by one factor per group, is passive for tool and device",
    draw_limited,
    scaled,
)
def limited_impulses_are_passive(case: LimitedImpact, subject: Renderer) -> Found:
    """Larger relative energy gain of tool and device, both from v⁻; infinite if the device exceeds
    its limit."""
    tool_impulse, device_force = subject(case.impulse.copy(), case.dt, case.force_limit.copy())
    mass, v = case.impact.mass_matrix, case.impact.velocity
    gains = [
        relative_gain(mass, v, v + np.linalg.solve(mass, p))
        for p in (tool_impulse, case.dt * device_force)
    ]
    value = np.inf if np.any(np.abs(device_force) > case.force_limit) else max(gains)
    return value, KIT.comparison(case.impact)


# The engine splits the contacts of a step into groups and resolves each separately: two scenes
# without common contacts move the same, simulated together or apart, unless one passes a factor, a
# budget or a state on to the other.
STEPS, APART = (
    200,
    16.0,
)  # [m] between the rooms; a power of two, so that positions in both round alike


@dataclass(frozen=True)
class TwoRooms:
    """Two scenes far from each other, and one scene that contains both."""

    one: SceneCase
    other: SceneCase
    together: SceneCase


def draw_rooms(rng: np.random.Generator) -> TwoRooms:
    """Draw two random scenes; both use the step, gravity and contact constants of the first."""
    first = draw_scene(rng, STEPS).values
    kept = ("name", "rate", "duration", "integrator", "contact")
    common = {key: first[key] for key in kept} | {"gravity": first.get("gravity")}
    rooms = [
        _room(first["bodies"], "near", 0.0),
        _room(draw_scene(rng, STEPS).values["bodies"], "far", APART),
    ]
    both = {key: rooms[0][key] + rooms[1][key] for key in ("bodies", "walls")}
    return TwoRooms(*(SceneCase(common | room, "IAPB") for room in (*rooms, both)))


def _room(bodies: list[Values], name: str, x: float) -> Values:
    """Return the bodies, renamed and moved by x, and four slabs around them."""

    def moved(body: Values) -> Values:
        own = body | {"name": f"{name}_{body['name']}"}
        if "parent" in body:
            return own | {"parent": f"{name}_{body['parent']}"}
        if body["joint"] == "planar":
            return own | {"position": [body["position"][0] + x, *body["position"][1:]]}
        return own | {"origin": [x, 0.0]}

    middle, upright, flat = ROOM + 1.0, [2.0, 6.0], [6.0, 2.0]
    slabs = (
        (middle, 0.0, upright),
        (-middle, 0.0, upright),
        (0.0, middle, flat),
        (0.0, -middle, flat),
    )
    walls = [
        {"name": f"{name}_{k}", "kind": "box", "size": size, "center": [x + a, b]}
        for k, (a, b, size) in enumerate(slabs)
    ]
    return {"bodies": [moved(body) for body in bodies], "walls": walls}


@law(
    ENGINE_LAWS,
    "group_splitting",
    "a group moves the same, alone or beside another that it does not touch",
    draw_rooms,
    SceneCase.simulate,
)
def groups_apart_move_alike(case: TwoRooms, subject: Callable[[SceneCase], Run]) -> Found:
    """Distance between the states of the joint and the separate run, at the first instant at which
    they differ.

    A compiled sum over more entries may add them in another order, so the last bits may differ.
    Later instants are not judged, because collisions amplify such differences.
    """
    together, one, other = subject(case.together), subject(case.one), subject(case.other)
    d = one.v.shape[1]
    worst = max(
        _first_difference(together, one, slice(0, d)),
        _first_difference(together, other, slice(d, None)),
    )
    return worst, 100.0 * together.v.shape[1] * EPS


def _first_difference(together: Run, apart: Run, of: slice) -> float:
    """Largest relative difference of q and v at the first instant with a difference (nq = nv in
    these scenes)."""
    steps = 1 + min(together.steps, apart.steps)
    all_states = np.hstack([together.q[:steps, of], together.v[:steps, of]])
    own_states = np.hstack([apart.q[:steps], apart.v[:steps]])
    differs = np.flatnonzero(np.any(all_states != own_states, axis=1))
    if not len(differs):
        return 0.0
    a, b = all_states[differs[0]], own_states[differs[0]]
    return float(np.max(np.abs(a - b)) / np.max(np.abs(b)))


# Passivity observer at the hand's port of a sampled wall (paper section VII, claim C20).
#
# The hand moves a device with physical damping b along x(t). The device's position is read every T
# seconds, and the wall's force F = K x_k + B (x_k − x_{k−1})/T (resisting, x > 0 inside, never
# pulling) is held until the next reading. Among all motions through the same readings, uniform
# motion between them dissipates least in b, namely b (Δx)²/T per step. Every motion therefore
# satisfies
#
#     E_n ≥ Σ F_k Δx_k + b Δx_k²/T ≥ (b − KT/2 − |B|) Σ Δx_k²/T.
#
# This uses the convexity of ½Kx² for the spring and 2|ab| ≤ a² + b² for the damper. Hence b ≥ KT/2
# + |B| is sufficient; this is the condition of Colgate and Schenkel (J. Robotic Systems 14, 1997).
# The inertia of the device stores energy but never creates any.
Wall = Callable[
    [float, float, float, float], float
]  # (depth x [m], its rate [m/s], K, B) -> resisting force [N]


@dataclass(frozen=True)
class HeldDevice:
    """A loop, the device's physical damping [N s/m], and the positions (n + 1,) [m] that the hand
    imposes.

    The loop of a wall alone has the wall's constants only, and its first position is 0.
    """

    loop: DeviceLoop
    device_damping: float
    positions: Floats

    @property
    def turnover(self) -> float:
        """Energy exchanged with wall or coupler, and with the damper [J]."""
        return (
            (self.device_damping + self.loop.bound)
            * float(np.sum(np.diff(self.positions) ** 2))
            / self.loop.dt
        )


def draw_wall(rng: np.random.Generator) -> HeldDevice:
    """Draw K and B over decades, T, b at or above the bound, and a motion from slow to half the
    sampling rate."""
    K, B = (
        10.0 ** rng.uniform(1.0, 5.0),
        float(rng.choice([0.0, 1.0])) * 10.0 ** rng.uniform(-1.0, 3.0),
    )
    dt = float(rng.choice([1.0 / 512.0, 1e-3, 1e-4]))
    x = hand_motion(rng, int(rng.integers(50, 800)))
    loop, margin = (
        DeviceLoop("wall", K, B, dt),
        float(rng.choice([1.0, 1.0, rng.uniform(1.0, 3.0)])),
    )
    return HeldDevice(loop, margin * loop.bound, x - x[0])


def hand_motion(rng: np.random.Generator, n: int) -> Floats:
    """Return readings of a sine up to half the sampling rate plus a random walk; both have random
    amplitudes (mm)."""
    k = np.arange(n + 1)
    sine = np.sin(np.pi * rng.uniform(0.0, 1.0) * k + rng.uniform(0.0, 6.3)) + rng.uniform(
        -1.0, 1.0
    )
    walk = np.cumsum(rng.normal(size=n + 1)) / np.sqrt(n)
    return np.asarray(
        1e-3 * 10.0 ** rng.uniform(-2.0, 1.0) * (rng.uniform() * sine + rng.uniform() * walk)
    )


def quickest_motion(
    K: float, B: float, b: float, dt: float, steps: int = 4000, half: float = 5e-4
) -> HeldDevice:
    """Return the motion to which a sampled wall gives most energy.

    The device enters the wall slowly, so deep that the wall always pushes. Then it moves back and
    forth by `half` [m] at half the sampling rate.
    """
    depth = 2.0 * half + 4.0 * B * half / (K * dt)
    entering = np.linspace(0.0, depth, steps // 4)
    return HeldDevice(
        DeviceLoop("wall", K, B, dt),
        b,
        np.concatenate([entering, depth + half * (-1.0) ** np.arange(steps)]),
    )


def penalty_wall(depth: float, rate: float, K: float, B: float) -> float:
    """The engine's penalty force (5) [N] at one contact, clamped so that it never pulls."""
    return float(normal_force(-depth, -rate, K, B, True)) if depth > 0.0 else 0.0


def leak(case: HeldDevice, wall: Wall) -> float:
    """Largest net energy [J] that the port has returned to the hand, for uniform motion between the
    readings."""
    x, loop = case.positions, case.loop
    rate = np.concatenate([[0.0], np.diff(x) / loop.dt])[:-1]
    force = [
        wall(float(a), float(r), loop.stiffness, loop.damping)
        for a, r in zip(x[:-1], rate, strict=True)
    ]
    return leaked(x, -np.array(force), case.device_damping, loop.dt)


@law(
    ENGINE_LAWS,
    "hand_port",
    "the hand gets no energy from a wall that meets Colgate's condition b ≥ KT/2 + |B|",
    draw_wall,
    penalty_wall,
)
def hand_port_is_passive(case: HeldDevice, subject: Wall) -> Found:
    """Leak relative to the energy exchanged with wall and damper; the tolerance covers the rounding
    of n sums."""
    relative = leak(case, subject) / case.turnover if case.turnover > 0.0 else 0.0
    return relative, 4.0 * len(case.positions) * EPS


@law(
    ENGINE_LAWS,
    "extremes",
    "every finite input gives a finite motion or a named error",
    draw_extreme_case,
    resolve_impact,
)
def finite_or_named(case: ImpactCase, subject: Resolver) -> Found:
    """0 if the resolver returns a finite velocity or raises an IapbError, else 1; the tolerance is
    0."""
    try:
        answer = subject(*case.given())
        v_plus = np.asarray(getattr(answer, "velocity", answer))
        fine = v_plus.shape == case.velocity.shape and bool(np.all(np.isfinite(v_plus)))
    except IapbError:
        fine = True
    except Exception:  # any other exception breaks the law
        fine = False
    return 0.0 if fine else 1.0, 0.0


# The same at the port of a whole device scene: a unilateral coupler to a tool on a rigid wall.
# Assume that b ≥ K_cpl T/2 + B_cpl, that e = 0, that the sensors are ideal, and that the hand, once
# in the wall, keeps the coupler pressing. Then no motion extracts energy from the loop of coupler,
# tool, rigid contact and device, because the tool rests and the coupler acts as the wall above.
# `verification.stability.device_port` measures the other cases.
HELD_STEPS, WAY = (
    150,
    10,
)  # steps of the motion; how much slower the entry is, so that its damping adds little energy


def draw_held_device(rng: np.random.Generator) -> HeldDevice:
    """Draw gains and masses over decades, b at or above the bound, and a slow entry followed by any
    pressing motion."""
    dt = float(rng.choice([1.0 / 512.0, 1e-3]))
    stiffness = 10.0 ** rng.uniform(1.0, 5.0)
    damping = float(rng.choice([0.0, 1.0])) * stiffness * dt * rng.uniform(0.0, 2.0)
    motion = hand_motion(rng, HELD_STEPS)
    quickest = float(np.max(np.abs(np.diff(motion))))
    motion += damping / stiffness * quickest / dt - float(
        np.min(motion)
    )  # K z + B ż >= 0: it presses
    clearance = quickest / WAY
    way = np.linspace(
        -clearance, motion[0], int(WAY * (motion[0] + clearance) / quickest) + 1, endpoint=False
    )
    loop = DeviceLoop(
        COUPLER_WORLD, stiffness, damping, dt, 10.0 ** rng.uniform(-1.0, 1.0), clearance
    )
    margin = float(rng.choice([1.0, 1.0, rng.uniform(1.0, 3.0)]))
    return HeldDevice(loop, margin * loop.bound, np.concatenate([way, motion]))


@law(
    ENGINE_LAWS,
    "device_port",
    "the hand gets no energy from a coupler that meets Colgate's condition, if the tool is pressed on a rigid wall",
    draw_held_device,
    actuator_forces,
)
def device_port_is_passive(
    case: HeldDevice, subject: Callable[[DeviceLoop, Floats], Floats]
) -> Found:
    """Leak relative to the energy exchanged with coupler and damper.

    The tolerance covers the rounding of n sums and of the coupler's extension, which is a
    difference of two positions.
    """
    x = case.positions
    out = leaked(x, subject(case.loop, x), case.device_damping, case.loop.dt)
    places = RADIUS / float(np.sqrt(np.mean(np.diff(x) ** 2)))
    return out / case.turnover, 4.0 * len(x) * EPS * (1.0 + places)


def judge_engine_law(
    name: str, subject: Callable[..., Any] | None = None, cases: int = 300, seed: int = 0
) -> LawCount:
    """Check one law on `cases` random cases; `subject` replaces the engine's own subject."""
    one, rng = ENGINE_LAWS[name], np.random.default_rng([seed, list(ENGINE_LAWS).index(name)])
    count = LawCount(name)
    for _ in range(cases):
        count.add(one.check(one.draw(rng), one.ours if subject is None else subject))
    return count
