"""A density gives mass, centre of mass and inertia: closed forms, and each mistake at its place."""

from __future__ import annotations

import math

import numpy as np
import pytest

from iapb.errors import SceneError
from iapb.scene import scene_from_text

PLANE = "name: d\nrate: 1000\nduration: 1\nbodies:\n  - {name: b, joint: planar, %s}\n"
SPACE = "name: d\nrate: 1000\nduration: 1\ndimensions: 3\nbodies:\n  - {name: b, joint: free_flyer, %s}\n"
BOX = "{kind: box, size: [0.2, 0.1]}"


def body(text: str, frame: str = PLANE):
    return scene_from_text(frame % text).bodies[0]


@pytest.mark.parametrize(("shapes", "mass", "center", "inertia"), [
    (BOX, 0.2, (0, 0), 0.2 * 0.05 / 12),
    ("{kind: circle, radius: 0.5, center: [1, 2]}", 2.5 * math.pi, (1, 2), 2.5 * math.pi / 8),
    ("{kind: polygon, vertices: [[0, 0], [1, 0], [0, 1]]}", 5.0, (1 / 3, 1 / 3), 5.0 / 9),
    # two squares side by side are a rectangle, 2 by 1
    ("{kind: box, size: [1, 1]}, {kind: box, size: [1, 1], center: [1, 0]}", 20.0, (0.5, 0), 20.0 * 5 / 12),
    ("{kind: polygon, vertices: [[-1, -1], [1, -1], [1, 1], [-1, 1]], angle: 0.7}", 40.0, (0, 0), 40.0 * 8 / 12),
])  # fmt: skip
def test_planar_shapes(shapes: str, mass: float, center: tuple[float, float], inertia: float) -> None:
    found = body(f"density: 10, shapes: [{shapes}]")
    assert found.mass == pytest.approx(mass) and found.inertia == pytest.approx(inertia)
    assert found.center_of_mass == pytest.approx(center, abs=1e-15)


def test_spatial_shapes() -> None:
    ball = body("density: 3, shapes: [{kind: sphere, radius: 0.5, center: [1, 0, 0]}]", SPACE)
    assert ball.mass == pytest.approx(math.pi / 2) and np.allclose(ball.inertia, np.eye(3) * math.pi / 20)
    halves = "{kind: box, size: [1, 1, 1]}, {kind: box, size: [1, 1, 1], center: [1, 0, 0]}"
    bar = body(f"density: 2, shapes: [{halves}]", SPACE)
    assert bar.center_of_mass == (0.5, 0.0, 0.0) and np.allclose(bar.inertia, np.diag([2, 5, 5]) * 4 / 12)
    turned = body("density: 1, shapes: [{kind: box, size: [1, 2, 3], rpy: [0.3, -0.2, 1.1]}]", SPACE)
    assert np.allclose(np.linalg.eigvalsh(turned.inertia), [2.5, 5.0, 6.5])


def test_a_density_can_be_swept_and_what_it_gives_is_what_a_scene_holds() -> None:
    scene = scene_from_text(PLANE % f"density: 10, shapes: [{BOX}]")
    assert scene.bodies[0].density is None and "density: null" in scene.with_values({}).source_text
    assert scene.with_values({"bodies.b.density": 20.0}).bodies[0].mass == pytest.approx(0.4)
    assert scene.with_values({"bodies.b.mass": 7.0}).bodies[0].mass == 7.0


@pytest.mark.parametrize(("text", "said"), [
    (f"density: 10, mass: 2, shapes: [{BOX}]", "5: bodies[0].density = 10: expected shapes that it fills, and no mass"),
    ("density: 10", "5: bodies[0].density = 10: expected shapes that it fills"),
    (f"density: -1, shapes: [{BOX}]", "5: bodies[0].density = -1: expected a number >= 1e-12"),
    (f"density: x, shapes: [{BOX}]", "5: bodies[0].density = 'x': expected a number"),
])  # fmt: skip
def test_mistakes_have_their_place(text: str, said: str) -> None:
    with pytest.raises(SceneError) as caught:
        body(text)
    line, rest = said.split(": ", 1)
    assert any(mistake.line == int(line) and mistake.column > 10 and rest in str(mistake)
               for mistake in caught.value.mistakes)
