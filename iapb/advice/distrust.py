"""Check the record of a run for signs of a meaningless result: energy, spin, overlap, passage and positions.

Energy is compared for the whole scene, for each group of trees that touch one another, and for each tree of bodies on
its own scale, so that a heavy neighbour hides nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.contact.geometry import ENDLESS, Shapes
from iapb.mechanics.energy import FORCES, energy_ledger, moved_straight
from iapb.mechanics.joints import KINDS
from iapb.mechanics.mechanism import Mechanism
from iapb.mechanics.rotations import rotation_of
from iapb.names import in_metres
from iapb.run import Run
from iapb.scene.bodies import WORLD, inertia_matrix
from iapb.scene.mechanism import mechanism_of, pairs_of, shapes_of
from iapb.scene.model import Scene, scene_kind

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]

UNACCOUNTED = 0.02  # share of the available energy, or of a free momentum, that errors of a first-order step may add
SWING = 0.1  # the same for the motion of a linkage: its error swings to and fro
STEADY = {"fixed", "prismatic", "planar", "free_flyer"}  # joints of trees whose motion has no such error
DEEP = 0.5  # of the thinner shape: largest overlap of rigid bodies
NARROW = 0.1  # of the body: a rigid body cannot pass a gap that is narrower by so much
OVERRUN = 0.1  # of a joint's range: largest distance beyond a limit at the end
FAST = 0.5  # of the thinner shape: a pair that moves by less in a step overlaps before one is through the other
GRAZED = 0.1  # of a shape's thickness: a path that enters it by less does not pass through it
NEAR = 1e-3  # of an overlap: how far from its wall's surface its end may lie
SLOW = 1e-6  # [m/s, rad/s] of a free body: slower motion may be rounding error
WILD = 10.0  # factor on the farthest distance that start, speed and acceleration explain


def distrust_of(run: Run) -> tuple[str, ...]:
    """Return the reasons why a result is not to be trusted, from the record alone; empty if nothing is wrong."""
    if not (np.isfinite(run.q).all() and np.isfinite(run.v).all()):
        return ("positions or velocities are not finite",)
    with np.errstate(all="ignore"):  # the square of what exploded may overflow
        parts = _Parts.of(run)
        if parts is None:
            return ()
        reasons = (_made_energy, _friction_drove, _sank, _passed, _squeezed, _flew, _overran, _spun)
        return tuple(why for reason in reasons if (why := reason(run, parts)))


class _Solid(NamedTuple):
    """A convex shape in the frame of its body (-1: the world): a ball or circle, or what faces n·x <= offset bound."""

    body: int
    points: Floats  # (p, 3) its centre, then its corners
    normals: Floats  # (e, 3) unit, outward; none for a ball
    offsets: Floats  # (e,)
    radius: float
    thin: float  # smallest extent
    reach: float  # greatest distance from the body's origin, or from the wall's centre

    @classmethod
    def of(cls, shapes: Shapes, i: int) -> _Solid:
        """Return shape number i of a scene, which must not be endless."""
        body, radius, centre = int(shapes.body[i]), float(shapes.radius[i]), shapes.center[i]
        corners = np.pad(shapes.vertices[shapes.first[i] : shapes.first[i] + shapes.count[i]], ((0, 0), (0, 1)))
        if len(corners):
            centre, edges = corners.mean(axis=0), np.roll(corners, -1, axis=0) - corners
            normals = np.cross(edges, [0.0, 0.0, 1.0]) / np.linalg.norm(edges, axis=1)[:, None]
        else:
            signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
            corners = centre + (signs * shapes.half_size[i]) @ shapes.axes[i].T
            normals = np.vstack([shapes.axes[i].T, -shapes.axes[i].T])
        points = centre[None] if radius > 0.0 else np.vstack([centre, corners])
        far = radius + float(np.linalg.norm(points - (centre if body < 0 else 0.0), axis=1).max())
        if radius > 0.0:
            return cls(body, points, np.zeros((0, 3)), np.zeros(0), radius, 2.0 * radius, far)
        over = points @ normals.T
        return cls(body, points, normals, over.max(axis=0), 0.0, float(np.ptp(over, axis=0).min()), far)

    def height(self, points: Floats) -> Floats:
        """Return a height (n,) of points (n, 2 or 3) over the surface: zero on it, negative inside."""
        if self.radius > 0.0:
            return np.linalg.norm(points - self.points[0, : points.shape[1]], axis=1) - self.radius
        return np.asarray((points @ self.normals[:, : points.shape[1]].T - self.offsets).max(axis=1))

    def crossed(self, before: Floats, after: Floats, arc: Floats, radius: float) -> Booleans:
        """Whether straight paths enter and leave the shape's core, what is deeper than `GRAZED` and a path's `arc`.

        radius : of the ball about the moving point, or 0. Two balls cross if they overlap by half of the smaller one.
        """
        arc = arc + GRAZED * self.thin
        if self.radius > 0.0:
            core = (max(self.radius, radius) + GRAZED * self.thin if radius > 0.0 else self.radius) - arc
            start, end, way = before - self.points[0], after - self.points[0], after - before
            share = np.clip(-(start * way).sum(axis=-1) / np.maximum((way * way).sum(axis=-1), 1e-300), 0.0, 1.0)
            first, last, least = (np.linalg.norm(x, axis=-1) for x in (start, end, start + share[..., None] * way))
            return np.asarray((least < core) & (first >= core) & (last >= core))
        before, after = (at @ self.normals.T - self.offsets + arc[..., None] for at in (before, after))
        share = before / np.where(before == after, 1.0, before - after)
        enters = np.where((before > 0.0) & (after <= 0.0), share, 0.0).max(axis=-1)
        leaves = np.where((before <= 0.0) & (after > 0.0), share, 1.0).min(axis=-1)
        outside = (before.max(axis=-1) > 0.0) & (after.max(axis=-1) > 0.0)
        return np.asarray(outside & ~((before > 0.0) & (after > 0.0)).any(axis=-1) & (leaves > enters))


class _Parts(NamedTuple):
    """The scene of a run, made again from the record, with its mechanism, its shapes and its energies."""

    scene: Scene
    mechanism: Mechanism
    gravity: Floats  # (3,)
    solids: dict[int, _Solid]  # by shape, without endless walls
    names: list[str]  # of each shape's body or wall
    pairs: NDArray[np.int32]  # (k, 2) shapes that may touch, without endless walls
    sizes: Floats  # (bodies + 1,) smallest extent of each body; last, of the world: infinity
    trifles: Floats  # (bodies,) negligible energy [J]: to lift a body by a thousandth of its size
    begin: int  # first state that forces explain: a later part of a run begins with the state at the whole run's start
    carried: tuple[int, int]  # start, stop in v of a tool that its coupler moves without force, at times; or 0, 0
    books: list[_Book]

    @classmethod
    def of(cls, run: Run) -> _Parts | None:
        """Return the parts; None if there is no step, or if the record's scene does not describe its bodies."""
        if not run.steps or [body.get("name") for body in run.scene_resolved.get("bodies", ())] != [*run.body_names]:
            return None
        scene = scene_kind(run.scene_resolved).model_validate(run.scene_resolved)
        mechanism, shapes, sizes = mechanism_of(scene), shapes_of(scene), np.full(len(scene.bodies) + 1, math.inf)
        if (mechanism.nq, mechanism.nv) != (run.q.shape[1], run.v.shape[1]):
            return None
        solids = {i: _Solid.of(shapes, i) for i in np.flatnonzero(~np.isin(shapes.kind, ENDLESS)).tolist()}
        for solid in (solid for solid in solids.values() if solid.body >= 0):
            sizes[solid.body] = min(sizes[solid.body], solid.thin)
        gravity, masses = np.array([*(scene.gravity or ()), 0.0, 0.0, 0.0])[:3], [body.mass for body in scene.bodies]
        trifles = 1e-3 * np.linalg.norm(gravity) * np.where(np.isinf(sizes), 0.0, sizes)[:-1] * masses
        names = [body.name for body in scene.bodies for _ in body.shapes] + [wall.name for wall in scene.walls]
        pairs, carried = pairs_of(scene, shapes), run.tool_dofs if run.coupling == "unilateral" else (0, 0)
        pairs, begin = pairs[np.isin(pairs, [*solids]).all(axis=1)], int(run.time[0] > 0.0)
        parts = cls(scene, mechanism, gravity, solids, names, pairs, sizes, trifles, begin, carried, [])
        parts.books.extend(_books(run, parts))
        return parts


