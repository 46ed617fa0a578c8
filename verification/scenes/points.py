"""Places of the bodies of a motion, and points of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from iapb.mechanics.mechanism import Mechanism
from reference import Floats


def placed(mechanism: Mechanism, qs: ArrayLike) -> tuple[Floats, Floats]:
    """Return the origins (n, B, 3) [m] and the axes (n, B, 3, 3) of the bodies at each
    configuration."""
    pose = mechanism.poses(qs, planar=False)
    turn = Rotation.from_quat(pose[..., 3:].reshape(-1, 4)).as_matrix()
    return pose[..., :3], turn.reshape(*pose.shape[:2], 3, 3)


def points_of(
    place: Floats, turn: Floats, arm: float | Floats, axes: Sequence[int] = (0, 1, 2)
) -> Floats:
    """Return the origin of each body and the points at `arm` along its axes (n, B, k, 3) [m]."""
    ends = place[..., None, :] + arm * np.swapaxes(turn, -1, -2)[..., axes, :]
    return np.concatenate([place[..., None, :], ends], axis=-2)
