"""Rebuild the impacts of recorded runs as cases, with the contact rows that collided.

A run stores v before and after every impact, its Jᵀp, and the contacts of its step. The mechanism
at the configuration of that step gives the rows (11)-(12). Every rebuilt case must reproduce the
velocity that the run recorded.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb import resolve_impact
from iapb.contact.kernels.contact_set import TOUCHING
from iapb.errors import IapbError
from iapb.mechanics.mechanism import Mechanism
from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene
from iapb.scene.mechanism import (
    mechanism_of,
    restitution_by_pair,
)
from iapb.system import System, system_of
from reference.complementarity.problem import ImpactProblem
from reference.worlds import run_world
from verification.impacts import Floats, ImpactCase

# Largest difference of the rebuilt and the recorded v⁺, relative to the largest |v⁻|: only rounding
# differs.
_REBUILT = 1e-9


def impacts_of_run(run: Run, scene: Scene) -> tuple[ImpactCase, ...]:
    """Return the impacts of an IAPB run as cases, one for each step and contact group that
    collides, but none of impacts with per-body rows, unequal restitution or friction, or scaled by
    a device limit.

    Raises
    ------
    IapbError
        A rebuilt impact does not give the velocity that the run recorded, so the run is not a run
        of this scene.
    """
    mechanism = mechanism_of(scene)
    approach = scene.contact.approach_velocity
    values = system_of(scene).restitutions
    rubbing = bool(run.law_settings.get("friction_in_impacts")) and scene.largest_friction > 0.0
    other_law = scene.contact.self_collision_rows == "per_body" or len(values) != 1 or rubbing
    cases = []
    for blow in _group_impacts(run, mechanism):
        if other_law or blow.scaled or blow.several:
            continue
        rows = _rows_of_step(run, mechanism, blow)
        v = blow.v_minus
        closing = rows @ v < -approach
        case = ImpactCase(
            mechanism.mass_matrix(blow.q),
            rows[closing],
            v,
            float(values[0]),
            f"scene {run.scene_name}",
            touching=rows[~closing],
        )
        off = np.abs(resolve_impact(*case.arrays, case.restitution).velocity - blow.v_plus).max()
        if off > _REBUILT * (float(np.abs(v).max()) or 1.0):
            raise IapbError(
                f"the impact in step {blow.step} of {run.scene_name}, rebuilt from its run, has "
                f"other "
                "velocities than recorded; simulate the run again"
            )
        cases.append(case)
    return tuple(cases)


class StruckImpact(NamedTuple):
    """An impact of an IAPB run as a problem without friction, and IAPB's answer.

    Attributes
    ----------
    problem : the normal rows with the restitution of each contact
    velocity : (d,) v⁺ of IAPB
    other_law : why IAPB's answer is not to be compared with the frictionless LCP's, and the setting
        that changes this; "" if it is
    """

    problem: ImpactProblem
    velocity: Floats
    other_law: str


PER_BODY = "per-body rows (contact.self_collision_rows: relative has the LCP's rows)"
SCALED = "an impulse scaled by a limit of the device (a larger device.force_limit leaves it whole)"
RUBBING = "friction (contact.forces: paper leaves it out of impacts)"


def problems_of_run(run: Run, scene: Scene) -> list[StruckImpact]:
    """Return all impacts of an IAPB run as problems, with each contact's own restitution."""
    system = System(scene)
    approach = scene.contact.approach_velocity
    mechanism = system.mechanism
    found = list[StruckImpact]()
    rubbing = bool(run.law_settings.get("friction_in_impacts"))
    per_body = scene.contact.self_collision_rows == "per_body"
    for number, blow in enumerate(_group_impacts(run, mechanism), 1):
        if blow.several:
            continue
        v = blow.v_minus
        mass = mechanism.mass_matrix(blow.q)
        rows = _rows_of_step(run, mechanism, blow)
        closing = rows @ v < -approach
        if not closing.any():
            continue
        e, mu = _coefficients(system, run, blow.q, np.array(blow.contacts)[closing])
        name = f"impact {number} at {run.time[blow.step]:.4g} s"
        problem = ImpactProblem.from_impact(mass, rows[closing], v, e, name=name)
        reasons = {PER_BODY: per_body, SCALED: blow.scaled, RUBBING: rubbing and mu.any()}
        other_law = " and ".join(reason for reason, holds in reasons.items() if holds)
        found.append(StruckImpact(problem, blow.v_plus, other_law))
    return found


