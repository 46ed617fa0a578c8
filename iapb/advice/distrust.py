"""Check the record of a run for signs of a meaningless result: energy, spin, overlap, passage and
positions.

Energy is compared for the whole scene, for each group of trees that touch one another, and for each
tree of bodies on its own scale, so that a heavy neighbour hides nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.linalg import norm

from iapb.contact.kernels.implicit import FADING
from iapb.contact.solids import Solid, joined
from iapb.mechanics.energy import FORCES, Steps, energy_ledger, lost_within, moved_straight
from iapb.mechanics.rotations import rotation_of
from iapb.names import in_metres
from iapb.numerics.schema import Booleans, Floats, Integers
from iapb.run import UNSOLVED, Run
from iapb.scene.mechanism import shape_names
from iapb.scene.reading import scene_from_values
from iapb.system import System

# share of the available energy, or of a free momentum, that errors of a first-order step may add
UNACCOUNTED = 0.02
SWING = 0.1  # the same for the motion of a linkage: its error swings to and fro
STEADY = {
    "fixed",
    "prismatic",
    "planar",
    "free_flyer",
}  # joints of trees whose motion has no such error
DEEP = 0.5  # of the thinner shape: largest overlap of rigid bodies
NARROW = 0.1  # of the body: a rigid body cannot pass a gap that is narrower by so much
# of the energy at hand: most that a coupling may give tool and device. A sound one gives back some
# that impacts took: by its delay, the device goes on, and springs back
DRIVEN = 0.5
OVERRUN = {
    "paper": 0.1,
    "implicit": 0.04,
}  # of a joint's range: largest distance beyond a limit at the end, by forces
# of the thinner shape: a pair that moves by less in a step overlaps before one is through the other
FAST = 0.5
# of the way of a contact in one step, whose end gives the velocity: largest overlap of a landing
LANDING = 1.05
MANY = 64  # landings of one step, and of the step before, that are looked at
ALONG = 0.9  # least cosine of the angle between the normals of one contact in two steps
NEAR = 1e-3  # of an overlap: how far from its wall's surface its end may lie
SLOW = 1e-6  # [m/s, rad/s] of a free body: slower motion may be rounding error


def distrust_of(run: Run, system: System | None = None) -> tuple[str, ...]:
    """Return the reasons why a result is not to be trusted, from the record alone; empty if nothing
    is wrong.

    `system` is that of the record's scene; without it, it is made from the record. A later part of
    a run continues the sums of energy since the start.
    """
    if not (np.isfinite(run.q).all() and np.isfinite(run.v).all()):
        return ("positions or velocities are not finite",)
    named = tuple(body.get("name") for body in run.scene_resolved.get("bodies", ()))
    if not run.steps or named != tuple(run.body_names):
        return ()
    system = system or System(scene_from_values(run.scene_resolved))
    if (run.q.shape[1], run.v.shape[1]) != (system.mechanism.nq, system.mechanism.nv):
        return ()
    with np.errstate(all="ignore"):  # the square of what exploded may overflow
        seen = _Seen(run, system)
        driven = tuple(_driven(seen))
        if driven:  # what the bodies then do follows from it
            return driven
        reasons = (_energy, _sank, _passed, _squeezed, _overran, _spun)
        unsolved = [remark for remark in run.remarks if remark == UNSOLVED]
        return tuple(unsolved + [why for reason in reasons for why in reason(seen)])


class _Seen:
    """A run with its scene, its mechanism and its shapes."""

    def __init__(self, run: Run, system: System) -> None:
        self.run = run
        self.system = system
        self.scene = system.scene
        self.bodies = system.scene.bodies
        self.mechanism = system.mechanism
        self.solids = system.solids  # by shape, without endless walls
        # smallest extent of each body; last, of the world
        self.sizes = np.full(len(self.bodies) + 1, math.inf)
        np.minimum.at(self.sizes, system.shapes.body, system.thickness)
        self.sizes[-1] = math.inf
        # the tree that a unilateral coupler moves without force, at times
        self.carried = system.tool_tree if run.coupling == "unilateral" else -1

    def trifle(self, bodies: Booleans) -> float:
        """Negligible energy [J] of some bodies: to lift each by a thousandth of its size; and
        rounding of the scene."""
        rounding = 1e-14 * np.max(self.run.energy.get("kinetic", 0.0))
        weights = norm(self.system.gravity) * self.mechanism.arrays.mass
        sizes = np.where(np.isinf(self.sizes), 0.0, self.sizes)[:-1]
        return rounding + 1e-3 * (weights * sizes)[bodies].sum()


# Energy and free motion


class _Book(NamedTuple):
    """Energies [J] of some trees of bodies."""

    name: str  # of the trees, empty for the whole scene
    friction: Floats  # (n,) its work
    excess: Floats  # (n,) energy that nothing explains
    at_hand: float  # energy available
    most: float  # largest excess of a sound run
    alone: bool = False  # whether it is one tree, with the work of its contacts in the balance


def _energy(seen: _Seen) -> Iterator[str]:
    """Say where energy exceeds that of the start plus the work done, and whether friction did
    positive work."""
    books = list(_books(seen))
    for book in books:
        k = np.argmax(book.excess)
        if not book.excess[k] <= book.most:  # it may be NaN
            whose = f"the energy of {book.name}" if book.name else "its energy"
            start = "start and the work of all forces" if book.alone else "start and work"
            yield (
                f"{whose} is {book.excess[k]:.3g} J above {start} at "
                f"{seen.run.time[k + 1]:.4g} s, where these are {book.at_hand:.3g} J"
            )
            break
    for book in books:
        most = book.friction.max()
        if not book.alone and not most <= book.most:
            yield f"friction drove {book.name or 'the bodies'}, by {most:.3g} J"
            break


def _books(seen: _Seen) -> Iterator[_Book]:
    """Yield the books of the scene, of groups of trees that touch, and of single trees, where there
    is a balance."""
    run = seen.run
    trees = seen.mechanism.tree_of_body
    if {"kinetic", "potential", "hand_work", "coupling_work"} <= run.energy.keys():
        yield _balance(seen, run.energy, trees >= 0, "")
    ledgers = {
        t: _ledger(seen, t)
        for t, (start, stop) in enumerate(seen.mechanism.tree_dofs)
        if start < stop and t != seen.carried
    }
    touching = np.stack([run.contacts.body_a, run.contacts.body_b])[:, run.contacts.body_b >= 0]
    group = joined(trees[-1] + 1, np.unique(trees[touching], axis=1).T)
    for number in np.unique(group):
        chosen = np.flatnonzero(group == number)
        members = [t for t in chosen.tolist() if t in ledgers]
        if members and seen.carried not in chosen:
            energy = {
                name: np.sum([ledgers[t][name] for t in members], axis=0)
                for name in ledgers[members[0]]
            }
            names = [_first_body(seen, t) for t in members[:3]] + ["others"] * (len(members) > 3)
            yield _balance(seen, energy, np.isin(trees, chosen), " and ".join(names))
    for t, energy in ledgers.items():
        yield _alone(seen, t, energy)


def _first_body(seen: _Seen, tree: int) -> str:
    return seen.run.body_names[np.argmax(seen.mechanism.tree_of_body == tree)]


def _ledger(seen: _Seen, tree: int) -> dict[str, Floats]:
    """Return the energy balance of one tree."""
    run = seen.run
    dofs = slice(*seen.mechanism.tree_dofs[tree])
    q = run.q[:, slice(*seen.mechanism.tree_coordinates[tree])]
    forces = {name: getattr(run, f"{name}_force")[:, dofs] for name in FORCES}
    impulse = np.ascontiguousarray(run.impulse[:, dofs])
    steps = Steps(q, run.v[:, dofs], forces, impulse, moved_straight(run))
    return energy_ledger(seen.mechanism.alone(tree), seen.system.gravity, steps)


def _alone(seen: _Seen, tree: int, energy: dict[str, Floats]) -> _Book:
    """Return the book of one tree with the work of its contacts.

    A step that was cut at a touch of the tree does not count: its forces are means, so that their
    work on a single tree is not known.
    """
    run = seen.run
    alone = seen.mechanism.alone(tree)
    dofs = slice(*seen.mechanism.tree_dofs[tree])
    forces = run.impulse[:, dofs], run.penalty_force[:, dofs], run.friction_force[:, dofs]
    cut = np.any(forces, axis=(0, 2)) & ~np.isnan(lost_within(run))
    gain = np.cumsum(np.where(cut, 0.0, np.diff(energy["integration_residual"], prepend=0.0)))
    kinds = {body.joint.kind for body in alone.bodies}
    steady = alone.has_constant_mass_matrix and kinds <= STEADY
    if steady:
        gain -= np.minimum.accumulate(np.minimum(gain, 0.0))
    taken = energy["penalty_work"], energy["friction_work"], -energy["impact_loss"]
    at_hand = _at_hand(energy) + sum(work.max(initial=0.0) for work in taken)
    most = (UNACCOUNTED if steady else SWING) * at_hand
    most += seen.trifle(seen.mechanism.tree_of_body == tree)
    return _Book(_first_body(seen, tree), energy["friction_work"], gain, at_hand, most, alone=True)


def _balance(seen: _Seen, energy: dict[str, Floats], bodies: Booleans, name: str) -> _Book:
    """Return the book of bodies that nothing else touches but walls, hand and coupling."""
    contacts = seen.run.contacts
    rows = slice(*contacts.offsets[:2])
    gap = contacts.gap[rows][bodies[contacts.body_a[rows]]]
    springs = _in_overlaps(seen, np.minimum(gap, 0.0), bodies)
    at_hand = _at_hand(energy) + springs
    total = energy["kinetic"] + energy["potential"]
    excess = total[1:] - _start(energy) - energy["hand_work"] - energy["coupling_work"]
    if "integration_residual" in energy:  # the book itself must not add any, either
        excess = np.maximum(excess, _made_inside(energy))
    friction = energy.get("friction_work", np.zeros(1))
    most = UNACCOUNTED * at_hand + seen.trifle(bodies)
    if not friction.max() <= most:
        # The ledger takes the way of the velocity after the force. Friction that only turns the
        # velocity, on a turntable, does no work.
        own = np.isin(seen.mechanism.tree_of_dof, seen.mechanism.tree_of_body[bodies])
        run = seen.run
        friction = np.cumsum(_work(run.friction_force[:, own], run.v[:, own], run.dt))
    return _Book(name, friction, excess - springs, at_hand, most)


def _start(energy: dict[str, Floats]) -> float:
    """Return the energy [J] at the start of the run, also where the arrays are a later part of it."""
    total = energy["kinetic"] + energy["potential"]
    if "integration_residual" not in energy:  # another engine gives a whole run
        return total[0]
    worked = energy["hand_work"] + energy["coupling_work"] + _made_inside(energy)
    return total[1] - worked[0]


def _made_inside(energy: dict[str, Floats]) -> Floats:
    """Return the energy (n,) [J] that contacts and integration have added since the start."""
    contacts = energy["penalty_work"] + energy["friction_work"] - energy["impact_loss"]
    return contacts + energy["integration_residual"]


def _in_overlaps(seen: _Seen, gap: Floats, bodies: Booleans) -> float:
    """Return the energy [J] that the overlaps of the first step may give the bodies.

    A rigid contact lifts its bodies out of an overlap, no faster than the overlap fades.
    """
    if seen.scene.contact.stiffness is not None:
        return 0.5 * seen.scene.contact.stiffness * np.sum(gap**2)
    depth = -gap.min(initial=0.0)
    mass = seen.mechanism.arrays.mass[bodies].sum()
    speed = depth / (FADING * seen.run.dt)
    gravity = norm(seen.system.gravity)
    return mass * (0.5 * speed**2 + gravity * depth)


def _at_hand(energy: dict[str, Floats]) -> float:
    """Return the energy available [J]: at the start, by loss of height, and by the work of hand and
    coupling."""
    works = energy["hand_work"], energy["coupling_work"]
    return _start(energy) - energy["potential"].min() + sum(np.abs(work).max() for work in works)


def _driven(seen: _Seen) -> Iterator[str]:
    """Say whether coupling and actuators gave tool and device energy that neither start nor hand
    explain.

    The energy of the coupling's springs counts while it acts. A unilateral coupler moves the tool
    where it does not act.
    """
    run = seen.run
    stiffness = np.array(run.coupling_settings.get("stiffness", ()))
    if "device_kinetic" not in run.energy or len(stiffness) != run.device_v.shape[1]:
        return
    tool = slice(*run.tool_dofs)
    tree = seen.system.device_mechanism()
    q = run.q[:, slice(*run.tool_coordinates)]
    v = run.v[:, tool]
    apart = tree.displacements(np.stack([q, run.device_q], axis=1).reshape(-1, q.shape[1]))
    springs = np.diff(0.5 * apart[::2] ** 2 @ stiffness)
    force = run.coupling_force[:, tool]
    springs[~force.any(axis=1)] = 0.0
    on_device = _work(run.device_force, run.device_v, run.dt)
    given = _rise(springs + _work(force, v, run.dt) + on_device)
    returned = _rise(_work(run.penalty_force[:, tool], v, run.dt)).max()
    energy = run.energy
    ports = [energy[name] for name in ("hand_work", "device_hand_work") if name in energy]
    # a real hand moves a real device, and its work is not known: so the device's energy counts, too
    at_hand = energy["kinetic"][0] + energy["device_kinetic"].max() + returned
    at_hand += np.ptp(energy["potential"]) + sum(np.abs(work).max() for work in ports)
    k = np.argmax(given)
    if not given[k] <= DRIVEN * at_hand + seen.trifle(seen.mechanism.tree_of_body >= 0):
        yield (
            f"the {run.coupling} coupling and its actuators gave tool and device {given[k]:.3g} J by "
            f"{run.time[k + 1]:.4g} s, where start, contacts and hand give {at_hand:.3g} J"
        )


def _work(force: Floats, v: Floats, dt: float) -> Floats:
    """Return the work (n,) [J] of a force (n, d) in each step: by the mean velocity, it is a force's
    share of kinetic energy."""
    return 0.5 * dt * np.einsum("nd,nd->n", force, v[1:] + v[:-1])


def _rise(work: Floats) -> Floats:
    """Return how far the sum of the works (n,) of the steps has risen above its least value
    before."""
    total = np.cumsum(work)
    return total - np.minimum.accumulate(np.minimum(total, 0.0))


def _spun(seen: _Seen) -> Iterator[str]:
    """Say which free body that carries nothing changes its spin or speed, gravity apart, while no
    force acts on it."""
    run = seen.run
    pushed = run.impulse != 0.0
    for name in FORCES:
        pushed |= getattr(run, f"{name}_force") != 0.0
    trees = seen.mechanism.tree_of_body.tolist()
    for b, body in enumerate(seen.bodies):
        flat = body.joint == "planar"
        free = trees.count(trees[b]) == 1 and (flat or body.joint == "free_flyer")
        if not free or trees[b] == seen.carried or any(body.joint_damping + body.joint_friction):
            continue
        dofs = slice(*seen.mechanism.tree_dofs[trees[b]])
        v = run.v[:, dofs]
        turn, _ = _frames(run, b, np.arange(run.steps + 1))
        if flat:
            angular = v * [0.0, 0.0, 1.0]
            linear = v * [1.0, 1.0, 0.0] @ rotation_of((0.0, 0.0, body.angle)).T
        else:
            angular = v[:, 3:]
            linear = (turn @ v[:, :3, None])[..., 0]
        inertia = seen.mechanism.arrays.inertia[b]
        spin = turn @ (angular @ inertia / norm(inertia, 2))[..., None]  # R I w / |I|
        arm = np.cross(angular, seen.mechanism.arrays.center_of_mass[b])
        speed = turn @ arm[..., None] + linear[..., None]
        falls = seen.system.gravity[:, None] * run.dt
        fastest = norm(linear, axis=1).max()
        for what, moved, due, most in (("spin", spin, 0.0, 0.0), ("speed", speed, falls, fastest)):
            changes = np.diff(moved, axis=0) - due
            changes[pushed[:, dofs].any(axis=1)] = 0.0
            drift = norm(np.cumsum(changes, axis=0), axis=1).max()
            share = drift / (max(norm(moved, axis=1).max(), most) + SLOW)
            if not share <= UNACCOUNTED:
                yield f"the {what} of {body.name} changes by {100.0 * share:.3g} % although nothing touches it"
                return


# Overlap and passage


def _sank(seen: _Seen) -> Iterator[str]:
    """Say where two bodies overlap by more than half of the thinner one, or a body by all of a
    wall's thickness."""
    run = seen.run
    table = run.contacts
    if not len(table.gap):
        return
    depth = -table.gap
    thinner = np.minimum(seen.sizes[table.body_a], seen.sizes[table.body_b])
    most = DEEP * thinner
    for wall in (solid for solid in seen.solids.values() if solid.body < 0):
        rows = np.flatnonzero((table.body_b < 0) & (depth > wall.thin))
        # on the surface of their wall
        ends = table.point[rows] + 0.5 * depth[rows, None] * table.normal[rows]
        rows = rows[np.abs(wall.height(ends)) < NEAR * depth[rows]]
        thinner[rows] = np.minimum(thinner[rows], wall.thin)
        most[rows] = np.minimum(most[rows], wall.thin)
    share = depth / most
    share[_landed(seen, np.flatnonzero((share > 1.0) & (depth < thinner)))] = 0.0
    i = np.argmax(share)
    if not share[i] <= 1.0:
        step = np.searchsorted(table.offsets, i, "right") - 1
        a, b = table.body_a[i], table.body_b[i]
        other = run.body_names[b] if b >= 0 else "a wall"
        limit = " (or the limit of its joint)" if seen.bodies[a].joint_limits else ""
        part = "all" if depth[i] >= thinner[i] else "more than half"
        yield (
            f"{run.body_names[a]} and {other}{limit} overlap by {in_metres(depth[i])} at "
            f"{run.time[step]:.4g} s, {part} of {in_metres(thinner[i])}"
        )


