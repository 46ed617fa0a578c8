"""Check a scene before its run for settings that make the result meaningless. Each warning says
what value to set.

The explicit forces of the paper have limits that implicit contact has not. A lasting contact
oscillates on its spring and damper (5). Let m = 1/(J M⁻¹ Jᵀ) be its effective mass, k = K Δt²/m and
b = B Δt/m. A step maps (gap, velocity) linearly. The oscillation grows if that map has an
eigenvalue of modulus above 1, which means k + 2 b > 4. Contacts that share a body oscillate
together: 1/m is then the largest eigenvalue of J M⁻¹ Jᵀ over all of them. A new contact can start
at a depth of up to v Δt, and its spring then returns up to k times the kinetic energy of the
approach, so k must not exceed 1 either. `iapb.advice.distrust` checks the run itself.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, cast

import numpy as np

from iapb.advice.loops import MARGIN, SOON, HapticLoop, hold, nearest, scaled
from iapb.contact import geometry, laws
from iapb.contact.finding import Contacts
from iapb.contact.kernels.implicit import COMPLIANCE, FADING
from iapb.contact.kernels.touch import MOST_SAMPLES
from iapb.contact.solids import joined
from iapb.effects import numbers
from iapb.errors import counted
from iapb.mechanics.rotations import frame_along
from iapb.names import in_metres
from iapb.numerics.schema import Floats, Integers
from iapb.scene import Scene, SpatialScene, mechanism
from iapb.scene.bodies import WORLD, filled_with
from iapb.scene.model import MAX_RATE, Gains, Hand
from iapb.scene.parts import Path
from iapb.system import system_of

Rows = Integers  # numbers of contacts

NEAR = 0.02  # of the smaller shape: contacts closer than this at the start count as touching
DEEP = 0.02  # of the smaller shape: a larger overlap at the start is more than a resting depth
SAG = 0.1  # of the smaller shape, or of a joint's range: largest static sag of a rigid contact
THROWN = 1.0  # largest k = K Δt²/m at which a new contact returns no more energy than it absorbs
ROUNDED = 1e-9  # relative rounding error of a limit
# a joint may turn often, so only multiples of this many radians (seven turns) count as degrees
MANY_TURNS = 45
NEAREST = 8  # contacts of the tool, closest first, at which a haptic loop is checked
FEWER = [0.96**n for n in range(1, 300)]  # factors of gains and of the step, in search of a limit
MOVED = 0.1  # s: within which the hand gives the tool the speed that one step of a sensor must not
SHAKEN = 0.1  # share of this speed that one step of the sensors may cause
_UNITS = {"stiffness": "N/m", "damping": "N s/m"}
# a free body has up to so many times the inertia of its shapes, or as little
STRANGE = 100.0
ROUND = (geometry.CIRCLE, geometry.SPHERE)
MANY_PAIRS = 2000  # with more pairs, only those closer than the largest body are checked


class Caution(NamedTuple):
    """A warning about a scene: its kind, the things that it concerns, and a sentence with the value
    to set."""

    kind: str
    where: str
    text: str

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class StepLimits:
    """Limits of stiffness, damping and rate at the most critical contacts.

    mass : smallest effective mass [kg]; contacts : number of contacts that oscillate together;
        where : their bodies
    stiffness : largest stable K at the scene's damping [N/m]; damping : largest stable B at its
        stiffness [N s/m]
    rate : smallest rate [Hz] at which the scene's stiffness and damping are stable
    """

    where: str
    contacts: int
    mass: float
    stiffness: float
    damping: float
    rate: float


class Start:
    """A scene at its start: its closest contacts and joint limits, with their rows, effective
    masses and loads; each quantity is computed when it is asked for.

    A joint limit is a contact with one number, after those of the shapes, in place of its two
    shapes.
    """

    def __init__(self, scene: Scene) -> None:
        mechanism.require_joints(scene)
        system = system_of(scene)
        self.scene = scene
        self.system = system
        self.dt = system.dt
        self.spatial = isinstance(scene, SpatialScene)
        self.mechanism = system.mechanism
        self.q, self.v = system.start
        self.stops = system.stops
        self.first_stop = len(self.found.gap) - len(self.stops.body)

    @cached_property
    def labels(self) -> list[str]:
        """Name of each shape, and of each joint limit."""
        names = mechanism.shape_names(self.scene)
        for body, sign in zip(self.stops.body, self.stops.sign, strict=True):
            side = "lower" if sign > 0.0 else "upper"
            names.append(f"the {side} limit of {self.scene.bodies[body].name}")
        return names

    @cached_property
    def size(self) -> Floats:
        """Smallest extent of each shape, infinite for walls; of a joint limit the joint's range
        [m]."""
        ranges = np.repeat(np.ptp(self.stops.bound.reshape(-1, 2), axis=1), 2)
        return np.append(self.system.thickness, self.stops.arm * ranges)

    @cached_property
    def kind(self) -> Integers:
        """Kind of each shape; −1 of a joint limit."""
        return np.append(self.system.shapes.kind, np.full(len(self.stops.body), -1))

    @cached_property
    def found(self) -> Contacts:
        """The contacts between the closest features of each pair, near or far, and the joint
        limits."""
        margin = math.inf
        if len(self.system.pairs) > MANY_PAIRS:
            extents = self.system.thickness
            margin = extents[np.isfinite(extents)].max(initial=0.0)
        placed = self.mechanism.placements(self.q)
        stops = self.stops
        found = self.system.finder.find(*placed, margin)
        limits = Contacts(
            stops.shape,
            stops.shape,
            stops.body,
            stops.parent,
            np.zeros_like(stops.body),
            placed[1][stops.body],
            np.zeros((len(stops.body), 3)),
            stops.arm * stops.sign * (self.q[stops.coordinate] - stops.bound),
        )
        both: Any = zip(found, limits, strict=True)
        return Contacts(*(np.concatenate(columns) for columns in both))

    @cached_property
    def tree_a(self) -> Integers:
        """Tree of the first body of each contact."""
        return self.mechanism.tree_of_body[self.found.body_a]

    @cached_property
    def tree_b(self) -> Integers:
        """Tree of the second body of each contact; at a wall that of the first."""
        moving = np.where(self.found.body_b < 0, self.found.body_a, self.found.body_b)
        return self.mechanism.tree_of_body[moving]

    @cached_property
    def rows(self) -> Floats:
        """Jacobian rows (c, d) along the normals."""
        rows = self.rows_along(np.arange(len(self.found.gap)), self.found.normal)
        limits = np.arange(self.first_stop, len(rows))
        rows[limits, self.stops.dof] = self.stops.arm * self.stops.sign
        return rows

    @cached_property
    def friction(self) -> Floats:
        """Coefficient of each contact."""
        return self.system.surfaces.by_pair(np.stack(self.found[:2], axis=1))[1]

    @cached_property
    def thickness(self) -> Floats:
        """Size of the thinner of two shapes in contact [m]."""
        return np.minimum(self.size[self.found.shape_a], self.size[self.found.shape_b])

    def rows_along(self, contacts: Rows, directions: Floats) -> Floats:
        """Return the Jacobian rows (k, d) of contacts (k,) along directions (k, 3)."""
        qs = np.tile(self.q, (len(contacts), 1))
        point = self.found.point[contacts]
        a, b = (
            self.mechanism.rows_along(qs, body[contacts], point, directions)
            for body in (self.found.body_a, self.found.body_b)
        )
        return a - b

    def slips(self, i: int) -> Floats:
        """Jacobian rows (2, d) of contact i across its normal; in the plane one of them is zero."""
        across = frame_along(self.found.normal[i])[:, :2].T
        return self.rows_along(np.full(2, i), across)

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

    def mobility(self, rows: Floats) -> float:
        """Largest eigenvalue of J M⁻¹ Jᵀ [1/kg]."""
        return np.linalg.eigvalsh(rows @ self.moved(rows))[-1] if len(rows) else 0.0

    def applied(self, q: Floats) -> Floats:
        """Generalized force (d,) at q of gravity and of the hand's force at t = 0."""
        return self.handed(q, 0.0) - self.mechanism.gravity(q, self.system.gravity)

    def handed(self, q: Floats, time: float) -> Floats:
        """Generalized force (d,) of the hand at q and at a time [s]."""
        return mechanism.hand_force_of(self.scene, self.mechanism, q, time)

    @property
    def tool(self) -> slice:
        """Range in v of the tree that the hand holds."""
        return slice(*self.system.tool_dofs)

    @cached_property
    def fall(self) -> Floats:
        """Acceleration (d,) by gravity and the hand at the start, without contacts and without
        motion."""
        return self.moved(self.applied(self.q)[None])[:, 0]

    @cached_property
    def pull(self) -> Floats:
        """Acceleration (c,) of each gap [m/s²] by gravity and the hand."""
        return self.rows @ self.fall

    @cached_property
    def meeting(self) -> tuple[Floats, Floats]:
        """When each gap closes at constant acceleration [s], infinite if never, and with which
        speed [m/s]."""
        gap = np.maximum(self.found.gap, 0.0)
        approach = -(self.rows @ self.v)
        square = approach**2 - 2.0 * self.pull * gap
        speed = np.sqrt(np.maximum(square, 0.0))
        time = np.where(gap == 0.0, 0.0, math.inf)
        np.divide(2.0 * gap, approach + speed, out=time, where=approach + speed > 0.0)
        return np.where(square < 0.0, math.inf, time), speed

    @cached_property
    def by_pair(self) -> list[Rows]:
        """Contacts of each pair of shapes, closest first: at most 4 in space and 2 in the plane, as
        on a flat face; the closest pair first."""
        kept: dict[tuple[int, int], list[int]] = {}
        for i in np.argsort(self.found.gap, kind="stable"):
            pair = self.found.shape_a[i], self.found.shape_b[i]
            kept.setdefault(pair, []).append(i)
        most = 4 if self.spatial else 2
        return [np.array(rows[:most]) for rows in kept.values()]

    @cached_property
    def touching(self) -> list[Rows]:
        """Contacts that touch or nearly touch at the start, in groups that shared moving trees
        connect."""
        near = np.flatnonzero(
            self.found.gap <= NEAR * np.where(np.isfinite(self.thickness), self.thickness, 0.0)
        )
        both = self.tree_a[near], self.tree_b[near]
        group = joined(len(self.mechanism.tree_dofs), zip(*both, strict=True))[both[0]]
        return [near[group == one] for one in dict.fromkeys(group)]

    @cached_property
    def supports(self) -> list[Rows]:
        """Groups of contacts that carry loads: those that touch, and the first pair that a falling
        tree hits."""
        touched = {
            tree for rows in self.touching for tree in (*self.tree_a[rows], *self.tree_b[rows])
        }
        falls: dict[int, Rows] = {}
        for rows in self.by_pair:
            i = rows[0]
            tree = self.tree_a[i]
            # a linkage would change its pose
            free = np.count_nonzero(self.mechanism.tree_of_body == tree) == 1
            # not on one corner
            flat = len(rows) > 1 or self.kind[self.found.shape_a[i]] in ROUND
            if tree not in touched and free and flat and self.pull[i] < 0.0:
                falls.setdefault(tree, rows)
        return [*self.touching, *falls.values()]

    @cached_property
    def critical(self) -> tuple[tuple[float, Rows], tuple[float, Rows]]:
        """Largest mobility [1/kg] and its contacts, twice: over touching groups and near pairs, and
        over near pairs."""
        nobody = (0.0, np.zeros(0, np.int64))
        boxes = (self.kind[self.found.shape_a] == geometry.BOX) & (
            self.kind[self.found.shape_b] == geometry.BOX
        )
        near = ~boxes | (self.found.gap <= self.thickness)  # so that the row is valid at touch
        meeting = [(self.mobility(self.rows[rows]), rows) for rows in self.by_pair if near[rows[0]]]
        lasting = [(self.mobility(self.rows[rows]), rows) for rows in self.touching]
        return (
            max([*lasting, *meeting], key=lambda one: one[0], default=nobody),
            max(meeting, key=lambda one: one[0], default=nobody),
        )

    def loads(self, rows: Rows) -> Floats:
        """Return forces p >= 0 (c,) [N] of a group of contacts that balance gravity and the hand: W
        p = −J M⁻¹ f."""
        W = self.rows[rows] @ self.moved(self.rows[rows])
        force = np.zeros(len(rows))
        pushing = np.ones(len(rows), np.bool_)
        for _ in range(len(rows)):
            force[:] = 0.0
            force[pushing] = np.linalg.lstsq(
                W[np.ix_(pushing, pushing)], -self.pull[rows][pushing], rcond=1e-12
            )[0]
            if (force >= 0.0).all():
                break
            pushing &= force > 0.0  # a contact that would pull carries nothing
        hand = self.scene.hand.largest_force() if self.scene.hand is not None else 0.0
        weights = np.linalg.norm(self.system.gravity) * self.mechanism.arrays.mass.sum()
        # wedges and levers can give more, but less in other poses
        return np.clip(force, 0.0, weights + hand)

    def names(self, rows: Iterable[int]) -> str:
        """Return the names of the things in contact, such as "box and floor"; of more than two, the
        first three."""
        shapes = (s for i in rows for s in (self.found.shape_a[i], self.found.shape_b[i]))
        named = list(dict.fromkeys(self.labels[s] for s in shapes))
        if len(named) < 3:
            return " and ".join(named)
        return ", ".join(named[:3]) + " …" * (len(named) > 3)