class _Book(NamedTuple):
    """Energies [J] of some trees of bodies."""

    name: str  # of the trees, empty for the whole scene
    friction: Floats  # (n,) its work
    excess: Floats  # (n,) energy that nothing explains
    at_hand: float  # energy available
    most: float  # largest excess of a sound run
    alone: bool = False  # whether it is one tree, with the work of its contacts in the balance


def _books(run: Run, parts: _Parts) -> Iterator[_Book]:
    """Yield the books of the scene, of groups of trees that touch, and of single trees, where there is a balance."""
    begin, trees, ranges = parts.begin, parts.mechanism.tree_of_body, parts.mechanism.tree_dofs
    if {"kinetic", "potential", "hand_work", "coupling_work"} <= set(run.energy):
        yield _balance(run, parts, run.energy, 0, trees >= 0, "")
    moving = [t for t, (start, stop) in enumerate(ranges) if start < stop and run.steps > begin]
    ledgers = {t: _ledger(run, parts, t) for t in moving if ranges[t] != parts.carried}
    firsts, group = np.searchsorted(trees, np.arange(len(ranges))), _groups(run, trees)
    for chosen in (np.flatnonzero(group == g) for g in np.unique(group)):
        members = [t for t in chosen.tolist() if t in moving]
        if members and len(chosen) < len(group) and all(t in ledgers for t in members):
            energy = {name: np.sum([ledgers[t][name] for t in members], axis=0) for name in ledgers[members[0]]}
            names = [run.body_names[firsts[t]] for t in members[:3]] + ["others"] * (len(members) > 3)
            yield _balance(run, parts, energy, begin, np.isin(trees, chosen), " and ".join(names))
    for t, energy in ledgers.items():
        alone, gain = parts.mechanism.alone(t), energy["integration_residual"]
        steady = alone.has_constant_mass_matrix and {body.joint.kind for body in alone.bodies} <= STEADY
        gain = gain - np.minimum.accumulate(np.minimum(gain, 0.0)) if steady else gain
        taken = (energy["penalty_work"], energy["friction_work"], -energy["impact_loss"])
        at_hand = _at_hand(energy) + sum(float(work.max(initial=0.0)) for work in taken)
        most = (UNACCOUNTED if steady else SWING) * at_hand + float(parts.trifles[trees == t].sum())
        yield _Book(run.body_names[firsts[t]], energy["friction_work"], gain, at_hand, most, alone=True)


