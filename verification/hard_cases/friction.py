"""Hard cases of dry friction: Kane and Levinson's double pendulum, the sliding threshold,
Painlevé's rod, stick-slip.

Kane and Levinson: the tip of a double pendulum strikes a rough floor, and Newton's law with
friction creates energy. Two uniform rods of 1 m and 1 kg hang from a hinge at 22.6° and 28.1° from
the vertical. The source has 20° and 30°; the angles here are those of the triangles 5-12-13 and
8-15-17, so that every sine and cosine is a fraction.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.run import Run
from iapb.scene import Scene
from reference.scene_events import SceneTruth, scene_truth
from verification.hard_cases.case import (
    NO_GAIN,
    Measured,
    TrajectoryCase,
    largest_gain,
    scene_named,
)

_G = 9.81
_WORLDS = ("IAPB", "PB", "ideal-friction")

# --- Kane and Levinson's double pendulum
# -----------------------------------------------------------------------
_SOURCE = "Kane and Levinson, Dynamics: Theory and Applications (1985); Kane (1984); angles and speeds ours"
_TO_THE_HORIZONTAL = np.array([[1.0, 1.0], [0.0, 1.0]])  # angles from those of the joints
_SHORTLY_AFTER = 0.02  # [s] the tip falls a millimetre


def double_pendulum_motion() -> TrajectoryCase:
    """The double pendulum falls on the floor from 1 mm and bounces for half a second."""
    return TrajectoryCase(
        "Kane and Levinson's double pendulum, its motion",
        _SOURCE,
        "a bounce with friction may throw the tip higher than the height from which it fell",
        "the energy never exceeds its initial value; Newton's and Coulomb's laws alone do not guarantee this",
        "kinetic plus potential energy never exceeds its initial value; until the tip touches, "
        "the motion follows from the equations of motion, integrated to ten digits",
        scene_named("double_pendulum_motion"),
        _measure_pendulum,
        worlds=("IAPB", "PB", "ideal", "ideal-friction"),
    )


def _measure_pendulum(run: Run) -> Measured:
    """Measure the relative error of the angles at the last instant before the tip touches the
    floor.

    Semi-implicit Euler is ahead by half a step's acceleration, so the relative error is at most
    step / time of flight. The rigid worlds are of order two: energy oscillates by its square.
    """
    flight = _flight()
    last = int(flight.events[0] / run.dt) - 1
    true_start, true_last = flight.state(np.array([0.0, last * run.dt]))[0] @ _TO_THE_HORIZONTAL
    off = np.abs(run.q[last] @ _TO_THE_HORIZONTAL - true_last).max()
    share = run.dt / (last * run.dt)
    gain = share**2 if run.law == "rigid constraints" else NO_GAIN
    turned = np.abs(true_last - true_start).max()
    return Measured(largest_gain(run), gain, float(off / turned), share)


@cache
def _flight() -> SceneTruth:
    """Return the event-driven motion until shortly after the tip touches the floor."""
    return scene_truth(scene_named("double_pendulum_motion"), _SHORTLY_AFTER)


def _until(
    event: Any, rate: Any, start: Any, rtol: float, atol: float
) -> tuple[float, Callable[[Any], Any]]:
    """Return the time of the event [s] and the motion until then."""
    from scipy.integrate import solve_ivp

    event.terminal = True
    found = solve_ivp(
        rate, (0.0, 0.1), start, "DOP853", events=event, dense_output=True, rtol=rtol, atol=atol
    )
    return float(found.t_events[0][0]), found.sol


# --- a block pushed along the floor
# ---------------------------------------------------------------------------
# friction, [s], v_threshold of (6) [m/s]
_MU = 0.3
_DURATION = 0.2
_CREEP = 1e-3
# Rounding over 800 steps and the settling of the springs: a correct world has no larger error.
_KEPT = 1e-6
# First-order error of a rigid step with Coulomb's law: half a step of the duration changes the
# distance by 6e-4.
_FIRST_ORDER = 0.01


def creep_of_the_regularised_law() -> TrajectoryCase:
    """A block on the floor, pushed with 0.99 μ m g and compared with law (6) itself."""

    def measure(run: Run) -> Measured:
        """Measure the distance from the motion of (6), relative to the creep distance."""
        x = v = 0.0
        for _ in range(run.steps):
            v += run.dt * _MU * _G * (0.99 - min(1.0, v / _CREEP))
            x += run.dt * v
        return Measured(largest_gain(run), NO_GAIN, abs(float(run.q[-1, 0]) / x - 1.0), _KEPT)

    return TrajectoryCase(
        "Creep of the regularised law, 1 % below the threshold",
        "(6) of the paper",
        "the paper's law (6) never sticks: the block must creep at the speed that the law gives, no faster",
        "after a few steps the block creeps at 0.99 times 1 mm/s, the speed below which (6) is viscous",
        "equation (6) of the paper for one coordinate, step by step",
        _block(0.99).with_values({"contact.forces": "paper"}),
        measure,
        ("IAPB", "PB"),
    )


def _block(share: float) -> Scene:
    """Return the scene of the block with a hand that pushes with this share of μ m g."""
    return scene_named("pushed_block").with_values({"hand.force": [share * _MU * _G, 0.0, 0.0]})


def pushed(share: float, name: str, expected: str) -> TrajectoryCase:
    """A block on the floor, pushed with this share of μ m g."""
    slide = 0.5 * max(share - 1.0, 0.0) * _MU * _G * _DURATION**2
    # if the block sticks: the distance of a creep at v_threshold
    scale = slide or _CREEP * _DURATION

    def measure(run: Run) -> Measured:
        """Measure the distance from the motion of Coulomb's law, relative to `scale`."""
        off = abs(float(run.q[-1, 0]) - slide) / scale
        return Measured(largest_gain(run), NO_GAIN, off, _FIRST_ORDER)

    return TrajectoryCase(
        name,
        "Coulomb's law",
        "a change of the force by one per cent decides whether the block moves",
        expected,
        f"Coulomb's law in closed form: {slide * 1e3:.4g} mm after {_DURATION:g} s",
        _block(share),
        measure,
        _WORLDS,
    )


