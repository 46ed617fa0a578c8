"""Restitution of each pair of shapes of a scene, where bodies and walls give their own.

The rule is the smaller of the two values given; a body or wall that gives none takes the other's, and where neither
gives one `contact.restitution` holds. So equal values stay what they are to the last bit, and a soft thing is soft
against everything.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iapb.errors import ArgumentError
from iapb.scene import Scene

Floats = NDArray[np.float64]

UNSTATED = 2.0  # larger than any restitution, so that the smaller of two is the one that is given


def restitution_by_shape(scene: Scene) -> Floats:
    """Return what the body or wall of each shape gives (n,), UNSTATED where none; in the order of `shapes_of`."""
    given = [body.restitution for body in scene.bodies for _ in body.shapes]
    given += [wall.restitution for wall in scene.walls]
    return np.array([UNSTATED if e is None else e for e in given], np.float64)


def restitution_by_pair(scene: Scene, pairs: NDArray[np.int32]) -> Floats:
    """Return e of each candidate pair (k, 2) of shapes."""
    own = restitution_by_shape(scene)
    smaller = np.minimum(own[pairs[:, 0]], own[pairs[:, 1]])
    return np.where(smaller > 1.0, scene.contact.restitution, smaller)


def one_restitution(scene: Scene, pairs: NDArray[np.int32]) -> float:
    """Return e where all pairs have the same one; for laws that know no other case.

    Raises
    ------
    ArgumentError
        Pairs differ.
    """
    values = np.unique(restitution_by_pair(scene, pairs))
    if len(values) > 1:
        found = f"one restitution for all contacts; here {values[0]:g} to {values[-1]:g}"
        raise ArgumentError("scene", scene.name, found)
    return float(values[0]) if len(values) else float(scene.contact.restitution)
