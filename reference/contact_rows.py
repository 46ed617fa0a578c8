"""Contacts of a system as rows, gaps and velocities, and their record after a step.

Pinocchio places the bodies, the engine's narrow phase finds the contacts there, and Pinocchio's
frame Jacobians give the rows nᵀ(J_a − J_b), (11)-(12). Nothing here calls the engine's mechanics.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numba
import numpy as np
from numpy.typing import NDArray

from iapb.contact.finding import Contacts
from iapb.mechanics.mechanism import Mechanism
from iapb.system import System
from reference import Floats
from reference.rigid_body import PinocchioMechanism, model_of

# An nᵀJ below this share of its summands is rounding error, not a lever arm of the contact.
ROW_NOISE = 1e-13
# Shapes that are apart graze if they just reach the plane of a face, up to this share of the size:
# they slide or roll past each other, as over a seam of two tiles. Far above rounding.
GRAZE = 1e-9
_mechanics: WeakKeyDictionary[Mechanism, PinocchioMechanism] = WeakKeyDictionary()
_solids: WeakKeyDictionary[Mechanism, _Solids] = WeakKeyDictionary()


def mechanics_of(system: System) -> PinocchioMechanism:
    """Return Pinocchio's model of the system's mechanism, built once."""
    if system.mechanism not in _mechanics:
        _mechanics[system.mechanism] = model_of(system.mechanism)
    return _mechanics[system.mechanism]


@dataclass(frozen=True)
class ContactRows:
    """c contacts of one configuration."""

    geometry: Contacts  #: c entries in each field
    jacobian: Floats  #: (c, d) unit-normal rows
    gap: Floats  #: (c,) [m]
    gamma: Floats  #: (c,) J v [m/s]


def find_rows(system: System, q: Floats, v: Floats, margin: float) -> ContactRows:
    """Return the contacts of `system` at q (nq,) with gap <= margin [m]."""
    axes, origins, frames = mechanics_of(system).bodies(q)
    geometry = system.finder.find(axes, origins, margin)
    if (geometry.gap > 0.0).any():
        shapes = geometry.shape_a, geometry.shape_b
        grazing = _grazing(*shapes, geometry.gap, _solids_of(system), axes, origins)
        if grazing.any():
            geometry = Contacts(*(column[~grazing] for column in geometry))
    if len(system.stops.bound):
        geometry = _with_stops(geometry, system, q, origins, frames, margin)
    rows = contact_jacobian(geometry.normal, geometry, origins, frames)
    return ContactRows(geometry, rows, geometry.gap, rows @ v)


class _Solids(NamedTuple):
    """Corners and faces of all shapes, one after another; a ball has one corner, a plane none."""

    radius: Floats  # (n,) [m] of a ball, else 0
    size: Floats  # (n,) [m]
    corner: Floats  # (k, 3)
    face: Floats  # (f, 3) outward normals
    offset: Floats  # (f,) [m] n·x of the points of a face
    corners: NDArray[np.int64]  # (n + 1,) the first corner of each shape
    faces: NDArray[np.int64]  # (n + 1,)
    body: NDArray[np.int64]  # (n,)


def _solids_of(system: System) -> _Solids:
    """Return the shapes in the axes of their bodies, made once."""
    if system.mechanism in _solids:
        return _solids[system.mechanism]
    number = len(system.shapes.kind)
    corner = [np.zeros((0, 3))]
    face = [np.zeros((0, 3))]
    offset = [np.zeros(0)]
    corners = np.zeros(number, np.int64)
    faces = np.zeros(number, np.int64)
    size = np.zeros(number)
    for s, solid in system.solids.items():
        points = solid.points if solid.radius > 0.0 else solid.points[1:]
        corner.append(points)
        face.append(solid.normals)
        offset.append(solid.offsets)
        corners[s] = len(points)
        faces[s] = len(solid.normals)
        size[s] = solid.reach
    made = _Solids(
        system.shapes.radius,
        size,
        np.concatenate(corner),
        np.concatenate(face),
        np.concatenate(offset),
        np.cumsum([0, *corners]),
        np.cumsum([0, *faces]),
        np.asarray(system.shapes.body, np.int64),
    )
    return _solids.setdefault(system.mechanism, made)


@numba.njit(cache=True, fastmath=False)
def _turned(axes, vector):  # type: ignore[no-untyped-def]
    turned = np.zeros(3)
    for i in range(3):
        for k in range(3):
            turned[i] += axes[i, k] * vector[k]
    return turned


@numba.njit(cache=True, fastmath=False)
def _grazing(shape_a, shape_b, gap, solids, axes, origins):  # type: ignore[no-untyped-def]
    """Return whether each contact (c,) is between shapes that graze, at these places of the
    bodies."""
    grazes = np.zeros(len(gap), np.bool_)
    for c in range(len(gap)):
        near = GRAZE * (solids.size[shape_a[c]] + solids.size[shape_b[c]])
        for side in range(2 if gap[c] > near else 0):
            one, other = (shape_a[c], shape_b[c]) if side == 0 else (shape_b[c], shape_a[c])
            here = solids.body[one]
            there = solids.body[other]
            for f in range(solids.faces[one], solids.faces[one + 1]):
                face = _turned(axes[here], solids.face[f])
                lowest = np.inf
                for k in range(solids.corners[other], solids.corners[other + 1]):
                    way = _turned(axes[there], solids.corner[k]) + origins[there] - origins[here]
                    lowest = min(lowest, (way * face).sum() - solids.offset[f])
                grazes[c] |= abs(lowest - solids.radius[other]) <= near
    return grazes


def _with_stops(
    geometry: Contacts, system: System, q: Floats, origins: Floats, frames: Floats, margin: float
) -> Contacts:
    """Append the joint limits with gap <= margin [m], as contacts on an arm that the joint
    rotates."""
    stops = system.stops
    gap = stops.arm * stops.sign * (q[stops.coordinate] - stops.bound)
    kept = np.flatnonzero(gap <= margin)
    body = stops.body[kept]
    parent = stops.parent[kept]
    dof = stops.dof[kept]
    # relative to the parent, at unit joint velocity
    turning = frames[body, 3:, dof]
    sliding = frames[body, :3, dof]
    turns = np.linalg.norm(turning, axis=1) > 0.5
    axis = np.where(turns[:, None], turning, sliding)
    lever = unit_tangents(axis, spatial=True)[:, 0]
    normal = np.where(turns[:, None], np.cross(axis, lever), axis) * stops.sign[kept, None]
    point = origins[body] + np.where(turns, stops.arm[kept], 0.0)[:, None] * lever
    shape = stops.shape[kept].astype(np.int32)
    feature = np.zeros(len(kept), np.int64)
    own = (
        shape,
        shape,
        body.astype(np.int32),
        parent.astype(np.int32),
        feature,
        point,
        normal,
        gap[kept],
    )
    columns: list[Any] = [np.concatenate([geometry[k], column]) for k, column in enumerate(own)]
    return Contacts(*columns)


def contact_jacobian(
    directions: Floats, geometry: Contacts, origins: Floats, frames: Floats
) -> Floats:
    """Return the rows (c, d) of the velocity of a relative to b along directions n (c, 3); mere
    rounding becomes 0.

    With a body's frame Jacobian (J_v, J_ω) and r from its origin to the point, nᵀJ = nᵀJ_v + (r ×
    n)ᵀJ_ω. origins (n + 1, 3), frames (n + 1, 6, d) : those of the bodies and, last, of the world
    """
    return np.asarray(
        _rows(directions, geometry.point, geometry.body_a, geometry.body_b, origins, frames)
    )


@numba.njit(cache=True, fastmath=False)
def _rows(directions, points, bodies_a, bodies_b, origins, frames):  # type: ignore[no-untyped-def]
    count = len(directions)
    d = frames.shape[2]
    rows = np.zeros((count, d))
    along = np.empty(6)
    for c in range(count):
        n = directions[c]
        size = 0.0
        length = 0.0
        for side in range(2):
            body, sign = (bodies_a[c], 1.0) if side == 0 else (bodies_b[c], -1.0)
            x, y, z = points[c] - origins[body]
            along[:3] = n
            along[3] = y * n[2] - z * n[1]
            along[4] = z * n[0] - x * n[2]
            along[5] = x * n[1] - y * n[0]
            for k in range(d):
                for i in range(6):
                    rows[c, k] += sign * along[i] * frames[body, i, k]
            reach = np.sqrt(x * x + y * y + z * z) + np.sqrt((points[c] ** 2).sum())
            size += np.sqrt((frames[body, :3] ** 2).sum()) + reach * np.sqrt(
                (frames[body, 3:] ** 2).sum()
            )
        for k in range(d):
            length += rows[c, k] ** 2
        if np.sqrt(length) <= ROW_NOISE * size:
            rows[c] = 0.0
    return rows


def tangent_rows(system: System, q: Floats, found: ContactRows) -> tuple[Floats, Floats]:
    """Return unit tangents t (c, s, 3) of the contacts and their rows tᵀ(J_a − J_b) (c, s, d).

    In the plane s = 1 and t = z × n; in space s = 2 and (n, t_1, t_2) is right-handed.
    """
    normals = found.geometry.normal
    tangents = unit_tangents(normals, getattr(system.scene, "dimensions", 2) == 3)
    _, origins, frames = mechanics_of(system).bodies(q)
    rows = [
        contact_jacobian(tangents[:, k], found.geometry, origins, frames)
        for k in range(tangents.shape[1])
    ]
    return tangents, np.stack(rows, axis=1)


def unit_tangents(normals: Floats, spatial: bool) -> Floats:
    """Return unit tangents (c, s, 3) of normals (c, 3): z × n in the plane, two tangents in
    space."""
    if not spatial:
        return np.cross([0.0, 0.0, 1.0], normals)[:, None]
    # the coordinate axis that is farthest from the normal
    least = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = np.cross(normals, least)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(normals, first)], axis=1)


def lasting(contacts: Any, before: int, geometry: Contacts, kept: Any) -> NDArray[np.bool_]:
    """Return which of the `kept` contacts the step before had, the first `before` of `contacts`."""
    old = {
        *zip(
            contacts.shape_a[:before].tolist(),
            contacts.shape_b[:before].tolist(),
            contacts.feature[:before].tolist(),
            strict=True,
        )
    }
    now = zip(
        geometry.shape_a[kept].tolist(),
        geometry.shape_b[kept].tolist(),
        geometry.feature[kept].tolist(),
        strict=True,
    )
    return np.array([name in old for name in now], np.bool_)


def write_contacts(
    state: Any, found: ContactRows, blow: Floats, pushed: Floats, friction: Floats, dt: float
) -> None:
    """Record in `state` the contacts that touch or carry an impulse.

    blow, pushed : (c,) impulses [N s]; `pushed` is recorded as forces
    friction : (c, 3) tangential impulses in world axes, recorded as forces
    """
    into = state.contacts
    before = int(state.contact_count[0])
    kept = np.flatnonzero(~(found.gap > 0.0) | (blow > 0.0) | (pushed > 0.0))
    state.contact_count[:] = len(kept), before
    if not len(kept):
        return
    into.is_new[: len(kept)] = ~lasting(into, before, found.geometry, kept)
    for name in Contacts._fields:
        getattr(into, name)[: len(kept)] = getattr(found.geometry, name)[kept]
    into.normal_velocity[: len(kept)] = found.gamma[kept]
    into.normal_force[: len(kept)] = pushed[kept] / dt
    into.friction_force[: len(kept)] = friction[kept] / dt
    state.contact_impulse[: len(kept)] = blow[kept]


def write_impact(
    state: Any, system: System, v: Floats, mass: Floats, impulse: Floats, rows: Floats
) -> None:
    """Log the collision impulses of a step as one impact, from v before, mass matrix, impulse (d,)
    and rows (c, d)."""
    log = state.impacts
    log.logged[0] = 0
    if not len(rows):
        return
    change = np.linalg.solve(mass, impulse)
    log.group[0] = max(system.tool_tree, 0)
    log.rows[0] = len(rows)
    log.rank[0] = np.linalg.matrix_rank(rows)
    log.scale[0] = 1.0
    log.clamp[0] = 1.0
    log.v_minus[0] = v
    log.v_plus[0] = v + change
    log.impulse[0] = impulse
    log.energy_lost[0] = -float((v + 0.5 * change) @ impulse)
    log.logged[0] = 1
