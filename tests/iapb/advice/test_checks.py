"""Warnings before a run: each number in closed form, each remedy silences its warning, and what is
right gets none."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from iapb.advice.checks import Start, check_scene, step_limits
from iapb.scene import Scene, find_scene, load_scene, scene_names
from iapb.scene.reading import scene_from_values
from tests.given import data_of

GIVEN = data_of(__file__, "warned.yaml")
BOX = scene_from_values(GIVEN["base"])
WARNED = GIVEN["warned"]


def warned(name: str) -> Scene:
    case = WARNED[name]
    base = scene_from_values(case["scene"]) if "scene" in case else BOX
    return base.with_values(case.get("set", {}))


@pytest.mark.parametrize("name", WARNED)
def test_each_fault_is_named_with_what_helps_and_that_helps(name: str) -> None:
    made = warned(name)
    found = check_scene(made)
    assert [caution.kind for caution in found] == WARNED[name]["kinds"]
    assert all(text in found[-1].text for text in WARNED[name]["said"]), found[-1].text
    for values in WARNED[name]["remedies"]:
        assert not check_scene(made.with_values(values)), values


@pytest.mark.parametrize("name", scene_names())
def test_shipped_scenes_get_no_warning(name: str) -> None:
    assert not check_scene(load_scene(find_scene(name)))


def test_a_law_hears_nothing_of_what_it_does_not_use() -> None:
    rigid: Any = SimpleNamespace(uses={"impulses"})
    assert not check_scene(warned("too stiff"), rigid)


@pytest.mark.parametrize("damping", [0.0, 50.0, 150.0])
def test_the_step_holds_k_plus_2b_up_to_4_at_the_lightest_mode_of_a_box_on_two_corners(
    damping: float,
) -> None:
    """Rocking: J M⁻¹ Jᵀ of two corners has the eigenvalue 2 a²/I = 3/m, a half a side; k ≤ 1 for
    what meets."""
    limits = step_limits(
        Start(BOX.with_values({"contact.damping": damping, "contact.stiffness": 1e4}))
    )
    dt = 1e-3
    mobility = 3.0  # of 1 kg
    assert limits is not None and limits.mass == pytest.approx(1.0 / mobility)
    expected = min(1.0, 4.0 - 2.0 * damping * mobility * dt) / (mobility * dt**2)
    assert limits.stiffness == pytest.approx(expected, rel=1e-6)
    assert limits.damping == pytest.approx(
        (4.0 - 1e4 * mobility * dt**2) / (2.0 * mobility * dt), rel=1e-6
    )


def test_in_a_stack_all_contacts_swing_together() -> None:
    """Heaving of n boxes on springs 2K: the largest eigenvalue of 2/m tridiag(−1, 2, −1), free end;
    rocking 3/2."""
    heave = 2.0 * (2.0 + 2.0 * math.cos(2.0 * math.pi / 11))
    assert Start(warned("sag")).critical[0][0] == pytest.approx(3.0 / 2.0 * heave, rel=1e-6)


def test_angles_in_degrees_are_named_with_their_place(tmp_path) -> None:
    path = tmp_path / "turned.yaml"
    path.write_text(
        """name: turned
rate: 1000
duration: 0.1
bodies:
  - {name: box, joint: planar, mass: 1, inertia: 0.01, position: [0, 0.3, 45],
     shapes: [{kind: box, size: [0.1, 0.1], angle: -30}]}
  - {name: arm, joint: revolute, mass: 1, inertia: 0.01, position: [10], joint_limits: [-45, 20]}
walls:
  - {name: block, kind: box, size: [1, 0.1], center: [0, -1], angle: 7}
""",
        encoding="utf-8",
    )
    found = [one for one in check_scene(load_scene(path)) if one.kind == "degrees"]
    assert {one.text.partition(": ")[0].rpartition(":")[0]: one.where for one in found} == {
        f"{path}:5": "bodies[0].position[2]",
        f"{path}:6": "bodies[0].shapes[0].angle",
        f"{path}:7": "bodies[1].joint_limits[0]",
        f"{path}:9": "walls[0].angle",
    }
