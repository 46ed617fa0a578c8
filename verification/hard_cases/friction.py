"""Measures of motions with dry friction: Kane and Levinson's double pendulum, the sliding threshold,
boxes that stop and stick, Painlevé's rod, stick-slip.

Kane and Levinson: the tip of a double pendulum strikes a rough floor, and Newton's law with
friction creates energy. Two uniform rods of 1 m and 1 kg hang from a hinge at 22.6° and 28.1° from
the vertical. The source has 20° and 30°; the angles here are those of the triangles 5-12-13 and
8-15-17, so that every sine and cosine is a fraction.

A friction force that is constant over a step can reverse the motion that it should stop. Law (6) of
the paper is an explicit damper μ N / v_threshold, which is unstable if μ N Δt > 2 m v_threshold.
For the boxes μ N Δt / (m v_threshold) is 4.9 at the default threshold.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.run import Run
from reference.scene_events import SceneTruth, scene_truth
from verification.hard_cases.case import Measured, scene_named
from verification.scenes.books import scene_of

_G = 9.81

# --- Kane and Levinson's double pendulum
# -----------------------------------------------------------------------
_TO_THE_HORIZONTAL = np.array([[1.0, 1.0], [0.0, 1.0]])  # angles from those of the joints
_SHORTLY_AFTER = 0.02  # [s] the tip falls a millimetre


def double_pendulum(run: Run) -> Measured:
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
    turned = np.abs(true_last - true_start).max()
    found = Measured(float(off / turned), share)
    return found._replace(gain_allowed=share**2) if run.law == "rigid constraints" else found


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


def creep(run: Run, share: float) -> Measured:
    """Measure the distance of a block that is pushed with this share of μ m g from the motion of
    (6), relative to the creep distance."""
    x = v = 0.0
    for _ in range(run.steps):
        v += run.dt * _MU * _G * (share - min(1.0, v / _CREEP))
        x += run.dt * v
    return Measured(abs(float(run.q[-1, 0]) / x - 1.0), _KEPT)


def pushed(run: Run, share: float) -> Measured:
    """Measure the distance of a block that is pushed with this share of μ m g from the motion of
    Coulomb's law.

    It is relative to the way of the block; if it sticks, to that of a creep at v_threshold.
    """
    slide = 0.5 * max(share - 1.0, 0.0) * _MU * _G * _DURATION**2
    scale = slide or _CREEP * _DURATION
    return Measured(abs(float(run.q[-1, 0]) - slide) / scale, _FIRST_ORDER)


# --- boxes that stop and stick
# -----------------------------------------------------------------------------
_ROUGHNESS = 0.5  # μ
_SLOPE = math.radians(20.0)
# relative error of the lean per box: the contact point lies at half the overlap
_SECOND_ORDER = 0.02


def nudged_box(run: Run) -> Measured:
    """Measure the largest distance of a box that starts at 0.2 m/s from its stopping place, from a
    tenth of a second after the stop on.

    The position of a first-order step is wrong by at most the distance of one step.
    """
    speed = 0.2
    way = speed**2 / (2.0 * _ROUGHNESS * _G)
    stopped = speed / (_ROUGHNESS * _G)
    x = run.q[run.time > stopped + 0.1, 0]
    return Measured(float(np.abs(x - way).max()) / way, speed * run.dt / way)


def on_a_slope(run: Run) -> Measured:
    """Measure the distance of the upper box of a stack from its elastic deflection at the end,
    relative to the deflection.

    The slabs of a stack oscillate on their springs without slipping.
    """
    scene = scene_of(run)
    count = len(scene.bodies)
    leans = _lean(scene)
    off = abs(float(run.q[-1, 3 * (count - 1)]) - leans)
    return Measured(off / leans, _SECOND_ORDER * count)


def _lean(scene: Any) -> float:
    """Return the elastic displacement of the upper box's centre down the slope [m], to first order,
    without slip.

    Face k carries the moment g sin(slope) h (n − k)² / 2 of the boxes above it. The face rotates by
    this moment divided by K w² / 2. The centre of the upper box is (n − 1 − k) h + h / 2 above the
    face.
    """
    count = len(scene.bodies)
    width, height = scene.bodies[0].shapes[0].size
    stiffness = scene.contact.stiffness
    turns = [
        _G * math.sin(_SLOPE) * height * (count - k) ** 2 / (stiffness * width**2)
        for k in range(count)
    ]
    return sum(turn * height * (count - k - 0.5) for k, turn in enumerate(turns))


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


def painleve_rod(run: Run) -> Measured:
    """Measure the largest error of the slip speed until it stops, relative to the initial slip
    speed, of a rod that slides on its lower end with μ = 2: its effective inertia is negative, so
    no finite force exists.

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
        return Measured(float(np.abs(slip[1:]).max()) / _SPEED, _FIRST_ORDER)
    slipping = run.time < end
    true = truth(run.time[slipping])
    steepest = float(np.abs(np.diff(true)).max())
    early = (1.0 + 0.5 * _GROWTH * end) * steepest
    return Measured(float(np.abs(slip[slipping] - true).max()) / _SPEED, early / _SPEED)


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


def stick_slip(run: Run) -> Measured:
    """Measure the largest distance of a plate of 1 kg on a rough floor, pushed by a spring and
    damper whose other end moves at constant speed, from the closed form, relative to the swing V/ω.

    The energy is measured in the frame of the ball, (v − V)² / 2 + K u² / 2. The damper takes some
    of it while the plate slides, friction while it sticks.
    """
    swing = _STEADY / _OMEGA
    u = _STEADY * run.time - run.q[:, 0] + 0.5 * _SLIDING
    held = (run.v[:, 0] - _STEADY) ** 2 + _PRESS * u**2
    off = float(np.abs(run.q[:, 0] - pushed_plate(run.time)).max()) / swing
    return Measured(off, _LATE * _OMEGA * run.dt, gain=float(held.max() / held[0]) - 1.0)


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