def _ledger(run: Run, parts: _Parts, tree: int) -> dict[str, Floats]:
    """Return the energies of one tree."""
    alone, dofs = parts.mechanism.alone(tree), slice(*parts.mechanism.tree_dofs[tree])
    q = int(parts.mechanism.arrays.q_start[np.searchsorted(parts.mechanism.tree_of_body, tree)])
    forces = {name: getattr(run, f"{name}_force")[parts.begin :, dofs] for name in FORCES}
    states = run.q[parts.begin :, q : q + alone.nq], run.v[parts.begin :, dofs]
    impulse = np.ascontiguousarray(run.impulse[parts.begin :, dofs])
    return energy_ledger(alone, parts.gravity, *states, forces, impulse, straight=moved_straight(run))


def _groups(run: Run, trees: Integers) -> Integers:
    """Return a number for each tree; trees that contacts connect at any time of the run have the same one."""
    group, both = np.arange(int(trees.max()) + 1), run.contacts.body_b >= 0
    for a, b in np.unique(trees[np.stack([run.contacts.body_a, run.contacts.body_b])[:, both]], axis=1).T:
        group[group == group[b]] = group[a]
    return group


def _balance(run: Run, parts: _Parts, energy: dict[str, Floats], begin: int, bodies: Booleans, name: str) -> _Book:
    """Return the book of bodies that nothing else touches but walls, hand and coupling."""
    rows = slice(*run.contacts.offsets[begin : begin + 2].tolist())
    gap = run.contacts.gap[rows][bodies[run.contacts.body_a[rows]]]
    springs = 0.5 * (parts.scene.contact.stiffness or 0.0) * float(np.sum(np.minimum(gap, 0.0) ** 2))
    total, at_hand = energy["kinetic"] + energy["potential"], _at_hand(energy) + springs
    excess = total[1:] - (total[0] + springs + energy["hand_work"] + energy["coupling_work"])
    friction = energy.get("friction_work", np.zeros(0))
    return _Book(name, friction, excess, at_hand, UNACCOUNTED * at_hand + float(parts.trifles[bodies].sum()))


