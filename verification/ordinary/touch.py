"""What it buys to resolve an impact at the moment of touch instead of at the next step.

Four motions have truths that know nothing of the engine: closed forms, and parabolas between touches
that a root finder finds. Each is simulated with both rules, and in MuJoCo.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from iapb.scene import Scene
from iapb.scene.mechanism import start_of
from iapb.scene.reading import scene_from_values
from reference import Floats
from reference.worlds import run_world
from verification.check import Check, Study, no_row_fails
from verification.data import data_of
from verification.ordinary.judge import THEIRS, WORLDS
from verification.table import Row

G = 9.81
STEPS = {"quick": (4.0, 1.0, 0.25), "full": (8.0, 4.0, 2.0, 1.0, 0.5, 0.25, 0.125)}  # [ms]
TOSSES = {"quick": 8, "full": 50}
RULES = ("touch", "step")


@dataclass(frozen=True)
class TimedMotion:
    """A scene and its configuration at the end.

    arms : what a coordinate's error is multiplied by: 1, or the arm [m] of an angle in lengths
    scale : what all errors are divided by
    """

    scene: Scene
    truth: Floats
    arms: Floats
    scale: float


class Outline(NamedTuple):
    """A planar body of 1 kg: the points (k, 2) around which it is round with a radius [m], and its
    inertia."""

    corners: Floats
    radius: float
    inertia: float


BOX = Outline(
    np.array([[0.05, 0.03], [-0.05, 0.03], [-0.05, -0.03], [0.05, -0.03]]),
    0.0,
    (0.1**2 + 0.06**2) / 12.0,
)
DISC = Outline(np.zeros((1, 2)), 0.1, 0.5 * 0.1**2)


@cache
def scene_named(name: str) -> Scene:
    """Return a scene of touch.yaml."""
    return scene_from_values(data_of(__file__, "touch.yaml")[name])


def toss(state: Floats, restitution: float, friction: float, seconds: float) -> Scene:
    """Return the scene of a box thrown onto a floor, from a state (x, y, angle and velocities)."""
    return scene_named("toss").with_values(
        {
            "duration": seconds,
            "bodies.box.position": state[:3].tolist(),
            "bodies.box.velocity": state[3:].tolist(),
            "contact.restitution": restitution,
            "contact.friction": friction,
        }
    )


def tossed(scene: Scene, body: Outline = BOX) -> tuple[Floats, int]:
    """Return where a thrown body is in the end, and the number of its impacts."""
    q, v = start_of(scene)
    left = scene.duration
    impacts = 0
    while True:
        t, corner = _next_touch(q, v, left, body)
        q = q + t * v - [0.0, 0.5 * G * t * t, 0.0]
        v = v - [0.0, G * t, 0.0]
        left -= t
        if corner < 0:
            return q, impacts
        impacts += 1
        c = np.cos(q[2])
        s = np.sin(q[2])
        x, y = body.corners[corner]
        rows = np.array([[0.0, 1.0, c * x - s * y], [1.0, 0.0, body.radius - s * x - c * y]])
        mass = [1.0, 1.0, body.inertia]
        v = v + coulomb(rows, v, mass, scene.contact.restitution, scene.contact.friction)


def _next_touch(q: Floats, v: Floats, left: float, body: Outline) -> tuple[float, int]:
    """Return when a corner touches the floor next, and which one; (left, −1) if none does."""
    times = np.linspace(0.0, left, 4000)
    low = heights(q, v, times, body) < 0.0
    falls = [(k, i) for k, i in np.argwhere(low[1:] & ~low[:-1]).tolist() if times[k + 1] > 1e-9]
    touches = []
    for k, corner in falls[:4]:

        def height(t: float, corner: int = corner) -> Any:
            return heights(q, v, t, body)[corner]

        touches.append((brentq(height, times[k] or 1e-9, times[k + 1], xtol=1e-16), corner))
    return min(touches, default=(left, -1))


def heights(q: Floats, v: Floats, t: ArrayLike, body: Outline = BOX) -> Floats:
    """Return the heights of the corners after t seconds of flight, for each t."""
    time = np.asarray(t)[..., None]
    y = q[1] + time * v[1] - 0.5 * G * time**2
    angle = q[2] + time * v[2]
    x_arm, y_arm = body.corners.T
    return np.asarray(y + np.sin(angle) * x_arm + np.cos(angle) * y_arm - body.radius)


def coulomb(
    rows: Floats, v: Floats, mass: list[float], restitution: float, friction: float
) -> Floats:
    """Return the change of v by one impact with Coulomb's law: it sticks, or slides one way.

    rows : (2, d) of the normal and the tangent; mass : (d,) diagonal of M
    """
    moved = rows / mass
    inverse = rows @ moved.T
    before = rows @ v
    due = -np.array([(1.0 + restitution) * before[0], before[1]])
    normal, side = np.linalg.solve(inverse, due)
    if abs(side) <= friction * normal:
        return np.asarray(moved.T @ [normal, side])
    for sign in (-1.0, 1.0):
        impulse = np.array([1.0, sign * friction])
        impulse *= due[0] / (inverse[0] @ impulse)
        if impulse[0] >= 0.0 and sign * (before + inverse @ impulse)[1] <= 0.0:
            return np.asarray(moved.T @ impulse)
    raise ArithmeticError("Coulomb's law has no solution")


def tosses(depth: str) -> Iterator[TimedMotion]:
    """Yield tosses from random states, without friction."""
    rng = np.random.default_rng(2)
    least = [0.0, 0.1, 0.0, -1.0, -1.0, -10.0]
    most = [0.0, 0.4, 6.28, 1.0, 1.0, 10.0]
    for _ in range(TOSSES[depth]):
        scene = toss(rng.uniform(least, most), 0.6, 0.0, 0.4)
        yield TimedMotion(scene, tossed(scene)[0], np.array([1.0, 1.0, 0.05]), 0.1)


def bounce(depth: str) -> Iterator[TimedMotion]:
    """Yield a disc that bounces with spin and friction."""
    scene = scene_named("bounce")
    arms = np.array([1.0, 1.0, DISC.radius])
    yield TimedMotion(scene, tossed(scene, DISC)[0], arms, DISC.radius)


def cradle(depth: str) -> Iterator[TimedMotion]:
    """Yield five elastic balls with gaps: the blow passes through them, one after another."""
    scene = scene_named("cradle")
    diameter = 0.1
    places, _ = start_of(scene)
    gap = places[1] - diameter
    truth = places + gap
    truth[4] = places[4] + scene.duration - 4.0 * gap
    yield TimedMotion(scene, truth, np.ones(5), diameter)


def stops(depth: str) -> Iterator[TimedMotion]:
    """Yield an arm that turns to and fro between two elastic stops."""
    scene = scene_named("stops")
    _, (speed,) = start_of(scene)
    low = -0.4
    wide = 1.0
    path = (speed * scene.duration - low) % (2.0 * wide)
    truth = low + min(path, 2.0 * wide - path)
    yield TimedMotion(scene, np.array([truth]), np.ones(1), wide)


MOTIONS: dict[str, Callable[[str], Iterator[TimedMotion]]] = {
    "a box is thrown with spin": tosses,
    "a disc bounces with spin": bounce,
    "a cradle with gaps": cradle,
    "an arm between two stops": stops,
}


def error_of(motion: TimedMotion, step: float, rule: str, world: str = "IAPB") -> float:
    """Return the largest error of the coordinates at the end, relative to the scale.

    step : [s]; rule : `contact.impact_time`
    """
    scene = motion.scene.with_values({"rate": 1.0 / step, "contact.impact_time": rule})
    run = run_world(scene, world)
    return float(np.abs(motion.arms * (run.q[-1] - motion.truth)).max()) / motion.scale


def _rows(study: Study, name: str) -> Iterator[Row]:
    """Yield the row of each step: median errors with both rules, and of MuJoCo."""
    found = list(MOTIONS[name](study.depth))
    for step in STEPS[study.depth]:
        row: dict[str, Any] = {
            "motion": name,
            "motions": len(found),
            "step [ms]": step,
        }
        for rule in RULES:
            row[f"error, impacts at the {rule}"] = _median(found, step, rule)
        if THEIRS in WORLDS:
            row[f"error of {THEIRS}"] = _median(found, step, RULES[0], WORLDS[THEIRS])
        yield row


def _median(motions: list[TimedMotion], step: float, rule: str, world: str = "IAPB") -> float:
    return float(np.median([error_of(motion, 1e-3 * step, rule, world) for motion in motions]))


TOUCH = Check(
    key="touch",
    question="How much nearer to its truth is a motion whose impacts happen at the moment of touch?",
    cases=lambda study: tuple(MOTIONS),
    row=_rows,
    holds=lambda row: bool(row["error, impacts at the touch"] < row["error, impacts at the step"]),
    targets=no_row_fails("motions that impacts at the touch make worse"),
)
