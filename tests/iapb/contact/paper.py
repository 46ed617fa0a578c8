"""The paper in numpy, planar and spatial: contact set, impacts, friction, forces.

Each function is the definition, written for reading.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.mechanics.mechanism import Mechanism
from iapb.scene import Scene
from iapb.scene.model import scene_kind
from iapb.system import System

Floats = NDArray[np.float64]
# cosine of the normals of one surface; overlap [m] that still counts as touching
ALIGNED = 0.85
TOUCHING = 1e-12


def scene_of(bodies: list[dict[str, Any]], walls: list[dict[str, Any]], **values: Any) -> Scene:
    """Return the scene of these bodies and walls; 1 kHz and 0.1 s unless told; in space if a body
    is a free flyer."""
    space = {"dimensions": 3} if any(body["joint"] == "free_flyer" for body in bodies) else {}
    given = (
        {"name": "made", "rate": 1000.0, "duration": 0.1, "bodies": bodies, "walls": walls}
        | space
        | values
    )
    return scene_kind(given).model_validate(given)


def in_space(scene: Scene) -> bool:
    """Whether bodies of the scene turn about three axes."""
    return hasattr(scene.bodies[0], "rpy")


# --- the law of impacts
# ----------------------------------------------------------------------------------------------


def impact(M: Floats, J: Floats, v: Floats, e: float) -> tuple[Floats, Floats]:
    """(20)-(21): v⁺ and the impulses of least norm."""
    size = np.linalg.norm(J, axis=1)
    A = J / np.where(size > 0.0, size, 1.0)[:, None]
    momentum = (
        -(1.0 + e)
        * A.T
        @ np.linalg.pinv(A @ np.linalg.solve(M, A.T), rcond=1e-12, hermitian=True)
        @ A
        @ v
    )
    return v + np.linalg.solve(M, momentum), np.linalg.pinv(J.T, rcond=1e-10) @ momentum


def breach_of_coulomb(T: Floats, p_t: Floats, limit: Floats, v_plus: Floats) -> float:
    """Largest speed by which T_i v⁺ is not what Coulomb's law leaves: 0 within the limit, against
    p_t on it."""
    worst = 0.0
    for rows, own, most in zip(T, p_t, limit, strict=True):
        w = rows @ v_plus
        length = float(np.linalg.norm(own))
        slides = length >= most * (1.0 - 1e-7) and length > 0.0
        worst = max(
            worst, float(np.linalg.norm(w + slides * np.linalg.norm(w) * own / max(length, 1e-300)))
        )
    return worst


# --- the contact set of a step (section III)
# -------------------------------------------------------------------------


class Contact(NamedTuple):
    """A contact of a step; `name`: its two shapes and its feature."""

    name: tuple[int, int, int]
    bodies: tuple[int, int]
    point: Floats
    normal: Floats
    gap: float


def contacts_of(system: System, q: Floats) -> list[Contact]:
    """Touching shapes, clustered."""
    found = system.contacts_at(q)
    columns = zip(
        found.shape_a, found.shape_b, found.feature, found.body_a, found.body_b, strict=True
    )
    touching = [
        Contact(
            (int(a), int(b), int(f)),
            (int(i), int(j)),
            found.point[k],
            found.normal[k],
            found.gap[k],
        )
        for k, (a, b, f, i, j) in enumerate(columns)
    ]
    return clustered(touching, system.scene.contact.cluster_distance)


def one_surface(c: Contact, d: Contact) -> bool:
    """The same two bodies, in either order, and normals at most 31.8 degrees apart."""
    aligned = float(c.normal @ d.normal)
    return (
        aligned >= ALIGNED
        if c.bodies == d.bodies
        else c.bodies == d.bodies[::-1] and -aligned >= ALIGNED
    )


def clustered(contacts: list[Contact], distance: float) -> list[Contact]:
    """Deepest first, what is nearer than the distance to a kept one of its surface goes; the order
    stays."""
    kept: list[Contact] = []
    for c in sorted(contacts, key=lambda c: c.gap):
        if not any(
            one_surface(c, d) and np.linalg.norm(c.point - d.point) < distance for d in kept
        ):
            kept.append(c)
    return [c for c in contacts if any(c is d for d in kept)]


def is_new(c: Contact, before: list[Contact], distance: float) -> bool:
    """No contact that overlapped in the step before has its name, or its surface and a place within
    the distance."""

    def same(d: Contact) -> bool:
        near = distance > 0.0 and one_surface(c, d)
        return d.name == c.name or near and np.linalg.norm(c.point - d.point) <= distance

    return not any(d.gap < -TOUCHING and same(d) for d in before)


def tree_of(mechanism: Mechanism, body: int) -> int:
    """The tree of a body that can move, else −1."""
    tree = -1 if body < 0 else int(mechanism.tree_of_body[body])
    return tree if tree >= 0 and mechanism.tree_dofs[tree][1] > mechanism.tree_dofs[tree][0] else -1


def linked(mechanism: Mechanism, contacts: list[Contact]) -> Any:
    """For each tree the first of those that the contacts connect it to; the static world connects
    nothing."""
    group = np.arange(len(mechanism.tree_dofs))
    for c in contacts:
        a, b = (tree_of(mechanism, body) for body in c.bodies)
        if a >= 0 and b >= 0:
            group[(group == group[a]) | (group == group[b])] = min(group[a], group[b])
    return group


def own_values(scene: Scene, c: Contact) -> tuple[float, float]:
    """(e, μ) of a contact: the smaller e, the geometric mean of μ; what only one gives counts, else
    the scene's."""
    owners = [body for body in scene.bodies for _ in body.shapes] + list(scene.walls)
    e, mu = (
        [value for k in c.name[:2] if (value := getattr(owners[k], field)) is not None]
        for field in ("restitution", "friction")
    )
    return (
        min(e, default=scene.contact.restitution),
        float(np.prod(mu)) ** (1.0 / len(mu)) if mu else scene.contact.friction,
    )


def tangents_of(n: Floats, space: bool) -> Floats:
    """Unit tangents: one in the plane, two in space (any two: Coulomb's disc is round)."""
    return np.linalg.svd(n[None])[2][1:] if space else np.array([[-n[1], n[0], 0.0]])


def relative_jacobian(mechanism: Mechanism, q: Floats, c: Contact) -> Floats:
    """J_a − J_b (3, d) of (12) at the contact's point."""
    a, b = c.bodies
    J = mechanism.point_jacobian(q, a, c.point)
    return J - mechanism.point_jacobian(q, b, c.point) if b >= 0 else J


def resting(scene: Scene, c: Contact, J: Floats, v: Floats) -> tuple[float, Floats]:
    """F_n of (5) and the friction force (6) on a at a contact."""
    given = scene.contact
    relative = J @ v
    speed = float(c.normal @ relative)
    force = -given.stiffness * c.gap - given.damping * speed
    force = max(force, 0.0) if given.penalty == "clamped" else force
    slip = relative - speed * c.normal
    size = max(float(np.linalg.norm(slip)), given.friction_velocity)
    return force, -own_values(scene, c)[1] * max(force, 0.0) * slip / size
