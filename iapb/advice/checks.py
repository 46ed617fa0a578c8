"""Check a scene before its run for settings that make the result meaningless. Each warning says what value to set.

The explicit forces of the paper have limits that implicit contact has not. A lasting contact oscillates on its spring
and damper (5). Let m = 1/(J M⁻¹ Jᵀ) be its effective mass, k = K Δt²/m and
b = B Δt/m. A step of the law's integrator maps (gap, velocity) linearly. The oscillation grows if that map has an
eigenvalue of modulus above 1; for semi-implicit Euler this means k + 2 b > 4. Contacts that share a body oscillate
together: 1/m is then the largest eigenvalue of J M⁻¹ Jᵀ over all of them. A new contact can start at a depth of up to
v Δt, and its spring then returns up to k times the kinetic energy of the approach, so k must not exceed 1 either.
`contact.auto` chooses values well below both limits. `iapb.advice.distrust` checks the run itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.contact.geometry import (
    BOX,
    ENDLESS,
    POLYGON,
    ContactBuffer,
    Shapes,
    contact_capacity,
    frame_along,
    make_contact_buffer,
)
from iapb.contact.kernels.narrow_phase import detect
from iapb.contact.laws import FRICTION, IMPACT_FRICTION, IMPULSES, PENALTY, ContactLaw, ImpulseAugmented
from iapb.mechanics.integrators import INTEGRATORS, Integrator
from iapb.mechanics.mechanism import Mechanism
from iapb.names import in_metres
from iapb.scene import Scene, SpatialScene
from iapb.scene.mechanism import (
    frictions_of,
    mechanism_of,
    pairs_of,
    restitution_by_pair,
    shapes_of,
    start_of,
    stops_of,
)
from iapb.scene.parts import LARGEST_NUMBER

Floats = NDArray[np.float64]

NEAR = 0.02  # of the smaller shape: contacts closer than this at the start count as touching
DEEP = 0.02  # of the smaller shape: a larger overlap at the start is more than a resting depth
SHIFTED = 0.05  # of the smaller shape: distance by which friction in an impact may displace a body
SAG = 0.1  # of the smaller shape, or of a joint's range: largest static sag of a rigid contact
THROWN = 1.0  # largest k = K Δt²/m at which a new contact returns no more energy than it absorbs
ROUNDED = 1e-9  # relative rounding error of a limit
MANY_TURNS = 45  # a joint may turn often, so only multiples of this many radians count as degrees
MANY_PAIRS = 2000  # with more pairs, only those closer than the largest body are checked


class Caution(NamedTuple):
    """A warning about a scene: its kind, the things that it concerns, and a sentence with the value to set."""

    kind: str
    where: str
    text: str

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class StepLimits:
    """Limits of stiffness, damping and rate at the most critical contacts.

    mass : smallest effective mass [kg]; contacts : number of contacts that oscillate together; where : their bodies
    stiffness : largest stable K at the scene's damping [N/m]; damping : largest stable B at its stiffness [N s/m]
    rate : smallest rate [Hz] at which the scene's stiffness and damping are stable
    """

    where: str
    contacts: int
    mass: float
    stiffness: float
    damping: float
    rate: float


class Start:
    """A scene at its start: its closest contacts with their rows, effective masses and loads.

    Parameters
    ----------
    scene : Scene
    mechanism, shapes, pairs : of the scene, if the caller has them already; else they are made here.
    """

    def __init__(self, scene: Scene, mechanism: Mechanism | None = None, shapes: Shapes | None = None,
                 pairs: NDArray[np.int32] | None = None) -> None:
        self.scene, self.dt, self.spatial = scene, 1.0 / scene.rate, isinstance(scene, SpatialScene)
        self.mechanism = mechanism_of(scene) if mechanism is None else mechanism
        self.shapes = shapes_of(scene) if shapes is None else shapes
        self.pairs = pairs_of(scene, self.shapes) if pairs is None else pairs
        self.q, self.v = start_of(scene)
        self.gravity = np.array([*(scene.gravity or ()), 0.0, 0.0, 0.0])[:3]
        self.size = np.array([_smallest_extent(self.shapes, i) for i in range(len(self.shapes.kind))])
        self.labels = [body.name for body in scene.bodies for _ in body.shapes] + [wall.name for wall in scene.walls]
        self.kind, self.radius = self.shapes.kind, self.shapes.radius
        self.found = self._contacts()
        self.rows = np.array([self._row(i, self.found.normal[i]) for i in range(len(self.found.gap))]).reshape(
            -1, self.mechanism.nv)
        if any(body.joint_limits for body in scene.bodies):
            self._add_stops()
        classes, table = frictions_of(scene)
        self.friction = table[classes[self.found.shape_a], classes[self.found.shape_b]]
        self.thickness = np.minimum(self.size[self.found.shape_a], self.size[self.found.shape_b])

    def _contacts(self) -> ContactBuffer:
        """Return the contacts between the closest features of each pair, near or far."""
        finite = self.size[np.isfinite(self.size)]
        few = len(self.pairs) <= MANY_PAIRS
        buffer, count = make_contact_buffer(_room(self.shapes, self.pairs, few)), 0
        if len(self.pairs):
            margin = math.inf if few else float(finite.max(initial=0.0))
            count = detect(self.shapes, self.pairs, *self.mechanism.placements(self.q), margin, buffer)
        columns: list[Any] = [column[: max(int(count), 0)] for column in buffer]
        return ContactBuffer(*columns)

    def _add_stops(self) -> None:
        """Append rows and gaps of the joint limits; a stop has one number in place of its two shapes."""
        stops, arrays, first = stops_of(self.scene, self.mechanism), self.mechanism.arrays, len(self.shapes.kind)
        names, ranges = [body.name for body in self.scene.bodies], [body.joint_limits for body in self.scene.bodies]
        extra, rows = make_contact_buffer(len(stops)), np.zeros((len(stops), self.mechanism.nv))
        for i, stop in enumerate(stops):
            low, high = ranges[stop.body] or (0.0, 0.0)
            extra.gap[i] = stop.arm * stop.sign * (self.q[arrays.q_start[stop.body]] - stop.bound)
            rows[i, arrays.v_start[stop.body]] = stop.arm * stop.sign
            extra.shape_a[i] = extra.shape_b[i] = first + i
            extra.body_a[i], extra.body_b[i] = stop.body, stop.parent
            self.labels.append(f"the {'lower' if stop.sign > 0.0 else 'upper'} limit of {names[stop.body]}")
            self.size = np.append(self.size, stop.arm * (high - low))
        places = self.mechanism.placements(self.q)[1]
        extra.point[:] = places[extra.body_a]
        columns: list[Any] = [np.concatenate([self.found[k], column]) for k, column in enumerate(extra)]
        self.found, self.rows = ContactBuffer(*columns), np.concatenate([self.rows, rows])
        self.kind = np.append(self.kind, np.full(len(stops), -1, self.kind.dtype))
        self.radius = np.append(self.radius, np.zeros(len(stops)))

    def _row(self, i: int, direction: Floats) -> Floats:
        """Return the Jacobian row (d,) of contact i along a direction."""
        row = np.zeros(self.mechanism.nv)
        for body, sign in ((self.found.body_a[i], 1.0), (self.found.body_b[i], -1.0)):
            if body >= 0:
                row += sign * direction @ self.mechanism.point_jacobian(self.q, int(body), self.found.point[i])
        return row

    @cached_property
    def blocks(self) -> list[tuple[slice, Floats]]:
        """Dofs and inverse mass matrix of each tree."""
        mass = self.mechanism.mass_matrix(self.q)
        ranges = [slice(*dofs) for dofs in self.mechanism.tree_dofs if dofs[1] > dofs[0]]
        return [(part, np.asarray(np.linalg.inv(mass[part, part]), np.float64)) for part in ranges]

    def moved(self, rows: Floats) -> Floats:
        """M⁻¹ Jᵀ (d, c) of rows J (c, d)."""
        out = np.zeros(rows.T.shape)
        for part, inverse in self.blocks:
            out[part] = inverse @ rows.T[part]
        return out

    @cached_property
    def applied(self) -> Floats:
        """Generalized force of gravity and of the hand at the start (d,)."""
        return self._applied_at(self.q)

    def _applied_at(self, q: Floats) -> Floats:
        """Generalized force (d,) at q of gravity and of the hand's force at t = 0."""
        force, hand = -self.mechanism.gravity(q, self.gravity), self.scene.hand
        pushes = hand.forces([0.0])[0] if hand is not None else []
        if hand is not None and any(pushes):
            body = self.mechanism.index(hand.body)
            R, p = self.mechanism.placements(q)
            flat = len(pushes) == 3
            wrench = np.array([*pushes[:2], 0.0, 0.0, 0.0, pushes[2]] if flat else pushes)
            point = p[body] + R[body] @ np.array([*hand.point, 0.0][:3])
            force += wrench[:3] @ self.mechanism.point_jacobian(q, body, point)
            force += wrench[3:] @ self.mechanism.frame_jacobian(q, body)[3:]
        return force

    @cached_property
    def by_pair(self) -> list[NDArray[np.int64]]:
        """Contacts of each pair of shapes, closest first: at most 4 in space and 2 in the plane, as on a flat face."""
        most = 4 if self.spatial else 2
        kept: dict[tuple[int, int], list[int]] = {}
        for i, pair in enumerate(zip(self.found.shape_a.tolist(), self.found.shape_b.tolist(), strict=True)):
            kept.setdefault(pair, []).append(i)
        return [np.array(sorted(rows, key=lambda i: float(self.found.gap[i]))[:most]) for rows in kept.values()]

    @cached_property
    def touching(self) -> list[NDArray[np.int64]]:
        """Contacts that touch or nearly touch at the start, in groups that shared moving trees connect."""
        near = np.flatnonzero(self.found.gap <= NEAR * np.where(np.isfinite(self.thickness), self.thickness, 0.0))
        group: dict[int, int] = {}

        def first(tree: int) -> int:
            while group.setdefault(tree, tree) != tree:
                tree = group[tree]
            return tree

        for i in near.tolist():
            trees = self.trees(i)
            for tree in trees[1:]:
                group[first(tree)] = first(trees[0])
        found: dict[int, list[int]] = {}
        for i in near.tolist():
            found.setdefault(first(self.trees(i)[0]), []).append(i)
        return [np.array(rows) for rows in found.values()]

    def trees(self, i: int) -> list[int]:
        """The trees that contact i touches."""
        bodies = [int(b) for b in (self.found.body_a[i], self.found.body_b[i]) if b >= 0]
        return list(dict.fromkeys(int(self.mechanism.tree_of_body[b]) for b in bodies))

    def is_free(self, tree: int) -> bool:
        """Whether a tree is one free body (planar or free-flyer joint) that the hand does not hold."""
        bodies = [self.scene.bodies[b] for b in np.flatnonzero(self.mechanism.tree_of_body == tree)]
        held = self.scene.hand is not None and any(body.name == self.scene.hand.body for body in bodies)
        return len(bodies) == 1 and bodies[0].joint in ("planar", "free_flyer") and not held

    @cached_property
    def supports(self) -> list[NDArray[np.int64]]:
        """Groups of contacts that carry loads: those that touch, and the first pair that a falling tree hits."""
        touched = {tree for rows in self.touching for i in rows for tree in self.trees(i)}
        pull = self.rows @ self.moved(self.applied[None])[:, 0]
        falls: dict[int, tuple[float, NDArray[np.int64]]] = {}
        for rows in self.by_pair:
            tree, gap = self.trees(rows[0])[0], float(self.found.gap[rows[0]])
            free = np.count_nonzero(self.mechanism.tree_of_body == tree) == 1  # a linkage would change its pose
            flat = len(rows) > 1 or self.radius[self.found.shape_a[rows[0]]] > 0.0  # not on one corner
            if tree in touched or not (free and flat and pull[rows[0]] < 0.0):
                continue
            if gap < falls.get(tree, (math.inf, rows))[0]:
                falls[tree] = gap, rows
        return [*self.touching, *(rows for _, rows in falls.values())]

    @cached_property
    def resting(self) -> Floats:
        """Normal forces (c,) [N] that would hold the start in equilibrium; 0 at contacts that do not touch."""
        force = np.zeros(len(self.found.gap))
        for rows in self.touching:
            force[rows] = self.loads(rows)
        return force

    def names(self, rows: Iterable[int]) -> str:
        """Return the names of the things in contact, such as "box and floor"; of more than two, the first three."""
        shapes = [s for i in rows for s in (int(self.found.shape_a[i]), int(self.found.shape_b[i]))]
        named = list(dict.fromkeys(self.labels[s] for s in shapes))
        return " and ".join(named) if len(named) < 3 else f"{', '.join(named[:3])}{' …' if len(named) > 3 else ''}"

    def mobility(self, rows: Floats) -> float:
        """Largest eigenvalue of J M⁻¹ Jᵀ [1/kg]."""
        return float(np.linalg.eigvalsh(rows @ self.moved(rows))[-1]) if len(rows) else 0.0

    @cached_property
    def critical(self) -> tuple[tuple[float, NDArray[np.int64]], tuple[float, NDArray[np.int64]]]:
        """Largest mobility [1/kg] and its contacts, twice: over touching groups and near pairs, and over near pairs."""
        nobody = (0.0, np.zeros(0, np.int64))
        pairs = [rows for rows in self.by_pair if self.is_near(rows[0])]
        lasting, meeting = ([(self.mobility(self.rows[rows]), rows) for rows in each]
                            for each in ([*self.touching, *pairs], pairs))
        return tuple(max(each, key=lambda one: one[0], default=nobody)  # type: ignore[return-value]
                     for each in (lasting, meeting))

    def is_near(self, i: int) -> bool:
        """Whether the row of contact i is also valid at touch; two boxes in space must be near for that."""
        boxes = self.kind[self.found.shape_a[i]] == BOX and self.kind[self.found.shape_b[i]] == BOX
        return not boxes or bool(self.found.gap[i] <= self.thickness[i])

    def loads(self, rows: NDArray[np.int64]) -> Floats:
        """Return forces p >= 0 (c,) [N] of a group of contacts that balance gravity and the hand: W p = −J M⁻¹ f."""
        J, force = self.rows[rows], np.zeros(len(rows))
        W, wanted = J @ self.moved(J), -J @ self.moved(self.applied[None])[:, 0]
        pushing = np.ones(len(rows), np.bool_)
        for _ in range(len(rows)):
            force[:] = 0.0
            force[pushing] = np.linalg.lstsq(W[np.ix_(pushing, pushing)], wanted[pushing], rcond=1e-12)[0]
            if (force >= 0.0).all():
                break
            pushing &= force > 0.0  # a contact that would pull carries nothing
        return np.clip(force, 0.0, self.total_load)  # wedges and levers can give more, but less in other poses

    @cached_property
    def at_stops(self) -> dict[int, float]:
        """Static forces [N] at the joint limits that do not touch, each with its own joint moved to the limit.

        The force of a stop balances the load of its own joint alone, as if the joints behind it were fixed.
        """
        stops, touching = stops_of(self.scene, self.mechanism), {int(i) for rows in self.touching for i in rows}
        arrays, held = self.mechanism.arrays, {}
        for i, stop in enumerate(stops, len(self.found.gap) - len(stops)):
            there = self.q.copy()
            there[arrays.q_start[stop.body]] = stop.bound
            load = float(self._applied_at(there)[arrays.v_start[stop.body]])
            if i not in touching:
                held[i] = max(-stop.sign * load / stop.arm, 0.0)
        return held

    @cached_property
    def total_load(self) -> float:
        """Sum of all weights and the hand's largest force [N]."""
        hand = self.scene.hand
        pushed = hand.largest_force() if hand is not None else 0.0
        return float(np.linalg.norm(self.gravity)) * sum(body.mass for body in self.scene.bodies) + pushed


