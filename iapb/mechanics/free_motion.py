"""Constants of the free motion of a mechanism's trees (see `iapb.mechanics.kernels.free_motion`), computed once."""

from __future__ import annotations

from math import sqrt

import numpy as np

from iapb.compiled import flag
from iapb.mechanics.joints import FREE_FLYER, PLANAR, SPHERICAL
from iapb.mechanics.kernels.arrays import MechanismArrays
from iapb.mechanics.kernels.free_motion import LINKAGE, RIGID, STRAIGHT, FreeMotion
from iapb.mechanics.structure import has_velocity_terms, moving_parts, point_inertia


def make_free_motion(m: MechanismArrays, tree_of_body: np.ndarray) -> FreeMotion:
    """Return the constants of the free motion of the trees, given as the tree of each body."""
    count = 1 + int(tree_of_body.max())
    found = FreeMotion(np.zeros(count, np.int64), np.full(count, -1, np.int64), np.zeros(count, np.int64),
                       np.zeros((count, 3)), np.zeros((count, 3, 3)), np.ones((count, 3)), False, False)
    parts, carriers = moving_parts(m), np.flatnonzero(m.v_count)
    for t in range(count):
        moving = np.flatnonzero(tree_of_body[carriers] == t).tolist()
        if not moving:
            continue
        first = moving[0]
        kind, center, inertia = int(parts.kind[first]), parts.center_of_mass[first], parts.inertia[first]
        found.root[t] = carriers[first]
        if len(moving) == 1 and kind in (FREE_FLYER, SPHERICAL):
            found.kind[t] = RIGID
            if kind == FREE_FLYER:
                found.center[t] = center
            else:
                inertia = inertia + parts.mass[first] * point_inertia(center)
            found.moments[t], found.axes[t] = principal_axes(inertia)
        elif has_velocity_terms(parts, moving):
            found.kind[t] = LINKAGE
            if kind in (FREE_FLYER, PLANAR, SPHERICAL) and (parts.parent[moving[1:]] >= 0).all():
                found.base[t] = parts.v_count[first]
    return found._replace(turning=flag(bool((found.kind != STRAIGHT).any())),
                          linked=flag(bool((found.kind == LINKAGE).any())))


def principal_axes(inertia: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the principal moments, ascending, and the axes as columns of a rotation, by Jacobi's method.

    Without LAPACK: the same bits on every processor.
    """
    matrix, axes = [[float(x) for x in row] for row in inertia], np.eye(3).tolist()
    for _ in range(30):
        i, j = max(((0, 1), (0, 2), (1, 2)), key=lambda at: abs(matrix[at[0]][at[1]]))
        if abs(matrix[i][j]) <= 1e-17 * (abs(matrix[i][i]) + abs(matrix[j][j])):
            break
        ratio = (matrix[j][j] - matrix[i][i]) / (2.0 * matrix[i][j])
        t = (1.0 if ratio >= 0.0 else -1.0) / (abs(ratio) + sqrt(ratio * ratio + 1.0))
        c = 1.0 / sqrt(t * t + 1.0)
        s = t * c
        for rows in (matrix, axes):
            for row in rows:
                row[i], row[j] = c * row[i] - s * row[j], s * row[i] + c * row[j]
        matrix[i], matrix[j] = ([c * a - s * b for a, b in zip(matrix[i], matrix[j], strict=True)],
                                [s * a + c * b for a, b in zip(matrix[i], matrix[j], strict=True)])
    order = sorted(range(3), key=lambda k: matrix[k][k])
    turned = np.array(axes)[:, order]
    if float((np.cross(turned[:, 0], turned[:, 1]) * turned[:, 2]).sum()) < 0.0:
        turned[:, 2] *= -1.0
    return np.array([matrix[k][k] for k in order]), np.ascontiguousarray(turned)
