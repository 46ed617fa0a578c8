"""The arguments of an impact with friction, checked and scaled as `impact_problem` does."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.contact.impact_problem import ImpactInput, check_input
from iapb.errors import ArgumentError

Floats = NDArray[np.float64]


class FrictionInput(NamedTuple):
    """A checked impact with friction: coordinates scaled as in `problem`, rows of unit normals and tangents as given.

    normals : (c, d); tangents : (c, m, d); restitution in [0, 1]; friction : (c,)
    """

    problem: ImpactInput
    normals: Floats
    tangents: Floats
    restitution: float
    friction: Floats


def check_friction(
    mass_matrix: ArrayLike, contact_jacobian: ArrayLike, tangents: ArrayLike, velocity: ArrayLike,
    restitution: float, friction: ArrayLike,
) -> FrictionInput:
    """Check shapes, ranges and finiteness; raise ArgumentError by name."""
    if np.ndim(restitution) != 0:
        raise ArgumentError("restitution", restitution, "one number for all contacts")
    problem = check_input(mass_matrix, contact_jacobian, velocity, restitution)
    if not 0.0 <= problem.restitution <= 1.0:
        raise ArgumentError("restitution", restitution, "a number in [0, 1]")
    scale = problem.coordinate_exponent
    rows = np.ldexp(problem.contact_jacobian, -problem.row_exponent[:, None].astype(np.int32))
    along = np.ldexp(_tangents(tangents, problem.contacts, problem.coordinates), scale.astype(np.int32))
    return FrictionInput(problem, rows, along, problem.restitution, _friction(friction, problem.contacts))


def _tangents(tangents: ArrayLike, contacts: int, coordinates: int) -> Floats:
    array = np.array(tangents, np.float64)
    if contacts == 0 and array.size == 0:
        return np.zeros((0, 1, coordinates))
    if array.ndim == 2:
        array = array[:, None, :]
    expected = f"shape ({contacts}, {coordinates}) or ({contacts}, 1 or 2, {coordinates})"
    if array.ndim != 3 or array.shape[0] != contacts or array.shape[1] not in (1, 2) or array.shape[2] != coordinates:
        raise ArgumentError("tangents", np.shape(tangents), expected)
    if not np.all(np.isfinite(array)):
        raise ArgumentError("tangents", "a number that is not finite", "finite numbers")
    return array


def _friction(friction: ArrayLike, contacts: int) -> Floats:
    array = np.array(friction, np.float64)
    if array.shape not in ((), (contacts,)):
        raise ArgumentError("friction", array.shape, f"a scalar or shape ({contacts},), one per contact")
    if not np.all((array >= 0.0) & np.isfinite(array)):
        raise ArgumentError("friction", friction, "finite numbers >= 0")
    return np.ascontiguousarray(np.broadcast_to(array, contacts))
