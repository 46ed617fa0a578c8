"""Contact rows of the references against point Jacobians, self-contacts included; the law in the engine's loop."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from iapb.contact.geometry import make_contact_buffer
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from iapb.run import COLLIDING, FREE, RESTING
from iapb.simulation import Simulation
from reference.contact_rows import contact_jacobian
from reference.time_stepping import RigidConstraints

SCENE = Path(__file__).parents[2] / "scenes" / "peg_corner.yaml"


def linkage() -> Mechanism:
    """Two links in a chain and a free peg."""
    inertia = np.diag([0.1, 0.1, 0.1])
    elbow = (np.eye(3), np.array([1.0, 0.0, 0.0]))
    return Mechanism(
        [
            Body("upper", None, Joint("revolute"), mass=1.0, inertia=inertia),
            Body("lower", "upper", Joint("revolute"), elbow, mass=1.0, inertia=inertia),
            Body("peg", None, Joint("planar"), mass=2.0, inertia=inertia),
        ]
    )


def test_rows_are_those_of_the_point_jacobians() -> None:
    rng, mechanism = np.random.default_rng(0), linkage()
    q, geometry = rng.normal(size=mechanism.nq), make_contact_buffer(4)
    geometry.body_a[:], geometry.body_b[:] = [0, 1, 2, 1], [-1, -1, 1, 2]
    angles = rng.uniform(0.0, 6.0, size=4)
    geometry.normal[:] = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(4)])
    geometry.point[:] = rng.normal(size=(4, 3))
    rows = contact_jacobian(mechanism, q, mechanism.placements(q)[1], geometry, 4)
    for i in range(4):
        expected = geometry.normal[i] @ mechanism.point_jacobian(
            q, int(geometry.body_a[i]), geometry.point[i]
        )
        if geometry.body_b[i] >= 0:
            at_b = mechanism.point_jacobian(q, int(geometry.body_b[i]), geometry.point[i])
            expected = expected - geometry.normal[i] @ at_b
        assert rows[i] == pytest.approx(expected, abs=1e-14)


def test_a_straight_arm_struck_along_itself_has_no_row() -> None:
    """Rounding leaves 1e-16 of a lever arm; as a row of its own it would take half the energy."""
    mechanism, geometry = linkage(), make_contact_buffer(1)
    angle = 0.7
    q = np.array([angle, 0.0, 0.0, 0.0, 0.0])
    axis = np.array([np.cos(angle), np.sin(angle), 0.0])
    geometry.body_a[0], geometry.body_b[0] = 1, -1
    geometry.normal[0], geometry.point[0] = -axis, 1.7 * axis
    assert not contact_jacobian(mechanism, q, mechanism.placements(q)[1], geometry, 1).any()


@pytest.mark.skipif(not SCENE.exists(), reason="the scene of the corner is not here")
def test_the_rigid_law_runs_as_a_world() -> None:
    simulation = Simulation(SCENE, RigidConstraints())
    states = {simulation.step().state for _ in range(400)}
    assert states == {FREE, COLLIDING, RESTING}
    gaps = simulation.state.contacts.gap[: simulation.state.contact_count[0]]
    assert gaps.min(initial=0.0) >= -1e-5
