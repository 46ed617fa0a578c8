"""Rotations given by roll, pitch and yaw about the fixed x, y and z axes, as in URDF."""

from __future__ import annotations

from typing import Any

import numpy as np

from iapb.numerics.elementary import arc_tangent, hypotenuse, sine_cosine
from iapb.numerics.schema import Floats


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