def _room(shapes: Shapes, pairs: NDArray[np.int32], few: bool) -> int:
    """Capacity for the contacts of all pairs; with few pairs, for contacts at any distance."""
    if not few:
        return contact_capacity(shapes, pairs)
    corners = np.where(shapes.kind == BOX, 8, np.maximum(shapes.count, 2))
    return int(corners[pairs].sum()) + 32


def _smallest_extent(shapes: Shapes, i: int) -> float:
    """Smallest width of a shape [m]; infinite for half-planes and half-spaces."""
    if shapes.kind[i] in ENDLESS:
        return math.inf
    if shapes.kind[i] == BOX:
        return 2.0 * float(shapes.half_size[i].min())
    if shapes.kind[i] != POLYGON:
        return 2.0 * float(shapes.radius[i])
    corners = shapes.vertices[shapes.first[i] : shapes.first[i] + shapes.count[i]]
    edges = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack([-edges[:, 1], edges[:, 0]]) / np.hypot(edges[:, 0], edges[:, 1])[:, None]
    return float((np.einsum("ei,vi->ev", normals, corners) - np.sum(normals * corners, axis=1)[:, None]).max(1).min())


def holds(integrator: Integrator, k: float, b: float) -> bool:
    """Whether a contact with k = K Δt²/m and b = B Δt/m is stable under the integrator."""
    def step(x: float, v: float) -> tuple[float, float]:
        q, rate = integrator.step(
            lambda q, v, dt: q + dt * v, lambda q, v: -k * q - b * v, np.array([x]), np.array([v]), 1.0)
        return float(q[0]), float(rate[0])

    (a, c), (d, e) = step(1.0, 0.0), step(0.0, 1.0)
    return float(np.abs(np.linalg.eigvals([[a, d], [c, e]])).max()) <= 1.0 + ROUNDED