def _landed(seen: _Seen, rows: Integers) -> Integers:
    """Return the deep contacts that are landings, and their later ones while the overlap fades, up
    to the first that is neither.

    A landing is new, and its way in the step explains the overlap: the normal points to where the
    body came from, so it leaves on that side. A spring (`forces: paper`) would throw it out.
    """
    if seen.scene.contact.forces != "implicit":
        return rows[:0]
    table = seen.run.contacts
    landed = list[int]()
    step = np.searchsorted(table.offsets, np.arange(len(table.gap)), "right")
    pair = np.stack([step, table.body_a, table.body_b], axis=1)
    new = table.is_new & (table.gap >= LANDING * table.normal_velocity * seen.run.dt)
    for row in rows:
        fading = (
            (pair[before] + [1, 0, 0] == pair[row]).all()
            and table.gap[before] <= table.gap[row]
            and table.normal[before] @ table.normal[row] > ALONG
            for before in landed[-MANY:]
        )
        if not (new[row] or any(fading)):
            break
        landed.append(row)
    return np.array(landed, np.int64)


def _passed(seen: _Seen) -> Iterator[str]:
    """Say which body is the first to pass through a wall or another body within one step (see
    `_crosses`)."""
    run = seen.run
    names = shape_names(seen.scene)
    first = run.steps
    said = ""
    # how far any point of each body moves [m]; last, the world
    moved = np.zeros((run.steps, len(seen.sizes)))
    for b in range(len(run.body_names)):
        turn, origin = _frames(run, b, np.arange(run.steps + 1))
        reach = max((solid.reach for solid in seen.solids.values() if solid.body == b), default=0.0)
        turned = norm(np.diff(turn, axis=0), axis=(1, 2)) / math.sqrt(2.0)
        moved[:, b] = norm(np.diff(origin, axis=0), axis=1) + reach * turned
    top = moved.max(axis=0)
    places = _places(run)[:-1]
    for a, b in seen.system.pairs.tolist():
        one = seen.solids.get(a)
        other = seen.solids.get(b)
        if one is None or other is None:  # an endless wall
            continue
        far = FAST * min(one.thin, other.thin)
        if top[one.body] + top[other.body] <= far:
            continue
        way = moved[:first, one.body] + moved[:first, other.body]
        middle = other.points[0, : places.shape[2]]
        if other.body >= 0:
            middle = places[:first, other.body]
        apart = norm(places[:first, one.body] - middle, axis=1) - one.reach - other.reach
        k = np.flatnonzero((way > far) & (way >= apart))
        through = k[_crosses(run, one, other, k) | _crosses(run, other, one, k)]
        if len(through):
            first = through[0]
            said = f"{names[a]} passes through {names[b]}"
    if said:
        yield f"{said} in the step to {run.time[first + 1]:.4g} s"


