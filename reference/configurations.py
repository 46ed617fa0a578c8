"""Configurations as states of an ordinary differential equation: dq/dt, and what keeps quaternions of length one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# joint kind -> how many of its last coordinates are a quaternion or (cos, sin)
TURNING_ENTRIES = {"continuous": 2, "planar_se2": 2, "spherical": 4, "free_flyer": 4}

# Step [s] of the differences of fourth order: truncation (h ω)⁴ω/480 and rounding stay below 1e-11 up to 10 rad/s.
_STEP = 1e-3


def of_length_one(mechanism: Any, q: Floats) -> Floats:
    """Return q (nq,) with its quaternions and (cos, sin) scaled to length one."""
    if mechanism.nq == mechanism.nv:
        return q
    scaled = q.copy()
    for body, start in zip(mechanism.bodies, mechanism.arrays.q_start, strict=True):
        stop = int(start) + body.joint.layout.nq
        turning = slice(stop - TURNING_ENTRIES.get(body.joint.kind, 0), stop)
        if turning.start < stop:
            scaled[turning] /= np.linalg.norm(scaled[turning])
    return scaled


def configuration_rate(mechanism: Any, q: Floats, v: Floats) -> Floats:
    """dq/dt (nq,) of a motion with velocity v (d,) through q: v itself where coordinates may be added."""
    if mechanism.nq == mechanism.nv:
        return v
    near, far = (
        (mechanism.integrate(q, v, h) - mechanism.integrate(q, v, -h)) / (2.0 * h) for h in (_STEP, 2.0 * _STEP)
    )
    rate: Floats = (4.0 * near - far) / 3.0
    return rate