def step_limits(start: Start) -> StepLimits | None:
    """Return the limits at the most critical contacts; None if nothing can touch."""
    worst = (
        _limits_at(start, *one, most)
        for one, most in zip(start.critical, (math.inf, THROWN), strict=True)
        if one[0]
    )
    return min(worst, key=lambda one: (one.stiffness, one.damping), default=None)


def _limits_at(start: Start, mobility: float, rows: Rows, most: float) -> StepLimits:
    """Return the limits at contacts (c,) of a mobility [1/kg]: k + 2 b <= 4, and k <= `most`."""
    dt = start.dt
    K, B = start.scene.contact.gains
    stable = 4.0 * (1.0 + ROUNDED)
    k = K * mobility * dt**2
    b = B * mobility * dt
    stiffness = min(most, max(0.0, stable - 2.0 * b))
    damping = max(0.0, 0.5 * (stable - k))
    # A step of Δt/y has k/y² and b/y, so it is stable from the root of 4 y² - 2 b y - k on.
    least = max((b + math.sqrt(b**2 + stable * k)) / stable, math.sqrt(k / most))
    return StepLimits(
        start.names(rows),
        len(rows),
        1.0 / mobility,
        stiffness / (mobility * dt**2),
        damping / (mobility * dt),
        least / dt,
    )