def _crosses(run: Run, one: Solid, other: Solid, k: Integers) -> Booleans:
    """Whether the centre or a corner of one shape, moving straight in the frame of another, enters
    and leaves it."""
    ours, theirs = ([_frames(run, solid.body, at) for at in (k, k + 1)] for solid in (one, other))
    before, after = (
        (one.points @ np.swapaxes(turned, 1, 2) + (at - origin)[:, None]) @ turn
        for (turned, at), (turn, origin) in zip(ours, theirs, strict=True)
    )
    turns = [norm(end[0] - start[0], axis=(1, 2))[:, None] for start, end in (ours, theirs)]
    shift = np.diff(
        [at - origin for (_, at), (_, origin) in zip(ours, theirs, strict=True)], axis=0
    )
    # x'' of a path seen from a body that turns by ω: ω² x, and Coriolis' 2 ω v
    arc = (
        norm(one.points, axis=1) * turns[0] * (turns[0] + 2.0 * turns[1])
        + norm(before, axis=2) * turns[1] ** 2
        + math.sqrt(2.0) * norm(shift[0], axis=1)[:, None] * turns[1]
    ) / 8.0
    return np.asarray(other.crossed(before, after, arc, one.radius).any(axis=1))


def _places(run: Run) -> Floats:
    """Return where each body's origin is, (n + 1, bodies, 2 or 3)."""
    return run.pose[:, :, : 2 if run.pose.shape[2] == 3 else 3]