def _at_hand(energy: dict[str, Floats]) -> float:
    """Return the energy available [J]: at the start, by loss of height, and by the work of hand and coupling."""
    worked = sum(float(np.abs(energy[name]).max(initial=0.0)) for name in ("hand_work", "coupling_work"))
    return float(energy["kinetic"][0] + energy["potential"][0] - energy["potential"].min()) + worked


def _made_energy(run: Run, parts: _Parts) -> str:
    """Say where energy exceeds the energy at the start plus the work done, or what the motion of one tree creates."""
    for book in parts.books:
        k = int(np.argmax(book.excess))
        if not book.excess[k] <= book.most:  # it may be NaN
            whose = f"the energy of {book.name}" if book.name else "its energy"
            start = "start and the work of all forces" if book.alone else "start and work"
            return (f"{whose} is {book.excess[k]:.3g} J above {start} at {run.time[k - len(book.excess)]:.4g} s, "
                    f"where these are {book.at_hand:.3g} J")
    return ""


def _friction_drove(run: Run, parts: _Parts) -> str:
    """Say if friction did positive work on the bodies of the scene, or on those that touch one another."""
    for book in parts.books:
        most = float(book.friction.max(initial=0.0))
        if not book.alone and not most <= book.most:
            return f"friction drove {book.name or 'the bodies'}, by {most:.3g} J"
    return ""


def _spun(run: Run, parts: _Parts) -> str:
    """Say which single body changes its spin or its speed, gravity apart, in steps in which no force acts on it.

    Bodies with a planar or free_flyer joint count that carry nothing and have no joint damping.
    """
    start, at, parents = 0, np.arange(parts.begin, run.steps + 1), {body.parent for body in parts.scene.bodies}
    forces, falls = [run.impulse, *(getattr(run, f"{name}_force") for name in FORCES)], parts.gravity[:, None] * run.dt
    for b, body in enumerate(parts.scene.bodies):
        dofs = slice(start, start := start + KINDS[body.joint].nv)
        free = body.joint in ("planar", "free_flyer") and body.parent == WORLD and not any(body.joint_damping)
        if not free or body.name in parents or (dofs.start, dofs.stop) == parts.carried or run.steps <= parts.begin:
            continue
        alone = ~np.any([force[parts.begin :, dofs].any(axis=1) for force in forces], axis=0)[:, None, None]
        v, turn, flat = run.v[parts.begin :, dofs], _frames(run, b, at)[0], body.joint == "planar"
        turning, origin = (v * [0.0, 0.0, 1.0], v * [1.0, 1.0, 0.0]) if flat else (v[:, 3:], v[:, :3])
        inertia = np.eye(3) if flat else np.array(inertia_matrix(body.inertia))
        spin = turn @ (turning @ inertia / np.linalg.norm(inertia, 2))[..., None]  # R I w / |I|
        arm = np.cross(turning, np.array([*body.center_of_mass, 0.0])[:3])
        speed = turn @ arm[..., None] + (rotation_of((0.0, 0.0, body.angle)) if flat else turn) @ origin[..., None]
        fastest = np.linalg.norm(origin, axis=1).max()
        for what, moved, due, most in (("spin", spin, 0.0, 0.0), ("speed", speed, falls, fastest)):
            drift = np.linalg.norm(np.cumsum(alone * (np.diff(moved, axis=0) - due), axis=0), axis=1).max()
            share = float(drift / (max(np.linalg.norm(moved, axis=1).max(), most) + SLOW))
            if not share <= UNACCOUNTED:
                return f"the {what} of {body.name} changes by {100.0 * share:.3g} % although nothing touches it"
    return ""


# Overlap and passage


