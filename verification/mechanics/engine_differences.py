"""Differences between the engine and the references: each quantity of the mechanics, and the contacts of a scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.mechanics.mechanism import Mechanism
from iapb.scene import Scene
from iapb.system import System
from reference.contact_finding import Contacts, find_contacts
from reference.contact_rows import contact_jacobian, mechanics_of
from reference.rigid_body import PinocchioMechanism

Floats = NDArray[np.float64]

EARTH = (0.0, 0.0, -9.81)  # [m/s^2]


@dataclass(frozen=True)
class SceneDifference:
    """Differences between engine and reference over configurations of a scene; relative for mechanics, else absolute.

    configurations : number of configurations
    apart : number of configurations whose contacts differ in number or by more than SAME, for instance because two
        faces are equally close and each side takes another one
    mass_matrix, inner_forces, placement, frame_jacobian : largest difference, relative to the largest entry
    contacts : number of compared contacts; point, normal, gap, row : their largest difference [m, 1, m, m or 1]
    """

    scene: str
    configurations: int
    apart: int
    mass_matrix: float
    inner_forces: float
    placement: float
    frame_jacobian: float
    contacts: int
    point: float
    normal: float
    gap: float
    row: float


SAME = 1e-9  # contacts that differ by more are different contacts; rounding of a dozen products is about 1e-14


def scene_difference(scene: Scene, configurations: int = 50, seed: int = 0) -> SceneDifference:
    """Compare the engine's mechanics and narrow phase with Pinocchio and `contact_finding`.

    The configurations are the initial one of the scene and random ones around it, displaced by 1e-6 to 1 [m, rad].
    """
    system, rng = System(scene), np.random.default_rng(seed)
    m, start = system.mechanism, system.make_state().q
    mechanics, contacts, apart = np.zeros(4), np.zeros(4), 0
    compared = 0
    for k in range(configurations):
        moved = rng.normal(size=m.nv) * 10.0 ** rng.uniform(-6.0, 0.0) if k else np.zeros(m.nv)
        q, v = m.integrate(start, moved), rng.normal(size=m.nv)
        mechanics = np.maximum(mechanics, _mechanics_apart(system, q, v))
        found = _contacts_apart(system, q)
        if found is None:
            apart += 1
        else:
            contacts, compared = np.maximum(contacts, found[1]), compared + found[0]
    mass, inner, placed, frame = mechanics.tolist()
    point, normal, gap, row = contacts.tolist()
    return SceneDifference(
        scene.name, configurations, apart, mass, inner, placed, frame, compared, point, normal, gap, row
    )


def _mechanics_apart(system: System, q: Floats, v: Floats) -> list[float]:
    """Relative differences of M, B + G, placements and frame Jacobians."""
    m, reference = system.mechanism, mechanics_of(system)
    axes, origins, frames = reference.bodies(q)
    rotations, positions = m.placements(q)
    ours = np.array([m.frame_jacobian(q, b) for b in range(len(positions))])
    mass, inner = reference.mass_matrix(q), reference.inner_forces(q, v, system.gravity)
    weight = float(np.linalg.norm(system.gravity)) * _spread(m, q)
    return [
        relative_difference([(m.mass_matrix(q), mass)]),
        relative_difference([(m.bias(q, v) + m.gravity(q, system.gravity), inner)], max(_swung(m, q, v), weight)),
        relative_difference([(rotations, axes[:-1]), (positions, origins[:-1])]),
        relative_difference([(ours, frames[:-1])]),
    ]


def _contacts_apart(system: System, q: Floats) -> tuple[int, Floats] | None:
    """Number of contacts, and largest differences (4,) of point, normal, gap, row; None if these are other contacts."""
    axes, origins, frames = mechanics_of(system).bodies(q)
    theirs = find_contacts(system.shapes, system.pairs, axes, origins, np.inf)
    found = system.contacts_at(q, np.inf)
    count = len(found.gap)
    ours = Contacts(*(getattr(found, name) for name in Contacts._fields))
    if count != len(theirs.gap):
        return None
    first, second = (_rows_of(found, origins, frames) for found in (ours, theirs))
    worst, left = np.zeros(4), list(range(count))
    for i in range(count):
        pair = [j for j in left if theirs.shape_a[j] == ours.shape_a[i] and theirs.shape_b[j] == ours.shape_b[i]]
        apart = [[float(np.abs(a[i] - b[j]).max()) for a, b in zip(first, second, strict=True)] for j in pair]
        if not apart or min(map(max, apart)) > SAME:
            return None
        nearest = min(range(len(pair)), key=lambda k: max(apart[k]))
        worst, left = np.maximum(worst, apart[nearest]), [j for j in left if j != pair[nearest]]
    return count, worst


def _rows_of(found: Contacts, origins: Floats, frames: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    return found.point, found.normal, found.gap, contact_jacobian(found.normal, found, origins, frames)


def compare(
    mechanism: Mechanism, reference: PinocchioMechanism, q: Floats, v: Floats, gravity: ArrayLike = EARTH
) -> dict[str, float]:
    """Return the largest difference of each quantity, relative to the reference's largest entry.

    Some quantities use another scale. The potential energy, whose zero is a convention, is relative to the sum of
    m |g| |c|. A bias may nearly vanish (a centre of mass almost on its axis, a body that hardly turns), so its scale is
    at least the size of the terms in its sum. These are m |c| w^2 with the fastest rate w, because the rounding of the
    world positions c affects every lever arm, and v x m v, which is zero but is computed from terms of the size of
    twice the kinetic energy.

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
    """Sum of m |g| |c| [J]: the size of the terms of the potential energy, whose sum may be near zero."""
    return float(np.linalg.norm(gravity)) * _spread(mechanism, q)


def _swung(mechanism: Mechanism, q: Floats, v: Floats) -> float:
    """Sum of m |c| w^2 [N], or of m v^2 [N m]: the size of the terms of a bias, whose sum may be near zero."""
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
    """Return the largest |ours - theirs| of all pairs, divided by the larger of `floor` and the largest |theirs|."""
    scale = max((float(np.max(np.abs(theirs), initial=0.0)) for _, theirs in pairs), default=0.0)
    scale = max(scale, floor)
    gap = max((float(np.max(np.abs(ours - theirs), initial=0.0)) for ours, theirs in pairs), default=0.0)
    return gap if scale == 0.0 else gap / scale