def _frames(run: Run, body: int, at: Integers) -> tuple[Floats, Floats]:
    """Return axes (n, 3, 3), as columns, and origin (n, 3) of a body, or of the world (-1), at some
    instants."""
    origin, axis = np.zeros((2, len(at), 3))  # the vector part of a quaternion
    w = np.ones(len(at))
    pose = run.pose[at, body]
    if body >= 0 and pose.shape[1] == 3:
        origin[:, :2] = pose[:, :2]
        axis[:, 2] = np.sin(0.5 * pose[:, 2])
        w = np.cos(0.5 * pose[:, 2])
    elif body >= 0:
        origin = pose[:, :3]
        axis = pose[:, 3:6]
        w = pose[:, 6]
    cross = np.cross(np.eye(3), axis[:, None])
    return np.eye(3) + 2.0 * (w[:, None, None] * cross + cross @ cross), origin


def _squeezed(seen: _Seen) -> Iterator[str]:
    """Say which body moves on by more than its size in a gap that is a tenth of its size too
    narrow."""
    run = seen.run
    table = run.contacts
    step_of = np.repeat(np.arange(run.steps), np.diff(table.offsets))
    fixed = table.body_b < 0
    # of two opposed contacts one has half of the overlap
    deep = fixed & (table.gap < -0.5 * NARROW * seen.sizes[table.body_a])
    for b, size in enumerate(seen.sizes[:-1]):
        own = fixed & (table.body_a == b)
        widest = 0.0
        caught = list[int]()
        for step in np.unique(step_of[own & deep]):
            rows = np.flatnonzero(own[slice(*table.offsets[step : step + 2])]) + table.offsets[step]
            facing = table.normal[rows] @ table.normal[rows].T < -0.9
            narrow = -np.add.outer(table.gap[rows], table.gap[rows])[facing].min(initial=0.0)
            if narrow > NARROW * size:
                caught.append(step)
                widest = max(widest, narrow)
        places = _places(run)[caught, b]
        far = norm(places - places[:1], axis=1).max(initial=0.0)
        if far > size:
            name = run.body_names[b]
            narrower = in_metres(widest)
            yield f"{name} goes on by {in_metres(far)} in a gap that is {narrower} narrower than it"
            return


def _overran(seen: _Seen) -> Iterator[str]:
    """Say which joint goes beyond a limit by more than half of its range, or by more than OVERRUN
    at the end."""
    run = seen.run
    most = OVERRUN[seen.scene.contact.forces]
    stops = seen.system.stops
    for i, (low, high) in zip(stops.coordinate[::2], stops.bound.reshape(-1, 2), strict=True):
        beyond = np.maximum(low - run.q[:, i], run.q[:, i] - high) / (high - low)
        k = -1 if beyond[-1] > most else beyond.argmax()
        if k == -1 or beyond[k] > DEEP:
            yield (
                f"{run.coordinate_names[i]} is {run.q[k, i]:.3g} at {run.time[k]:.4g} s, beyond "
                f"its limits {low:g} and {high:g} by {beyond[k]:.3g} times their range"
            )
            return
