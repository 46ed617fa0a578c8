"""Laying bodies out as arrays: where each joint's coordinates stand, which dofs move which body."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.mechanics.bodies import Body
from iapb.mechanics.kernels import MechanismArrays

Floats = NDArray[np.float64]


def collect_arrays(bodies: tuple[Body, ...], parents: list[int]) -> MechanismArrays:
    """Return the bodies as contiguous arrays; parents (n,) are body indices, -1 = world."""
    layouts = [body.joint.layout for body in bodies]
    v_count = np.array([layout.nv for layout in layouts], dtype=np.int64)
    v_start = np.cumsum(v_count) - v_count
    q_count = np.array([layout.nq for layout in layouts], dtype=np.int64)
    last_dof, dof_body, dof_parent = _chains(v_start, v_count, parents)
    return MechanismArrays(
        kind=np.array([layout.code for layout in layouts], dtype=np.int64),
        parent=np.array(parents, dtype=np.int64),
        q_start=np.cumsum(q_count) - q_count,
        v_start=v_start,
        v_count=v_count,
        joint_axis=_stack([body.joint.unit_axis for body in bodies], (3,)),
        placement_rotation=_stack([body.placement[0] for body in bodies], (3, 3)),
        placement_position=_stack([body.placement[1] for body in bodies], (3,)),
        mass=np.array([body.mass for body in bodies], dtype=np.float64),
        center_of_mass=_stack([body.center_of_mass for body in bodies], (3,)),
        inertia=_stack([body.inertia for body in bodies], (3, 3)),
        last_dof=np.array(last_dof, dtype=np.int64),
        dof_body=np.array(dof_body, dtype=np.int64),
        dof_parent=np.array(dof_parent, dtype=np.int64),
        dof_rotates=np.array([turns for layout in layouts for turns in layout.rotating], dtype=np.bool_),
    )


def _stack(rows: list[Floats], shape: tuple[int, ...]) -> Floats:
    return np.ascontiguousarray(np.array(rows, dtype=np.float64).reshape(len(rows), *shape))


def _chains(v_start: Any, v_count: Any, parents: list[int]) -> tuple[list[int], list[int], list[int]]:
    """For each body its last dof on the way from the world; for each dof its body and the dof before it."""
    last_dof: list[int] = []
    dof_body: list[int] = []
    dof_parent: list[int] = []
    for b, parent in enumerate(parents):
        last = last_dof[parent] if parent >= 0 else -1
        for k in range(int(v_start[b]), int(v_start[b] + v_count[b])):
            dof_body.append(b)
            dof_parent.append(last)
            last = k
        last_dof.append(last)
    return last_dof, dof_body, dof_parent


def tree_ranges(m: MechanismArrays, tree_of_body: NDArray[np.int64]) -> list[tuple[int, int]]:
    """Return (start, stop) in v of each tree; empty for a tree of fixed bodies."""
    ranges = []
    for tree in range(int(tree_of_body.max()) + 1 if len(tree_of_body) else 0):
        members = np.flatnonzero(tree_of_body == tree)
        ranges.append((int(m.v_start[members[0]]), int(m.v_start[members[-1]] + m.v_count[members[-1]])))
    return ranges