def _largest(good: Any, high: float) -> float:
    """Return the largest x in (0, high] with good(x), or 0 if there is none; good is true up to some x."""
    if good(high):
        return high
    low = 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if good(middle) else (low, middle)
    return low if low > 1e-9 * high else 0.0


def step_limits(start: Start, integrator: str = "semi_implicit_euler") -> StepLimits | None:
    """Return the limits at the most critical contacts; None if nothing can touch."""
    lasting, meeting = start.critical
    found = [_limits(start, INTEGRATORS[integrator], *one, thrown) for one, thrown in ((lasting, math.inf),
                                                                                      (meeting, THROWN)) if one[0]]
    return min(found, key=lambda one: (one.stiffness, one.damping), default=None)


def _limits(start: Start, method: Integrator, mobility: float, rows: NDArray[np.int64], most: float) -> StepLimits:
    """Return the limits for contacts of one mobility, with k at most `most`."""
    dt, contact = start.dt, start.scene.contact
    k, b = contact.stiffness * mobility * dt**2, contact.damping * mobility * dt
    stiffness = _largest(lambda x: x <= most and holds(method, x, b), 4.0) / (mobility * dt**2)
    damping = _largest(lambda x: holds(method, k, x), 4.0) / (mobility * dt)
    longest = _largest(lambda x: k * x**2 <= most and holds(method, k * x**2, b * x), 1e6) * dt
    rate = 1.0 / longest if longest else math.inf
    return StepLimits(start.names(rows), len(rows), 1.0 / mobility, stiffness, damping, rate)


