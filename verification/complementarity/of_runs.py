"""Rebuild the impacts of recorded runs as cases, with the contact rows that collided.

A run stores v before and after every impact, its Jᵀp, and the contacts of its step. The mechanism
at the configuration of that step gives the rows (11)-(12). Every rebuilt case must reproduce the
velocity that the run recorded.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from iapb import resolve_impact
from iapb.contact.kernels.contact_set import TOUCHING
from iapb.errors import IapbError
from iapb.mechanics.mechanism import Mechanism
from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene
from iapb.system import System
from reference.worlds import run_world
from verification.impacts import Floats, ImpactCase

# Largest difference of the rebuilt and the recorded v⁺, relative to the largest |v⁻|: only rounding
# differs.
_REBUILT = 1e-9


class StruckImpact(NamedTuple):
    """An impact of an IAPB run as a case without friction, and IAPB's answer.

    Attributes
    ----------
    case : the normal rows of the contacts that collide, with the restitution of each in `unequal`;
        in `touching` those of the others
    velocity : (d,) v⁺ of IAPB
    other_law : why IAPB's answer is not to be compared with the frictionless LCP's, and the setting
        that changes this; "" if it is
    """

    case: ImpactCase
    velocity: Floats
    other_law: str


PER_BODY = "per-body rows (contact.self_collision_rows: relative has the LCP's rows)"
SCALED = "an impulse scaled by a limit of the device (a larger device.force_limit leaves it whole)"
RUBBING = "friction (contact.forces: paper leaves it out of impacts)"


def impacts_of_run(run: Run, scene: Scene) -> list[StruckImpact]:
    """Return the impacts of an IAPB run, one for each step and contact group that collides.

    A group that collides at several moments of a step is left out.
    """
    system = System(scene)
    mechanism = system.mechanism
    approach = scene.contact.approach_velocity
    rubbing = bool(run.law_settings.get("friction_in_impacts"))
    per_body = scene.contact.self_collision_rows == "per_body"
    found = list[StruckImpact]()
    for number, blow in enumerate(_group_impacts(run, mechanism), 1):
        if blow.several:
            continue
        v = blow.v_minus
        rows = _rows_of_step(run, mechanism, blow)
        closing = rows @ v < -approach
        if not closing.any():
            continue
        e, mu = _coefficients(system, run, blow.q, blow.contacts[closing])
        case = ImpactCase(
            mechanism.mass_matrix(blow.q),
            rows[closing],
            v,
            float(e[0]),
            f"impact {number} at {run.time[blow.step]:.4g} s",
            unequal=e,
            touching=rows[~closing],
        )
        reasons = {PER_BODY: per_body, SCALED: blow.scaled, RUBBING: rubbing and mu.any()}
        other_law = " and ".join(reason for reason, holds in reasons.items() if holds)
        found.append(StruckImpact(case, blow.v_plus, other_law))
    return found


def equality_impacts(run: Run, scene: Scene) -> list[ImpactCase]:
    """Return the impacts of an IAPB run that (21) resolves, with one restitution each.

    Raises
    ------
    IapbError
        A rebuilt impact does not give the velocity that the run recorded, so the run is not a run
        of this scene.
    """
    cases = list[ImpactCase]()
    for one in impacts_of_run(run, scene):
        if one.other_law or np.ptp(one.case.given_restitution()) > 0.0:
            continue
        case = replace(one.case, unequal=None)
        off = np.abs(resolve_impact(*case.arrays, case.restitution).velocity - one.velocity).max()
        if off > _REBUILT * (float(np.abs(case.velocity).max()) or 1.0):
            raise IapbError(
                f"{case.family} of {run.scene_name}, rebuilt from its run, has other velocities "
                "than recorded; simulate the run again"
            )
        cases.append(case)
    return cases


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
        e[k : k + 1], mu[k : k + 1] = system.surfaces.by_pair(pair)
    return e, mu


class _GroupImpact(NamedTuple):
    """The impact of one contact group in one step; the engine resolves the group's islands one
    after another."""

    step: int
    contacts: NDArray[np.int64]  # of the group, also those that touch without approaching
    v_minus: Floats
    v_plus: Floats  # (d,); outside the group's coordinates it equals v_minus
    scaled: bool
    q: Floats  # where it happened
    several: bool  # impacts of the group at several moments of the step: contacts show the last one


def _group_impacts(run: Run, mechanism: Mechanism) -> Iterator[_GroupImpact]:
    """Yield the impacts of each step, the islands of each contact group joined."""
    table = run.impacts
    for step in np.unique(table.step).tolist():
        of_step = np.flatnonzero(table.step == step)
        touching = np.arange(*run.contacts.offsets[step : step + 2])
        group_of_tree = _groups(run, mechanism, touching)
        group_of_contact = group_of_tree[mechanism.tree_of_body[run.contacts.body_a[touching]]]
        group_of_line = group_of_tree[table.group[of_step]]
        for group in dict.fromkeys(group_of_line.tolist()):
            lines = of_step[group_of_line == group]
            own = np.zeros(mechanism.nv, bool)
            for tree in np.flatnonzero(group_of_tree == group):
                own[slice(*mechanism.tree_dofs[tree])] = True
            before = table.v_minus[lines[0]]
            yield _GroupImpact(
                step,
                touching[group_of_contact == group],
                before,
                np.where(own, table.v_plus[lines[-1]], before),
                scaled=bool(np.any(table.scale[lines] != 1.0)),
                q=table.q[lines[0]],
                several=bool(np.ptp(table.time[lines]) > 0.0),
            )


def _groups(run: Run, mechanism: Mechanism, touching: NDArray[np.int64]) -> NDArray[np.int32]:
    """Return the number of the group of each tree: contacts between moving bodies link trees (paper,
    section III)."""
    table = run.contacts
    moving = touching[table.body_b[touching] >= 0]
    ends = tuple(mechanism.tree_of_body[body[moving]] for body in (table.body_a, table.body_b))
    trees = len(mechanism.tree_dofs)
    links = coo_array((np.ones(len(moving)), ends), shape=(trees, trees))
    groups: NDArray[np.int32] = connected_components(links, directed=False)[1]
    return groups


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


def scene_impacts(name: str, restitution: float | None = None) -> list[ImpactCase]:
    """Simulate a scene of the project and return its impacts that (21) resolves."""
    scene = load_scene(find_scene(name))
    if restitution is not None:
        scene = scene.with_values({"contact.restitution": restitution})
    return equality_impacts(run_world(scene, "IAPB"), scene)