def check_scene(
    scene: Scene, law: laws.ContactLaw | None = None, coupling: str | None = None
) -> tuple[Caution, ...]:
    """Find mistakes that would make a run of this scene meaningless, without running it.

    Parameters
    ----------
    scene : Scene
    law : contact law; default `ImpulseAugmented()`. Fields that the law does not use are not
        checked.
    coupling : name of the coupling, "none" for none; default: each that the scene gives gains for

    Returns
    -------
    tuple of Caution
        Empty if nothing is wrong.
    """
    chosen: Any = laws.ImpulseAugmented() if law is None else law
    chosen = chosen.within(scene) if hasattr(chosen, "within") else chosen
    start = Start(scene)
    uses = frozenset[str](getattr(chosen, "uses", ()))
    found = [*_degrees(scene), *_inertias(start), *_overlaps(start)]
    found += _fast(start, laws.IMPULSES in uses and scene.contact.at_touch, coupling != "none")
    if laws.PENALTY in uses and not scene.contact.rigid:
        found += _sags(start)
    integrator = getattr(chosen, "integrator", "semi_implicit_euler")
    if laws.PENALTY in uses and scene.contact.forces == "paper":
        found += _too_stiff(start)
        found += _overdriven_friction(start) if laws.FRICTION in uses else ()
    elif (
        laws.PENALTY in uses
        and start.spatial
        and len(start.system.pairs)
        and integrator != "momentum"
    ):
        found.append(
            Caution(
                "integrator",
                scene.name,
                "implicit contact in space can gain energy with the integrator "
                f"{integrator}: set integrator: momentum, or contact.forces: paper",
            )
        )
    if scene.hand is not None:
        for name in ("four-channel", "unilateral"):
            if coupling in (None, name) and getattr(scene.couplings, name.replace("-", "_")):
                found += _coupled(start, name)
    return tuple(found)


