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

from iapb.contact.kernels.implicit import FADING
from iapb.contact.solids import Solid, joined
from iapb.mechanics.energy import FORCES, Steps, energy_ledger, lost_within, moved_straight
from iapb.mechanics.rotations import rotation_of
from iapb.names import in_metres
from iapb.numerics.schema import Booleans, Floats, Integers
from iapb.run import UNSOLVED, Run
from iapb.scene.bodies import inertia_matrix
from iapb.scene.mechanism import limits_of, shape_names
from iapb.scene.model import scene_kind
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
WILD = 10.0  # factor on the farthest distance that start, speed and acceleration explain


def distrust_of(run: Run, system: System | None = None) -> tuple[str, ...]:
    """Return the reasons why a result is not to be trusted, from the record alone; empty if nothing
    is wrong.

    `system` is that of the record's scene; without it, it is made from the record.
    """
    if not (np.isfinite(run.q).all() and np.isfinite(run.v).all()):
        return ("positions or velocities are not finite",)
    if not run.steps or [body.get("name") for body in run.scene_resolved.get("bodies", ())] != [
        *run.body_names
    ]:
        return ()
    with np.errstate(all="ignore"):  # the square of what exploded may overflow
        seen = _Seen(run, system)
        if (seen.mechanism.nq, seen.mechanism.nv) != (run.q.shape[1], run.v.shape[1]):
            return ()  # the record's scene does not describe its bodies
        driven = tuple(_driven(seen))
        if driven:  # what the bodies then do follows from it
            return driven
        reasons = (_energy, _sank, _passed, _squeezed, _flew, _overran, _spun)
        unsolved = [remark for remark in run.remarks if remark == UNSOLVED]
        return tuple(unsolved + [why for reason in reasons for why in reason(seen)])


class _Seen:
    """A run with its scene, made again from the record, its mechanism and its shapes."""

    def __init__(self, run: Run, system: System | None) -> None:
        if system is None:
            values = run.scene_resolved
            system = System(scene_kind(values).model_validate(values))
        self.run = run
        self.scene = system.scene
        self.bodies = system.scene.bodies
        self.mechanism = system.mechanism
        self.gravity = system.gravity
        self.solids = system.solids  # by shape, without endless walls
        self.names = shape_names(system.scene)
        self.pairs = system.pairs[np.isin(system.pairs, [*self.solids]).all(axis=1)]
        self.sizes = np.full(
            len(self.bodies) + 1, math.inf
        )  # smallest extent of each body; last, of the world
        for solid in (solid for solid in self.solids.values() if solid.body >= 0):
            self.sizes[solid.body] = min(self.sizes[solid.body], solid.thin)
        # the first state that forces explain: a later part of a run begins with the state at the
        # whole run's start
        self.begin = int(run.time[0] > 0.0)
        # start, stop in v of a tool that its coupler moves without force, at times; or 0, 0
        self.carried = run.tool_dofs if run.coupling == "unilateral" else (0, 0)

    def trifle(self, bodies: Booleans) -> float:
        """Negligible energy [J] of some bodies: to lift each by a thousandth of its size; and
        rounding of the scene."""
        rounding = (
            1e-14 * float(self.run.energy["kinetic"].max(initial=0.0))
            if "kinetic" in self.run.energy
            else 0.0
        )
        weights = np.linalg.norm(self.gravity) * np.array([body.mass for body in self.bodies])
        return rounding + float(
            (1e-3 * weights * np.where(np.isinf(self.sizes), 0.0, self.sizes)[:-1])[bodies].sum()
        )


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
        k = int(np.argmax(book.excess))
        if not book.excess[k] <= book.most:  # it may be NaN
            start = "start and the work of all forces" if book.alone else "start and work"
            yield (
                f"{f'the energy of {book.name}' if book.name else 'its energy'} is "
                f"{book.excess[k]:.3g} J above "
                f"{start} at {seen.run.time[k - len(book.excess)]:.4g} s, where these are "
                f"{book.at_hand:.3g} J"
            )
            break
    for book in books:
        most = float(book.friction.max(initial=0.0))
        if not book.alone and not most <= book.most:
            yield f"friction drove {book.name or 'the bodies'}, by {most:.3g} J"
            break


