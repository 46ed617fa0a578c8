"""How far the engine's mechanics and Pinocchio's are apart, quantity by quantity."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.mechanics.mechanism import Mechanism
from reference.rigid_body import PinocchioMechanism

Floats = NDArray[np.float64]

EARTH = (0.0, 0.0, -9.81)  # [m/s^2]


def compare(
    mechanism: Mechanism, reference: PinocchioMechanism, q: Floats, v: Floats, gravity: ArrayLike = EARTH
) -> dict[str, float]:
    """Return the largest difference of each quantity, relative to the reference's largest entry.

    The potential energy, whose zero is a convention, is taken relative to the sum of m |g| |c|; a bias that nearly
    vanishes (a centre of mass almost on its axis, a body that hardly turns) relative to the size of the terms that
    it sums: m |c| w^2, w the fastest turn, since world positions c are rounded and with them every lever arm; and
    v x m v, which is zero but is computed, of the size of twice the kinetic energy.

    Quantities: mass_matrix, bias, gravity, inverse_dynamics, kinetic_energy, potential_energy, momentum,
    and, over all bodies, placement, point_jacobian (at a point one metre off the origin) and frame_jacobian.
    """
    m, p, dv = mechanism, reference, np.cos(np.arange(mechanism.nv))
    pairs: dict[str, tuple[Any, Any]] = {
        "mass_matrix": (m.mass_matrix(q), p.mass_matrix(q)),
        "gravity": (m.gravity(q, gravity), p.gravity(q, gravity)),
        "inverse_dynamics": (m.inverse_dynamics(q, v, dv, gravity), p.inverse_dynamics(q, v, dv, gravity)),
        "kinetic_energy": (m.kinetic_energy(q, v), p.kinetic_energy(q, v)),
        "momentum": (m.centroidal_momentum(q, v), p.centroidal_momentum(q, v)),
    }
    differences = {name: relative_difference([pair]) for name, pair in pairs.items()}
    differences["bias"] = relative_difference([(m.bias(q, v), p.bias(q, v))], _swung(mechanism, q, v))
    height = abs(m.potential_energy(q, gravity) - p.potential_energy(q, gravity))
    differences["potential_energy"] = height / max(_lifted(mechanism, q, gravity), np.finfo(float).tiny)
    return differences | _compare_bodies(mechanism, reference, q)


def _lifted(mechanism: Mechanism, q: Floats, gravity: ArrayLike) -> float:
    """Sum of m |g| |c| [J]: the size of the terms of a potential energy that may itself be near zero."""
    return float(np.linalg.norm(gravity)) * _spread(mechanism, q)


def _swung(mechanism: Mechanism, q: Floats, v: Floats) -> float:
    """Sum of m |c| w^2 [N], or of m v^2 [N m]: the size of the terms of a bias that may itself be near zero."""
    fastest = float(np.max(np.abs(v[mechanism.arrays.dof_rotates]), initial=0.0))
    return max(fastest**2 * _spread(mechanism, q), 2.0 * mechanism.kinetic_energy(q, v))


def _spread(mechanism: Mechanism, q: Floats) -> float:
    """Sum of m |c| [kg m]."""
    rotations, positions = mechanism.placements(q)
    bodies = zip(mechanism.bodies, rotations, positions, strict=True)
    return sum(body.mass * float(np.linalg.norm(p + R @ body.center_of_mass)) for body, R, p in bodies)


def _compare_bodies(mechanism: Mechanism, reference: PinocchioMechanism, q: Floats) -> dict[str, float]:
    rotations, positions = mechanism.placements(q)
    pairs: dict[str, list[tuple[Any, Any]]] = {"placement": [], "point_jacobian": [], "frame_jacobian": []}
    for b, name in enumerate(mechanism.names):
        rotation, position = reference.placement(q, name)
        point = positions[b] + np.array([0.6, 0.0, -0.8])
        ours, theirs = mechanism.point_jacobian(q, b, point), reference.point_jacobian(q, name, point)
        pairs["placement"] += [(rotations[b], rotation), (positions[b], position)]
        pairs["point_jacobian"].append((ours, theirs))
        pairs["frame_jacobian"].append((mechanism.frame_jacobian(q, b), reference.frame_jacobian(q, name)))
    return {name: relative_difference(found) for name, found in pairs.items()}


def relative_difference(pairs: list[tuple[Any, Any]], floor: float = 0.0) -> float:
    """Return the largest |ours - theirs| of all pairs over the largest |theirs|, or over the floor if it is more."""
    scale = max((float(np.max(np.abs(theirs), initial=0.0)) for _, theirs in pairs), default=0.0)
    scale = max(scale, floor)
    gap = max((float(np.max(np.abs(ours - theirs), initial=0.0)) for ours, theirs in pairs), default=0.0)
    return gap if scale == 0.0 else gap / scale