def check_scene(scene: Scene, law: ContactLaw | None = None) -> tuple[Caution, ...]:
    """Find mistakes that would make a run of this scene meaningless, without running it.

    Parameters
    ----------
    scene : Scene
    law : contact law; default `ImpulseAugmented()`. Fields that the law does not use are not checked.

    Returns
    -------
    tuple of Caution
        Empty if nothing is wrong.
    """
    chosen: Any = ImpulseAugmented() if law is None else law
    chosen = chosen.within(scene) if hasattr(chosen, "within") else chosen
    start = Start(settled(scene)[0])
    uses: frozenset[str] = getattr(chosen, "uses", frozenset())
    found = [*_degrees(scene), *_overlaps(start), *_fast(start)]
    if PENALTY in uses:
        found += _sags(start)
        if scene.contact.forces == "paper":
            found += _too_stiff(start, getattr(chosen, "integrator", "semi_implicit_euler"))
            found += _overdriven_friction(start) if FRICTION in uses else ()
    if IMPULSES in uses and IMPACT_FRICTION not in uses and start.scene.contact.self_collision_rows == "relative":
        found += _slips_through_impacts(start)
    return tuple(found)


def _degrees(scene: Scene) -> Iterator[Caution]:
    """Warn of angles that look like degrees: whole numbers beyond one turn.

    Such numbers are not plausible in radians: a placement needs at most one turn, and an angle copied from the end of
    another run is rarely a whole number. A joint may turn several times, so its start and limits raise a warning only
    if they are multiples of 45 (45 rad are seven turns).
    """
    for path, angle, unit in _angles(scene):
        if abs(angle) > math.tau and angle % unit == 0.0:
            name = "".join(f"[{one}]" if isinstance(one, int) else f".{one}" for one in path)[1:]
            yield Caution("degrees", name, f"{scene.place_of(*path)}{name} = {angle:g} rad looks like degrees: set "
                          f"{math.radians(angle):.6g}, for angles are in radians")


