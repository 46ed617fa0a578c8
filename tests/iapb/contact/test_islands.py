"""Islands of a collision: trees that only touch what is struck are left out, and the outcome is that of the group."""

from __future__ import annotations

import numpy as np

from iapb import resolve_impact
from iapb.scene import scene_from_text
from iapb.simulation import simulate
from verification.complementarity.scene_cases import impacts_of_run

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
