"""Rigid bodies with inertia and joint, the trees that they form, and arrays of numbers given by a
caller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.errors import ArgumentError
from iapb.mechanics.joints import Joint, Mimic
from iapb.numerics.schema import Floats

# A placement given with nine digits counts as a rotation; a coarser one would shear the body.
ROTATION_TOLERANCE = 1e-8
# Rounding of R I R^T leaves this much asymmetry, relative to the largest entry of the inertia.
SYMMETRY_TOLERANCE = 1e-12


def real_numbers(value: Any) -> NDArray[Any] | None:
    """Return the value as an array; None for strings, truth values, time spans, complex numbers and
    masked arrays."""
    try:
        given = np.asarray(value)
    except (TypeError, ValueError):
        return None
    if isinstance(value, np.ma.MaskedArray):
        return None
    if given.dtype.kind == "O":
        if not all(isinstance(x, Real) and not isinstance(x, bool) for x in given.flat):
            return None
        try:
            return given.astype(np.float64)
        except OverflowError:  # a whole number that no double reaches
            return np.full(given.shape, np.inf)
    return given if given.dtype.kind in "fiu" else None


def float_array(argument: str, value: ArrayLike, shape: tuple[int, ...]) -> Floats:
    """Return value as a contiguous float array of that shape (-1 first: any length), or raise
    ArgumentError."""
    given = real_numbers(value)
    if given is None:
        raise ArgumentError(argument, value, f"numbers of shape {shape}".replace("-1", "n"))
    array = given.astype(np.float64, "C", copy=False)
    many = shape[:1] == (-1,) and array.ndim == len(shape) and array.shape[1:] == shape[1:]
    if array.shape != shape and not many:
        raise ArgumentError(f"{argument} of shape", array.shape, str(shape).replace("-1", "n"))
    return array


def finite_array(argument: str, value: ArrayLike, shape: tuple[int, ...], unit: str = "") -> Floats:
    """Return a copy of value as a float array of that shape with finite numbers, or raise
    ArgumentError."""
    array = float_array(argument, value, shape).copy()
    if not np.isfinite(array).all():
        raise ArgumentError(argument, value, f"finite numbers{f' [{unit}]' if unit else ''}")
    return array


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
        Joint frame in the parent body's frame. At the joint's neutral position the body frame
        equals it.
    mass : float
        [kg], zero allowed (a frame).
    center_of_mass : (3,) [m]
        In the body frame.
    inertia : (3, 3) [kg m^2]
        About the centre of mass, body axes. Only symmetry is checked: whether the mechanism's mass
        matrix is positive definite depends on the whole chain and is checked when it is factored.
    mimic : Mimic or None
        What a revolute or prismatic joint follows; it has no coordinate of its own then.
    """

    name: str
    parent: str | None
    joint: Joint
    placement: tuple[Any, Any] = field(default_factory=lambda: (np.eye(3), np.zeros(3)))
    mass: float = 0.0
    center_of_mass: Any = (0.0, 0.0, 0.0)
    inertia: Any = ((0.0,) * 3,) * 3
    mimic: Mimic | None = None

    def __post_init__(self) -> None:
        where = f"body {self.name!r}: "
        rotation = finite_array(where + "placement rotation", self.placement[0], (3, 3))
        position = finite_array(where + "placement position", self.placement[1], (3,), "m")
        mass = float(finite_array(where + "mass", self.mass, (), "kg"))
        center = finite_array(where + "center_of_mass", self.center_of_mass, (3,), "m")
        inertia = finite_array(where + "inertia", self.inertia, (3, 3), "kg m^2")
        if (
            np.abs(rotation.T @ rotation - np.eye(3)).max() > ROTATION_TOLERANCE
            or np.linalg.det(rotation) < 0.0
        ):
            raise ArgumentError(
                where + "placement rotation", rotation, "a rotation matrix (orthonormal, det +1)"
            )
        if np.abs(inertia - inertia.T).max() > SYMMETRY_TOLERANCE * np.abs(inertia).max():
            raise ArgumentError(where + "inertia", inertia, "a symmetric matrix [kg m^2]")
        if self.mimic is not None and self.joint.kind not in ("revolute", "prismatic"):
            raise ArgumentError(where + "mimic", self.mimic, "a revolute or prismatic joint")
        if mass < 0.0:
            raise ArgumentError(where + "mass", mass, "at least 0 kg")
        vars(self).update(
            placement=(rotation, position), mass=mass, center_of_mass=center, inertia=inertia
        )


def parents_and_trees(bodies: Sequence[Body]) -> tuple[list[int], list[int]]:
    """Return each body's parent as an index, -1 = world, and its tree, or raise ArgumentError.

    Trees are numbered in the order of their roots; their bodies are consecutive, so that M is block
    diagonal.
    """
    index: dict[str, int] = {}
    parents: list[int] = []
    trees: list[int] = []
    for i, body in enumerate(bodies):
        if body.name in index:
            raise ArgumentError(f"bodies[{i}].name", body.name, "a name that no other body has")
        if body.parent is not None and body.parent not in index:
            raise ArgumentError(
                f"bodies[{i}].parent", body.parent, "None or the name of an earlier body"
            )
        last = trees[-1] if trees else -1
        parents.append(-1 if body.parent is None else index[body.parent])
        trees.append(last + 1 if body.parent is None else trees[parents[i]])
        if trees[i] < last:
            raise ArgumentError(f"bodies[{i}]", body.name, "the bodies of each tree in sequence")
        index[body.name] = i
    return parents, trees