def _angles(scene: Scene) -> Iterator[tuple[tuple[str | int, ...], float, int]]:
    """Yield the path and value [rad] of each angle, and the number whose multiples look like degrees."""
    plain = scene.resolved()
    for part in ("bodies", "walls"):
        for i, one in enumerate(plain[part]):
            shapes = [((part, i, "shapes", k), shape) for k, shape in enumerate(one.get("shapes", ()))]
            for path, placed in [((part, i), one), *shapes]:
                yield from (((*path, "angle"), placed["angle"], 1),) if "angle" in placed else ()
                yield from (((*path, "rpy", k), x, 1) for k, x in enumerate(placed.get("rpy", ())))
    for i, body in enumerate(scene.bodies):
        if body.joint == "planar" and len(body.position) == 3:
            yield ("bodies", i, "position", 2), body.position[2], 1
        if body.joint == "revolute":
            yield from ((("bodies", i, "position", k), x, MANY_TURNS) for k, x in enumerate(body.position))
            limits = body.joint_limits or ()
            yield from ((("bodies", i, "joint_limits", k), x, MANY_TURNS) for k, x in enumerate(limits))


def _overlaps(start: Start) -> Iterator[Caution]:
    """Warn of shapes that start inside each other, behind a wall, or in a gap narrower than the shape."""
    found = start.found
    sides: dict[int, list[int]] = {}
    for rows in start.by_pair:
        i = int(rows[0])
        depth, size = -float(found.gap[i]), float(start.thickness[i])
        if depth <= 0.0 or not _too_deep(start, rows):
            continue
        if found.body_b[i] < 0:
            sides.setdefault(int(found.body_a[i]), []).append(i)
        a, b = start.labels[found.shape_a[i]], start.labels[found.shape_b[i]]
        out = ", ".join(f"{depth * x:.3g}" for x in found.normal[i][: 3 if start.spatial else 2])
        stored = 0.5 * start.scene.contact.stiffness * float(np.sum(np.minimum(found.gap[rows], 0.0) ** 2))
        if start.kind[found.shape_b[i]] in ENDLESS and depth >= size:
            yield Caution("outside", f"{a} and {b}", f"{a} starts behind {b}, {in_metres(depth)} deep: "
                          f"move it by [{out}] m")
        elif float(start.rows[i] @ start.moved(start.rows[i][None])[:, 0]) <= 1e-12 * start.critical[0][0]:
            yield Caution("overlap", f"{a} and {b}", f"{a} starts {in_metres(depth)} inside {b}, and no joint can move "
                          f"it out: move it by [{out}] m, or take the shape or the wall away")
        else:
            yield Caution("overlap", f"{a} and {b}", f"{a} starts {in_metres(depth)} inside {b}, and {stored:.3g} J in "
                          f"the contact's spring throw it out: move it by [{out}] m")
    for rows_of_body in sides.values():
        for n, i in enumerate(rows_of_body):
            against = [j for j in rows_of_body[:n] if float(found.normal[i] @ found.normal[j]) < -0.5]
            for j in against[:1]:
                a, b, c = (start.labels[s] for s in (found.shape_a[i], found.shape_b[j], found.shape_b[i]))
                wide = -float(found.gap[i] + found.gap[j])
                yield Caution("wedged", f"{a}, {b}, {c}", f"{a} stands in a gap between {b} and {c} that is "
                              f"{in_metres(wide)} narrower than it: widen the gap, or make {a} smaller")


def _too_deep(start: Start, rows: NDArray[np.int64]) -> bool:
    """Whether a pair starts deeper than at rest, judged by its depth and by the energy of its springs."""
    gap = np.minimum(start.found.gap[rows], 0.0)
    depth, size, K = -float(gap.min()), float(start.thickness[rows[0]]), start.scene.contact.stiffness
    if depth * K <= 2.0 * float(start.resting[rows].max()):
        return False
    if depth > DEEP * size:
        return True
    moved = start.moved(start.rows[rows])
    mass = 1.0 / max(float(np.max(np.sum(start.rows[rows] * moved.T, axis=1))), 1e-300)
    closing = float(np.abs(start.rows[rows] @ start.v).max())
    weight = float(np.abs(start.rows[rows] @ start.moved(start.applied[None])[:, 0]).max()) * mass
    usual = 0.5 * mass * closing**2 + weight * DEEP * size
    usual = max(usual, 0.5 * mass * size**2)  # moving by its size in a second
    return depth > 1e-6 * size and 0.5 * K * float(np.sum(gap**2)) > usual


def _fast(start: Start) -> Iterator[Caution]:
    """Warn of bodies that move by more than half of a shape in the step of the impact."""
    pull = start.rows @ start.moved(start.applied[None])[:, 0]
    for rows in start.by_pair:
        i = int(rows[0])
        gap, size = max(float(start.found.gap[i]), 0.0), float(start.thickness[i])
        approach, force = -float(start.rows[i] @ start.v), -float(pull[i])
        if approach <= 0.0 and force <= 0.0 or approach**2 + 2.0 * force * gap < 0.0:
            continue
        speed = math.sqrt(approach**2 + 2.0 * force * gap)
        late = 2.0 * gap > (approach + speed) * start.scene.duration
        if late or speed * start.dt <= 0.5 * size:
            continue
        thin, other = (start.labels[s] for s in _thin_first(start, i))
        yield Caution("fast", f"{thin} and {other}", f"{other} meets {thin} at {speed:.3g} m/s, "
                      f"{in_metres(speed * start.dt)} in a step, and the thinner is {in_metres(size)}: it sinks in or "
                      f"passes through; set rate >= {_up(4.0 * speed / size)} Hz")


