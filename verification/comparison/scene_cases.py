"""The impacts of recorded runs as cases: which rows collided, rebuilt from the run alone.

The run keeps v before and after and Jᵀp of every impact, and the contacts of its step: the rows (11)-(12) follow from
the mechanism at the configuration of that step. Every rebuilt case is checked against what the run recorded.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.errors import IapbError
from iapb.mechanics.mechanism import Mechanism
from iapb.run import Run
from iapb.scene import Scene
from iapb.scene_mechanism import mechanism_of
from verification.comparison.cases import ImpactCase

Floats = NDArray[np.float64]

# The rebuilt v⁺ against the recorded one, relative to |v⁻|: both are roundings of the same numbers.
_REBUILT = 1e-9


class SceneImpacts(NamedTuple):
    """The cases of one run; `left_out` counts impacts under other rows (per body) or cut by a device limit."""

    cases: tuple[ImpactCase, ...]
    left_out: int


def impacts_of_run(run: Run, scene: Scene) -> SceneImpacts:
    """Return the impacts of an IAPB run as cases.

    Raises
    ------
    IapbError
        A rebuilt impact does not give the velocity that the run recorded: the run and the scene do not belong together.
    """
    mechanism, approach = mechanism_of(scene), scene.contact.approach_velocity
    cases, left_out = [], 0
    for k, step in enumerate(run.impacts.step):
        per_body = scene.contact.self_collision_rows == "per_body"
        if per_body or run.impacts.scale[k] != 1.0:
            left_out += 1
            continue
        rows = _rows_of_step(run, mechanism, int(step), int(run.impacts.group[k]))
        v = run.impacts.v_minus[k]
        closing = rows @ v < -approach
        e = float(scene.contact.restitution)
        case = ImpactCase(
            f"scene {run.scene_name}", mechanism.mass_matrix(run.q[step]), rows[closing], v, e, rows[~closing]
        )
        _check(case, run, k)
        cases.append(case)
    return SceneImpacts(tuple(cases), left_out)


def scene_impacts(name: str, world: str = "IAPB", restitution: float | None = None) -> SceneImpacts:
    """Simulate a scene that comes with the project and return its impacts."""
    from iapb.scene import load_scene
    from iapb.scene_files import find_scene
    from reference.worlds import run_world

    scene = load_scene(find_scene(name))
    if restitution is not None:
        scene = scene.with_values({"contact.restitution": restitution})
    return impacts_of_run(run_world(scene, world), scene)


def _rows_of_step(run: Run, mechanism: Mechanism, step: int, group: int) -> Floats:
    """nᵀ(J_a − J_b) (k, d) of the step's contacts that belong to the impact's contact group."""
    table, q = run.contacts, run.q[step]
    chosen = [
        m for m in range(int(table.offsets[step]), int(table.offsets[step + 1]))
        if mechanism.tree_of_body[table.body_a[m]] in _trees_of_group(run, mechanism, step, group)
    ]  # fmt: skip
    rows = np.zeros((len(chosen), mechanism.nv))
    for i, m in enumerate(chosen):
        rows[i] = table.normal[m] @ mechanism.point_jacobian(q, int(table.body_a[m]), table.point[m])
        if table.body_b[m] >= 0:
            rows[i] -= table.normal[m] @ mechanism.point_jacobian(q, int(table.body_b[m]), table.point[m])
    return rows


def _trees_of_group(run: Run, mechanism: Mechanism, step: int, group: int) -> set[int]:
    """Trees that a chain of contacts between moving bodies links to tree `group` (paper, section III)."""
    table, trees = run.contacts, {group}
    links = [
        {int(mechanism.tree_of_body[table.body_a[m]]), int(mechanism.tree_of_body[table.body_b[m]])}
        for m in range(int(table.offsets[step]), int(table.offsets[step + 1]))
        if table.body_b[m] >= 0
    ]
    while any(link & trees and not link <= trees for link in links):
        trees |= set().union(*(link for link in links if link & trees))
    return trees


def _check(case: ImpactCase, run: Run, k: int) -> None:
    from iapb import resolve_impact

    impact = resolve_impact(case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution)
    scale = float(np.abs(case.velocity).max()) or 1.0
    if np.abs(impact.velocity - run.impacts.v_plus[k]).max() > _REBUILT * scale:
        raise IapbError(f"impact {k} of {run.scene_name} cannot be rebuilt from its run: velocities differ")