# --- Painlevé's rod
# -------------------------------------------------------------------------------------------
_SINE = 0.8
_COSINE = 0.6
_ROUGH = 2.0
_SPEED = 1.0
_STIFF = 1e4
# of the centre [m]: an overlap of 1 nm, so that the contact is closed at the start
_HEIGHT = 0.5 * _SINE + 1e-6 - 1e-9
# [1/kg] of the sliding contact: negative
_MOBILITY = 1.0 + 3.0 * _COSINE * (_COSINE - _ROUGH * _SINE)
_GROWTH = math.sqrt(-_MOBILITY * _STIFF)  # [1/s] σ: the overlap grows as exp(σ t) at first


def painleve_rod() -> TrajectoryCase:
    """A rod slides on its lower end with μ = 2: its effective inertia is negative, so no finite
    force exists."""
    return TrajectoryCase(
        "Painlevé's rod: sliding without a finite answer",
        "Painlevé (1895); Génot and Brogliato (1999); Stewart (2000)",
        "the effective inertia of the sliding contact is negative: no acceleration of rigid "
        "bodies satisfies the laws, "
        "and with springs the force grows without bound",
        "the rod jams: with a rigid contact at once, with a spring as soon as the force is large enough",
        f"the equations of motion: with springs the slip stops after {1e3 * _slipping()[0]:.1f} ms; if rigid, at once",
        scene_named("painleve_rod"),
        _measure_rod,
        _WORLDS,
    )