def _slips_through_impacts(start: Start) -> Iterator[Caution]:
    """Warn of a free body that slides as it lands, if friction in the impact would change its path visibly.

    Only the first contact of each free body counts. Linkages are left out, for their poses change on the way, and so is
    a body that the hand holds. Friction in the impact would reduce the slip by up to Δv = μ (1 + e) v_n. Without it,
    resting friction removes the same slip within Δv/(μ a), where a is the acceleration onto the wall. A body that
    bounces keeps the slip during its flight of 2 e v_n/a.
    """
    pull = start.moved(start.applied[None])[:, 0]
    first: dict[int, tuple[float, int, float, float]] = {}  # tree -> time, contact, approach, acceleration
    for rows in start.by_pair:
        i = int(rows[0])
        gap, approach = max(float(start.found.gap[i]), 0.0), -float(start.rows[i] @ start.v)
        force, trees = -float(start.rows[i] @ pull), start.trees(i)
        square = approach**2 + 2.0 * force * gap
        if not all(start.is_free(tree) for tree in trees) or square < 0.0:
            continue
        speed = math.sqrt(square)
        time = 2.0 * gap / (approach + speed) if approach + speed > 0.0 else 0.0 if gap == 0.0 else math.inf
        for tree in trees:
            first[tree] = min(first.get(tree, (math.inf, i, 0.0, 0.0)), (time, i, speed, force))
    found = [(_shift(start, *one, pull), one) for one in first.values() if one[0] < start.scene.duration]
    (share, change, slip), (_, i, speed, _) = max(found, default=((0.0, 0.0, 0.0), (0.0, 0, 0.0, 0.0)))
    if share > SHIFTED:
        both = start.names([i])
        yield Caution("impact friction", both, f"{both} meet at {speed:.3g} m/s and slide at {slip:.3g} m/s, and "
                      f"impacts of this law have no friction, which would take {change:.3g} m/s of it: use the world "
                      "IAPB-friction or ideal-friction")


def _shift(start: Start, time: float, i: int, speed: float, force: float, pull: Floats) -> tuple[float, float, float]:
    """Return how friction in the impact at contact i changes path (over the thinner size) and slip, and the slip."""
    mu, pair = float(start.friction[i]), np.array([[start.found.shape_a[i], start.found.shape_b[i]]])
    e = float(restitution_by_pair(start.scene, pair)[0])
    slip = float(np.linalg.norm([start._row(i, t) @ (start.v + time * pull) for t in _tangents(start, i)]))
    change, left = min(mu * (1.0 + e) * speed, slip), start.scene.duration - time
    if change == 0.0:
        return 0.0, 0.0, slip
    lasts = left if force <= 0.0 else min(left, max(2.0 * e * speed / force, 0.5 * change / (mu * force)))
    return change * lasts / float(start.thickness[i]), change, slip


def _thin_first(start: Start, i: int) -> tuple[int, int]:
    a, b = int(start.found.shape_a[i]), int(start.found.shape_b[i])
    return (a, b) if start.size[a] < start.size[b] else (b, a)


def _too_stiff(start: Start, integrator: str) -> Iterator[Caution]:
    """Warn of stiffness or damping beyond the stable limits of the step."""
    limits, contact = step_limits(start, integrator), start.scene.contact
    if limits is None or (contact.stiffness <= limits.stiffness and contact.damping <= limits.damping):
        return
    many = f"{limits.contacts} contact{'s' * (limits.contacts > 1)}"
    who = f"{limits.where} ({many}, effective mass {limits.mass:.3g} kg)"
    remedy = f"or rate >= {_up(limits.rate)} Hz" if math.isfinite(limits.rate) else "or another integrator"
    by_damping = limits.damping > 0.0 and contact.damping * limits.stiffness > contact.stiffness * limits.damping
    if limits.stiffness == 0.0 or by_damping:
        yield Caution("damping", limits.where, f"contact.damping = {contact.damping:g} N s/m is more than a step of "
                      f"{start.scene.rate:g} Hz can hold at {who}: set contact.damping <= "
                      f"{_down(limits.damping)}, {remedy}")
    else:
        yield Caution("stiffness", limits.where, f"contact.stiffness = {contact.stiffness:g} N/m is more than a step "
                      f"of {start.scene.rate:g} Hz can hold at {who}: set contact.stiffness <= "
                      f"{_down(limits.stiffness)}, {remedy}")


def _sags(start: Start) -> Iterator[Caution]:
    """Warn of static loads that sag by more than a tenth: of a shape at a contact, of the range at a joint limit."""
    K = start.scene.contact.stiffness
    if K == 0.0:
        return
    worst: tuple[float, int] = (SAG, -1)
    for rows in start.supports:
        shares = start.loads(rows) / (K * start.thickness[rows])
        worst = max(worst, (float(shares.max()), int(rows[shares.argmax()])))
    share, i = max([worst, *((force / (K * start.thickness[i]), i) for i, force in start.at_stops.items())])
    if i < 0:
        return
    both, remedy = start.names([i]), f"set contact.stiffness >= {_up(K * share / SAG)}"
    if start.found.shape_a[i] == start.found.shape_b[i]:
        yield Caution("sag", both, f"at rest the load on {both} holds its joint beyond it by {share:.3g} times its "
                      f"range: {remedy}")
    else:
        yield Caution("sag", both, f"at rest {both} overlap by {in_metres(share * start.thickness[i])}, "
                      f"{share:.0%} of the thinner: {remedy}")


