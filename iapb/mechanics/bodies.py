"""Rigid bodies with inertia and joint, and the order of the trees of a mechanism."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.errors import ArgumentError
from iapb.mechanics.joints import Joint

Floats = NDArray[np.float64]

# A placement given with nine digits counts as a rotation; a coarser one would shear the body.
ROTATION_TOLERANCE = 1e-8
# Rounding of R I R^T leaves this much asymmetry, relative to the largest entry of the inertia.
SYMMETRY_TOLERANCE = 1e-12


def no_placement() -> tuple[Floats, Floats]:
    """Return the placement of a joint frame that equals the parent's frame."""
    return np.eye(3), np.zeros(3)


def finite_array(argument: str, value: ArrayLike, shape: tuple[int, ...], unit: str = "") -> Floats:
    """Return value as a float array of that shape.

    Raises
    ------
    ArgumentError
        Wrong shape, not numbers, NaN or infinite.
    """
    expected = f"finite numbers of shape {shape}{f' [{unit}]' if unit else ''}"
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise ArgumentError(argument, value, expected) from None
    if array.shape != shape or not np.isfinite(array).all():
        raise ArgumentError(argument, value, expected)
    return array


def float_vector(argument: str, value: ArrayLike, size: int) -> Floats:
    """Return value as a contiguous float vector, without a copy if it is one already; entries may be NaN or infinite.

    Raises
    ------
    ArgumentError
        Wrong shape, or not numbers.
    """
    try:
        vector = np.asarray(value, np.float64, "C")
    except (TypeError, ValueError):
        return finite_array(argument, value, (size,))
    return vector if vector.shape == (size,) else finite_array(argument, value, (size,))


def float_rows(argument: str, value: ArrayLike, columns: int) -> Floats:
    """Return value as a contiguous float array (rows, columns), under the rules of `float_vector`."""
    try:
        rows = np.asarray(value, np.float64, "C")
    except (TypeError, ValueError):
        raise ArgumentError(argument, value, f"numbers of shape (rows, {columns})") from None
    if rows.ndim != 2 or rows.shape[1] != columns:
        raise ArgumentError(f"{argument} of shape", rows.shape, f"(rows, {columns})")
    return rows


def _check_rotation(argument: str, rotation: Floats) -> None:
    error = np.abs(rotation.T @ rotation - np.eye(3)).max()
    if error > ROTATION_TOLERANCE or np.linalg.det(rotation) < 0.0:
        raise ArgumentError(argument, rotation, "a rotation matrix (orthonormal, determinant +1)")


def _check_symmetric(argument: str, inertia: Floats) -> None:
    if np.abs(inertia - inertia.T).max() > SYMMETRY_TOLERANCE * np.abs(inertia).max():
        raise ArgumentError(argument, inertia, "a symmetric matrix [kg m^2]")


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body of a tree.

    Parameters
    ----------
    name : str
        Unique in the mechanism.
    parent : str or None
        Body that carries this one; None = the world.
    joint : Joint
        How the body moves relative to its parent.
    placement : (rotation (3, 3), position (3,) [m])
        Joint frame in the parent body's frame. At the joint's neutral position the body frame equals it.
    mass : float
        [kg], zero allowed (a frame).
    center_of_mass : (3,) [m]
        In the body frame.
    inertia : (3, 3) [kg m^2]
        About the centre of mass, body axes. Only symmetry is checked: whether the mechanism's mass
        matrix is positive definite depends on the whole chain and is checked when it is factored.
    """

    name: str
    parent: str | None
    joint: Joint
    placement: tuple[Any, Any] = field(default_factory=no_placement)
    mass: float = 0.0
    center_of_mass: Any = (0.0, 0.0, 0.0)
    inertia: Any = ((0.0,) * 3,) * 3

    def __post_init__(self) -> None:
        where = f"body {self.name!r}: "
        rotation = finite_array(where + "placement rotation", self.placement[0], (3, 3))
        position = finite_array(where + "placement position", self.placement[1], (3,), "m")
        mass = float(finite_array(where + "mass", self.mass, (), "kg"))
        center = finite_array(where + "center_of_mass", self.center_of_mass, (3,), "m")
        inertia = finite_array(where + "inertia", self.inertia, (3, 3), "kg m^2")
        _check_rotation(where + "placement rotation", rotation)
        _check_symmetric(where + "inertia", inertia)
        if mass < 0.0:
            raise ArgumentError(where + "mass", mass, "at least 0 kg")
        checked = {"placement": (rotation, position), "mass": mass, "center_of_mass": center}
        for name, value in (checked | {"inertia": inertia}).items():
            object.__setattr__(self, name, value)


def parent_indices(bodies: Sequence[Body]) -> list[int]:
    """Return each body's parent as an index, -1 = world.

    Raises
    ------
    ArgumentError
        A repeated name, an unknown parent, a parent after its child, or a tree whose bodies are not
        consecutive (M would not be block diagonal).
    """
    index: dict[str, int] = {}
    parents: list[int] = []
    for i, body in enumerate(bodies):
        if body.name in index:
            raise ArgumentError(f"bodies[{i}].name", body.name, "a name that no other body has")
        if body.parent is not None and body.parent not in index:
            raise ArgumentError(f"bodies[{i}].parent", body.parent, "None or the name of an earlier body")
        parents.append(-1 if body.parent is None else index[body.parent])
        index[body.name] = i
    trees = tree_indices(parents)
    for i in range(1, len(trees)):
        if trees[i] < trees[i - 1]:
            raise ArgumentError(f"bodies[{i}]", bodies[i].name, "the bodies of each tree in sequence")
    return parents


def tree_indices(parents: Sequence[int]) -> list[int]:
    """Number the trees in the order of their roots and return each body's tree."""
    trees: list[int] = []
    roots = 0
    for parent in parents:
        trees.append(roots if parent < 0 else trees[parent])
        roots += parent < 0
    return trees