def _degrees(scene: Scene) -> Iterator[Caution]:
    """Warn of angles that look like degrees: whole numbers beyond one turn, in joints multiples of
    45."""
    for part, things in (("bodies", scene.bodies), ("walls", scene.walls)):
        for i, thing in enumerate(things):
            for inside, angle, unit in _angles(thing):
                if abs(angle) > math.tau and angle % unit == 0.0:
                    yield _about(
                        scene,
                        "degrees",
                        (part, i, *inside),
                        f" = {angle:g} rad looks like degrees: set {math.radians(angle):.6g}, for "
                        "angles are in radians",
                    )


def _angles(thing: Any) -> Iterator[tuple[Path, float, int]]:
    """Yield path, value and unit of each angle of a body, wall or shape."""
    if hasattr(thing, "angle"):
        yield ("angle",), thing.angle, 1
    for k, angle in enumerate(getattr(thing, "rpy", ())):
        yield ("rpy", k), angle, 1
    for k, shape in enumerate(getattr(thing, "shapes", ())):
        for inside, angle, unit in _angles(shape):
            yield ("shapes", k, *inside), angle, unit
    joint = getattr(thing, "joint", "")
    if joint == "planar":
        yield ("position", 2), thing.position[2], 1
    elif joint == "revolute":
        for field in ("position", "joint_limits"):
            for k, angle in enumerate(getattr(thing, field) or ()):
                yield (field, k), angle, MANY_TURNS