def _overdriven_friction(start: Start) -> Iterator[Caution]:
    """Warn where regularised friction (6), an explicit damper μN/v_thr, reverses a motion within a step."""
    contact = start.scene.contact
    if contact.friction_law != "regularised" or not start.friction.any():
        return
    worst, where = 2.0, np.zeros(0, np.int64)
    for rows in start.supports:
        force = start.loads(rows)
        root = np.sqrt(start.friction[rows] * force * start.dt / contact.friction_velocity)
        tangents = [(start._row(i, t), r) for i, r in zip(rows, root, strict=True) for t in _tangents(start, i)]
        found = start.mobility(np.array([r * row for row, r in tangents]))
        if found > worst * (1.0 + ROUNDED):
            worst, where = found, rows
    if len(where):
        speed = contact.friction_velocity * worst / 2.0
        yield Caution("friction", start.names(where), f"friction (6) at {start.names(where)} turns motion round within "
                      f"a step, {0.5 * worst:.3g} times beyond its limit μ N Δt = 2 m v_threshold: set "
                      f"contact.friction_velocity >= {_up(speed)}, or contact.friction_law: coulomb")


def _tangents(start: Start, i: int) -> Floats:
    axes = frame_along("normal", start.found.normal[i])
    n = start.found.normal[i]
    return axes[:, :2].T if start.spatial else np.array([[-n[1], n[0], 0.0]])


def _down(x: float, digits: int = 2) -> str:
    """Return x rounded down to two digits."""
    return f"{_two_digits(x, math.floor, digits):g}"


def _up(x: float, digits: int = 2) -> str:
    """Return x rounded up to two digits."""
    return f"{_two_digits(x, math.ceil, digits):g}"


def _two_digits(x: float, way: Any, digits: int = 2) -> float:
    if not (0.0 < x < math.inf):
        return x
    power = math.floor(math.log10(x)) - digits + 1
    slack = 1.0 + ROUNDED if way is math.floor else 1.0 - ROUNDED
    return float(f"{way(x * slack / 10.0**power)}e{power}")


# What `contact.auto` chooses

AUTO_K, AUTO_B = 0.2, 0.5  # k and b at the most critical contacts: k + 2 b = 1.2 is far below 4
SPARE = 2.0  # factor by which later contacts may be lighter than those at the start


def settled(scene: Scene, start: Start | None = None) -> tuple[Scene, tuple[str, ...]]:
    """Return the scene with the values that `contact.auto` and `contact.resting_start` choose, and remarks on them.

    A scene that uses neither is returned unchanged.
    """
    said: tuple[str, ...] = ()
    if scene.contact.auto:
        scene, said = _chosen(scene, Start(scene) if start is None else start)
    elif scene.chosen_fields:
        choice, sentence = _firm(scene)
        scene, said = scene.model_copy(update={"contact": scene.contact.choosing(choice)}), (sentence,)
    return _at_rest(scene, said) if scene.contact.resting_start else (scene, said)


SAG_ALLOWED, SAG_SHARE = 1e-4, 1e-3  # m, and share of the smallest shape: largest static sag of implicit contact
SPARE_LOAD = 10.0  # times the weight of everything that moves: levers and wedges can press harder
RELAXATION = 0.01  # s: B/K, in which an overlap fades; a shorter one would throw what lands out of its first overlap
STANDARD_GRAVITY = 9.81  # m/s², for scenes with less


def _firm(scene: Scene) -> tuple[dict[str, float], str]:
    """Return stiffness and damping of implicit contact that are not given, and a sentence on them.

    The stiffness holds ten times the weight of all bodies, and the hand's force, at the sag allowed.
    """
    shapes = shapes_of(scene)
    sizes = [_smallest_extent(shapes, i) for i in range(len(shapes.kind))]
    sag = min(SAG_ALLOWED, SAG_SHARE * min([size for size in sizes if math.isfinite(size)], default=1.0))
    mass = sum(body.mass for body in scene.bodies)
    load = mass * max(STANDARD_GRAVITY, math.hypot(*(scene.gravity or (0.0,))))
    load += scene.hand.largest_force() if scene.hand is not None and not scene.hand.force_function else 0.0
    choice: dict[str, float] = {}
    if "stiffness" in scene.chosen_fields:
        choice["stiffness"] = min(_two_digits(SPARE_LOAD * load / sag, math.ceil), LARGEST_NUMBER)
    if "damping" in scene.chosen_fields:
        stiffness = choice.get("stiffness", scene.contact.stiffness)
        choice["damping"] = min(_two_digits(stiffness * RELAXATION, math.ceil), LARGEST_NUMBER)
    values = ", ".join(f"{name} = {value:g} {_UNITS[name]}" for name, value in choice.items())
    K = choice.get("stiffness", scene.contact.stiffness)
    sags = f"; a load of {load:.3g} N sags by {in_metres(load / K)}" if K > 0.0 else ""
    return choice, f"chosen for implicit contact: {values}{sags}"