def _books(seen: _Seen) -> Iterator[_Book]:
    """Yield the books of the scene, of groups of trees that touch, and of single trees, where there
    is a balance."""
    run = seen.run
    mechanism = seen.mechanism
    begin = seen.begin
    trees = mechanism.tree_of_body
    ranges = mechanism.tree_dofs
    ledgers = dict[int, dict[str, Floats]]()
    roots = np.searchsorted(trees, np.arange(len(ranges)))
    if {"kinetic", "potential", "hand_work", "coupling_work"} <= set(run.energy):
        yield _balance(seen, run.energy, 0, trees >= 0, "")
    moving = [t for t, (start, stop) in enumerate(ranges) if start < stop and run.steps > begin]
    for t in (t for t in moving if ranges[t] != seen.carried):
        alone = mechanism.alone(t)
        dofs = slice(*ranges[t])
        q = int(mechanism.arrays.q_start[trees == t].min())
        forces = {name: getattr(run, f"{name}_force")[begin:, dofs] for name in FORCES}
        states = run.q[begin:, q : q + alone.nq], run.v[begin:, dofs]
        impulse = np.ascontiguousarray(run.impulse[begin:, dofs])
        steps = Steps(*states, forces, impulse, moved_straight(run))
        ledgers[t] = energy_ledger(alone, seen.gravity, steps)
    touching = np.stack([run.contacts.body_a, run.contacts.body_b])[:, run.contacts.body_b >= 0]
    group = joined(len(ranges), np.unique(trees[touching], axis=1).T)
    for chosen in (np.flatnonzero(group == g) for g in np.unique(group)):
        members = [t for t in chosen.tolist() if t in moving]
        if members and len(chosen) < len(group) and all(t in ledgers for t in members):
            energy = {
                name: np.sum([ledgers[t][name] for t in members], axis=0)
                for name in ledgers[members[0]]
            }
            names = [run.body_names[roots[t]] for t in members[:3]] + ["others"] * (
                len(members) > 3
            )
            yield _balance(seen, energy, begin, np.isin(trees, chosen), " and ".join(names))
    for t, energy in ledgers.items():
        alone = mechanism.alone(t)
        gain = _of_whole_steps(seen, energy["integration_residual"], slice(*ranges[t]))
        steady = (
            alone.has_constant_mass_matrix and {body.joint.kind for body in alone.bodies} <= STEADY
        )
        gain = gain - np.minimum.accumulate(np.minimum(gain, 0.0)) if steady else gain
        taken = (energy["penalty_work"], energy["friction_work"], -energy["impact_loss"])
        at_hand = _at_hand(energy) + sum(float(work.max(initial=0.0)) for work in taken)
        most = (UNACCOUNTED if steady else SWING) * at_hand + seen.trifle(trees == t)
        yield _Book(
            run.body_names[roots[t]], energy["friction_work"], gain, at_hand, most, alone=True
        )


def _of_whole_steps(seen: _Seen, residual: Floats, dofs: slice) -> Floats:
    """Return the residual of one tree without the steps that were cut at its touches: their forces
    are means, so that the work of a single tree is not known."""
    run = seen.run
    begin = seen.begin
    forces = [run.impulse, run.penalty_force, run.friction_force]
    touched = np.any([force[begin:, dofs].any(axis=1) for force in forces], axis=0)
    cut = ~np.isnan(lost_within(run))[begin:] & touched
    return np.asarray(np.cumsum(np.where(cut, 0.0, np.diff(residual, prepend=0.0))), np.float64)


def _balance(
    seen: _Seen, energy: dict[str, Floats], begin: int, bodies: Booleans, name: str
) -> _Book:
    """Return the book of bodies that nothing else touches but walls, hand and coupling."""
    contacts = seen.run.contacts
    rows = slice(*contacts.offsets[begin : begin + 2].tolist())
    gap = contacts.gap[rows][bodies[contacts.body_a[rows]]]
    springs = _in_overlaps(seen, np.minimum(gap, 0.0), bodies)
    total = energy["kinetic"] + energy["potential"]
    at_hand = _at_hand(energy) + springs
    excess = total[1:] - (total[0] + springs + energy["hand_work"] + energy["coupling_work"])
    friction = energy.get("friction_work", np.zeros(0))
    most = UNACCOUNTED * at_hand + seen.trifle(bodies)
    if not friction.max(initial=0.0) <= most:
        friction = friction - np.cumsum(_booked_late(seen, begin, bodies))
    return _Book(name, friction, excess, at_hand, most)


