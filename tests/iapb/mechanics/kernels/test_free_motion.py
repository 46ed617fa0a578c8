"""Free motion keeps both momenta to rounding and makes no energy."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.run import Run
from iapb.scene import Scene
from iapb.scene.mechanism import mechanism_of
from iapb.scene.reading import scene_from_values
from iapb.simulation import simulate
from tests.given import data_of

GIVEN = data_of(__file__, "free_motion.yaml")
BODY = scene_from_values(GIVEN["body"])
PLANE = scene_from_values(GIVEN["robot in the plane"])
TURNED = [[2e-3, 3e-4, 1e-4], [3e-4, 2e-3, -2e-4], [1e-4, -2e-4, 3e-3]]
CASES = {
    "a body at 1000 rad/s": BODY.with_values(
        {"duration": 0.2, "bodies.body.velocity": [3, 0, -1, 300, 800, 500]}
    ),
    "its centre elsewhere": BODY.with_values({"bodies.body.center_of_mass": [0.1, -0.2, 0.05]}),
    "turned inertia": BODY.with_values({"bodies.body.inertia": TURNED}),
    "a floating robot": scene_from_values(GIVEN["robot"]),
    "a planar one": PLANE,
}
LIMITED = PLANE.with_values({f"bodies.{name}.joint_limits": [-0.3, 0.3] for name in ("one", "two")})


def momenta(run: Run, given: Scene) -> np.ndarray:
    mechanism = mechanism_of(given)
    return np.array(
        [mechanism.centroidal_momentum(q, v) for q, v in zip(run.q[::50], run.v[::50], strict=True)]
    )


@pytest.mark.parametrize("name", CASES)
def test_both_momenta_are_kept_to_rounding_and_the_energy_nearly(name: str) -> None:
    run = simulate(CASES[name])
    found = momenta(run, CASES[name])
    for part in (slice(0, 3), slice(3, 6)):
        drift = np.abs(found[:, part] - found[0, part]).max()
        assert drift <= 3e-15 * run.steps * np.abs(found[0]).max()
    kinetic = run.energy["kinetic"]
    assert np.abs(kinetic / kinetic[0] - 1.0).max() < (
        1e-12 if "robot" in name or "planar" in name else 1e-6
    )


def test_stops_between_two_links_keep_both_momenta() -> None:
    run = simulate(LIMITED)
    found = momenta(run, LIMITED)
    assert len(run.impacts.step) > 1
    np.testing.assert_allclose(found, found[:1].repeat(len(found), axis=0), atol=1e-9)