def _about(scene: Scene, kind: str, path: Path, says: str) -> Caution:
    """Return a warning about a field, with its place in the file."""
    name = scene.field_name(*path)
    return Caution(kind, name, f"{scene.place_of(*path)}{name}{says}")


def _inertias(start: Start) -> Iterator[Caution]:
    """Warn of moments of inertia that no body has: the largest one exceeds the sum of the others by
    a thousandth; and of those of a free body that its shapes do not have with its mass."""
    moments = np.linalg.eigvalsh(start.mechanism.arrays.inertia)
    for i, (body, (low, middle, high)) in enumerate(zip(start.scene.bodies, moments, strict=True)):
        if high > 1.001 * (low + middle):
            says = f": no body has a moment of {high:.3g} kg m2 beside {low:.3g} and {middle:.3g}"
            says += "; it is at most their sum"
            yield _about(start.scene, "inertia", ("bodies", i, "inertia"), says)
        if body.joint in ("planar", "free_flyer") and body.parent == WORLD and body.shapes:
            filled = filled_with(body.shapes, 1.0)
            largest = np.linalg.norm(np.atleast_2d(filled["inertia"]), 2)
            times = high / (largest * body.mass / filled["mass"])
            if times < 1.0 / STRANGE:  # a larger one is that of parts without shapes
                says = f" is {times:.2g} times that of its shapes with its mass: is the unit kg m2?"
                yield _about(start.scene, "inertia", ("bodies", i, "inertia"), says)


def _overlaps(start: Start) -> Iterator[Caution]:
    """Warn of shapes that start inside each other, or in a gap narrower than the shape."""
    found = start.found
    sides = dict[int, list[int]]()
    resting = np.zeros(len(start.rows))
    for rows in start.touching:
        resting[rows] = start.loads(rows)
    for rows in start.by_pair:
        i = rows[0]
        depth = -found.gap[i]
        if depth <= 0.0 or not _too_deep(start, rows, resting[rows].max()):
            continue
        if found.body_b[i] < 0:
            sides.setdefault(found.body_a[i], []).append(i)
        a, b = (start.labels[s] for s in (found.shape_a[i], found.shape_b[i]))
        out = ", ".join(f"{depth * x:.3g}" for x in found.normal[i][: 3 if start.spatial else 2])
        says = f"{a} starts {in_metres(depth)} inside {b}: move it by [{out}] m"
        if start.mobility(start.rows[i : i + 1]) <= 1e-12 * start.critical[0][0]:
            says += ", or take the shape or the wall away, for no joint can move it out"
        yield Caution("overlap", f"{a} and {b}", says)
    for rows_of_body in sides.values():
        for i, j in itertools.combinations(rows_of_body, 2):
            if found.normal[i] @ found.normal[j] < -0.5:
                a, b, c = (
                    start.labels[s] for s in (found.shape_a[i], found.shape_b[i], found.shape_b[j])
                )
                narrower = in_metres(-found.gap[i] - found.gap[j])
                yield Caution(
                    "wedged",
                    f"{a}, {b}, {c}",
                    f"{a} stands in a gap between {b} and {c} that is {narrower} narrower than it: "
                    f"widen the gap, or make {a} smaller",
                )