def _booked_late(seen: _Seen, begin: int, bodies: Booleans) -> Floats:
    """Return how much too high each step's work of friction F is booked (n,) [J]: F M⁻¹ F Δt²/2.

    The ledger takes the way of the velocity after the force, kinetic energy that of the mean
    velocity. Friction that only turns the velocity, on a turntable, does no work.
    """
    run = seen.run
    mechanism = seen.mechanism
    late = np.zeros(seen.run.steps - begin)
    for t in np.unique(mechanism.tree_of_body[bodies]).tolist():
        dofs = slice(*mechanism.tree_dofs[t])
        force = run.friction_force[begin:, dofs]
        rows = np.flatnonzero(force.any(axis=1))
        constant = mechanism.alone(t).has_constant_mass_matrix
        for k in rows[: 1 if constant else None].tolist():
            at = rows if constant else k
            inverse = np.linalg.inv(mechanism.mass_matrix(run.q[begin + k])[dofs, dofs])
            late[at] += 0.5 * run.dt**2 * np.sum(force[at] @ inverse * force[at], axis=-1)
    return late


def _in_overlaps(seen: _Seen, gap: Floats, bodies: Booleans) -> float:
    """Return the energy [J] that the overlaps of the first step may give the bodies.

    A rigid contact lifts its bodies out of an overlap, no faster than the overlap fades.
    """
    if seen.scene.contact.stiffness is not None:
        return 0.5 * seen.scene.contact.stiffness * float(np.sum(gap**2))
    depth = -float(gap.min(initial=0.0))
    mass = sum(body.mass for body, chosen in zip(seen.bodies, bodies, strict=True) if chosen)
    speed = depth / (FADING * seen.run.dt)
    gravity = float(np.linalg.norm(seen.gravity))
    return mass * (0.5 * speed**2 + gravity * depth)


def _at_hand(energy: dict[str, Floats]) -> float:
    """Return the energy available [J]: at the start, by loss of height, and by the work of hand and
    coupling."""
    worked = sum(
        float(np.abs(energy[name]).max(initial=0.0)) for name in ("hand_work", "coupling_work")
    )
    return float(energy["kinetic"][0] + energy["potential"][0] - energy["potential"].min()) + worked


def _driven(seen: _Seen) -> Iterator[str]:
    """Say whether coupling and actuators gave tool and device energy that neither start nor hand
    explain.

    The energy of the coupling's springs counts while it acts. A unilateral coupler moves the tool
    where it does not act.
    """
    run = seen.run
    begin = seen.begin
    tool = slice(*seen.run.tool_dofs)
    stiffness = np.array(run.coupling_settings.get("stiffness", ()))
    known = "device_kinetic" in run.energy and len(stiffness) == run.device_v.shape[1]
    if not known or run.steps <= begin:
        return
    tree = seen.mechanism.alone(seen.mechanism.tree_dofs.index(run.tool_dofs))
    q = run.q[begin:, slice(*run.tool_coordinates)]
    v = run.v[begin:, tool]
    apart = tree.displacements(np.stack([q, run.device_q[begin:]], axis=1).reshape(-1, q.shape[1]))
    springs = np.diff(0.5 * apart[::2] ** 2 @ stiffness)
    force = run.coupling_force[begin:, tool]
    springs[~force.any(axis=1)] = 0.0
    work = springs + _work(force, v, run.dt)
    work += _work(run.device_force[begin:], run.device_v[begin:], run.dt)
    given = _rise(work)
    returned = _rise(_work(run.penalty_force[begin:, tool], v, run.dt)).max()
    energy = run.energy
    ports = [energy[name] for name in ("hand_work", "device_hand_work") if name in energy]
    # a real hand moves a real device, and its work is not known: so the device's energy counts, too
    at_hand = energy["kinetic"][0] + energy["device_kinetic"].max() + returned
    at_hand += np.ptp(energy["potential"]) + sum(np.abs(work).max() for work in ports)
    k = int(np.argmax(given))
    if not given[k] <= DRIVEN * at_hand + seen.trifle(seen.mechanism.tree_of_body >= 0):
        yield (
            f"the {run.coupling} coupling and its actuators gave tool and device {given[k]:.3g} J by "
            f"{run.time[begin + 1 + k]:.4g} s, where start, contacts and hand give {at_hand:.3g} J"
        )


