"""Mass, centre of mass and inertia of a body whose shapes have one density; overlaps of shapes count twice.

BLAS is not used, because its last bits depend on the processor.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np


@np.errstate(divide="raise", invalid="raise")
def filled(shapes: Sequence[Any], density: float) -> dict[str, Any]:
    """Return `mass`, `center_of_mass` and `inertia` about it, as in a scene file.

    Parameters
    ----------
    shapes : checked shapes of one body
    density : [kg/m2] in the plane, [kg/m3] in space

    Raises
    ------
    ArithmeticError
        The mass rounds to zero.
    """
    parts = [_part(shape, density) for shape in shapes]
    mass = math.fsum(m for m, _, _ in parts)
    center = sum(m * c for m, c, _ in parts) / mass
    inertia: Any = 0.0
    for m, c, about in parts:
        r = c - center
        square = (r * r).sum()
        inertia = inertia + about + m * (square if len(r) == 2 else square * np.eye(3) - np.outer(r, r))
    return {"mass": mass, "center_of_mass": center.tolist(), "inertia": np.asarray(inertia).tolist()}


def _part(shape: Any, density: float) -> tuple[float, Any, Any]:
    """Return mass, centre of mass in body axes, and inertia about it: a number in the plane, a matrix in space."""
    center = np.array(shape.center)
    if shape.kind == "circle":
        mass = density * math.pi * shape.radius**2
        return mass, center, 0.5 * mass * shape.radius**2
    if shape.kind == "sphere":
        mass = density * 4.0 / 3.0 * math.pi * shape.radius**3
        return mass, center, np.eye(3) * (0.4 * mass * shape.radius**2)
    from iapb.mechanics.rotations import rotation_of  # brings numba along

    if shape.kind == "polygon":
        mass, own, about = _polygon(np.array(shape.vertices), density)
        turn = rotation_of((0.0, 0.0, shape.angle))[:2, :2]
        return mass, center + (turn * own).sum(axis=1), about
    mass, squares = density * math.prod(shape.size), np.array(shape.size) ** 2
    if len(center) == 2:
        return mass, center, mass * squares.sum() / 12.0
    turn, principal = rotation_of(shape.rpy), mass * (squares.sum() - squares) / 12.0
    return mass, center, sum(principal[k] * np.outer(turn[:, k], turn[:, k]) for k in range(3))


def _polygon(vertices: Any, density: float) -> tuple[float, Any, float]:
    """Return mass, centre and moment of inertia from the triangles between the first corner and each edge."""
    a, b = vertices[1:-1] - vertices[0], vertices[2:] - vertices[0]
    masses = 0.5 * density * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    mass = masses.sum()
    center = (masses[:, None] * (a + b)).sum(axis=0) / (3.0 * mass)
    about = (masses * (a * a + a * b + b * b).sum(axis=1)).sum() / 6.0 - mass * (center * center).sum()
    return float(mass), center + vertices[0], about
