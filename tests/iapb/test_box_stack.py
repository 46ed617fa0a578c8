"""A stack with a mass ratio of a million: what carries it, and at which step."""

from __future__ import annotations

import numpy as np

from iapb.scene import find_scene, load_scene
from iapb.simulation import simulate
from reference.worlds import run_world


def test_penalties_carry_the_stack_at_their_own_small_step() -> None:
    scene = load_scene(find_scene("box_stack"))
    masses = [body.mass for body in scene.bodies]
    assert max(masses) / min(masses) == 1e6
    run = simulate(scene)
    assert run.complete
    assert np.abs(run.q - run.q[0]).max() < 1e-9
    weight = sum(masses) * 9.81
    assert -run.contacts.gap.min() < 1.01 * weight / (2.0 * scene.contact.stiffness)


def test_at_the_haptic_rate_the_same_penalties_throw_the_stack_apart() -> None:
    """The limit is real: with the step 200 times longer the light box leaves."""
    run = simulate(load_scene(find_scene("box_stack")).with_values({"rate": 1000, "duration": 0.2}))
    assert not run.complete or np.abs(run.q - run.q[0]).max() > 1e-2


def test_rigid_constraints_carry_it_at_the_haptic_rate() -> None:
    scene = load_scene(find_scene("box_stack")).with_values({"rate": 1000, "duration": 0.1})
    run = run_world(scene, "ideal")
    assert run.complete
    assert np.abs(run.q - run.q[0]).max() < 1e-6
