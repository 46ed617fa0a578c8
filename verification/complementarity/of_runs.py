"""Rebuild the impacts of recorded runs as cases, with the contact rows that collided.

A run stores v before and after every impact, its Jᵀp, and the contacts of its step. The mechanism
at the configuration of that step gives the rows (11)-(12). Every rebuilt case must reproduce the
velocity that the run recorded.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from iapb import resolve_impact
from iapb.errors import IapbError
from iapb.mechanics.mechanism import Mechanism
from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene
from iapb.scene.mechanism import mechanism_of
from iapb.system import system_of
from reference.worlds import run_world
from verification.impacts import Floats, ImpactCase

# Largest difference of the rebuilt and the recorded v⁺, relative to the largest |v⁻|: only rounding
# differs.
_REBUILT = 1e-9


def impacts_of_run(run: Run, scene: Scene) -> list[ImpactCase]:
    """Return the impacts of an IAPB run that (21) resolves, one for each step and contact group that
    collides.

    Impacts with per-body rows, unequal restitution or friction, those scaled by a device limit, and
    those of a group that collides at several moments of a step are left out.

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
    if scene.contact.self_collision_rows == "per_body" or len(values) != 1 or rubbing:
        return []
    cases = list[ImpactCase]()
    for blow in _group_impacts(run, mechanism):
        if blow.scaled or blow.several:
            continue
        v = blow.v_minus
        rows = _rows_of_step(run, mechanism, blow)
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
                "other velocities than recorded; simulate the run again"
            )
        cases.append(case)
    return cases


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
    return impacts_of_run(run_world(scene, "IAPB"), scene)
