"""The contacts of a step from Python: detect, filter, compare with the step before, group, classify.

The same kernels as the compiled step, for users who look at one configuration at a time (paper section III).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.compiled import block
from iapb.contact.geometry import (
    ContactBuffer,
    Floats,
    Shapes,
    candidate_pairs,
    contact_capacity,
    make_contact_buffer,
)
from iapb.contact.kernels.contact_set import classify, cluster, mark_new
from iapb.contact.kernels.narrow_phase import detect
from iapb.contact.kernels.rows import body_row, contact_row, contact_velocities
from iapb.errors import ArgumentError
from iapb.mechanics.kernels import forward_kinematics, make_workspace
from iapb.mechanics.mechanism import Mechanism
from iapb.run import STATE_NAMES

# A contact approaches when v_n < −v_approach. Resting contacts hover around zero by rounding (1e-16 m/s) and by
# the velocity that one step of a penalty force gives; 1e-6 m/s is far below any impact that can be felt, and far
# above rounding.
APPROACH_VELOCITY = 1e-6


@dataclass(frozen=True)
class ContactSet:
    """The contacts of one configuration, c of them, t trees.

    Attributes
    ----------
    body_a, body_b : (c,) int
        The normal points from b into a; body -1 is the static world.
    shape_a, shape_b : (c,) int
    feature : (c,) int
        Which vertex and edge touch.
    point : (c, 3) [m]
        World, midway between the two surfaces.
    normal : (c, 3)
        Unit.
    gap : (c,) [m]
        Negative = overlap.
    normal_velocity : (c,) [m/s]
        n·(v_a − v_b); positive separates.
    tangential_velocity : (c, 3) [m/s]
    is_new : (c,) bool
        Not a contact of the previous set.
    collides : (c,) bool
        Enters the impact of this step.
    group_of_tree : (t,) int
        First tree of the group that a tree belongs to.
    state_of_tree : (t,) int
        FREE, COLLIDING or RESTING of iapb.run.
    """

    body_a: NDArray[np.int32]
    body_b: NDArray[np.int32]
    shape_a: NDArray[np.int32]
    shape_b: NDArray[np.int32]
    feature: NDArray[np.int64]
    point: Floats
    normal: Floats
    gap: Floats
    normal_velocity: Floats
    tangential_velocity: Floats
    is_new: NDArray[np.bool_]
    collides: NDArray[np.bool_]
    group_of_tree: NDArray[np.int64]
    state_of_tree: NDArray[np.int8]
    _buffer: Any = field(repr=False)  # a ContactBuffer, laid out for the kernels

    def __len__(self) -> int:
        return len(self.gap)

    @property
    def state_names(self) -> tuple[str, ...]:
        """State of each tree in words: free, colliding, resting."""
        return tuple(STATE_NAMES[state] for state in self.state_of_tree)


def find_contacts(
    mechanism: Mechanism,
    shapes: Shapes,
    q: ArrayLike,
    v: ArrayLike,
    previous: ContactSet | None = None,
    *,
    pairs: NDArray[np.int32] | None = None,
    margin: float = 0.0,
    cluster_distance: float = 0.0,
    coherence_distance: float = 0.0,
    approach_velocity: float = APPROACH_VELOCITY,
) -> ContactSet:
    """Return the contacts at configuration q and velocity v, compared with those of the step before.

    Parameters
    ----------
    q, v : (nq,), (d,)
        Configuration and generalized velocity.
    previous : ContactSet, optional
        Contacts of the step before; without them every contact is new.
    pairs : (k, 2) int, optional
        Pairs of shapes to test; default: every pair on different bodies, `candidate_pairs(shapes)`.
    margin : float [m]
        Contacts with gap <= margin are listed; only those with gap <= 0 link groups and collide.
    cluster_distance : float [m]
        Contacts of one surface closer than this collapse into the deepest; 0: off.
    coherence_distance : float [m]
        A contact this close to one of the step before is not new; must exceed (largest speed) × (step).
        0: a contact is old only if the same vertex and edge touched before.
    approach_velocity : float [m/s]
        A contact approaches when v_n < −approach_velocity.

    Raises
    ------
    ArgumentError
        A distance or velocity below zero, q or v of the wrong length or not finite.
    """
    require_not_negative(
        cluster_distance=cluster_distance,
        coherence_distance=coherence_distance,
        approach_velocity=approach_velocity,
    )
    q, v = finite_vector("q", q, mechanism.nq), finite_vector("v", v, mechanism.nv)
    chosen = candidate_pairs(shapes) if pairs is None else np.asarray(pairs, np.int32).reshape(-1, 2)
    buffer: Any = block(make_contact_buffer(contact_capacity(shapes, chosen)))
    arrays, workspace = block(mechanism.arrays), block(make_workspace(len(mechanism.names), mechanism.nv))
    forward_kinematics(arrays, q, workspace)
    count = detect(block(shapes), chosen, workspace.rotation, workspace.position, float(margin), buffer)
    if cluster_distance > 0.0:
        count = cluster(buffer, count, float(cluster_distance))
    before, count_before = (buffer, 0) if previous is None else (previous._buffer, len(previous))
    mark_new(buffer, count, before, count_before, float(coherence_distance))
    contact_velocities(arrays, workspace, v, buffer, count)
    start, stop = (np.array(ends, np.int64) for ends in zip(*mechanism.tree_dofs, strict=True))
    group, state = np.zeros(len(start), np.int64), np.zeros(len(start), np.int8)
    spreading = np.zeros(len(start), np.bool_)
    trees = mechanism.tree_of_body
    classify(buffer, count, trees, start, stop, float(approach_velocity), spreading, group, state)
    columns: dict[str, Any] = {
        name: getattr(buffer, name)[:count]
        for name in ContactSet.__dataclass_fields__
        if name in ContactBuffer._fields
    }
    return ContactSet(**columns, group_of_tree=group, state_of_tree=state, _buffer=buffer)


def contact_rows(
    mechanism: Mechanism, contacts: ContactSet, q: ArrayLike, *, self_collision_rows: str = "relative"
) -> tuple[Floats, NDArray[np.int64]]:
    """Return the rows (r, d) of J_c for all contacts of the set, and the contact (r,) of each row.

    Entries that are only rounding are exact zeros (`iapb.contact.kernels.rows.ROW_NOISE`). Select the rows of
    an impact by ``contacts.collides``.

    Parameters
    ----------
    self_collision_rows : {"relative", "per_body"}
        Between two moving bodies: one row nᵀ(J_a − J_b), equation (12); or the paper's own nᵀJ_a and nᵀJ_b,
        (13)-(14), which do not conserve momentum (each body rebounds as from a wall).
    """
    if self_collision_rows not in ("relative", "per_body"):
        raise ArgumentError("self_collision_rows", self_collision_rows, "'relative' or 'per_body'")
    arrays, workspace = block(mechanism.arrays), block(make_workspace(len(mechanism.names), mechanism.nv))
    forward_kinematics(arrays, finite_vector("q", q, mechanism.nq), workspace)
    rows, owners = [], []
    for i in range(len(contacts)):
        bodies = (int(contacts.body_a[i]), int(contacts.body_b[i]))
        separate = self_collision_rows == "per_body" and bodies[1] >= 0
        for body in bodies if separate else bodies[:1]:
            row = np.zeros(mechanism.nv)
            if separate:
                body_row(arrays, workspace, body, contacts.point[i], contacts.normal[i], row)
            else:
                contact_row(arrays, workspace, contacts._buffer, i, row)
            rows.append(row)
            owners.append(i)
    return np.array(rows).reshape(-1, mechanism.nv), np.array(owners, np.int64)


def finite_vector(name: str, value: ArrayLike, length: int) -> Floats:
    """Return `value` as a vector of `length` finite numbers, or raise `ArgumentError`."""
    vector = np.ascontiguousarray(value, np.float64)
    if vector.shape != (length,) or not np.all(np.isfinite(vector)):
        raise ArgumentError(name, value, f"{length} finite numbers")
    return vector


def require_not_negative(**values: float) -> None:
    """Raise `ArgumentError` for the first argument that is not a finite number >= 0."""
    for name, value in values.items():
        if not (np.isfinite(value) and value >= 0.0):
            raise ArgumentError(name, value, "a finite number >= 0")
