"""The contact law of the "ideal" world and of CBuc: rigid contacts at velocity level, one QP per
step.

The mechanism moves on its own for half a step, by `reference.free_motion`. There, at Moreau's
midpoint, forces and impulses act by `reference.rigid_step` (Moreau/Jean, Stewart-Trinkle/Anitescu,
Poisson; dry friction). Then it moves on for the other half. So smooth motion has order two, also
with contacts that rest or slide and with joint damping. What stays of order one: the moment of an
impact, a corner that turns where friction holds it, and scenes with a hand, in which all acts at the
start of the step. This module makes both a contact law that runs on every scene.

Contacts are found and recorded at the midpoint.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.contact.geometry import BOX, BOX_CORNERS, ENDLESS, POLYGON
from iapb.contact.laws import FRICTION, IMPACT_FRICTION, JOINTS, OWN_RESTITUTION, StepResult
from iapb.errors import ArgumentError
from iapb.names import one_of
from iapb.run import COLLIDING, FREE, RESTING
from iapb.system import System
from reference import Floats, contact_rows
from reference.free_motion import free_motion
from reference.one_thread import one_thread
from reference.rigid_step import (
    StepContacts,
    friction_step,
    rigid_step,
    velocity_bounds,
)

# Entries of J in one step, which then takes 4 GB and about 15 s. 320 circles on a floor reach this
# limit.
MOST_ENTRIES = 50_000_000
# Measured on AMD EPYC (Zen 4) with 5 to 100 circles and boxes on a floor: 0.13 to 0.9 µs per entry
# from 50 on.
SECONDS_A_STEP = 1e-3
SECONDS_AN_ENTRY = 3e-7

FRICTION_LAWS = ("none", "coulomb")


class _Solved(NamedTuple):
    """Result of a step with c contacts and d velocities; impulses in [N s]."""

    velocity: Floats  # (d,) v⁺
    normal: Floats  # (c,)
    tangential: Floats  # (c, 3) in world axes
    dragging: Floats  # (d, c) generalized impulse of each of them


@dataclass(frozen=True)
class RigidConstraints:
    """The law of the rigid worlds: non-penetration is a constraint on the velocity at the end of
    each step.

    Parameters
    ----------
    friction : "none" (the paper's rigid worlds), or "coulomb" with the scene's coefficient

    Restitution follows Newton's law with the scene's value for each pair. Poisson's law is used in
    frictionless steps where values differ, or for which Newton's law has no solution or would gain
    energy. The latter can happen with one e for all contacts, too (see `reference.rigid_step`).
    With friction, Newton's law may gain energy.
    """

    friction: str = "none"
    name = "rigid constraints"

    def __post_init__(self) -> None:
        if self.friction not in FRICTION_LAWS:
            raise ArgumentError("friction", self.friction, one_of(self.friction, FRICTION_LAWS))

    @property
    def uses(self) -> frozenset[str]:
        """Parts of the scene that the law uses: restitution, joints, and friction unless `friction`
        is "none"."""
        friction = () if self.friction == "none" else (FRICTION, IMPACT_FRICTION)
        return frozenset((OWN_RESTITUTION, JOINTS, *friction))

    @property
    def settings(self) -> dict[str, Any]:
        """All parameters of a step besides the scene, which gives the coefficients of restitution
        and friction."""
        return {
            "friction": self.friction,
            "restitution where Newton's law has no solution or gains energy": "Poisson",
        }

    def cost(self, system: System) -> Cost:
        """Estimate the cost of a step from the scene alone, with the contacts of every pair of
        shapes, near or far.

        A circle or ball has one contact with anything, two boxes in the plane up to two, and in
        space up to eight.
        """
        kind = system.shapes.kind
        d = system.mechanism.nv
        points = np.where(
            np.isin(kind, (BOX, *ENDLESS)), BOX_CORNERS, np.where(kind == POLYGON, 2, 1)
        )
        contacts = int(points[system.pairs].min(axis=1).sum()) + len(system.stops.bound)
        return Cost(contacts, d, SECONDS_A_STEP + SECONDS_AN_ENTRY * contacts * d)

    @one_thread()
    def advance(self, system: System, state: Any, applied_force: Floats, dt: float) -> StepResult:
        """Do one step (see `iapb.contact.laws.ContactLaw`).

        Impulses are reported as collision impulses at contacts that approached faster than the
        scene's approach velocity, and at pushing contacts connected to them through bodies. The
        others are reported as forces p/dt. The step only determines the sum of both. Collision
        impulses include the loads of the step; with e near 1 their work may exceed the energy loss.
        With joint damping, a step with a collision has two parts: the collision, then forces and
        damping.
        """
        entries = len(system.pairs) * system.mechanism.nv
        if entries > MOST_ENTRIES // BOX_CORNERS and (cost := self.cost(system)).too_large:
            raise ArgumentError(
                "scene",
                system.scene.name,
                f"at most {MOST_ENTRIES:,} numbers in the rows of a rigid "
                f"step; {cost.contacts:,} contacts of {cost.coordinates:,} coordinates have "
                f"{cost.contacts * cost.coordinates:,}. Fewer bodies, or the world IAPB",
            )
        mechanics = contact_rows.mechanics_of(system)
        g = system.gravity
        before = _share_before(system, state) * dt
        q = state.q.copy()
        v = state.v.copy()
        if before:
            q, v = free_motion(mechanics, q, v, before)
        mass = mechanics.mass_matrix(q)
        found = contact_rows.find_rows(system, q, v, np.inf)
        # B belongs to the free motion after the forces; where it is zero, its rounding errors keep
        # their old place.
        inner = mechanics.gravity(q, g) if mechanics.has_bias else mechanics.inner_forces(q, v, g)
        force = applied_force - inner
        # Joint damping is implicit, by M + θ Δt D.
        damping = system.joint_damping
        approach = system.scene.contact.approach_velocity
        damps = bool(damping.any())
        implicit = _implicit_share(mass, damping, dt)
        damped = mass + implicit * dt * np.diag(damping) if damps else mass
        thrown = v
        removed = _removed(state, found, dt) if before else np.zeros(len(found.gap))
        struck = step = self._solve(system, damped, q, v, force - damping * v, dt, found, removed)
        blows = _blows(mass, found, step.normal, approach)
        lasts = ~blows
        if damps and blows.any():
            # The collision comes first, with M alone: an impulse p solved with damping could gain
            # energy on M.
            struck = self._solve(system, mass, q, v, np.zeros_like(v), dt, found, removed)
            blows, lasts = (
                _blows(mass, found, struck.normal, approach),
                np.ones(len(blows), np.bool_),
            )
            thrown = v + np.linalg.solve(mass, _sum_of(found, struck, blows))
            moved = replace(found, gamma=found.jacobian @ thrown)
            step = self._solve(
                system, damped, q, thrown, force - damping * thrown, dt, moved, removed
            )
        impulse = _sum_of(found, struck, blows)
        pressing = (found.jacobian.T * step.normal)[:, lasts].sum(axis=1) / dt
        dragging = step.dragging[:, lasts].sum(axis=1) / dt
        blow = np.where(blows, struck.normal, 0.0)
        pushed = np.where(lasts, step.normal, 0.0)
        contact_rows.write_contacts(
            state, found, blow, pushed, np.where(lasts[:, None], step.tangential, 0.0), dt
        )
        contact_rows.write_impact(state, system, v, mass, impulse, found.jacobian[blows])
        q_plus, v_plus = free_motion(mechanics, q, step.velocity, dt - before)
        touches = ((found.gap <= 0.0) | (step.normal > 0.0)).any()
        contact_state = COLLIDING if blows.any() else RESTING if touches else FREE
        if damps:
            dragging -= damping * (implicit * step.velocity + (1.0 - implicit) * thrown)
        return StepResult(q_plus, v_plus, pressing, dragging, impulse, contact_state)

    def _solve(
        self,
        system: System,
        mass: Floats,
        q: Floats,
        v: Floats,
        force: Floats,
        dt: float,
        found: contact_rows.ContactRows,
        removed: Floats,
    ) -> _Solved:
        values = system.restitutions
        of_pairs, mu = system.surfaces.by_pair(np.stack(found.geometry[:2], axis=1))
        e: float | Floats = (
            float(values[0]) if len(values) else float(system.scene.contact.restitution)
        )
        differs = len(values) > 1  # among pairs that can touch: one e for each contact
        if differs:
            e = of_pairs
        removed = removed * np.equal(e, 0.0)
        if self.friction == "none" or not system.surfaces.friction.any():
            # Contacts that touch together must act together, wherever in a step they do.
            contacts = StepContacts(found.jacobian, found.gap, e, removed)
            step = rigid_step(mass, v, force, dt, contacts, together=differs)
            return _Solved(
                step.velocity,
                step.impulse,
                np.zeros((len(found.gap), 3)),
                np.zeros_like(found.jacobian.T),
            )
        bound = velocity_bounds(found.gap, found.gamma, e, dt, removed)
        tangents, rows = contact_rows.tangent_rows(system, q, found)
        v_free = v + dt * np.linalg.solve(mass, force)
        velocity, normal, slip = friction_step(mass, v_free, found.jacobian, rows, bound, mu)
        along = np.einsum("csx,cs->cx", tangents, slip)
        dragging = np.einsum("csd,cs->dc", rows, slip)
        return _Solved(velocity, normal, along, dragging)


def _sum_of(found: contact_rows.ContactRows, solved: _Solved, chosen: NDArray[np.bool_]) -> Floats:
    """Return the generalized impulse (d,) of the chosen contacts."""
    if not chosen.any():
        return np.zeros(found.jacobian.shape[1])
    return np.asarray((found.jacobian.T * solved.normal + solved.dragging)[:, chosen].sum(axis=1))


def _share_before(system: System, state: Any) -> float:
    """Return the share of a step in which the mechanism moves before forces and contacts act.

    It is a half, Moreau's midpoint, which makes smooth motion of order two. It is 0 with a hand,
    whose force and coupling are those at the start of the step: later, they would feed energy into
    the motion. It is 0, too, at the start of a motion in which closed contacts approach.
    """
    if system.tool_tree >= 0:
        return 0.0
    if np.array_equal(state.q, system.start[0]):
        found = contact_rows.find_rows(system, state.q, state.v, 0.0)
        if (found.gamma < -system.scene.contact.approach_velocity).any():
            return 0.0
    return 0.5


def _removed(state: Any, found: contact_rows.ContactRows, dt: float) -> Floats:
    """Return the share (c,) of each overlap that a step removes: that of its own last motion.

    A contact that lasts is kept at its velocity, so the way to the next midpoint ends in an overlap
    of second order. The contact approaches by this motion, and the step takes it back; otherwise
    overlaps add up. An overlap at the start stays.
    """
    back = np.maximum(np.minimum(-found.gap, -found.gamma * dt), 0.0)
    before = int(state.contact_count[0])
    back *= contact_rows.lasting(state.contacts, before, found.geometry, slice(None))
    return np.divide(back, -found.gap, out=np.zeros(len(back)), where=back > 0.0)


def _implicit_share(mass: Floats, damping: Floats, dt: float) -> float:
    """Return θ of a step with joint damping D (d,), at which (1 − θ) v + θ v⁺ is damped.

    A half has order two; more where Δt M⁻¹ D > 2, so that no velocity changes its sign.
    """
    if not damping.any():
        return 1.0
    root = np.linalg.cholesky(mass)
    scaled = np.linalg.solve(root, np.diag(np.sqrt(damping)))
    fastest = dt * float(np.linalg.norm(scaled, 2)) ** 2
    return max(0.5, 1.0 - 1.0 / fastest)


class Cost(NamedTuple):
    """Cost of a step of the rigid worlds: number of contacts, of coordinates, and estimated
    seconds."""

    contacts: int
    coordinates: int
    seconds: float

    @property
    def too_large(self) -> bool:
        """Whether the rows of one step have more than MOST_ENTRIES entries."""
        return self.contacts * self.coordinates > MOST_ENTRIES


def _blows(
    mass: Floats, found: contact_rows.ContactRows, impulse: Floats, approach: float
) -> NDArray[np.bool_]:
    """Return the contacts (c,) of the collision: approaching ones, and pushing ones connected to
    them (W_ij ≠ 0)."""
    # Without connected contacts, inner ones of a cradle would act by forces, and the impact alone
    # could gain energy.
    pushes = impulse > 0.0
    struck = pushes & (found.gamma < -approach)
    if not struck.any() or np.array_equal(struck, pushes):
        return struck
    from scipy.sparse.csgraph import connected_components

    rows = found.jacobian[pushes]
    _, island = connected_components(rows @ np.linalg.solve(mass, rows.T) != 0.0, directed=False)
    struck[pushes] = np.isin(island, island[struck[pushes]])
    return struck