@cache
def _slipping() -> tuple[float, Callable[[NDArray[np.float64]], NDArray[np.float64]]]:
    """Return the time at which the slip stops [s] and its speed until then [m/s], for a rod on one
    spring."""

    def slip(state: NDArray[np.float64]) -> Any:
        return state[3] + 0.5 * np.sin(state[2]) * state[5]

    def rate(_: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
        sine = math.sin(state[2])
        cosine = math.cos(state[2])
        push = _STIFF * max(0.0, 0.5 * sine + 1e-6 - state[1])
        turn = 12.0 * push * (-0.5 * cosine + 0.5 * sine * _ROUGH)
        return np.array([*state[3:], _ROUGH * push, push - _G, turn])

    def stops(_: float, state: NDArray[np.float64]) -> float:
        return float(slip(state))

    start = [0.0, _HEIGHT, math.atan2(_SINE, _COSINE), -_SPEED, 0.0, 0.0]
    end, motion = _until(stops, rate, start, 1e-11, 1e-13)
    return end, lambda time: slip(motion(time))


def _measure_rod(run: Run) -> Measured:
    """Measure the largest error of the slip speed until it stops, relative to the initial slip
    speed.

    A rigid world must have no slip after the first step, except for the rotation of the rod within
    a step. With springs a first-order method may start or stop the slip one step late or early.
    Implicit contact is also early because its force acts at the end of the step, as if the spring
    had a damper KΔt: the overlap then grows at the rate σ + ½ σ² Δt instead of σ, so after the time
    t it is ahead by ½ σ t steps. The bound is the largest change of the slip speed in one step,
    times these steps.
    """
    slip = run.v[:, 0] + 0.5 * np.sin(run.q[:, 2]) * run.v[:, 2]
    end, truth = _slipping()
    if run.law == "rigid constraints":
        return Measured(
            largest_gain(run), NO_GAIN, float(np.abs(slip[1:]).max()) / _SPEED, _FIRST_ORDER
        )
    slipping = run.time < end
    true = truth(run.time[slipping])
    steepest = float(np.abs(np.diff(true)).max())
    early = (1.0 + 0.5 * _GROWTH * end) * steepest
    return Measured(
        largest_gain(run),
        NO_GAIN,
        float(np.abs(slip[slipping] - true).max()) / _SPEED,
        early / _SPEED,
    )


# --- a plate pushed by a spring: stick-slip
# ----------------------------------------------------------------------- The spring is a contact: a
# ball of 1e8 kg with constant speed presses on the edge of a plate of 1 kg.
_PRESS = 1e4  # spring [N/m]
_DAMPED = 10.0  # damper of the contact [N s/m]
_STEADY = 0.01  # speed of the ball [m/s]
_OMEGA = math.sqrt(_PRESS)  # [rad/s] of the plate on the spring, without the damper
_DECAY = 0.5 * _DAMPED  # [1/s] of its swing
_SWING = math.sqrt(_OMEGA**2 - _DECAY**2)  # [rad/s] with the damper
# the spring's depth [m] in steady sliding; the start has 1.5 times this depth
_SLIDING = _MU * _G / _PRESS
# Error of a step Δt in units of ωΔt times the swing V/ω. The force acts at the end of the step, as
# if the contact had another damper KΔt, so the swing decays faster by ω²Δt/2. It loses ½ω²Δt t
# exp(−at) of its size, at most ω²Δt/(2 e a), with a the decay rate and e Euler's number. The stick
# begins and ends up to one step late.
_LATE = _OMEGA / (2.0 * math.e * _DECAY) + 2.0


def stick_slip() -> TrajectoryCase:
    """A plate of 1 kg on a rough floor, pushed by a spring and damper whose other end moves at
    constant speed."""
    swing = _STEADY / _OMEGA

    def measure(run: Run) -> Measured:
        """Measure the largest distance from the closed form, relative to the swing V/ω, and the
        energy gain.

        The energy is measured in the frame of the ball, (v − V)² / 2 + K u² / 2. The damper takes
        some of it while the plate slides, friction while it sticks.
        """
        u = _STEADY * run.time - run.q[:, 0] + 0.5 * _SLIDING
        held = (run.v[:, 0] - _STEADY) ** 2 + _PRESS * u**2
        off = float(np.abs(run.q[:, 0] - pushed_plate(run.time)).max()) / swing
        return Measured(float(held.max() / held[0]) - 1.0, NO_GAIN, off, _LATE * _OMEGA * run.dt)

    return TrajectoryCase(
        "Stick-slip of a plate that a spring pushes",
        "Den Hartog, Trans. ASME 53 (1931); the textbooks' block on a belt; the damper is ours",
        "the plate stops and starts again where the forces on it are exactly at the limit of friction, μ m g",
        "the plate slides, sticks once, and slides on; its swing on the spring decays, so it never sticks again",
        "closed form: a damped swing while the plate slides, at rest while spring and damper press less than μ m g",
        scene_named("stick_slip"),
        measure,
        ("IAPB", "PB"),
    )


def pushed_plate(time: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the position of the plate [m]; u is the spring's depth minus that of steady sliding.

    While the plate slides, u'' = −ω² u − 2 a u'. It starts with u₀ at the ball's speed V, and stops
    where u' = V. It slides again where spring and damper press with the limit of friction, ω² u + 2
    a V = 0.
    """
    u0 = 0.5 * _SLIDING
    stops = _stopping(u0)
    starts_at = -2.0 * _DECAY * _STEADY / _OMEGA**2
    stopped_at = float(_swing(np.array(stops), u0, _DECAY * u0))
    starts = stops + (starts_at - stopped_at) / _STEADY
    first = u0 + _STEADY * time - _swing(time, u0, _DECAY * u0)
    held = u0 + _STEADY * stops - stopped_at
    again = _swing(time - starts, starts_at, _STEADY + _DECAY * starts_at)
    last = held + _STEADY * (time - starts) + starts_at - again
    return np.asarray(
        np.select([time < stops, time < starts], [first, np.full_like(time, held)], last),
        np.float64,
    )


def _swing(time: NDArray[np.float64], place: float, push: float) -> NDArray[np.float64]:
    """Return u(t) = exp(−a t) (u(0) cos Ωt + (u'(0) + a u(0)) sin(Ωt) / Ω) [m]; `push` is u'(0) + a
    u(0) [m/s]."""
    swung = place * np.cos(_SWING * time) + push / _SWING * np.sin(_SWING * time)
    return np.asarray(np.exp(-_DECAY * time) * swung, np.float64)


@cache
def _stopping(u0: float) -> float:
    """Return the first time [s] at which u' = V, from u(0) = u₀ and u'(0) = 0 on."""
    from scipy.optimize import brentq

    def too_slow(time: float) -> float:
        return (
            -math.exp(-_DECAY * time) * _OMEGA**2 * u0 / _SWING * math.sin(_SWING * time) - _STEADY
        )

    return float(brentq(too_slow, math.pi / _SWING, 1.5 * math.pi / _SWING, xtol=1e-15))