def _coefficients(
    system: System, run: Run, q: Floats, contacts: NDArray[np.int64]
) -> tuple[Floats, Floats]:
    """Return e and mu (k,) of contacts at configuration q, from the shapes that touch there.

    A run records the bodies of a contact, not its shapes: they are those of the nearest contact of
    these bodies that the geometry gives. A joint's stop has none.
    """
    there = system.contacts_at(q, TOUCHING)
    table = run.contacts
    e = np.full(len(contacts), system.scene.contact.restitution)
    mu = np.zeros(len(contacts))
    for k, m in enumerate(contacts):
        same = (there.body_a == table.body_a[m]) & (there.body_b == table.body_b[m])
        if not same.any():
            continue
        away = np.linalg.norm(there.point - table.point[m], axis=1)
        nearest = np.argmin(np.where(same, away, np.inf))
        pair = np.array([[there.shape_a[nearest], there.shape_b[nearest]]])
        e[k] = restitution_by_pair(system.scene, pair)[0]
        mu[k] = system.frictions.by_pair(pair)[0]
    return e, mu


class _GroupImpact(NamedTuple):
    """The impact of one contact group in one step; the engine resolves the group's islands one
    after another."""

    step: int
    contacts: list[
        int
    ]  # indices of the group's contacts, also of those that touch without approaching
    v_minus: Floats
    v_plus: Floats  # (d,); outside the group's coordinates it equals v_minus
    scaled: bool
    q: Floats  # where it happened
    several: bool  # impacts of the group at several moments of the step: contacts show the last one


def _group_impacts(run: Run, mechanism: Mechanism) -> list[_GroupImpact]:
    """Join the islands of each contact group."""
    found = []
    table = run.impacts
    for step in np.unique(table.step).tolist():
        of_step = np.flatnonzero(table.step == step)
        touching = range(int(run.contacts.offsets[step]), int(run.contacts.offsets[step + 1]))
        groups = {
            k: _trees_of_group(run, mechanism, touching, int(table.group[k])) for k in of_step
        }
        for trees in dict.fromkeys(groups.values()):
            own = np.zeros(mechanism.nv, bool)
            for tree in trees:
                own[slice(*mechanism.tree_dofs[tree])] = True
            contacts = [
                m for m in touching if mechanism.tree_of_body[run.contacts.body_a[m]] in trees
            ]
            lines = [int(k) for k in of_step if groups[k] == trees]
            before = table.v_minus[lines[0]]
            after = table.v_plus[lines[-1]]
            found.append(
                _GroupImpact(
                    step,
                    contacts,
                    before,
                    np.where(own, after, before),
                    scaled=any(table.scale[k] != 1.0 for k in lines),
                    q=table.q[lines[0]],
                    several=len({float(table.time[k]) for k in lines}) > 1,
                )
            )
    return found


def _trees_of_group(run: Run, mechanism: Mechanism, touching: range, group: int) -> frozenset[int]:
    """Return the trees that contacts between moving bodies link to the tree `group` (paper, section
    III)."""
    table = run.contacts
    trees = {group}
    links = [
        {int(mechanism.tree_of_body[table.body_a[m]]), int(mechanism.tree_of_body[table.body_b[m]])}
        for m in touching
        if table.body_b[m] >= 0
    ]
    while any(link & trees and not link <= trees for link in links):
        trees |= set().union(*(link for link in links if link & trees))
    return frozenset(trees)


def _rows_of_step(run: Run, mechanism: Mechanism, blow: _GroupImpact) -> Floats:
    """Return the rows nᵀ(J_a − J_b) (k, d) of the group's contacts."""
    table = run.contacts
    contacts = blow.contacts
    places = np.tile(blow.q, (len(contacts), 1))
    of_a, of_b = (
        mechanism.rows_along(
            places, bodies[contacts], table.point[contacts], table.normal[contacts]
        )
        for bodies in (table.body_a, table.body_b)
    )
    return of_a - of_b


def scene_impacts(name: str, restitution: float | None = None) -> tuple[ImpactCase, ...]:
    """Simulate a scene of the project and return its impacts as cases."""
    scene = load_scene(find_scene(name))
    if restitution is not None:
        scene = scene.with_values({"contact.restitution": restitution})
    return impacts_of_run(run_world(scene, "IAPB"), scene)