def _too_deep(start: Start, rows: Rows, resting: float) -> bool:
    """Whether a pair starts deeper than at rest, under a load [N], judged by its depth and its
    springs' energy."""
    gap = np.minimum(start.found.gap[rows], 0.0)
    J = start.rows[rows]
    depth = -gap.min()
    size = start.thickness[rows[0]]
    K = start.scene.contact.gains[0]
    if depth * K <= 2.0 * resting and K > 0.0:
        return False
    mass = 1.0 / max(np.max(np.sum(J * start.moved(J).T, axis=1)), 1e-300)
    kinetic = 0.5 * mass * np.abs(J @ start.v).max() ** 2
    weight = mass * np.abs(start.pull[rows]).max()
    # the latter: moving by its size in a second
    usual = max(kinetic + weight * DEEP * size, 0.5 * mass * size**2)
    return depth > DEEP * size or depth > 1e-6 * size and 0.5 * K * np.sum(gap**2) > usual


def _fast(start: Start, at_touch: bool, coupled: bool) -> Iterator[Caution]:
    """Warn of bodies that move by more than half of a shape in the step of the impact.

    Where impacts happen at the touch, a step is searched at MOST_SAMPLES moments, but not that of a
    tool with a coupling.
    """
    held = at_touch and coupled and start.scene.is_coupled
    for i, *_ in start.by_pair:
        time, speed = (x[i] for x in start.meeting)
        size = start.thickness[i]
        leaving = start.rows[i] @ start.v >= 0.0 and start.pull[i] >= 0.0
        searched = at_touch and not (held and start.rows[i, start.tool].any())
        most = (0.5 * MOST_SAMPLES if searched else 0.5) * size
        if leaving or time > start.scene.duration or speed * start.dt <= most:
            continue
        shapes = sorted(
            (start.found.shape_b[i], start.found.shape_a[i]), key=lambda s: start.size[s]
        )
        thin, other = (start.labels[s] for s in shapes)
        yield Caution(
            "fast",
            f"{thin} and {other}",
            f"{other} meets {thin} at {speed:.3g} m/s, "
            f"{in_metres(speed * start.dt)} in a step, and the thinner is {in_metres(size)}: it "
            f"sinks in or "
            f"passes through; set rate >= {_up(2.0 * speed / most):g} Hz",
        )


def _too_stiff(start: Start) -> Iterator[Caution]:
    """Warn of stiffness or damping beyond the stable limits of the step."""
    limits = step_limits(start)
    contact = start.scene.contact
    K, B = contact.gains
    if limits is None or (K <= limits.stiffness and B <= limits.damping):
        return
    by_damping = limits.damping > 0.0 and B * limits.stiffness > K * limits.damping
    field = "damping" if limits.stiffness == 0.0 or by_damping else "stiffness"
    yield Caution(
        field,
        limits.where,
        f"contact.{field} = {getattr(contact, field):g} {_UNITS[field]} is more than a "
        f"step of {start.scene.rate:g} Hz can hold at {limits.where} ({counted(limits.contacts, 'contact')}, "
        f"effective mass {limits.mass:.3g} kg): set "
        f"contact.{field} <= "
        f"{_down(getattr(limits, field)):g}, or rate >= {_up(limits.rate):g} Hz",
    )


