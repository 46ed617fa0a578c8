"""One compiled step: what it leaves at the contacts agrees with what it did to the bodies."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.contact.kernels.step import OK, advance
from iapb.contact.laws import Penalty
from iapb.scene import load_scene
from iapb.scene_files import find_scene
from iapb.system import System


def test_the_forces_noted_at_the_contacts_carry_the_box() -> None:
    """With one stage per step the forces at the contacts are those that the step applied."""
    system = System(load_scene(find_scene("sliding_box")))
    world, state = system.world_under(Penalty()), system.make_state()
    applied = np.zeros(system.mechanism.nv)
    for _ in range(3):
        assert advance(world, state, applied) == OK
    count, contacts = state.contact_count[0], state.contacts
    normal = contacts.normal[:count] * contacts.normal_force[:count, None]
    assert count > 0 and np.any(normal != 0.0)
    assert state.penalty_force[:2] == pytest.approx(normal.sum(axis=0)[:2], abs=1e-12)
    friction = contacts.friction_force[:count].sum(axis=0)
    assert np.any(friction != 0.0)
    assert state.friction_force[:2] == pytest.approx(friction[:2], abs=1e-12)
