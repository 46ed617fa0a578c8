"""What it buys to resolve an impact at the moment of touch instead of at the next step.

Four motions have truths that know nothing of the engine: closed forms, and parabolas between touches
that a root finder finds. Each is simulated with both rules, and in MuJoCo.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import brentq

from iapb.scene.reading import scene_from_values
from reference import Floats
from reference.worlds import run_world
from verification.check import Check, Study, no_row_fails
from verification.ordinary.judge import THEIRS, WORLDS, is_installed
from verification.table import Row

G = 9.81
WIDTH = 0.1
HEIGHT = 0.06
CORNERS = 0.5 * np.array([[WIDTH, HEIGHT], [-WIDTH, HEIGHT], [-WIDTH, -HEIGHT], [WIDTH, -HEIGHT]])
INERTIA = (WIDTH**2 + HEIGHT**2) / 12.0
FLOOR = {"name": "floor", "kind": "half_plane", "point": [0, 0], "normal": [0, 1]}
STEPS = {"quick": (4.0, 1.0, 0.25), "full": (8.0, 4.0, 2.0, 1.0, 0.5, 0.25, 0.125)}  # [ms]
TOSSES = {"quick": 8, "full": 50}
RULES = ("touch", "step")


@dataclass(frozen=True)
class TimedMotion:
    """A scene and its configuration at the end.

    arms : what a coordinate's error is multiplied by: 1, or the arm [m] of an angle in lengths
    scale : what all errors are divided by
    """

    name: str
    scene: dict[str, Any]
    truth: Floats
    arms: Floats
    scale: float


def toss_values(
    state: Floats, restitution: float, friction: float, seconds: float
) -> dict[str, Any]:
    """Return the scene of a box thrown onto a floor, from a state (x, y, angle and velocities)."""
    box = {
        "name": "box",
        "joint": "planar",
        "mass": 1.0,
        "inertia": INERTIA,
        "position": state[:3].tolist(),
        "velocity": state[3:].tolist(),
        "shapes": [{"kind": "box", "size": [WIDTH, HEIGHT]}],
    }
    return {
        "name": "toss",
        "duration": seconds,
        "gravity": [0.0, -G],
        "bodies": [box],
        "walls": [FLOOR],
        "contact": {"restitution": restitution, "friction": friction},
    }


def toss(state: Floats, restitution: float, friction: float, seconds: float) -> TimedMotion:
    """Return a box thrown with spin onto a floor."""
    truth, _ = tossed(state, restitution, friction, seconds)
    arms = np.array([1.0, 1.0, 0.5 * WIDTH])
    scene = toss_values(state, restitution, friction, seconds)
    return TimedMotion("a box is thrown with spin", scene, truth, arms, WIDTH)


def tossed(
    state: Floats, restitution: float, friction: float, seconds: float
) -> tuple[Floats, int]:
    """Return where the box is in the end, and the number of its impacts."""
    q = state[:3].copy()
    v = state[3:].copy()
    left = seconds
    impacts = 0
    while True:
        t, corner = _next_touch(q, v, left)
        q = q + t * v - [0.0, 0.5 * G * t * t, 0.0]
        v = v - [0.0, G * t, 0.0]
        left -= t
        if corner < 0:
            return q, impacts
        impacts += 1
        c = math.cos(q[2])
        s = math.sin(q[2])
        row = np.array([0.0, 1.0, c * CORNERS[corner, 0] - s * CORNERS[corner, 1]])
        along = np.array([1.0, 0.0, -s * CORNERS[corner, 0] - c * CORNERS[corner, 1]])
        v = v + coulomb(np.stack([row, along]), v, [1.0, 1.0, INERTIA], restitution, friction)


def _next_touch(q: Floats, v: Floats, left: float) -> tuple[float, int]:
    """Return when a corner touches the floor next, and which one; (left, −1) if none does."""
    times = np.linspace(0.0, left, 4000)
    low = np.array([heights(q, v, t) for t in times]) < 0.0
    falls = [(k, i) for k, i in np.argwhere(low[1:] & ~low[:-1]).tolist() if times[k + 1] > 1e-9]
    touches = []
    for k, corner in falls[:4]:
        height = partial(_height, q, v, corner)
        touches.append((brentq(height, times[k] or 1e-9, times[k + 1], xtol=1e-16), corner))
    return min(touches, default=(left, -1))


def heights(q: Floats, v: Floats, t: float) -> Floats:
    """Return the heights of the four corners after t seconds of flight."""
    y = q[1] + t * v[1] - 0.5 * G * t * t
    angle = q[2] + t * v[2]
    return np.asarray(y + math.sin(angle) * CORNERS[:, 0] + math.cos(angle) * CORNERS[:, 1])


def _height(q: Floats, v: Floats, corner: int, t: float) -> float:
    return float(heights(q, v, t)[corner])


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
        yield toss(rng.uniform(least, most), 0.6, 0.0, 0.4)


def bounce(depth: str) -> Iterator[TimedMotion]:
    """Yield a disc that bounces with spin and friction: parabolas of known length, Coulomb's law at
    each end."""
    radius = 0.1
    height = 0.3
    e = 0.8
    mu = 0.3
    seconds = 1.6
    inertia = 0.5 * radius**2
    q = np.array([0.0, radius + height, 0.0])
    v = np.array([1.0, 0.0, 20.0])
    scene = {
        "name": "bounce",
        "duration": seconds,
        "gravity": [0.0, -G],
        "bodies": [_disc(q, v, radius, inertia)],
        "walls": [FLOOR],
        "contact": {"restitution": e, "friction": mu},
    }
    rows = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, radius]])
    left = seconds
    while True:
        above = q[1] - radius
        t = min((v[1] + math.sqrt(v[1] ** 2 + 2.0 * G * above)) / G, left)
        q = q + t * v - [0.0, 0.5 * G * t * t, 0.0]
        v = v - [0.0, G * t, 0.0]
        left -= t
        if left <= 0.0:
            break
        q[1] = radius
        v = v + coulomb(rows, v, [1.0, 1.0, inertia], e, mu)
    yield TimedMotion(
        "a disc bounces with spin",
        scene,
        np.asarray(q, np.float64),
        np.array([1.0, 1.0, radius]),
        radius,
    )


def _disc(q: Floats, v: Floats, radius: float, inertia: float) -> dict[str, Any]:
    return {
        "name": "disc",
        "joint": "planar",
        "mass": 1.0,
        "inertia": inertia,
        "position": q.tolist(),
        "velocity": v.tolist(),
        "shapes": [{"kind": "circle", "radius": radius}],
    }


def cradle(depth: str) -> Iterator[TimedMotion]:
    """Yield five elastic balls with gaps: the blow passes through them, one after another."""
    gap = 1.13e-3
    pitch = 0.1
    seconds = 0.064
    places = (pitch + gap) * np.arange(5)
    ball = {"joint": "prismatic", "axis": [1, 0], "mass": 1.0}
    shape = {"kind": "circle", "radius": 0.5 * pitch}
    balls = [
        ball
        | {
            "name": f"ball_{k}",
            "position": [float(place)],
            "velocity": [float(k == 0)],
            "shapes": [shape],
        }
        for k, place in enumerate(places)
    ]
    scene = {
        "name": "cradle",
        "duration": seconds,
        "bodies": balls,
        "contact": {"restitution": 1.0},
    }
    truth = np.asarray(places + gap, np.float64)
    truth[4] = places[4] + seconds - 4.0 * gap
    yield TimedMotion("a cradle with gaps", scene, truth, np.ones(5), pitch)


def stops(depth: str) -> Iterator[TimedMotion]:
    """Yield an arm that turns to and fro between two elastic stops."""
    speed = 3.7
    low = -0.4
    high = 0.6
    seconds = 1.6
    arm = {
        "name": "arm",
        "joint": "revolute",
        "mass": 1.0,
        "inertia": 0.02,
        "center_of_mass": [0.3, 0.0],
        "velocity": [speed],
        "joint_limits": [low, high],
    }
    scene = {
        "name": "stops",
        "duration": seconds,
        "bodies": [arm],
        "contact": {"restitution": 1.0},
    }
    path = (speed * seconds - low) % (2.0 * (high - low))
    truth = low + min(path, 2.0 * (high - low) - path)
    yield TimedMotion("an arm between two stops", scene, np.array([truth]), np.ones(1), high - low)


MOTIONS: tuple[Callable[[str], Iterator[TimedMotion]], ...] = (tosses, bounce, cradle, stops)


def error_of(motion: TimedMotion, step: float, rule: str, world: str = "IAPB") -> float:
    """Return the largest error of the coordinates at the end, relative to the scale.

    step : [s]; rule : `contact.impact_time`
    """
    contact = motion.scene["contact"] | {"impact_time": rule}
    scene = scene_from_values(motion.scene | {"rate": 1.0 / step, "contact": contact})
    run = run_world(scene, world)
    return float(np.abs(motion.arms * (run.q[-1] - motion.truth)).max()) / motion.scale


def _rows(study: Study, motions: Callable[[str], Iterator[TimedMotion]]) -> Iterator[Row]:
    """Yield the row of each step: median errors with both rules, and of MuJoCo."""
    found = list(motions(study.depth))
    for step in STEPS[study.depth]:
        row: dict[str, Any] = {
            "motion": found[0].name,
            "motions": len(found),
            "step [ms]": step,
        }
        for rule in RULES:
            row[f"error, impacts at the {rule}"] = _median(found, step, rule)
        if is_installed(THEIRS):
            row[f"error of {THEIRS}"] = _median(found, step, RULES[0], WORLDS[THEIRS])
        yield row


def _median(motions: list[TimedMotion], step: float, rule: str, world: str = "IAPB") -> float:
    return float(np.median([error_of(motion, 1e-3 * step, rule, world) for motion in motions]))


TOUCH = Check(
    key="touch",
    question="How much nearer to its truth is a motion whose impacts happen at the moment of touch?",
    cases=lambda study: MOTIONS,
    row=_rows,
    holds=lambda row: bool(row["error, impacts at the touch"] < row["error, impacts at the step"]),
    targets=no_row_fails("motions that impacts at the touch make worse"),
)