def _sags(start: Start) -> Iterator[Caution]:
    """Warn of static loads that sag by more than a tenth: of a shape at a contact, of the range at
    a joint limit."""
    K, _ = start.scene.contact.gains
    if K == 0.0:
        return
    stops = start.stops
    found = [(0.0, -1)]
    for rows in start.supports:
        shares = start.loads(rows) / (K * start.thickness[rows])
        found.append((shares.max(), rows[shares.argmax()]))
    touching = {i for rows in start.touching for i in rows}
    for k, i in enumerate(range(start.first_stop, len(start.rows))):
        if i not in touching:
            # the joint is at its limit, and those behind it are fixed
            there = start.q.copy()
            there[stops.coordinate[k]] = stops.bound[k]
            load = -(stops.sign[k] * start.applied(there)[stops.dof[k]] / stops.arm[k])
            found.append((load / (K * start.thickness[i]), i))
    share, i = max(found)
    if share <= SAG:
        return
    both = start.names([i])
    says = f"{both} overlap by {in_metres(share * start.thickness[i])}, {share:.0%} of the thinner"
    if i >= start.first_stop:
        says = f"the load on {both} holds its joint beyond it by {share:.3g} times its range"
    yield Caution("sag", both, f"at rest {says}: set contact.stiffness >= {_up(K * share / SAG):g}")


def _overdriven_friction(start: Start) -> Iterator[Caution]:
    """Warn where friction (6), an explicit damper μN/v_thr, reverses a motion within a step."""
    contact = start.scene.contact
    worst = 2.0
    where = ""
    for rows in start.supports:
        loads = start.friction[rows] * start.loads(rows) * start.dt / contact.friction_velocity
        slips = [
            math.sqrt(load) * row
            for i, load in zip(rows, loads, strict=True)
            for row in start.slips(i)
        ]
        found = start.mobility(np.array(slips))
        if found > worst * (1.0 + ROUNDED):
            worst = found
            where = start.names(rows)
    if where:
        yield Caution(
            "friction",
            where,
            f"friction (6) at {where} turns motion round within a step, {0.5 * worst:.3g} "
            "times beyond its limit μ N Δt = 2 m v_threshold: set contact.friction_velocity >= "
            f"{_up(contact.friction_velocity * worst / 2.0):g}, or contact.forces: implicit",
        )


# Haptic loops


def _coupled(start: Start, coupling: str) -> Iterator[Caution]:
    """Warn of a coupling whose loop of tool and device grows by itself, or shakes them by the
    resolution of the sensors."""
    loops = _loops(start, coupling)
    wrong = [where for where, loop in loops.items() if loop.grows]
    if wrong:
        yield _growing(start, coupling, loops, wrong[0])
        return
    device = start.scene.device
    loop = next(iter(loops.values()))
    times = cast(Hand, start.scene.hand).times(start.scene.duration)
    inverse = np.linalg.inv(loop.mass)
    pushes = [start.handed(start.q, time)[start.tool] for time in times]
    hand = max(push @ inverse @ push for push in pushes)
    if device is None or device.position_resolution is None or hand == 0.0:
        return
    kick = np.array(device.position_resolution) * (loop.stiffness * loop.dt + loop.damping)
    share = math.sqrt(kick @ inverse @ kick / hand) / MOVED
    if share > SHAKEN:
        least = [_down(step * SHAKEN / share) for step in device.position_resolution]
        yield Caution(
            "sensors",
            f"{coupling} coupling",
            f"one step of the sensors changes the velocity, by the {coupling} coupling, by {share:.2g} of "
            f"what the hand does in {MOVED:g} s: set device.position_resolution <= {numbers(least)}, or "
            "smaller gains",
        )