def _chosen(scene: Scene, start: Start) -> tuple[Scene, tuple[str, ...]]:
    """Return the scene with the values that `contact.auto` chooses, and a remark."""
    dt, given = start.dt, scene.contact.model_fields_set
    choice: dict[str, float] = {}
    said = who = ""
    if scene.contact.forces == "implicit":
        choice, said = _firm(scene)
        given = given | {"stiffness", "damping"}
    mobility, rows = start.critical[0]
    mobility *= SPARE if len(start.blocks) > 1 else 1.0
    if mobility == 0.0:  # nothing is near enough to know what will touch: as if the lightest body did
        mobility = SPARE * max((1.0 / body.mass for body in scene.bodies if body.mass > 0.0), default=0.0)
        who = "the lightest body"
    if mobility == 0.0 or not len(start.rows) and not len(start.pairs):
        return scene.with_values({"contact.auto": False}), ()
    if "stiffness" not in given:
        choice["stiffness"] = _two_digits(AUTO_K / (mobility * dt**2), math.floor)
    if "damping" not in given:
        K = choice.get("stiffness", scene.contact.stiffness)
        most = AUTO_B * min(1.0, math.sqrt(K * mobility * dt**2 / AUTO_K))  # softer springs want less
        choice["damping"] = _two_digits(most / (mobility * dt), math.floor)
    if "coherence_distance" not in given:
        choice["coherence_distance"] = _two_digits(2.0 * _top_speed(start) * dt, math.ceil)
    choice = {name: min(value, LARGEST_NUMBER) for name, value in choice.items()}
    if not said:
        values = ", ".join(f"{name} = {value:g} {_UNITS[name]}" for name, value in choice.items())
        said = (f"contact.auto chose {values}: effective mass {1.0 / mobility:.3g} kg at "
                f"{who or start.names(rows)}, {scene.rate:g} Hz")
    return scene.with_values({"contact.auto": False} | {f"contact.{name}": x for name, x in choice.items()}), (said,)


_UNITS = {"stiffness": "N/m", "damping": "N s/m", "coherence_distance": "m"}


def _top_speed(start: Start) -> float:
    """Return the largest speed [m/s] of a contact point, from the start and a fall or push over the scene's length."""
    length = float(np.ptp(start.found.point, axis=0).max()) if len(start.found.gap) else 0.0
    push = np.abs(start.rows @ start.moved(start.applied[None])[:, 0]).max(initial=0.0)
    speed = np.abs(start.rows @ start.v).max(initial=0.0)
    return float(math.sqrt(speed**2 + 2.0 * push * length))


# What `contact.resting_start` chooses

SETTLING = 8  # Newton steps: the rows turn with the bodies, and the displacements are small
BALANCED = 1e-6  # largest unbalanced share of the load
DIGITS = 10  # of positions in m and rad, so that rounding in linear algebra has no effect


def _at_rest(scene: Scene, said: tuple[str, ...]) -> tuple[Scene, tuple[str, ...]]:
    """Return the scene with touching bodies moved to the equilibrium of springs and sticking friction, and remarks."""
    scene = settling = scene.with_values({"contact.resting_start": False})
    for _ in range(SETTLING):
        found = _sunk(Start(settling))
        if isinstance(found, str):
            return scene, (*said, f"contact.resting_start: left as given, for {found}")
        if not found:
            moved = float(np.abs(start_of(settling)[0] - start_of(scene)[0]).max())
            return settling, (*said, f"contact.resting_start moved what touches by up to {moved:.3g} m, rad")
        settling = settling.with_values(found)
    return scene, (*said, "contact.resting_start: left as given, for no equilibrium was found")


def _sunk(start: Start) -> dict[str, Any] | str:
    """Do one Newton step towards equilibrium; return new positions by path, or the reason why there is none.

    The result is empty at equilibrium. Springs and friction λ balance the load f: K JᵀJ δ + Tᵀλ = f − K Jᵀg. The
    solution with the least √K δ and λ/√K is taken, so that nothing moves along its contacts. No contact may pull, and
    the sum of the friction forces must not exceed the sum of μ N.
    """
    if not start.touching or start.scene.contact.stiffness == 0.0:
        return "nothing touches, or no spring holds it"
    rows, K = np.concatenate(start.touching), start.scene.contact.stiffness
    trees = list({tree for i in rows for tree in start.trees(i)})
    ours = np.isin(start.mechanism.tree_of_body[start.mechanism.arrays.dof_body], trees)
    if start.v[ours].any() or (start.found.shape_a[rows] == start.found.shape_b[rows]).any():
        return "what touches moves, or is a joint at its limit"
    J, g, f = start.rows[rows][:, ours], start.found.gap[rows], start.applied[ours]
    tangents = [start._row(i, t) for i in rows if start.friction[i] > 0.0 for t in _tangents(start, i)]
    T = np.array(tangents).reshape(-1, start.mechanism.nv)[:, ours]
    scale = np.concatenate([np.full(J.shape[1], 1.0 / math.sqrt(K)), np.full(len(T), math.sqrt(K))])
    held = np.hstack([K * J.T @ J, T.T])
    solved = scale * np.linalg.lstsq(held * scale, f - K * J.T @ g, rcond=1e-9)[0]
    delta, friction = solved[: J.shape[1]], solved[J.shape[1] :]
    push, size = -K * (g + J @ delta), float(np.abs(f).max(initial=0.0))
    open_load = float(np.abs(f + J.T @ push - T.T @ friction).max(initial=0.0))
    most = float((start.friction[rows] * np.maximum(push, 0.0)).sum())
    if open_load > BALANCED * size or push.min() < -BALANCED * size or np.abs(friction).sum() > most + BALANCED * size:
        return "what touches would slide, tip or fall"
    if float(np.abs(delta).max()) <= 10.0**-DIGITS:
        return {}
    moved = np.zeros(start.mechanism.nv)
    moved[ours] = delta
    q, first = start.mechanism.integrate(start.q, moved, 1.0), start.mechanism.arrays.q_start
    return {f"bodies.{body.name}.position": q[first[b] : first[b] + len(body.position)].round(DIGITS).tolist()
            for b, body in enumerate(start.scene.bodies) if start.mechanism.tree_of_body[b] in trees}
