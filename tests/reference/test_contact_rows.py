"""Contact rows of the references against point Jacobians, self-contacts included; the law in the engine's loop."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from iapb.mechanics.mechanism import Body, Joint, Mechanism
from iapb.run import COLLIDING, FREE, RESTING
from iapb.simulation import Simulation
from reference.contact_finding import Contacts
from reference.contact_rows import contact_jacobian
from reference.rigid_body import model_of
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


def contacts(bodies: list[tuple[int, int]], points: np.ndarray, normals: np.ndarray) -> Contacts:
    """Contacts of these bodies, of no shape in particular."""
    a, b = np.array(bodies, np.int32).T
    nothing = np.zeros(len(a), np.int32)
    return Contacts(nothing, nothing, a, b, nothing.astype(np.int64), points, normals, np.zeros(len(a)))


def test_rows_are_those_of_the_engines_point_jacobians() -> None:
    rng, mechanism = np.random.default_rng(0), linkage()
    q, angles = rng.normal(size=mechanism.nq), rng.uniform(0.0, 6.0, size=4)
    normals = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(4)])
    found = contacts([(0, -1), (1, -1), (2, 1), (1, 2)], rng.normal(size=(4, 3)), normals)
    _, origins, frames = model_of(mechanism).bodies(q)
    rows = contact_jacobian(found.normal, found, origins, frames)
    for i in range(4):
        expected = normals[i] @ mechanism.point_jacobian(q, int(found.body_a[i]), found.point[i])
        if found.body_b[i] >= 0:
            expected = expected - normals[i] @ mechanism.point_jacobian(q, int(found.body_b[i]), found.point[i])
        assert rows[i] == pytest.approx(expected, abs=1e-14)


def test_a_straight_arm_struck_along_itself_has_no_row() -> None:
    """Rounding leaves 1e-16 of a lever arm; as a row of its own it would take half the energy."""
    angle = 0.7
    q, axis = np.array([angle, 0.0, 0.0, 0.0, 0.0]), np.array([np.cos(angle), np.sin(angle), 0.0])
    found = contacts([(1, -1)], 1.7 * axis[None], -axis[None])
    _, origins, frames = model_of(linkage()).bodies(q)
    assert not contact_jacobian(found.normal, found, origins, frames).any()


@pytest.mark.skipif(not SCENE.exists(), reason="the scene of the corner is not here")
def test_the_rigid_law_runs_as_a_world() -> None:
    simulation = Simulation(SCENE, RigidConstraints())
    states = {simulation.step().state for _ in range(400)}
    assert states == {FREE, COLLIDING, RESTING}
    gaps = simulation.state.contacts.gap[: simulation.state.contact_count[0]]
    assert gaps.min(initial=0.0) >= -1e-5
