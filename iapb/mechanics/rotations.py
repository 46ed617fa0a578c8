"""Rotations given by roll, pitch and yaw about the fixed x, y and z axes, as in URDF."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iapb.numerics.elementary import arc_tangent, hypotenuse, sine_cosine
from iapb.numerics.schema import Floats


def unit(vector: ArrayLike) -> Floats:
    """Return a vector (3,) with length one; scaled first, so that a tiny one does not vanish and a
    huge one does not overflow."""
    scaled = np.asarray(vector, np.float64) / np.abs(vector).max()
    return scaled / math.sqrt(sum(x * x for x in scaled.tolist()))


def frame_along(normal: ArrayLike) -> Floats:
    """Return right-handed axes (columns); the third axis points along `normal` (longer than 0)."""
    z = unit(normal)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x = x / math.sqrt(sum(y * y for y in x.tolist()))
    return np.column_stack([x, np.cross(z, x), z])


def rotation_of(rpy: Any) -> Floats:
    """Return the rotation (3, 3) by roll, pitch, yaw: R_z R_y R_x."""
    (sr, cr), (sp, cp), (sy, cy) = (sine_cosine(float(angle)) for angle in rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def angles_of(rotation: Floats) -> tuple[float, float, float]:
    """Return roll, pitch, yaw [rad] of a rotation; at pitch ±90° the roll is taken as zero."""
    across = hypotenuse(rotation[0, 0], rotation[1, 0])
    pitch = arc_tangent(-rotation[2, 0], across)
    if across < 1e-9:  # x points up or down: only the sum of roll and yaw is determined
        return 0.0, pitch, arc_tangent(-rotation[0, 1], rotation[1, 1])
    return (
        arc_tangent(rotation[2, 1], rotation[2, 2]),
        pitch,
        arc_tangent(rotation[1, 0], rotation[0, 0]),
    )
