"""A scene's values: set by path, written as text that reads back the same, filled from a
density."""

from __future__ import annotations

import copy
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.errors import ArgumentError
from iapb.scene import Scene, find_scene, load_scene, scene_from_text

PEG = load_scene(find_scene("peg_corner"))
PLANE = "name: d\nrate: 1e3\nduration: 0.5\nbodies:\n  - {name: b, joint: planar, %s}\n"
SPACE = "name: d\nrate: 1e3\nduration: 0.5\ndimensions: 3\nbodies:\n  - {name: b, joint: free_flyer, %s}\n"


def test_a_scene_keeps_its_text_and_reads_yaml_numbers_and_aliases() -> None:
    text = PLANE % "mass: &m 1, inertia: 1e-3, density: null" + "hand: {body: b, point: [0, *m]}\n"
    scene = scene_from_text(text)
    assert (scene.rate, scene.step, scene.steps, scene.bodies[0].inertia) == (
        1000.0,
        1e-3,
        500,
        1e-3,
    )
    assert scene.source_text == text and scene.hand is not None and scene.hand.point == (0.0, 1.0)
    assert scene.contact.rigid and not {"stiffness", "damping"} & {*scene.resolved()["contact"]}


@given(st.floats(0.0, 1e9), st.floats(-1e9, 1e9), st.floats(0.0, 1.0))
def test_text_and_values_of_a_changed_scene_give_it_to_the_last_bit(
    friction: float, angle: float, e: float
) -> None:
    changed = PEG.with_values(
        {"contact.friction": friction, "bodies.peg.position.2": angle, "contact.restitution": e}
    )
    plain = changed.resolved()
    assert scene_from_text(changed.source_text).resolved() == plain
    assert Scene.model_validate(copy.deepcopy(plain)).resolved() == plain


@pytest.mark.parametrize(
    "title",
    [
        "1e-3",
        "# no comment",
        "two\nlines\r",
        'it\'s "so" \\n',
        "Größe 😀",
        "\x07\x7f\x85\u2028\ufeff\ud7ff",
        "&a *b !c %d @e `f",
    ],
)
def test_any_text_stands_in_the_text_of_a_scene(title: str) -> None:
    assert scene_from_text(PEG.with_values({"title": title}).source_text).title == title


def test_values_are_set_by_name_and_by_number_and_the_scene_itself_stays() -> None:
    changed = PEG.with_values(
        {
            "contact.friction": 0.3,
            "bodies.peg.position.2": 0.1,
            "walls.1.point": np.array([0, 1]),
            "rate": np.float64(256),
        }
    )
    assert (changed.contact.friction, changed.rate, PEG.contact.friction) == (0.3, 256.0, 0.0)
    assert changed.bodies[0].position == (*PEG.bodies[0].position[:2], 0.1)
    assert changed.walls[1].point == (0.0, 1.0)  # type: ignore[union-attr]
    with pytest.raises(ValueError, match="frozen"):
        PEG.rate = 3.0  # type: ignore[misc]


@given(st.lists(st.floats(0.0, 2.0 * math.pi), min_size=3, max_size=12, unique=True), st.booleans())
def test_points_on_a_circle_are_convex_and_stored_counterclockwise(
    angles: list[float], clockwise: bool
) -> None:
    angles.sort()
    if (
        min(b - a for a, b in zip(angles, [*angles[1:], angles[0] + 2.0 * math.pi], strict=True))
        < 1e-3
    ):
        return
    points = [[math.cos(a), math.sin(a)] for a in (angles[::-1] if clockwise else angles)]
    wall = {"name": "wedge", "kind": "polygon", "vertices": points}
    x, y = np.array(PEG.with_values({"walls": [wall]}).walls[0].vertices).T  # type: ignore[union-attr]
    assert float(x @ np.roll(y, -1) - np.roll(x, -1) @ y) > 0.0


@pytest.mark.parametrize(
    ("kind", "shapes", "mass", "center", "moments"),
    [
        (
            PLANE,
            "{kind: polygon, vertices: [[0, 0], [1, 0], [0, 1]]}",
            0.5,
            (1 / 3, 1 / 3),
            [0.5 / 9],
        ),
        # two squares side by side are a rectangle, 2 by 1
        (
            PLANE,
            "{kind: box, size: [1, 1]}, {kind: box, size: [1, 1], center: [1, 0]}",
            2.0,
            (0.5, 0),
            [2.0 * 5 / 12],
        ),
        (
            PLANE,
            "{kind: polygon, vertices: [[0, 0], [2, 0], [2, 2], [0, 2]], angle: 1.5707963267948966, center: [1, 0]}",
            4.0,
            (0, 1),
            [4.0 * 8 / 12],
        ),
        (
            SPACE,
            "{kind: box, size: [1, 1, 1]}, {kind: box, size: [1, 1, 1], center: [1, 0, 0]}",
            2.0,
            (0.5, 0, 0),
            [2 / 6, 5 / 6, 5 / 6],
        ),
        (
            SPACE,
            "{kind: box, size: [1, 2, 3], rpy: [0.3, -0.2, 1.1]}",
            6.0,
            (0, 0, 0),
            [2.5, 5.0, 6.5],
        ),
    ],
)
def test_a_density_gives_mass_center_and_inertia(
    kind: str, shapes: str, mass: float, center: Any, moments: list[float]
) -> None:
    found = scene_from_text(kind % f"density: 10, shapes: [{shapes}]").bodies[0]
    assert (found.mass, found.density) == (pytest.approx(10.0 * mass), None)
    assert found.center_of_mass == pytest.approx(center, abs=1e-15)
    principal = [found.inertia] if kind == PLANE else np.linalg.eigvalsh(found.inertia)
    assert principal == pytest.approx(10.0 * np.array(moments))


def test_a_density_can_be_swept_and_what_it_gives_is_what_a_scene_holds() -> None:
    scene = scene_from_text(PLANE % "density: 10, shapes: [{kind: box, size: [0.2, 0.1]}]")
    assert "density: null" in scene.with_values({}).source_text
    assert scene.with_values({"bodies.b.density": 20.0}).bodies[0].mass == pytest.approx(0.4)
    assert scene.with_values({"bodies.b.mass": 7.0}).bodies[0].mass == 7.0


def test_a_scene_may_have_a_dot_in_its_name_and_other_models_are_named(tmp_path: Path) -> None:
    made = scene_from_text((PLANE % "mass: 1, inertia: 1").replace("name: d", "name: arm.v2"))
    assert made.name == "arm.v2"
    for ending, said in ((".xml", "models of MuJoCo are not read"), (".urdf", "robots: [{name")):
        model = tmp_path / f"model{ending}"
        model.write_text("<mujoco/>")
        with pytest.raises(ArgumentError, match=re.escape(said)):
            find_scene(model)
