"""Contacts and rows of the references: against coal, against the engine's point Jacobians, and in a run."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.contact.geometry import BOX, Shape, candidate_pairs, make_shapes
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from iapb.run import COLLIDING, FREE, RESTING
from iapb.scene import find_scene
from iapb.simulation import Simulation
from reference import contact_finding
from reference.contact_finding import Contacts, find_contacts
from reference.contact_rows import contact_jacobian
from reference.rigid_body import model_of
from reference.time_stepping import RigidConstraints


def test_boxes_in_space_overlap_as_coal_says() -> None:
    """Normal and depth of two boxes at random, where a face decides and where edges do."""
    coal, rng, compared = pytest.importorskip("coal"), np.random.default_rng(0), 0
    for _ in range(200):
        sizes = rng.uniform(0.5, 1.5, size=(2, 3))
        axes = np.array([np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2)] + [np.eye(3)])
        axes[:2] *= np.sign(np.linalg.det(axes[:2]))[:, None, None]
        origins = np.array([np.zeros(3), rng.normal(scale=0.6, size=3), np.zeros(3)])
        shapes = make_shapes([Shape(BOX, k, half_size=0.5 * size) for k, size in enumerate(sizes)], True)
        found = find_contacts(shapes, candidate_pairs(shapes), axes, origins, 0.0)
        (one, other), result = (coal.Box(*size) for size in sizes), coal.CollisionResult()
        poses = [coal.Transform3s(axes[k], origins[k]) for k in range(2)]
        if not coal.collide(one, poses[0], other, poses[1], coal.CollisionRequest(), result):
            assert not len(found.gap) or found.gap.min() > -1e-6
            continue
        depth, compared = result.getContact(0).penetration_depth, compared + 1
        assert found.gap.min() == pytest.approx(depth, abs=1e-6 + contact_finding.EDGE_SHARE * abs(depth))
    assert compared > 50


def linkage() -> Mechanism:
    """Two links in a chain and a free peg."""
    inertia, elbow = np.diag([0.1, 0.1, 0.1]), (np.eye(3), np.array([1.0, 0.0, 0.0]))
    return Mechanism([Body("upper", None, Joint("revolute"), mass=1.0, inertia=inertia),
                      Body("lower", "upper", Joint("revolute"), elbow, mass=1.0, inertia=inertia),
                      Body("peg", None, Joint("planar"), mass=2.0, inertia=inertia)])  # fmt: skip


def rows_of(q: np.ndarray, bodies: list[tuple[int, int]], points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    a, b = np.array(bodies, np.int32).T
    nothing = np.zeros(len(a), np.int32)
    found = Contacts(nothing, nothing, a, b, nothing.astype(np.int64), points, normals, np.zeros(len(a)))
    return contact_jacobian(normals, found, *model_of(linkage()).bodies(q)[1:])


def test_rows_are_those_of_the_engines_point_jacobians() -> None:
    rng, mechanism, bodies = np.random.default_rng(0), linkage(), [(0, -1), (1, -1), (2, 1), (1, 2)]
    q, angles, points = rng.normal(size=mechanism.nq), rng.uniform(0.0, 6.0, size=4), rng.normal(size=(4, 3))
    normals = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(4)])
    for row, n, x, (a, b) in zip(rows_of(q, bodies, points, normals), normals, points, bodies, strict=True):
        other = mechanism.point_jacobian(q, b, x) if b >= 0 else 0.0
        assert row == pytest.approx(n @ (mechanism.point_jacobian(q, a, x) - other), abs=1e-14)


def test_a_straight_arm_struck_along_itself_has_no_row() -> None:
    """Rounding leaves 1e-16 of a lever arm; as a row of its own it would take half the energy."""
    q, axis = np.array([0.7, 0.0, 0.0, 0.0, 0.0]), np.array([[np.cos(0.7), np.sin(0.7), 0.0]])
    assert not rows_of(q, [(1, -1)], 1.7 * axis, -axis).any()


def test_the_rigid_law_runs_in_the_engines_loop() -> None:
    simulation = Simulation(find_scene("peg_corner"), RigidConstraints())
    assert {simulation.step().state for _ in range(400)} == {FREE, COLLIDING, RESTING}
    gaps = simulation.state.contacts.gap[: simulation.state.contact_count[0]]
    assert gaps.min(initial=0.0) >= -1e-5
