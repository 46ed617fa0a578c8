"""A contact group is resolved by itself: what else moves in the scene changes nothing, to the last bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.scene import Scene, find_scene, load_scene
from iapb.simulation import simulate

STEPS = 100  # the two discs meet in step 51


def bystanders(scene: Scene, before: int, after: int) -> Scene:
    """Return the scene with moving discs far away, listed before and after its own bodies."""

    def disc(k: int) -> dict[str, Any]:
        return scene.resolved()["bodies"][0] | {"name": f"far_{k}", "position": [0.0, 5.0 + k, 0.0]}

    own = scene.resolved()["bodies"]
    bodies = [*(disc(k) for k in range(before)), *own, *(disc(before + k) for k in range(after))]
    return scene.with_values({"bodies": bodies})


@pytest.mark.parametrize(("before", "after"), [(0, 1), (1, 0), (2, 3)])
def test_impact_of_a_group_does_not_depend_on_bodies_elsewhere(before: int, after: int) -> None:
    scene = load_scene(find_scene("two_discs"))
    alone, among = simulate(scene, steps=STEPS), simulate(bystanders(scene, before, after), steps=STEPS)
    own = slice(3 * before, 3 * before + 6)
    assert len(alone.impacts.step) == len(among.impacts.step) == 1
    np.testing.assert_array_equal(among.v[:, own], alone.v)
    np.testing.assert_array_equal(among.impacts.impulse[:, own], alone.impacts.impulse)
    np.testing.assert_array_equal(among.contacts.impulse, alone.contacts.impulse)


def test_two_groups_collide_in_one_step_as_if_alone() -> None:
    """The second group must not see the scratch of the first, which has another size."""
    scene = load_scene(find_scene("two_discs"))
    own = scene.resolved()["bodies"]
    moved = [body | {"name": f"{body['name']}_2", "position": [body["position"][0], 5.0, 0.0]} for body in own]
    third = own[1] | {"name": "third", "position": [0.04, 5.0, 0.0], "velocity": [-0.5, 0.0, 0.0]}
    both = simulate(scene.with_values({"bodies": [*own, *moved, third]}), steps=STEPS)
    lone = simulate(scene.with_values({"bodies": [*moved, third]}), steps=STEPS)
    first = simulate(scene, steps=STEPS)
    np.testing.assert_array_equal(both.v[:, :6], first.v)
    np.testing.assert_array_equal(both.v[:, 6:], lone.v)
