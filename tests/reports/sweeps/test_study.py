"""What a study may say, and what is said of one that may not."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from iapb import load_scene
from iapb.errors import ArgumentError, SceneError
from reports.sweeps.study import (
    MAX_POINTS,
    Range,
    find_study,
    load_study,
    points_of,
    scene_of,
    study_from_text,
    study_names,
)

SMALL = """\
name: small
scene: two_discs
values: {duration: 0.06, bodies.striker.position.0: -0.06}
grid:
  contact.restitution: [0, 1]
random: {count: 3, seed: 3, values: {bodies.striker.velocity.1: {from: -0.1, to: 0.1}}}
"""


def test_every_combination_of_world_grid_and_draw_is_a_point() -> None:
    study = study_from_text(SMALL.replace("grid:", "grid:\n  law.integrator: [midpoint]"))
    points = list(points_of(study, "two_discs"))
    assert len(points) == study.size == 6 and [point.index for point in points] == list(range(6))
    assert {point.values["contact.restitution"] for point in points} == {0, 1}
    assert all(point.values["duration"] == 0.06 for point in points)
    assert points[0].law == {"integrator": "midpoint"} and "law.integrator" not in points[0].values


def test_more_draws_change_none_of_those_before_and_another_seed_all() -> None:
    one = SMALL.replace("[0, 1]", "[1]")
    few, many, other = ([point.values for point in points_of(study_from_text(text), "s")] for text in (
        one, one.replace("count: 3", "count: 9"), one.replace("seed: 3", "seed: 4")))
    assert many[:3] == few and many[3] not in few and not any(values in few for values in other)


@pytest.mark.parametrize(("start", "stop", "scale"), [
    (0.1, 1e3, "linear"), (0.1, 1e3, "log"), (1e9, 1e-320, "log"), (1e-320, 1e9, "log")])
def test_a_range_has_its_ends_exactly_and_even_steps(start: float, stop: float, scale: str) -> None:
    values = Range.model_validate({"from": start, "to": stop, "count": 5, "scale": scale}).values()
    assert (values[0], values[-1], len(values)) == (start, stop, 5)
    places = values if scale == "linear" else [math.log(value) for value in values]
    steps = [b - a for a, b in zip(places, places[1:], strict=False)]
    assert max(steps) == pytest.approx(min(steps), rel=1e-9 if 1e-300 < min(values) else 1e-4)  # fewer digits there


@pytest.mark.parametrize(("old", "new", "said"), [
    *((f"{name}:", f"{name}x:", f"{name}x") for name in ("values", "grid", "random", "count", "seed", "from", "to")),
    ("count: 3", "count: 0", "random.count"),
    ("count: 3", f"count: {MAX_POINTS}", "at most"),
    ("[0, 1]", "{from: 0, to: 1, count: 3, scale: log}", "linear where an end is not positive"),
    ("{from: -0.1, to: 0.1}", "{from: 1, to: 0.1}", "at least 1"),
])  # fmt: skip
def test_a_mistake_is_told_with_its_place(old: str, new: str, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        study_from_text(SMALL.replace(old, new), "file.yaml")


@pytest.mark.parametrize("name", study_names())
def test_each_study_that_comes_with_the_project_can_be_run(name: str) -> None:
    study = load_study(find_study(name))
    scene = load_scene(scene_of(study, find_study(name)))
    first = next(points_of(study, scene.name))
    assert scene.with_values(first.values).name == scene.name


def test_studies_and_scenes_that_are_not_there_are_refused_by_name(tmp_path: Path) -> None:
    """Among them a name longer than any file's (found by wrong input), and links that lead in a circle."""
    with pytest.raises(ArgumentError, match="struck_discs"):
        find_study("nothing")
    (tmp_path / "a.yaml").symlink_to("b.yaml")
    (tmp_path / "b.yaml").symlink_to("a.yaml")
    (tmp_path.with_name("outside")).write_text("")
    (tmp_path / "link").symlink_to(tmp_path.with_name("outside"))
    for scene in ("9" * 1000 + ".yaml", "a.yaml", "link", "../outside", "/etc/passwd", "a\0b"):
        with pytest.raises(ArgumentError, match="scene = "):
            scene_of(study_from_text(SMALL).model_copy(update={"scene": scene}), tmp_path / "study.yaml")