def _sank(run: Run, parts: _Parts) -> str:
    """Say where two bodies overlap by more than half of the thinner one, or a body by all of a wall's thickness."""
    table = run.contacts
    if not len(table.gap):
        return ""
    thinner = np.minimum(parts.sizes[table.body_a], parts.sizes[table.body_b])
    most = DEEP * thinner
    for wall in (solid for solid in parts.solids.values() if solid.body < 0):
        rows = np.flatnonzero((table.body_b < 0) & (table.gap < -wall.thin))
        ends = table.point[rows] - 0.5 * table.gap[rows, None] * table.normal[rows]  # on the surface of their wall
        rows = rows[np.abs(wall.height(ends)) < -NEAR * table.gap[rows]]
        thinner[rows], most[rows] = np.minimum(thinner[rows], wall.thin), np.minimum(most[rows], wall.thin)
    i = int(np.argmin(table.gap / most))
    if -table.gap[i] <= most[i]:
        return ""
    k = int(np.searchsorted(table.offsets, i, "right")) - 1
    a, b = (run.body_names[x] if x >= 0 else "a wall" for x in (table.body_a[i], table.body_b[i]))
    b += " (or the limit of its joint)" if parts.scene.bodies[table.body_a[i]].joint_limits else ""
    share = "all" if -table.gap[i] >= thinner[i] else "more than half"
    return (f"{a} and {b} overlap by {in_metres(-float(table.gap[i]))} at {run.time[k]:.4g} s, {share} of "
            f"{in_metres(float(thinner[i]))}")


def _passed(run: Run, parts: _Parts) -> str:
    """Say which body is the first to pass through a wall or another body within one step.

    For each pair of shapes that may touch, centre and corners of one move straight in the frame of the other from one
    state to the next, and pass if they enter and leave it (`_Solid.crossed`). Balls and circles have no corners. This
    misses edges that cross in space with no corner or centre in the other shape, a ball that passes a corner beside its
    centre, and paths that a turn bends by half of a shape. `_sank` looks at half-spaces and what takes several steps.
    """
    moved, places = _movements(run, parts), run.pose[:-1, :, : 2 if run.pose.shape[2] == 3 else 3]
    top, first, said = moved.max(axis=0), run.steps, ""
    for a, b in parts.pairs.tolist():
        one, other = parts.solids[a], parts.solids[b]
        if top[one.body] + top[other.body] <= FAST * min(one.thin, other.thin):
            continue
        way = moved[:first, one.body] + moved[:first, other.body]
        middle = other.points[0, : places.shape[2]] if other.body < 0 else places[:first, other.body]
        apart = np.linalg.norm(places[:first, one.body] - middle, axis=1) - one.reach - other.reach
        k = np.flatnonzero((way > FAST * min(one.thin, other.thin)) & (way >= apart))
        through = k[_crosses(run, one, other, k) | _crosses(run, other, one, k)] if len(k) else k
        if len(through):
            first, said = int(through[0]), f"{parts.names[a]} passes through {parts.names[b]}"
    return f"{said} in the step to {run.time[first + 1]:.4g} s" if said else ""


def _movements(run: Run, parts: _Parts) -> Floats:
    """Return how far any point of each body moves in each step [m] (n, bodies + 1); last, the world."""
    moved = np.zeros((run.steps, len(parts.sizes)))
    for b in range(len(run.body_names)):
        turn, origin = _frames(run, b, np.arange(run.steps + 1))
        reach = max((solid.reach for solid in parts.solids.values() if solid.body == b), default=0.0)
        turned = np.linalg.norm(np.diff(turn, axis=0), axis=(1, 2)) / math.sqrt(2.0)
        moved[:, b] = np.linalg.norm(np.diff(origin, axis=0), axis=1) + reach * turned
    return moved


def _crosses(run: Run, one: _Solid, other: _Solid, k: Integers) -> Booleans:
    """Whether a point of one shape passes through another in each of the steps k."""
    ours, theirs = ([_frames(run, solid.body, at) for at in (k, k + 1)] for solid in (one, other))
    before, after = ((one.points @ np.swapaxes(turned, 1, 2) + (at - origin)[:, None]) @ turn
                     for (turned, at), (turn, origin) in zip(ours, theirs, strict=True))
    bends = [np.linalg.norm(end[0] - start[0], axis=(1, 2))[:, None] ** 2 / 8.0 for start, end in (ours, theirs)]
    arc = np.linalg.norm(one.points, axis=1) * bends[0] + np.linalg.norm(before, axis=2) * bends[1]
    return np.asarray(other.crossed(before, after, arc, one.radius).any(axis=1))


