"""What is true of ordinary scenes, which cases.yaml names: closed forms, and ordinary differential
equations solved by DOP853 to 1e-11 or better."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from iapb.scene import Scene
from iapb.scene.mechanism import mechanism_of, start_of
from reference.rigid_body import model_of
from verification.ordinary.quantities import Floats, Motion

G = 9.81


def _angle_at(
    time: float, start: list[float], rates: Callable[[float, Floats], list[float]]
) -> float:
    """Return the first coordinate at a time, from a start and the rates of all coordinates."""
    found = solve_ivp(rates, (0, time), start, "DOP853", rtol=1e-11, atol=1e-12)
    return float(found.y[0, -1])


def rolled(v: float, w: float, mu: float, time: float, share: float = 0.4) -> float:
    """The way of a ball that starts with velocity v and surface velocity w, its inertia share·m·r²
    [m]. It slides until it rolls."""
    slip = v - w
    sliding = abs(slip) / (mu * G * (1.0 + 1.0 / share))
    end = (v + share * w) / (1.0 + share)
    return (v + end) / 2.0 * sliding + end * (time - sliding)


def tipped(w: float, h: float, speed: float, time: float) -> float:
    """The angle of a box that turns clockwise about its lower edge without sliding [rad]."""
    half = math.hypot(w, h) / 2
    lean = math.atan2(w, h)
    about = (w * w + h * h) / 3
    return -_angle_at(
        time, [0.0, speed], lambda _, y: [y[1], G * half * math.sin(y[0] - lean) / about]
    )


def driven(mu: float, mass: float, time: float) -> float:
    """How far a wedge of 1 kg with a half angle of 15 degrees, which 5 N push, moves up [m]; all
    its faces and the blocks beside it slide."""
    s = math.sin(math.radians(15.0))
    c = math.cos(math.radians(15.0))
    down = 2 * (s + mu * c)
    out = c - mu * s - mu * (s + mu * c)
    # 1 kg · a = load − down N,  mass a tan 15° = out N − μ mass g
    rows = [[1.0, down], [mass * s / c, -out]]
    return -float(np.linalg.solve(rows, [G + 5.0, -mu * mass * G])[0]) * time**2 / 2


def slipped(mu: float, lean: float, time: float) -> float:
    """How far a ladder turns that slips at both ends, a rod of 1 m with round ends that leans at
    an angle [degrees] from the floor [rad]."""
    half = 0.5
    tip = 0.005  # radius of its ends

    def rates(_: float, y: Floats) -> list[float]:
        c = math.cos(y[0])
        s = math.sin(y[0])
        # unknown: angular acceleration, force of the floor, force of the wall, each by mass;
        # inertia = half²/3
        rows = [
            [-half * s, mu, -1.0],
            [half * c, -1.0, -mu],
            [-(half**2) / 3, mu * (half * s + tip) - half * c, mu * (half * c + tip) + half * s],
        ]
        loads = [half * c * y[1] ** 2, half * s * y[1] ** 2 - G, 0.0]
        return [y[1], float(np.linalg.solve(rows, loads)[0])]

    start = math.radians(lean)
    return start - _angle_at(time, [start, 0.0], rates)


def landed(w: float, h: float, mu: float, e: float, speed: float, time: float) -> float:
    """How far a box turns after it landed flat and slides on: its leading corner slips, the other
    opens [rad]."""
    # per unit of mass
    arm = w / 2 - mu * h / 2
    about = (w * w + h * h) / 12
    return time * (1 + e) * speed / (1 + w / 2 * arm / about) * arm / about


def against_a_wall(ratio: float) -> tuple[float, float]:
    """The velocities of a heavy ball (1 m/s at the start) and of a light one between it and a wall
    at +x, after all elastic collisions [m/s]."""
    heavy = 1.0
    light = 0.0
    while heavy > light or light > 0.0:
        if heavy > light:
            common = (ratio * heavy + light) / (ratio + 1.0)
            heavy = 2.0 * common - heavy
            light = 2.0 * common - light
        else:
            light = -light
    return heavy, light


def free_motion(scene: Scene) -> Motion:
    """Return the motion of a scene without contact at a hundred instants, by Pinocchio's forward
    dynamics."""
    mechanics = model_of(mechanism_of(scene))
    model = mechanics.model
    nq = mechanics.nq
    model.gravity.linear = np.array([*(scene.gravity or ()), 0.0, 0.0, 0.0][:3])

    def rates(_: float, y: Floats) -> Any:
        q = mechanics.normalize(y[:nq])
        v = y[nq:]
        force = np.zeros(mechanics.nv)
        faster = mechanics.pin.aba(model, mechanics.data, q, v, force)
        return np.concatenate([mechanics.rate(q, v), faster])

    times = np.linspace(0.0, scene.duration, 101)
    start = np.concatenate(start_of(scene))
    span = (0.0, scene.duration)
    found = solve_ivp(rates, span, start, "DOP853", times, rtol=1e-12, atol=1e-12)
    poses = [mechanics.bodies(mechanics.normalize(y[:nq]))[:2] for y in found.y.T]
    turn, place = (np.array(part)[:, :-1] for part in zip(*poses, strict=True))
    return Motion(times, place, turn)
