"""One compiled step: what it leaves at the contacts agrees with what it did to the bodies."""

from __future__ import annotations

import numpy as np
import pytest

import iapb.system
from iapb.contact.kernels.step import OK, advance, locate, touching
from iapb.contact.laws import Penalty
from iapb.scene import find_scene, load_scene, scene_from_text
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


def test_the_broad_phase_leaves_out_no_touching_pair(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twelve discs thrown together: the contacts of the near pairs are those of all pairs."""
    discs = "".join(
        f"  - {{name: disc_{k}, joint: planar, mass: 0.1, inertia: 1e-5, shapes: [{{kind: circle, radius: 0.5}}]}}\n"
        for k in range(12)
    )
    scene = scene_from_text(f"name: discs\nrate: 1000\nduration: 0.1\nbodies:\n{discs}contact: {{stiffness: 500}}\n")
    q = np.random.default_rng(1).uniform(-1.5, 1.5, 36)
    touched = []
    for worthwhile in (0, 10**9):
        monkeypatch.setattr(iapb.system, "WORTHWHILE_PAIRS", worthwhile)
        system = System(scene)
        world, state = system.world_under(Penalty()), system.make_state()
        assert world.switches.broad_phase == (worthwhile == 0)
        state.q[:] = q
        assert locate(world, state)
        count = touching(world, state, state.contacts)
        touched.append(list(zip(state.contacts.shape_a[:count], state.contacts.shape_b[:count], strict=True)))
    assert touched[0] == touched[1] and len(touched[0]) > 5