def _work(force: Floats, v: Floats, dt: float) -> Floats:
    """Return the work (n,) [J] of a force (n, d) in each step: by the mean velocity, it is a force's
    share of kinetic energy."""
    return np.asarray(0.5 * dt * np.einsum("nd,nd->n", force, v[1:] + v[:-1]), np.float64)


def _rise(work: Floats) -> Floats:
    """Return how far the sum of the works (n,) of the steps has risen above its least value
    before."""
    total = np.cumsum(work)
    return np.asarray(total - np.minimum.accumulate(np.minimum(total, 0.0)), np.float64)


def _spun(seen: _Seen) -> Iterator[str]:
    """Say which free body that carries nothing changes its spin or speed, gravity apart, while no
    force acts on it."""
    run = seen.run
    begin = seen.begin
    forces = [run.impulse, *(getattr(run, f"{name}_force") for name in FORCES)]
    trees = seen.mechanism.tree_of_body.tolist()
    for b, body in enumerate(seen.bodies):
        own = seen.mechanism.tree_dofs[trees[b]]
        free = (
            body.joint in ("planar", "free_flyer")
            and trees.count(trees[b]) == 1
            and not any((*body.joint_damping, *body.joint_friction))
        )
        if not free or own == seen.carried or run.steps <= begin:
            continue
        dofs = slice(*own)
        alone = ~np.any([force[begin:, dofs].any(axis=1) for force in forces], axis=0)[
            :, None, None
        ]
        v = run.v[begin:, dofs]
        flat = body.joint == "planar"
        turn = _frames(run, b, np.arange(begin, run.steps + 1))[0]
        turning, origin = (
            (v * [0.0, 0.0, 1.0], v * [1.0, 1.0, 0.0]) if flat else (v[:, 3:], v[:, :3])
        )
        inertia = np.eye(3) if flat else inertia_matrix(body.inertia)
        spin = turn @ (turning @ inertia / np.linalg.norm(inertia, 2))[..., None]  # R I w / |I|
        arm = np.cross(turning, np.array([*body.center_of_mass, 0.0])[:3])
        speed = (
            turn @ arm[..., None]
            + (rotation_of((0.0, 0.0, body.angle)) if flat else turn) @ origin[..., None]
        )
        falls = seen.gravity[:, None] * run.dt
        fastest = np.linalg.norm(origin, axis=1).max()
        for what, moved, due, most in (("spin", spin, 0.0, 0.0), ("speed", speed, falls, fastest)):
            drift = np.linalg.norm(
                np.cumsum(alone * (np.diff(moved, axis=0) - due), axis=0), axis=1
            ).max()
            share = float(drift / (max(np.linalg.norm(moved, axis=1).max(), most) + SLOW))
            if not share <= UNACCOUNTED:
                yield f"the {what} of {body.name} changes by {100.0 * share:.3g} % although nothing touches it"
                return


# Overlap and passage


