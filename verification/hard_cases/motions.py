"""Motions with a law in closed form: contact chatter, a sampled wall at Colgate's bound, a wedged
peg, a cradle."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from iapb.run import Run
from iapb.scene import find_scene, load_scene
from verification.hard_cases.case import (
    NO_GAIN,
    Measured,
    TrajectoryCase,
    largest_gain,
    scene_named,
)

# --- a ball that chatters
# --------------------------------------------------------------------------------------
_HEIGHT = 0.1
_GRAVITY = 9.81
_RESTITUTION = 0.5
_RADIUS = 0.1
# Each bounce is up to one step late: bounce k is k steps late at speed v eᵏ, in sum v Δt Σ k eᵏ = 2
# v Δt for e = ½. The first bounce penetrates by one step, and the height between two instants has
# an error of one step, too.
_STEPS_LATE = 4.0

_FALL = math.sqrt(2.0 * _HEIGHT / _GRAVITY)  # [s] until the first bounce
# [s], the sum of all flights
_END_OF_BOUNCES = _FALL * (1.0 + 2.0 * _RESTITUTION / (1.0 - _RESTITUTION))


def chatter() -> TrajectoryCase:
    """A ball dropped from 0.1 m with e = ½."""
    return TrajectoryCase(
        "Contact chatter: infinitely many bounces in 0.43 s",
        "Zeno's bouncing ball; textbook",
        "the bounces accumulate at one instant: an event-driven method never passes it, time stepping may bounce on",
        "the ball follows the parabolas as far as the time step resolves them, then it rests",
        f"closed form: after bounce k a parabola of height h e²ᵏ; at rest from {_END_OF_BOUNCES:.4f} s on",
        scene_named("chatter"),
        _measure_chatter,
    )


def exact_height(time: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the height of the ball above the floor [m] by the closed form."""
    height = np.where(time < _FALL, _HEIGHT - 0.5 * _GRAVITY * time**2, 0.0)
    start = _FALL
    speed = _GRAVITY * _FALL * _RESTITUTION
    while speed * speed / (2.0 * _GRAVITY) > np.finfo(float).eps * _HEIGHT:
        flown = time - start
        height = np.where(
            (flown >= 0.0) & (flown < 2.0 * speed / _GRAVITY),
            speed * flown - 0.5 * _GRAVITY * flown**2,
            height,
        )
        start = start + 2.0 * speed / _GRAVITY
        speed = speed * _RESTITUTION
    return np.asarray(height, np.float64)


def _measure_chatter(run: Run) -> Measured:
    """Measure the largest distance from the closed form, relative to the height of the drop."""
    off = float(np.abs(run.q[:, 0] - _RADIUS - exact_height(run.time)).max()) / _HEIGHT
    late = _STEPS_LATE * math.sqrt(2.0 * _GRAVITY * _HEIGHT) * run.dt / _HEIGHT
    return Measured(largest_gain(run), NO_GAIN, off, late)


# --- a sampled wall: it is passive if b > K T / 2 + |B|; otherwise its spring can create energy
# -------------------
_PHYSICAL_DAMPING = 0.5  # b [N s/m] of the device of scenes/wall_1d.yaml
# of tool and device, hand, coupling, in SI units
_MASS = 2.0
_FORCE = 0.4
_COUPLING = 100.0
_COUPLING_DAMPING = 70.0
_RADIUS_OF_HANDLE = 0.01
_BOUND = 2.0 * _PHYSICAL_DAMPING * 512.0  # K [N/m] with B = 0
# Rounding over 1,536 steps, which each new contact amplifies: measured 1e-9 of the distance; faults
# are far larger.
_SAME_NUMBERS = 1e-6


def wall(factor: int, why_hard: str, expected: str) -> TrajectoryCase:
    """A wall of `factor` times the stiffness K = 2 b / T of the bound; at 2000 times, T² K / m =
    1.95, half of the value at which the step diverges.
    """
    values = {"contact.stiffness": factor * _BOUND, "contact.damping": 0.0, "duration": 3.0}
    name = (
        "Stiff wall at" if factor == 1 else f"Wall {factor:,} times stiffer than"
    ) + " Colgate's passivity bound"

    def measure(run: Run) -> Measured:
        """Measure the largest distance of the tool from the sampled law, relative to its initial
        gap to the wall."""
        truth = sampled_wall(run.law, factor * _BOUND, run.steps, run.dt)
        way = abs(float(run.q[0, 0])) - _RADIUS_OF_HANDLE
        return Measured(
            largest_gain(run),
            NO_GAIN,
            float(np.abs(run.q[:, 0] - truth).max()) / way,
            _SAME_NUMBERS,
        )

    return TrajectoryCase(
        name,
        "Colgate and Schenkel, J. Robotic Systems 14 (1997); scenes/wall_1d.yaml",
        why_hard,
        expected,
        "up to the bound, Colgate and Schenkel's theorem guarantees passivity; beyond the bound, "
        "we measure the energy "
        "gain. The reference motion comes from a recursion for tool, device and sampled wall in "
        "one coordinate",
        load_scene(find_scene("wall_1d")).with_values(values),
        measure,
    )


