"""Groups and islands of a collision are resolved by themselves: what else moves, or only touches, changes nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb import resolve_impact
from iapb.scene import Scene, find_scene, load_scene, scene_from_text
from iapb.simulation import simulate
from verification.complementarity.scene_cases import impacts_of_run

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


DISC = "joint: planar, mass: 0.1, inertia: 2e-5, shapes: [{kind: circle, radius: 0.02}]"
# Four discs in a row touch by 1 µm; one striker comes from each side and both meet the row in the same step.
ROW = scene_from_text(f"""\
name: row_struck_twice
rate: 1000
duration: 0.02
bodies:
  - {{name: left, {DISC}, position: [-0.0405, 0, 0], velocity: [1, 0, 0]}}
  - {{name: a, {DISC}}}
  - {{name: b, {DISC}, position: [0.039999, 0, 0]}}
  - {{name: c, {DISC}, position: [0.079998, 0, 0]}}
  - {{name: d, {DISC}, position: [0.119997, 0, 0]}}
  - {{name: right, {DISC}, position: [0.160497, 0, 0], velocity: [-1, 0, 0]}}
contact: {{restitution: 0.5, stiffness: 0, damping: 0}}
""")


def test_a_group_struck_at_both_ends_is_two_islands() -> None:
    run = simulate(ROW)
    first = run.impacts.step == run.impacts.step[0]
    assert list(run.impacts.group[first]) == [0, 4] and list(run.impacts.rows[first]) == [1, 1]
    moved = np.abs(run.impacts.v_plus[first] - run.impacts.v_minus[first]).reshape(2, 6, 3).any(axis=2)
    assert moved.tolist() == [[True, True, False, False, False, False], [False, False, False, False, True, True]]


def test_together_they_are_the_impact_of_the_whole_group() -> None:
    """Rows, M and v of the group from the run; resolved at once, they give what the islands gave."""
    run = simulate(ROW)
    case = impacts_of_run(run, ROW).cases[0]
    assert len(case.contact_jacobian) == 2
    whole = resolve_impact(case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution)
    last = np.flatnonzero(run.impacts.step == run.impacts.step[0])[-1]
    np.testing.assert_allclose(run.impacts.v_plus[last], whole.velocity, rtol=0, atol=1e-15)
