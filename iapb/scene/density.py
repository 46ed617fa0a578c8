"""Mass, centre of mass and inertia of a body whose shapes have one density; overlaps of shapes count twice."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

Matrix = list[list[float]]


def filled(shapes: Iterable[Any], density: float, spatial: bool) -> dict[str, Any]:
    """Return `mass`, `center_of_mass` and `inertia` about it, as in a scene file.

    Parameters
    ----------
    shapes : checked shapes of one body
    density : [kg/m2] in the plane, [kg/m3] in space
    spatial : whether the shapes are three-dimensional
    """
    parts: list[tuple[float, list[float], Any]] = [
        _spatial(shape, density) if spatial else _planar(shape, density) for shape in shapes]
    mass = math.fsum(m for m, _, _ in parts)
    center = [math.fsum(m * c[k] for m, c, _ in parts) / mass for k in range(len(parts[0][1]))]
    moved = [(m, [x - y for x, y in zip(c, center, strict=True)], about) for m, c, about in parts]
    if not spatial:
        inertia: Any = math.fsum(about + m * (x * x + y * y) for m, (x, y), about in moved)
    else:
        inertia = [[math.fsum(about[i][j] + m * (_dot(r, r) * (i == j) - r[i] * r[j]) for m, r, about in moved)
                    for j in range(3)] for i in range(3)]
    return {"mass": mass, "center_of_mass": center, "inertia": inertia}


def _planar(shape: Any, density: float) -> tuple[float, list[float], float]:
    """Return mass, centre of mass in body axes, and moment of inertia about it."""
    if shape.kind == "circle":
        mass = density * math.pi * shape.radius**2
        return mass, list(shape.center), 0.5 * mass * shape.radius**2
    if shape.kind == "box":
        mass = density * shape.size[0] * shape.size[1]
        return mass, list(shape.center), mass * (shape.size[0] ** 2 + shape.size[1] ** 2) / 12.0
    return _polygon(shape, density)


def _polygon(shape: Any, density: float) -> tuple[float, list[float], float]:
    """Return the same for a polygon, as a sum over the triangles between the first corner and each edge."""
    first, mass, moments, about = shape.vertices[0], 0.0, [0.0, 0.0], 0.0
    for a, b in zip(shape.vertices[1:], shape.vertices[2:], strict=False):
        ax, ay, bx, by = a[0] - first[0], a[1] - first[1], b[0] - first[0], b[1] - first[1]
        part = 0.5 * density * (ax * by - ay * bx)
        mass += part
        moments[0] += part * (ax + bx) / 3.0
        moments[1] += part * (ay + by) / 3.0
        about += part * (ax * ax + ay * ay + ax * bx + ay * by + bx * bx + by * by) / 6.0
    x, y = moments[0] / mass, moments[1] / mass
    about -= mass * (x * x + y * y)
    x, y = x + first[0], y + first[1]
    cos, sin = _cos_sin(shape.angle)
    return mass, [shape.center[0] + cos * x - sin * y, shape.center[1] + sin * x + cos * y], about


def _spatial(shape: Any, density: float) -> tuple[float, list[float], Matrix]:
    """Return mass, centre of mass in body axes, and inertia about it in body axes."""
    if shape.kind == "sphere":
        mass = density * 4.0 / 3.0 * math.pi * shape.radius**3
        about = 0.4 * mass * shape.radius**2
        return mass, list(shape.center), [[about * (i == j) for j in range(3)] for i in range(3)]
    a, b, c = shape.size
    mass = density * a * b * c
    principal = [mass * (b * b + c * c) / 12.0, mass * (a * a + c * c) / 12.0, mass * (a * a + b * b) / 12.0]
    turn = _rotation(shape.rpy)
    tensor = [[math.fsum(turn[i][k] * principal[k] * turn[j][k] for k in range(3)) for j in range(3)] for i in range(3)]
    return mass, list(shape.center), [[0.5 * (tensor[i][j] + tensor[j][i]) for j in range(3)] for i in range(3)]


def _rotation(rpy: Sequence[float]) -> Matrix:
    """Return the matrix of roll, pitch and yaw about the fixed x, y and z axes, in this order."""
    (cr, sr), (cp, sp), (cy, sy) = (_cos_sin(x) for x in rpy)
    return [[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr]]


def _cos_sin(angle: float) -> tuple[float, float]:
    """Return cosine and sine by Taylor's series, because the C library's last bit depends on the processor."""
    x, terms = math.remainder(angle, math.tau), [1.0]
    for k in range(1, 32):
        terms.append(terms[-1] * x / k)
    signed = [term if k % 4 < 2 else -term for k, term in enumerate(terms)]
    return math.fsum(signed[::2]), math.fsum(signed[1::2])


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return math.fsum(x * y for x, y in zip(a, b, strict=True))