def sampled_wall(law: str, stiffness: float, steps: int, dt: float) -> NDArray[np.float64]:
    """Return the tool positions (steps + 1,) of two coupled masses and a wall that is sampled once
    per step."""
    x = [-0.03, -0.03]
    v = [0.1, 0.1]
    touching = False
    path = [x[0]]
    for _ in range(steps):
        coupling = _COUPLING * (x[1] - x[0]) + _COUPLING_DAMPING * (v[1] - v[0])
        depth = x[0] + _RADIUS_OF_HANDLE
        struck = law == "impulse-augmented penalty" and depth >= 0.0 and not touching and v[0] > 0.0
        touching = depth > 0.0
        impulse = -_MASS * v[0] if struck else 0.0
        push = 0.0 if struck or law == "rigid constraints" else -stiffness * max(depth, 0.0)
        v[0] += (impulse + dt * (_FORCE + push + coupling)) / _MASS
        if law == "rigid constraints" and depth + dt * v[0] > 0.0:
            impulse = -_MASS * (v[0] + depth / dt)
            v[0] = -depth / dt
        v[1] += dt * (_FORCE + push + impulse / dt - coupling - _PHYSICAL_DAMPING * v[1]) / _MASS
        x = [place + dt * speed for place, speed in zip(x, v, strict=True)]
        path.append(x[0])
    return np.array(path)


# --- a peg wedged in its hole
# ------------------------------------------------------------------------------------
# from scenes/peg_hole.yaml: [N/m], [N], slope
_STIFFNESS = 1000.0
_HAND = 0.4
_DRAFT = 0.01
_END = 0.0105  # y [m] of the peg's centre when its front meets the hole's end
_STOPPED = 1e-9  # largest speed [m/s] of a body at rest: ten decades below that of the impact
# Relative tolerance of the springs' rest position: after one second the coupling has settled to
# 1e-8.
_SETTLED = 1e-4


def wedged_peg_motion() -> TrajectoryCase:
    """The scene peg_hole: the hand pushes the peg to the end of its hole and keeps pushing."""
    return TrajectoryCase(
        "A peg wedged in its hole, its motion",
        "paper section VII: at most six collisions at once, in a tight hole; numbers ours",
        "six gaps close in the same step; then the springs of six contacts carry the hand force",
        "the peg rests at the end of the hole, as deep as the springs of its six contacts allow",
        "statics: 2 K δ + 4 K s² δ = F, with depth δ, hand force F, stiffness K of a contact, and "
        "s the sine of the "
        "angle between the sides and the motion; with rigid contacts δ = 0",
        load_scene(find_scene("peg_hole")),
        _measure_peg,
    )


def _measure_peg(run: Run) -> Measured:
    """Measure the distance from the rest position in units of the static depth; a peg that still
    moves adds one."""
    sine = _DRAFT / math.hypot(1.0, _DRAFT)
    depth = _HAND / (2.0 * _STIFFNESS + 4.0 * _STIFFNESS * sine**2)
    place = _END if run.law == "rigid constraints" else _END - depth
    off = float(np.abs(run.q[-1] - [0.0, place, 0.0]).max()) / depth
    moving = float(np.abs(run.v[-1]).max() > _STOPPED)
    return Measured(largest_gain(run), NO_GAIN, off + moving, _SETTLED)


# --- Newton's cradle whose balls touch
# --------------------------------------------------------------------------- Radii and positions
# are binary fractions, so that gaps are exactly 0, or decimal fractions, so that gaps are rounding.
_CRADLE_STIFFNESS = 1e4
# Undamped springs that are sampled once per step conserve energy up to the second-order error 2 K
# Δt² / m.
_BY_SPRINGS = 2.0 * _CRADLE_STIFFNESS * 1e-6


def cradle(scene: str, words: str, sunk: float = 0.0) -> TrajectoryCase:
    """A cradle whose balls are a gap apart, or sunk into each other [m]; radii of whole centimetres
    leave gaps of a few 1e-18 m of either sign.

    A contact counts as new until it overlaps, so contacts with a gap of exactly 0 collide like
    those with a gap of one micrometre. If they counted as old, springs would transmit the impact.
    Springs that are sampled once per step gain up to 2 K Δt²/m, which is 0.21 % here, as the world
    PB shows.
    """

    def measure(run: Run) -> Measured:
        """Measure the relative error of momentum and energy at the end; both must equal those of
        the first ball."""
        v = run.v[-1]
        off = max(abs(float(v.sum()) - 1.0), abs(float(v @ v) - 1.0))
        stored = 3.0 * 0.5 * _CRADLE_STIFFNESS * sunk**2 / 0.5  # share of the energy in springs
        # Sampling the springs once per step adds up to a tenth.
        return Measured(largest_gain(run), NO_GAIN + 1.1 * stored, off, _BY_SPRINGS)

    return TrajectoryCase(
        f"Newton's cradle, {words}",
        "textbook; the paper's rows (12)",
        "new contacts transmit momentum by impulses, lasting ones by springs; rounding may decide if one is new",
        "momentum and energy are conserved, whichever balls leave",
        "momentum and energy of five equal elastic balls, the first at 1 m/s: Σ v = 1 and Σ v² = 1",
        scene_named(scene),
        measure,
    )
