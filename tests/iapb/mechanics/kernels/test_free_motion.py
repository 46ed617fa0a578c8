"""Free motion keeps both momenta to rounding and makes no energy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.run import Run
from iapb.scene import Scene
from iapb.scene.mechanism import mechanism_of
from iapb.simulation import simulate
from tests.iapb.contact.paper import scene_of


def scene(*bodies: dict[str, Any], **values: Any) -> Scene:
    return scene_of(list(bodies), [], **{"duration": 1.0} | values)


def body(spin: float, **values: Any) -> dict[str, Any]:
    return {
        "name": "body",
        "joint": "free_flyer",
        "mass": 1.3,
        "inertia": [1e-3, 2e-3, 2.5e-3],
        "velocity": [3.0, 0.0, -1.0, 0.3 * spin, 0.8 * spin, 0.5 * spin],
    } | values


LINK = {
    "joint": "revolute",
    "mass": 0.4,
    "center_of_mass": [0.1, 0, 0],
    "inertia": [1e-4, 2e-3, 2e-3],
}
ROBOT = (
    body(3.0, center_of_mass=[0.02, 0.01, -0.03]),
    LINK
    | {
        "name": "one",
        "parent": "body",
        "axis": [0, 0.6, 0.8],
        "origin": [0.1, 0, 0],
        "velocity": [5.0],
    },
    LINK
    | {
        "name": "two",
        "parent": "one",
        "axis": [1, 0, 1],
        "origin": [0.2, 0, 0],
        "velocity": [-8.0],
    },
)
FLAT = {"joint": "revolute", "mass": 0.4, "center_of_mass": [0.1, 0], "inertia": 2e-3}
FLAT_ROBOT = (
    {"name": "body", "joint": "planar", "mass": 1.0, "inertia": 1e-2, "velocity": [1.0, -2.0, 4.0]},
    FLAT | {"name": "one", "parent": "body", "origin": [0.1, 0], "velocity": [5.0]},
    FLAT | {"name": "two", "parent": "one", "origin": [0.2, 0], "velocity": [-9.0]},
)
CASES = {
    "a body at 1000 rad/s": scene(body(1000.0), duration=0.2),
    "its centre elsewhere": scene(body(50.0, center_of_mass=[0.1, -0.2, 0.05])),
    "turned inertia": scene(
        body(50.0, inertia=[[2e-3, 3e-4, 1e-4], [3e-4, 2e-3, -2e-4], [1e-4, -2e-4, 3e-3]])
    ),
    "a floating robot": scene(*ROBOT),
    "a planar one": scene(*FLAT_ROBOT),
}
LIMITED = scene(FLAT_ROBOT[0], *(link | {"joint_limits": [-0.3, 0.3]} for link in FLAT_ROBOT[1:]))


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
