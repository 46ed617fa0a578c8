"""Ends of the joints' ranges as contacts: their rows are the joints' own velocities, whatever the bodies' places."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.compiled import block
from iapb.contact.geometry import make_contact_buffer
from iapb.contact.kernels.joint_stops import add_stops, is_stop
from iapb.contact.kernels.world import Stops
from iapb.mechanics.kernels.kinematics import forward_kinematics
from reference.random_mechanisms import random_mechanism, random_state


@pytest.mark.parametrize("seed", range(6))
def test_a_stop_is_a_contact_along_its_joint_alone(seed: int) -> None:
    """gap = ± r (q − bound), its row nᵀ(J_a − J_b) = ± r e_k (r = 1 m where the joint slides), n of unit length."""
    rng = np.random.default_rng(seed)
    mechanism = random_mechanism(rng, 5, ("revolute", "prismatic"), trees=2)
    q, _ = random_state(rng, mechanism)
    m = mechanism.arrays
    body = rng.permutation(np.repeat(np.arange(5), 2))
    parent = np.array([m.parent[b] for b in body], np.int64)
    dof = m.v_start[body].astype(np.int64)
    slides = ~np.asarray(m.dof_rotates)[dof].astype(bool)
    arm = np.where(slides, 1.0, rng.uniform(0.1, 2.0, 10))
    sign, bound = rng.choice([-1.0, 1.0], 10), q[m.q_start[body]] + rng.uniform(-0.5, 0.5, 10)
    stops: Any = block(Stops(body.astype(np.int64), parent, 7 + np.arange(10), m.q_start[body].astype(np.int64), dof,
                             sign, bound, arm))
    workspace, contacts = block(mechanism.workspace()), block(make_contact_buffer(12))
    forward_kinematics(block(m), q, workspace)
    for margin in (-0.05, 0.0, 0.2):
        gap = arm * sign * (q[m.q_start[body]] - bound)
        near = np.flatnonzero(gap <= margin)
        count = add_stops(block(m), stops, workspace, q, margin, contacts, 2)
        assert count == 2 + len(near)
        for row, i in enumerate(near, start=2):
            assert (contacts.body_a[row], contacts.body_b[row]) == (body[i], parent[i])
            assert contacts.shape_a[row] == contacts.shape_b[row] == 7 + i and is_stop(contacts, row)
            assert contacts.feature[row] == 0 and contacts.gap[row] == pytest.approx(gap[i], abs=1e-15)
            x, n = contacts.point[row], contacts.normal[row]
            assert np.linalg.norm(n) == pytest.approx(1.0, abs=1e-14)
            jacobian = mechanism.point_jacobian(q, int(body[i]), x)
            if parent[i] >= 0:
                jacobian = jacobian - mechanism.point_jacobian(q, int(parent[i]), x)
            expected = sign[i] * arm[i] * np.eye(mechanism.nv)[dof[i]]
            np.testing.assert_allclose(n @ jacobian, expected, atol=1e-12)
            lever = x - workspace.position[body[i]]
            assert np.linalg.norm(lever) == pytest.approx(0.0 if slides[i] else arm[i], abs=1e-14)
    small: Any = block(make_contact_buffer(2 + len(near)))
    assert add_stops(block(m), stops, workspace, q, 0.2, small, 2) == 2 + len(near)
    assert add_stops(block(m), stops, workspace, q, 0.2, small, 3) == (-1 if len(near) else 3)
