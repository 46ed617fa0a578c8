"""The paper in numpy, planar and spatial: contact geometry, contact set, impacts, friction, forces, one step.

Each function is the definition, written for reading; none calls a kernel. Contacts are `Touch`es, from b into a.
"""

from __future__ import annotations

from itertools import combinations, product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from iapb.mechanics.mechanism import Mechanism
from iapb.scene import Scene
from iapb.scene.model import scene_kind
from iapb.system import System

Floats = NDArray[np.float64]
ALIGNED, TOUCHING = 0.85, 1e-12  # cosine of the normals of one surface; overlap [m] that still counts as touching


def scene_of(bodies: list[dict[str, Any]], walls: list[dict[str, Any]], **values: Any) -> Scene:
    """Return the scene of these bodies and walls; 1 kHz and 0.1 s unless told; in space if a body is a free flyer."""
    space = {"dimensions": 3} if any(body["joint"] == "free_flyer" for body in bodies) else {}
    given = {"name": "made", "rate": 1000.0, "duration": 0.1, "bodies": bodies, "walls": walls} | space | values
    return scene_kind(given).model_validate(given)


def in_space(scene: Scene) -> bool:
    """Whether bodies of the scene turn about three axes."""
    return hasattr(scene.bodies[0], "rpy")


# --- geometry ------------------------------------------------------------------------------------------------------


class Touch(NamedTuple):
    """A contact: point midway between the surfaces, unit normal from b into a, gap (negative = overlap)."""

    point: Floats
    normal: Floats
    gap: float


class Solid(NamedTuple):
    """A shape in the world: half (point, normal), ball (centre, radius), polygon (corners CCW), box (axes, halves)."""

    kind: str
    body: int
    center: Floats
    radius: float = 0.0
    normal: Floats = np.zeros(0)
    corners: Floats = np.zeros(0)
    axes: Floats = np.zeros(0)
    half: Floats = np.zeros(0)


def turned(angles: Any) -> Floats:
    """Rotation by an angle in the plane, or by roll, pitch and yaw in space."""
    if np.ndim(angles) == 0:
        return np.array([[np.cos(angles), -np.sin(angles)], [np.sin(angles), np.cos(angles)]])
    R = np.eye(3)
    for axis, angle in enumerate(angles):
        turn, (i, j) = np.eye(3), ((1, 2), (2, 0), (0, 1))[axis]
        turn[np.ix_([i, j], [i, j])] = turned(angle)
        R = turn @ R
    return R


def solids(scene: Scene, mechanism: Mechanism, q: Floats) -> list[Solid]:
    """Every shape of the scene at q, bodies first."""
    frames, places = mechanism.placements(q)
    n = 3 if in_space(scene) else 2
    found = [_solid(shape, k, frames[k][:n, :n], places[k][:n])
             for k, body in enumerate(scene.bodies) for shape in body.shapes]
    return found + [_solid(wall, -1, np.eye(n), np.zeros(n)) for wall in scene.walls]