def _sank(seen: _Seen) -> Iterator[str]:
    """Say where two bodies overlap by more than half of the thinner one, or a body by all of a
    wall's thickness."""
    run = seen.run
    table = seen.run.contacts
    thinner = np.minimum(seen.sizes[table.body_a], seen.sizes[table.body_b])
    most = DEEP * thinner
    for wall in (solid for solid in seen.solids.values() if solid.body < 0):
        rows = np.flatnonzero((table.body_b < 0) & (table.gap < -wall.thin))
        # on the surface of their wall
        ends = table.point[rows] - 0.5 * table.gap[rows, None] * table.normal[rows]
        rows = rows[np.abs(wall.height(ends)) < -NEAR * table.gap[rows]]
        thinner[rows] = np.minimum(thinner[rows], wall.thin)
        most[rows] = np.minimum(most[rows], wall.thin)
    share = -table.gap / most
    share[_landed(seen, np.flatnonzero((share > 1.0) & (-table.gap < thinner)))] = 0.0
    i = int(np.argmax(share)) if len(share) else -1
    if i >= 0 and not share[i] <= 1.0:
        k = int(np.searchsorted(table.offsets, i, "right")) - 1
        a, b = (
            run.body_names[x] if x >= 0 else "a wall" for x in (table.body_a[i], table.body_b[i])
        )
        b += " (or the limit of its joint)" if seen.bodies[table.body_a[i]].joint_limits else ""
        part = "all" if -table.gap[i] >= thinner[i] else "more than half"
        yield (
            f"{a} and {b} overlap by {in_metres(-float(table.gap[i]))} at {run.time[k]:.4g} s, "
            f"{part} of "
            f"{in_metres(float(thinner[i]))}"
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
    for row in rows.tolist():
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
    first = seen.run.steps
    said = ""
    moved = np.zeros(
        (run.steps, len(seen.sizes))
    )  # how far any point of each body moves [m]; last, the world
    for b in range(len(run.body_names)):
        turn, origin = _frames(run, b, np.arange(run.steps + 1))
        reach = max((solid.reach for solid in seen.solids.values() if solid.body == b), default=0.0)
        turned = np.linalg.norm(np.diff(turn, axis=0), axis=(1, 2)) / math.sqrt(2.0)
        moved[:, b] = np.linalg.norm(np.diff(origin, axis=0), axis=1) + reach * turned
    top = moved.max(axis=0)
    places = _places(run)[:-1]
    for a, b in seen.pairs.tolist():
        one = seen.solids[a]
        other = seen.solids[b]
        far = FAST * min(one.thin, other.thin)
        if top[one.body] + top[other.body] <= far:
            continue
        way = moved[:first, one.body] + moved[:first, other.body]
        middle = (
            other.points[0, : places.shape[2]] if other.body < 0 else places[:first, other.body]
        )
        apart = np.linalg.norm(places[:first, one.body] - middle, axis=1) - one.reach - other.reach
        k = np.flatnonzero((way > far) & (way >= apart))
        through = k[_crosses(run, one, other, k) | _crosses(run, other, one, k)] if len(k) else k
        if len(through):
            first = int(through[0])
            said = f"{seen.names[a]} passes through {seen.names[b]}"
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
    turns = [
        np.linalg.norm(end[0] - start[0], axis=(1, 2))[:, None] for start, end in (ours, theirs)
    ]
    shift = np.diff(
        [at - origin for (_, at), (_, origin) in zip(ours, theirs, strict=True)], axis=0
    )
    # x'' of a path seen from a body that turns by ω: ω² x, and Coriolis' 2 ω v
    arc = (
        np.linalg.norm(one.points, axis=1) * turns[0] * (turns[0] + 2.0 * turns[1])
        + np.linalg.norm(before, axis=2) * turns[1] ** 2
        + math.sqrt(2.0) * np.linalg.norm(shift[0], axis=1)[:, None] * turns[1]
    ) / 8.0
    return np.asarray(other.crossed(before, after, arc, one.radius).any(axis=1))


def _places(run: Run) -> Floats:
    """Return where each body's origin is, (n + 1, bodies, 2 or 3)."""
    return run.pose[:, :, : 2 if run.pose.shape[2] == 3 else 3]


def _frames(run: Run, body: int, at: Integers) -> tuple[Floats, Floats]:
    """Return axes (n, 3, 3), as columns, and origin (n, 3) of a body, or of the world (-1), at some
    instants."""
    turn = np.tile(np.eye(3), (len(at), 1, 1))
    origin = np.zeros((len(at), 3))
    pose = run.pose[at, body]
    if body >= 0 and run.pose.shape[2] == 3:
        origin[:, :2] = pose[:, :2]
        c = np.cos(pose[:, 2])
        s = np.sin(pose[:, 2])
        turn[:, :2, :2] = np.stack([c, -s, s, c], axis=1).reshape(-1, 2, 2)
    elif body >= 0:
        origin = pose[:, :3]
        x, y, z, w = pose[:, 3:].T
        o = np.zeros(len(at))
        cross = np.stack([o, -z, y, z, o, -x, -y, x, o], axis=1).reshape(-1, 3, 3)
        turn = turn + 2.0 * (w[:, None, None] * cross + cross @ cross)
    return turn, origin


def _squeezed(seen: _Seen) -> Iterator[str]:
    """Say which body moves on by more than its size in a gap that is a tenth of its size too
    narrow."""
    run = seen.run
    table = seen.run.contacts
    for b, size in enumerate(seen.sizes[:-1].tolist()):
        rows = np.flatnonzero((table.body_a == b) & (table.body_b < 0) & (table.gap < 0.0))
        # of two opposed contacts one has half of the overlap
        if not (table.gap[rows] < -0.5 * NARROW * size).any():
            continue
        step = np.searchsorted(table.offsets, rows, "right") - 1
        caught = [np.zeros(0, np.int64)]
        widest = 0.0
        # the contacts of a step are consecutive
        for apart in range(1, int(np.bincount(step - step[0]).max())):
            one = rows[:-apart]
            other = rows[apart:]
            narrow = -(table.gap[one] + table.gap[other])
            facing = np.einsum("ij,ij->i", table.normal[one], table.normal[other]) < -0.9
            held = (step[:-apart] == step[apart:]) & facing & (narrow > NARROW * size)
            caught.append(step[:-apart][held])
            widest = max(widest, float(narrow[held].max(initial=0.0)))
        places = _places(run)[np.unique(np.concatenate(caught)), b]
        far = float(np.linalg.norm(places - places[:1], axis=1).max(initial=0.0))
        if far > size:
            yield (
                f"{run.body_names[b]} goes on by {in_metres(far)} in a gap that is "
                f"{in_metres(widest)} narrower "
                "than it"
            )
            return


def _flew(seen: _Seen) -> Iterator[str]:
    """Say which position is farther than start, speed and acceleration can explain."""
    run = seen.run
    lengths = [i for i, unit in enumerate(seen.run.coordinate_units) if unit == "m"]
    moved = np.abs(run.q - run.q[0]).max(axis=0)[lengths]
    time = float(run.time[-1])
    masses = [body.mass for body in seen.bodies if body.mass]
    push = float(np.linalg.norm(run.hand_force, axis=1).max(initial=0.0)) / min(masses, default=1.0)
    reach = float(np.abs(run.q[0]).max() + seen.sizes[np.isfinite(seen.sizes)].max(initial=0.0))
    reach += float(
        np.abs(run.v[0]).max() * time + 0.5 * (np.linalg.norm(seen.gravity) + push) * time**2
    )
    if lengths and not moved.max() <= WILD * reach:
        name = run.coordinate_names[lengths[int(moved.argmax())]]
        yield f"{name} moves by {in_metres(float(moved.max()))}, where {in_metres(reach)} can be explained"


def _overran(seen: _Seen) -> Iterator[str]:
    """Say which joint goes beyond a limit by more than half of its range, or by more than OVERRUN
    at the end."""
    run = seen.run
    most = OVERRUN[seen.scene.contact.forces]
    limited = zip(seen.mechanism.arrays.q_start, limits_of(seen.scene), strict=True)
    for i, (low, high) in ((i, limits) for i, limits in limited if limits):
        beyond = np.maximum(low - run.q[:, i], run.q[:, i] - high) / (high - low)
        k = len(beyond) - 1 if beyond[-1] > most else int(beyond.argmax())
        if beyond[k] > (most if k == len(beyond) - 1 else DEEP):
            yield (
                f"{run.coordinate_names[i]} is {run.q[k, i]:.3g} at {run.time[k]:.4g} s, beyond "
                f"its limits {low:g} "
                f"and {high:g} by {beyond[k]:.3g} times their range"
            )
            return