def _frames(run: Run, body: int, at: Integers) -> tuple[Floats, Floats]:
    """Return axes (n, 3, 3), as columns, and origin (n, 3) of a body, or of the world (-1), at some instants."""
    turn, origin = np.tile(np.eye(3), (len(at), 1, 1)), np.zeros((len(at), 3))
    pose = run.pose[at, body]
    if body >= 0 and run.pose.shape[2] == 3:
        origin[:, :2], c, s = pose[:, :2], np.cos(pose[:, 2]), np.sin(pose[:, 2])
        turn[:, :2, :2] = np.stack([c, -s, s, c], axis=1).reshape(-1, 2, 2)
    elif body >= 0:
        origin, (x, y, z, w), o = pose[:, :3], pose[:, 3:].T, np.zeros(len(at))
        cross = np.stack([o, -z, y, z, o, -x, -y, x, o], axis=1).reshape(-1, 3, 3)
        turn = turn + 2.0 * (w[:, None, None] * cross + cross @ cross)
    return turn, origin


def _squeezed(run: Run, parts: _Parts) -> str:
    """Say which body moves on by more than its size in a gap that is a tenth of its size too narrow."""
    table = run.contacts
    for b, size in enumerate(parts.sizes[:-1].tolist() if len(table.gap) else ()):
        deep = table.gap < -0.5 * NARROW * size  # if two overlap by more in sum, one of them does by half of it
        if not deep.any() or not (deep & (table.body_a == b) & (table.body_b < 0)).any():
            continue
        rows = np.flatnonzero((table.body_a == b) & (table.body_b < 0) & (table.gap < 0.0))
        step = np.searchsorted(table.offsets, rows, "right") - 1
        caught, narrow = _pressed(step, table.normal[rows], table.gap[rows], NARROW * size)
        place = run.pose[caught, b, : 2 if run.pose.shape[2] == 3 else 3]
        far = float(np.linalg.norm(place - place[:1], axis=1).max(initial=0.0))
        if far > size:
            wide = in_metres(narrow)
            return f"{run.body_names[b]} goes on by {in_metres(far)} in a gap that is {wide} narrower than it"
    return ""


def _pressed(step: Integers, normal: Floats, gap: Floats, least: float) -> tuple[Integers, float]:
    """Return the steps, ascending, in which two opposed contacts overlap by more than `least` in sum, and the most."""
    found, widest = [np.zeros(0, np.int64)], 0.0
    for apart in range(1, int(np.bincount(step - step[0]).max())):  # the contacts of a step are consecutive
        narrow = -(gap[:-apart] + gap[apart:])
        facing = np.einsum("ij,ij->i", normal[:-apart], normal[apart:]) < -0.9
        caught = (step[:-apart] == step[apart:]) & facing & (narrow > least)
        found.append(step[:-apart][caught])
        widest = max(widest, float(narrow[caught].max(initial=0.0)))
    return np.unique(np.concatenate(found)), widest


def _flew(run: Run, parts: _Parts) -> str:
    """Say which position is farther than start, speed and acceleration can explain."""
    lengths = [i for i, unit in enumerate(run.coordinate_units) if unit == "m"]
    moved = np.maximum(run.q.max(axis=0) - run.q[0], run.q[0] - run.q.min(axis=0))[lengths]
    time, masses = float(run.time[-1]), [body.mass for body in parts.scene.bodies if body.mass]
    push = float(np.linalg.norm(run.hand_force, axis=1).max(initial=0.0)) / min(masses, default=1.0)
    reach = float(np.abs(run.q[0]).max() + parts.sizes[np.isfinite(parts.sizes)].max(initial=0.0))
    reach += float(np.abs(run.v[0]).max() * time + 0.5 * (np.linalg.norm(parts.gravity) + push) * time**2)
    if not len(lengths) or moved.max() <= WILD * reach:
        return ""
    far, name = in_metres(float(moved.max())), run.coordinate_names[lengths[int(moved.argmax())]]
    return f"{name} moves by {far}, where {in_metres(reach)} can be explained"


def _overran(run: Run, parts: _Parts) -> str:
    """Say which joint goes beyond a limit by more than half of its range, or by more than a tenth at the end."""
    for i, limits in zip(parts.mechanism.arrays.q_start, (b.joint_limits for b in parts.scene.bodies), strict=True):
        if not limits:
            continue
        low, high = limits
        beyond = np.maximum(low - run.q[:, i], run.q[:, i] - high) / (high - low)
        k = len(beyond) - 1 if beyond[-1] > OVERRUN else int(beyond.argmax())
        if beyond[k] > (OVERRUN if k == len(beyond) - 1 else DEEP):
            return (f"{run.coordinate_names[i]} is {run.q[k, i]:.3g} at {run.time[k]:.4g} s, beyond its limits {low:g} "
                    f"and {high:g} by {beyond[k]:.3g} times their range")
    return ""
