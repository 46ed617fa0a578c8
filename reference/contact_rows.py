"""Contacts of a system as rows, gaps and velocities, and back into the record of a step.

Rows nᵀ(J_a − J_b), (11)-(12), are built from Pinocchio's frame Jacobians of the bodies and the contacts of
`reference.contact_finding`: nothing here calls the engine's mechanics or its narrow phase.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from iapb.mechanics.mechanism import Mechanism
from reference.contact_finding import Contacts, find_contacts
from reference.rigid_body import PinocchioMechanism, model_of

Floats = NDArray[np.float64]

# nᵀJ smaller than this share of what it is summed from is rounding, not a lever arm of the contact.
ROW_NOISE = 1e-13
Z = np.array([0.0, 0.0, 1.0])

_mechanics: WeakKeyDictionary[Mechanism, PinocchioMechanism] = WeakKeyDictionary()


def mechanics_of(system: Any) -> PinocchioMechanism:
    """Pinocchio's model of the system's mechanism, built once."""
    mechanism = system.mechanism
    if mechanism not in _mechanics:
        _mechanics[mechanism] = model_of(mechanism)
    return _mechanics[mechanism]


@dataclass(frozen=True)
class ContactRows:
    """c contacts of one configuration.

    geometry : Contacts, c of each
    jacobian : (c, d) unit-normal rows; gap : (c,) [m]; gamma : (c,) J v [m/s]
    """

    geometry: Contacts
    jacobian: Floats
    gap: Floats
    gamma: Floats


def find_rows(system: Any, q: Floats, v: Floats, margin: float) -> ContactRows:
    """Return the contacts of `system` at q (nq,) with gap <= margin [m]."""
    axes, origins, frames = mechanics_of(system).bodies(q)
    geometry = find_contacts(system.shapes, system.pairs, axes, origins, margin)
    rows = contact_jacobian(geometry.normal, geometry, origins, frames)
    return ContactRows(geometry, rows, geometry.gap, rows @ v)


def contact_jacobian(directions: Floats, geometry: Contacts, origins: Floats, frames: Floats) -> Floats:
    """Velocity (c, d) of a against b at each contact along its direction n (c, 3), zero where it is only rounding.

    With a body's frame Jacobian (J_v, J_ω) and r from its origin to the point: nᵀJ = nᵀJ_v + (r × n)ᵀJ_ω.
    origins (n + 1, 3), frames (n + 1, 6, d) : of the bodies, the world's last
    """
    count = len(directions)
    rows, sizes = np.zeros((count, frames.shape[2])), np.zeros(count)
    norms = np.linalg.norm(frames.reshape(-1, 2, 3 * frames.shape[2]), axis=2)
    for bodies, sign in ((geometry.body_a, 1.0), (geometry.body_b, -1.0)):
        arms = geometry.point - origins[bodies]
        along = np.concatenate([directions, cross(arms, directions)], axis=1)
        rows += sign * np.einsum("cx,cxd->cd", along, frames[bodies])
        reach = np.linalg.norm(arms, axis=1) + np.linalg.norm(geometry.point, axis=1)
        sizes += norms[bodies, 0] + reach * norms[bodies, 1]
    rows[np.linalg.norm(rows, axis=1) <= ROW_NOISE * sizes] = 0.0
    return rows


def tangent_rows(system: Any, q: Floats, found: ContactRows) -> tuple[Floats, Floats]:
    """Unit tangents t (c, s, 3) of the contacts and their rows tᵀ(J_a − J_b) (c, s, d).

    s = 1 in the plane, t = z × n; s = 2 in space, so that (n, t_1, t_2) is right-handed.
    """
    normals = found.geometry.normal
    tangents = _tangents(normals) if getattr(system.scene, "dimensions", 2) == 3 else cross(Z, normals)[:, None]
    _, origins, frames = mechanics_of(system).bodies(q)
    rows = [contact_jacobian(tangents[:, k], found.geometry, origins, frames) for k in range(tangents.shape[1])]
    return tangents, np.stack(rows, axis=1)


def _tangents(normals: Floats) -> Floats:
    """Two unit tangents (c, 2, 3) of each normal (c, 3)."""
    least = np.eye(3)[np.argmin(np.abs(normals), axis=1)]  # the coordinate axis that is farthest from the normal
    first = cross(normals, least)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, cross(normals, first)], axis=1)


def cross(a: Floats, b: Floats) -> Floats:
    """a × b over the last axis (..., 3): numpy's own takes ten times as long for a few vectors."""
    found = np.empty(np.broadcast_shapes(a.shape, b.shape))
    found[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    found[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    found[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return found


def write_contacts(
    state: Any, found: ContactRows, impulse: Floats, friction: Floats, forced: NDArray[np.bool_], dt: float
) -> None:
    """Record in `state` the contacts that touch or carry an impulse; `forced` marks p as a force, not a blow.

    friction : (c, 3) tangential impulses, world axes, recorded as forces where `forced`
    """
    kept = np.flatnonzero((found.gap <= 0.0) | (impulse > 0.0))
    was = identities(state.contacts, range(int(state.contact_count[0])))
    identity = identities(found.geometry, kept)
    for name in Contacts._fields:
        getattr(state.contacts, name)[: len(kept)] = getattr(found.geometry, name)[kept]
    state.contacts.normal_velocity[: len(kept)] = found.gamma[kept]
    state.contacts.normal_force[: len(kept)] = np.where(forced, impulse, 0.0)[kept] / dt
    state.contacts.friction_force[: len(kept)] = np.where(forced[:, None], friction, 0.0)[kept] / dt
    state.contacts.is_new[: len(kept)] = [name not in was for name in identity]
    state.contact_impulse[: len(kept)] = np.where(forced, 0.0, impulse)[kept]
    state.contact_count[1], state.contact_count[0] = state.contact_count[0], len(kept)


def write_impact(state: Any, system: Any, v: Floats, change: Floats, impulse: Floats, rows: Floats) -> None:
    """Log the blows of a step as one impact: velocity before, its change, generalized impulse and rows (c, d)."""
    log = state.impacts
    log.logged[0] = 0
    if not len(rows):
        return
    log.group[0], log.rows[0], log.rank[0] = max(system.tool_tree, 0), len(rows), np.linalg.matrix_rank(rows)
    log.scale[0], log.clamp[0] = 1.0, 1.0
    log.v_minus[0], log.v_plus[0], log.impulse[0] = v, v + change, impulse
    log.energy_lost[0] = -float((v + 0.5 * change) @ impulse)
    log.logged[0] = 1


def identities(contacts: Any, rows: Any) -> list[tuple[int, int, int]]:
    """Which contact each row is: its two shapes and their features."""
    return [(int(contacts.shape_a[i]), int(contacts.shape_b[i]), int(contacts.feature[i])) for i in rows]