def _solid(shape: Any, body: int, R: Floats, p: Floats) -> Solid:
    if shape.kind.startswith("half"):
        n = np.array(shape.normal)
        return Solid("half", body, np.array(shape.point), normal=n / np.linalg.norm(n))
    center = p + R @ np.array(shape.center)
    if shape.kind in ("circle", "sphere"):
        return Solid("ball", body, center, shape.radius)
    axes = R @ turned(shape.angle if len(p) == 2 else shape.rpy)
    if len(p) == 3:
        return Solid("box", body, center, axes=axes, half=0.5 * np.array(shape.size))
    local = np.array(shape.vertices if shape.kind == "polygon" else
                     [(x * shape.size[0] / 2, y * shape.size[1] / 2) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    return Solid("polygon", body, center, corners=center + local @ axes.T)


def corners_of(a: Solid) -> Floats:
    """The corners of a polygon or box, or the centre of a ball."""
    if a.kind == "box":
        return a.center + np.array(list(product((-1, 1), repeat=3))) * a.half @ a.axes.T
    return a.corners if a.kind == "polygon" else a.center[None]


def touches(a: Solid, b: Solid) -> list[Touch]:
    """All contacts of a pair, whatever their gap; b is the half-plane or half-space if there is one."""
    if b.kind == "half":
        gaps = (corners_of(a) - b.center) @ b.normal - a.radius
        return [Touch(x - (a.radius + gap / 2) * b.normal, b.normal, gap)
                for x, gap in zip(corners_of(a), gaps, strict=True)]
    if a.kind == "ball":
        normal, distance = _out_of(b, a.center)
        gap = distance - a.radius
        return [Touch(a.center - (a.radius + gap / 2) * normal, normal, gap)]
    if b.kind == "ball":
        return flipped(touches(b, a))
    return polygons(a, b) if a.kind == "polygon" else boxes(a, b)


def flipped(found: list[Touch]) -> list[Touch]:
    """The same contacts with both sides exchanged."""
    return [Touch(point, -normal, gap) for point, normal, gap in found]


def _out_of(b: Solid, x: Floats) -> tuple[Floats, float]:
    """Direction from the surface of b to x and the distance, negative inside."""
    if b.kind == "ball":
        apart = x - b.center
        distance = float(np.linalg.norm(apart))
        return (apart / distance if distance else -np.eye(len(x))[-1]), distance - b.radius
    if b.kind == "box":
        local = b.axes.T @ (x - b.center)
        beyond = np.abs(local) - b.half
        if (beyond <= 0.0).all():
            k = int(np.argmax(beyond))
            return np.copysign(1.0, local[k]) * b.axes[:, k], float(beyond[k])
        apart = b.axes @ (local - np.clip(local, -b.half, b.half))
    else:
        along, normals, length = edges_of(b.corners)
        heights = np.sum((x - b.corners) * normals, axis=1)
        if (k := int(np.argmax(heights))) >= 0 and heights[k] <= 0.0:
            return normals[k], float(heights[k])
        share = np.clip(np.sum((x - b.corners) * along, axis=1), 0.0, length)
        apart = min((x - b.corners - share[:, None] * along), key=lambda arm: float(arm @ arm))
    distance = float(np.linalg.norm(apart))
    return apart / distance, distance


def edges_of(corners: Floats) -> tuple[Floats, Floats, Floats]:
    """Direction, outward normal and length of each edge."""
    along = np.roll(corners, -1, axis=0) - corners
    length = np.linalg.norm(along, axis=1)
    direction = along / length[:, None]
    return direction, np.column_stack([direction[:, 1], -direction[:, 0]]), length


def polygons(a: Solid, b: Solid) -> list[Touch]:
    """The ends of the incident edge over the reference edge, or the closest corners if the polygons are apart there."""
    def separations(ref: Floats, other: Floats) -> Floats:
        return np.array([((other - start) @ n).min() for start, n in zip(ref, edges_of(ref)[1], strict=True)])

    of_a, of_b = separations(a.corners, b.corners), separations(b.corners, a.corners)
    ref, other, sign = (b.corners, a.corners, 1.0) if of_b.max() >= of_a.max() else (a.corners, b.corners, -1.0)
    best = max(of_a.max(), of_b.max())
    directions, normals, lengths = edges_of(ref)
    edge = int(np.argmax(of_b if sign > 0.0 else of_a))
    u, n, length = directions[edge], normals[edge], lengths[edge]
    incident = int(np.argmin(edges_of(other)[1] @ n))
    ends = np.array([other[incident], other[(incident + 1) % len(other)]]) - ref[edge]
    s, h = ends @ u, ends @ n
    inside = np.clip(s, 0.0, length)
    heights = [h[k] if s[k] == inside[k] else np.interp(inside[k], s[::-1], h[::-1]) for k in range(2)]
    if s[1] <= length and s[0] >= 0.0 and min(heights) - best <= 1e-10:
        return [Touch(ref[edge] + place * u + high / 2 * n, sign * n, high)
                for place, high in zip(inside, heights, strict=True)]
    apart = other[None] - ref[:, None]
    i, j = np.unravel_index(np.argmin(np.linalg.norm(apart, axis=2)), apart.shape[:2])
    gap = float(np.linalg.norm(apart[i, j]))
    return [Touch((ref[i] + other[j]) / 2, sign * apart[i, j] / gap, gap)]


def boxes(a: Solid, b: Solid) -> list[Touch]:
    """Separating axes: edge on edge if it separates clearly more, else the clipped face, four points of it at most."""
    apart = a.center - b.center

    def separation(n: Floats) -> float:
        return float(abs(apart @ n) - a.half @ np.abs(a.axes.T @ n) - b.half @ np.abs(b.axes.T @ n))

    size = a.half.sum() + b.half.sum()
    of_a, of_b = ([separation(n) for n in solid.axes.T] for solid in (a, b))
    most, i = max(of_a), int(np.argmax(of_a))
    k = int(np.argmax(of_b))
    lead = 1e-4 * size if abs(a.axes[:, i] @ b.axes[:, k]) > 0.9999 else 0.0
    by_a, best = of_b[k] <= most + lead, max(most, of_b[k])
    pairs = [(separation(n / np.linalg.norm(n)), x, y) for x, y in product(range(3), repeat=2)
             if np.linalg.norm(n := np.cross(a.axes[:, x], b.axes[:, y])) > 1e-6]
    edge, x, y = max(pairs) if pairs else (-np.inf, 0, 0)
    if edge > best + 0.05 * abs(best) + 1e-12 * size:
        n = np.cross(a.axes[:, x], b.axes[:, y])
        n *= np.copysign(1.0, n @ apart) / np.linalg.norm(n)
        low, high = -np.sign(a.axes.T @ n) * a.half, np.sign(b.axes.T @ n) * b.half
        low[x] = high[y] = 0.0
        start, end, one, two = a.center + a.axes @ low, b.center + b.axes @ high, a.axes[:, x], b.axes[:, y]
        s, t = np.linalg.lstsq(np.column_stack([one, -two]), end - start)[0]
        s, t = np.clip(s, -a.half[x], a.half[x]), np.clip(t, -b.half[y], b.half[y])
        return [Touch((start + s * one + end + t * two) / 2, n, edge)]
    return faces(a, b, i, most) if by_a else flipped(faces(b, a, k, of_b[k]))


def faces(a: Solid, b: Solid, k: int, separation: float) -> list[Touch]:
    """The corners of b's most opposed face clipped to the sides of a's face k; of none, b's lowest corner."""
    m = a.axes[:, k] * np.copysign(1.0, (b.center - a.center) @ a.axes[:, k])
    j = int(np.argmax(np.abs(b.axes.T @ m)))
    u, v = ((b.half * b.axes)[:, (j + i) % 3] for i in (1, 2))
    middle = b.center - np.sign(b.axes[:, j] @ m) * b.half[j] * b.axes[:, j]
    whole = polygon = np.array([middle + u + v, middle - u + v, middle - u - v, middle + u - v])
    sides = [(k + i) % 3 for i in (1, 2)]
    for axis, sign in product(sides, (-1.0, 1.0)):
        polygon = _clip(polygon, sign * a.axes[:, axis], a.half[axis] + sign * a.center @ a.axes[:, axis])
    height = (polygon - a.center) @ m - a.half[k]
    if len(polygon) == 0:
        local = a.axes.T @ (whole[np.argmin(whole @ m)] - a.center)
        local[sides] = np.clip(local[sides], -a.half[sides], a.half[sides])
        local[k] = (a.half[k] + separation / 2) * np.sign(m @ a.axes[:, k])
        return [Touch(a.center + a.axes @ local, -m, separation)]
    return [Touch(x - h / 2 * m, -m, h) for x, h in zip(polygon, height, strict=True)]


def _clip(polygon: Floats, normal: Floats, limit: float) -> Floats:
    """Sutherland and Hodgman: what of a polygon (n, 3) lies on this side of a plane, n·x <= limit."""
    kept: list[Floats] = []
    for x, y in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        over_x, over_y = x @ normal - limit, y @ normal - limit
        kept += [x] if over_x <= 0.0 else []
        kept += [x + (y - x) * over_x / (over_x - over_y)] if over_x * over_y < 0.0 else []
    return np.array(kept).reshape(-1, 3)


def widest(found: list[Touch], m: Floats) -> list[Touch]:
    """Of more than four points of a face: the deepest, the farthest from it, and the widest to either side."""
    if len(found) <= 4:
        return found
    points = np.array([touch.point for touch in found])
    first = int(np.argmin([touch.gap for touch in found]))
    second = int(np.argmax(np.linalg.norm(points - points[first], axis=1)))
    beside = (points - points[first]) @ np.cross(m, points[second] - points[first])
    left = [k for k in range(len(found)) if k not in (first, second)]
    third = max(left, key=beside.__getitem__)
    left.remove(third)
    return [found[k] for k in (first, second, third, min(left, key=beside.__getitem__))]


def contacts_between(shapes: list[Solid], margin: float) -> dict[tuple[int, int], list[Touch]]:
    """Contacts of all pairs of shapes (a, b): a moves; of two moving bodies a has the smaller number."""
    found = {}
    for i, j in combinations(range(len(shapes)), 2):
        a, b = (j, i) if shapes[i].body < 0 or 0 <= shapes[j].body < shapes[i].body else (i, j)
        if shapes[a].body < 0 or shapes[a].body == shapes[b].body:
            continue
        here = [touch for touch in touches(shapes[a], shapes[b]) if touch.gap <= margin]
        if shapes[a].kind == shapes[b].kind == "box" and here:
            here = widest(here, here[0].normal)
        if here:
            found[a, b] = here
    return found


# --- the law of impacts ----------------------------------------------------------------------------------------------


def impact(M: Floats, J: Floats, v: Floats, e: float) -> tuple[Floats, Floats]:
    """(20)-(21): v⁺ and the impulses of least norm."""
    size = np.linalg.norm(J, axis=1)
    A = J / np.where(size > 0.0, size, 1.0)[:, None]
    momentum = -(1.0 + e) * A.T @ np.linalg.pinv(A @ np.linalg.solve(M, A.T), rcond=1e-12, hermitian=True) @ A @ v
    return v + np.linalg.solve(M, momentum), np.linalg.pinv(J.T, rcond=1e-10) @ momentum


def poisson(M: Floats, J: Floats, v: Floats, e: Floats) -> tuple[Floats, Floats]:
    """Poisson's law by two LCPs: v⁺ and the impulses, unique where the rows are independent."""
    L = np.linalg.cholesky(M)
    A, u = np.linalg.solve(L, J.T), L.T @ v
    p = nnls(A, -u)[0] * (1.0 + e)
    p = p + nnls(A, -(u + A @ p))[0]
    return v + np.linalg.solve(M, J.T @ p), p


def breach_of_coulomb(T: Floats, p_t: Floats, limit: Floats, v_plus: Floats) -> float:
    """Largest speed by which T_i v⁺ is not what Coulomb's law leaves: 0 within the limit, against p_t on it."""
    worst = 0.0
    for rows, own, most in zip(T, p_t, limit, strict=True):
        w, length = rows @ v_plus, float(np.linalg.norm(own))
        slides = length >= most * (1.0 - 1e-7) and length > 0.0
        worst = max(worst, float(np.linalg.norm(w + slides * np.linalg.norm(w) * own / max(length, 1e-300))))
    return worst


# --- the contact set of a step (section III) -------------------------------------------------------------------------


class Contact(NamedTuple):
    """A contact of a step; `name`: its two shapes and its feature; `stop`: ± arm and dof of the end of a joint."""

    name: tuple[int, int, int]
    bodies: tuple[int, int]
    point: Floats
    normal: Floats
    gap: float
    stop: tuple[float, int] | None = None


def contacts_of(system: System, q: Floats) -> list[Contact]:
    """Touching shapes, clustered, then the ends of the joints' ranges that are passed."""
    found = system.contacts_at(q)
    columns = zip(found.shape_a, found.shape_b, found.feature, found.body_a, found.body_b, strict=True)
    touching = [Contact((int(a), int(b), int(f)), (int(i), int(j)), found.point[k], found.normal[k], found.gap[k])
                for k, (a, b, f, i, j) in enumerate(columns)]
    kept = clustered(touching, system.scene.contact.cluster_distance)
    return kept + [stop for stop in stops(system, q) if stop.gap <= 0.0]


def stops(system: System, q: Floats) -> list[Contact]:
    """Both ends of each range: gap = ± r (q − bound), r the radius of gyration of all that a revolute joint carries."""
    m, found = system.mechanism, []
    names = ["world", *(body.name for body in system.scene.bodies)]
    parents = [names.index(body.parent) - 1 for body in system.scene.bodies]
    for b, body in enumerate(system.scene.bodies):
        if body.joint_limits is None:
            continue
        dof, carried = int(m.arrays.v_start[b]), 0.0
        for other, each in enumerate(system.scene.bodies):
            ancestor = other
            while ancestor >= 0 and ancestor != b:
                ancestor = parents[ancestor]
            carried += each.mass * (ancestor == b)
        arm = np.sqrt(m.mass_matrix(system.start[0])[dof, dof] / carried) if body.joint == "revolute" else 1.0
        for sign, bound in zip((1.0, -1.0), body.joint_limits, strict=True):
            gap, number = sign * arm * (q[m.arrays.q_start[b]] - bound), 10**6 + len(found)
            nowhere = np.zeros(3)  # what counts is the row ± r e_k
            found.append(Contact((number, number, 0), (b, parents[b]), nowhere, nowhere, gap, (sign * arm, dof)))
    return found


def one_surface(c: Contact, d: Contact) -> bool:
    """The same two bodies, in either order, and normals at most 31.8 degrees apart."""
    aligned = float(c.normal @ d.normal)
    return aligned >= ALIGNED if c.bodies == d.bodies else c.bodies == d.bodies[::-1] and -aligned >= ALIGNED


def clustered(contacts: list[Contact], distance: float) -> list[Contact]:
    """Deepest first, what is nearer than the distance to a kept one of its surface goes; the order stays."""
    kept: list[Contact] = []
    for c in sorted(contacts, key=lambda c: c.gap):
        if not any(one_surface(c, d) and np.linalg.norm(c.point - d.point) < distance for d in kept):
            kept.append(c)
    return [c for c in contacts if any(c is d for d in kept)]


def is_new(c: Contact, before: list[Contact], distance: float) -> bool:
    """No contact that overlapped in the step before has its name, or its surface and a place within the distance."""
    def same(d: Contact) -> bool:
        near = distance > 0.0 and c.stop is d.stop is None and one_surface(c, d)
        return d.name == c.name or near and np.linalg.norm(c.point - d.point) <= distance

    return not any(d.gap < -TOUCHING and same(d) for d in before)


def tree_of(mechanism: Mechanism, body: int) -> int:
    """The tree of a body that can move, else −1."""
    tree = -1 if body < 0 else int(mechanism.tree_of_body[body])
    return tree if tree >= 0 and mechanism.tree_dofs[tree][1] > mechanism.tree_dofs[tree][0] else -1


def linked(mechanism: Mechanism, contacts: list[Contact]) -> Any:
    """For each tree the first of those that the contacts connect it to; the static world connects nothing."""
    group = np.arange(len(mechanism.tree_dofs))
    for c in contacts:
        a, b = (tree_of(mechanism, body) for body in c.bodies)
        if a >= 0 and b >= 0:
            group[(group == group[a]) | (group == group[b])] = min(group[a], group[b])
    return group


def own_values(scene: Scene, c: Contact) -> tuple[float, float]:
    """(e, μ) of a contact: the smaller e, the geometric mean of μ; what only one gives counts, else the scene's."""
    if c.stop is not None:
        return scene.contact.restitution, 0.0
    owners = [body for body in scene.bodies for _ in body.shapes] + list(scene.walls)
    e, mu = ([value for k in c.name[:2] if (value := getattr(owners[k], field)) is not None]
             for field in ("restitution", "friction"))
    return (min(e, default=scene.contact.restitution),
            float(np.prod(mu)) ** (1.0 / len(mu)) if mu else scene.contact.friction)


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
    given, relative = scene.contact, J @ v
    speed = float(c.normal @ relative)
    force = -given.stiffness * c.gap - given.damping * speed
    force = max(force, 0.0) if given.penalty == "clamped" else force
    slip = relative - speed * c.normal
    size = max(float(np.linalg.norm(slip)), given.friction_velocity)
    return force, -own_values(scene, c)[1] * max(force, 0.0) * slip / size