def _growing(start: Start, coupling: str, loops: dict[str, HapticLoop], where: str) -> Caution:
    """Return the warning of a loop that grows: where, by which limit, and what to set."""
    every = [*loops.values()]
    loop = loops[where]
    rate = start.scene.rate
    names = start.mechanism.velocity_names[start.tool]
    one = np.eye(len(loop.mass))

    def holds(factors: dict[str, Any]) -> bool:
        return hold(scaled(each, factors) for each in every)

    # a coordinate without whose gains the loop holds
    alone = [i for i in range(len(one)) if holds(dict.fromkeys(MARGIN, 1.0 - one[i]))]
    blamed = one[alone[0]] if alone else np.ones(len(one))
    swinging = names[alone[0]] if alone else "tool and device"
    less = [1.0 - (1.0 - x) * blamed for x in FEWER]
    path = f"couplings.{coupling.replace('-', '_')}"
    remedies = []
    for fields in (("damping",), ("stiffness",), ("stiffness", "damping")):
        tried = [dict.fromkeys(fields, factor) for factor in less]
        factors = nearest(holds, tried)
        if factors is not None:
            limits = {name: getattr(loop, name) * factors[name] for name in fields}
            said = [f"{path}.{name} <= {numbers(map(_down, x))}" for name, x in limits.items()]
            remedies.append(" and ".join(said))
            break
    shorter = range(loop.delay - 1, -1, -1)
    delay = nearest(lambda n: hold(replace(each, delay=n) for each in every), shorter)
    if delay is not None:
        remedies.append(f"device.delay <= {delay}")
    steps = [x for x in FEWER if rate / x <= MAX_RATE]
    step = nearest(lambda x: holds({"dt": x}), steps)
    if step is not None:
        remedies.append(f"rate >= {_up(rate / step):g} Hz")
    return Caution(
        "coupling",
        f"{coupling} coupling",
        f"the {coupling} coupling makes {swinging} swing ever more, {where}{_limit(loop)}: set "
        f"{', or '.join(remedies) or 'smaller gains'}",
    )


def _limit(loop: HapticLoop) -> str:
    """Return the limit that a loop breaks, where a closed form says it."""
    if loop.delay:
        return f", with a delay of {counted(loop.delay, 'step')} each way"
    share = (2.0 * loop.damping * loop.dt * np.diag(np.linalg.inv(loop.mass))).max()
    return f", for B Δt/(m/2) = {share:.3g} is above its limit 2" if share >= 2.0 else ""


def _loops(start: Start, coupling: str) -> dict[str, HapticLoop]:
    """Return the loops of a coupling by where they act: in free motion, and at the tool's nearest
    contacts.

    What the tool touches counts as fixed.
    """
    scene = start.scene
    tool = start.tool
    contact = start.scene.contact
    gains: Gains = getattr(scene.couplings, coupling.replace("-", "_"))
    device: Any = scene.device
    mass = start.mechanism.mass_matrix(start.q)[tool, tool]
    free = HapticLoop(
        mass,
        np.array(gains.stiffness),
        np.array(gains.damping),
        device_damping=np.array((device and device.damping) or np.zeros(len(mass))),
        joint_damping=start.system.joint_damping[tool],
        delay=device.delay if device is not None else 0,
        dt=start.dt,
        spring=np.zeros_like(mass),
        damper=np.zeros_like(mass),
        implicit=contact.forces != "paper",
        reflects=coupling == "four-channel",
    )
    K, B = contact.gains
    if contact.rigid:  # as `iapb.contact.kernels.implicit` chooses it
        soft = start.mechanism.arrays.mass.sum() / (COMPLIANCE * start.dt)
        K = soft / ((1.0 + FADING) * start.dt)
        B = soft - K * start.dt
    loops = {"in free motion": free}
    if not free.reflects:  # it acts in contact, and a little before
        loops = {"before the tool touches": replace(free, within=SOON)}
    touched = [rows for rows in start.by_pair if start.rows[rows][:, tool].any()]
    for rows in touched[:NEAREST]:
        J = start.rows[rows][:, tool]
        wall = replace(free, spring=K * J.T @ J, damper=B * J.T @ J)
        if not scaled(wall, dict.fromkeys(MARGIN, 0.0)).grows:  # else the contact is to blame
            loops[f"while {start.names(rows)} touch"] = wall
    return loops


def _up(x: float, way: Callable[[float], int] = math.ceil, slack: float = 1.0 - ROUNDED) -> float:
    """Return x rounded up to two digits."""
    if not (0.0 < x < math.inf):
        return x
    power = math.floor(math.log10(x)) - 1
    return float(f"{way(x * slack / 10.0**power)}e{power}")


def _down(x: float) -> float:
    return _up(x, math.floor, 1.0 + ROUNDED)
