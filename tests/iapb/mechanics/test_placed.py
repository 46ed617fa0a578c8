"""Bodies are placed once for a configuration; whoever asks again finds them where they are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from iapb.compiled import block
from iapb.mechanics.bodies import Body
from iapb.mechanics.joints import Joint
from iapb.mechanics.kernels import forward_kinematics
from iapb.mechanics.mechanism import Mechanism

ANGLES = np.array([0.3, -0.4])


def arm(joints: Sequence[str] = ("revolute", "fixed", "revolute")) -> Mechanism:
    """Links of length one, the middle one welded to the first."""
    names = ["a", "b", "c"][: len(joints)]
    parents = [None, *names][: len(joints)]
    place = (np.eye(3), (1.0, 0.0, 0.0))
    return Mechanism([Body(name, parent, Joint(kind), place, 1.0, (0.5, 0, 0), np.eye(3))
                      for name, parent, kind in zip(names, parents, joints, strict=True)])


def test_bodies_are_placed_again_when_a_coordinate_has_changed_and_only_then() -> None:
    mechanism = arm()
    arrays, workspace = block(mechanism.arrays), block(mechanism.workspace())
    forward_kinematics(arrays, ANGLES, workspace)
    placed = workspace.position.copy()
    workspace.position[:] = 7.0
    forward_kinematics(arrays, ANGLES.copy(), workspace)
    assert (workspace.position == 7.0).all()
    for k in range(2):
        forward_kinematics(arrays, ANGLES, workspace)
        moved = ANGLES.copy()
        moved[k] = np.nextafter(moved[k], 1.0)
        workspace.position[:] = 7.0
        forward_kinematics(arrays, moved, workspace)
        # an angle one unit in the last place further
        assert workspace.position == pytest.approx(placed, abs=1e-15)


def test_a_mechanism_that_cannot_move_is_placed() -> None:
    mechanism = arm(("fixed",))
    workspace = block(mechanism.workspace())
    forward_kinematics(block(mechanism.arrays), np.zeros(0), workspace)
    assert workspace.position[0] == pytest.approx((1.0, 0.0, 0.0), abs=0.0)


def test_the_moving_parts_alone_have_places_of_their_own() -> None:
    """M is computed from fewer bodies: the third one's place is not the second's."""
    mechanism = arm()
    _, before = mechanism.placements(ANGLES)
    mechanism.mass_matrix(ANGLES + 0.1)
    mechanism.mass_matrix(ANGLES)
    _, after = mechanism.placements(ANGLES)
    assert (after == before).all()
    mechanism.placements(ANGLES + 0.2)
    fresh = arm().mass_matrix(ANGLES + 0.2)
    assert (mechanism.mass_matrix(ANGLES + 0.2) == fresh).all()
