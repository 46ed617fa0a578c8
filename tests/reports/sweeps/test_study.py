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
    Study,
    find_study,
    load_study,
    points_of,
    scene_of,
    study_from_text,
    study_names,
)


def test_every_combination_of_world_grid_and_draw_is_a_point(study: Study) -> None:
    points = list(points_of(study, "two_discs"))
    assert len(points) == study.size == 6
    assert [point.index for point in points] == list(range(6))
    assert {point.values["contact.restitution"] for point in points} == {0, 1}
    assert all(point.values["duration"] == 0.06 for point in points)


def test_more_draws_change_none_of_those_before(text: str) -> None:
    one = text.replace("[0, 1]", "[1]")
    few = [p.values for p in points_of(study_from_text(one), "s")]
    many = [p.values for p in points_of(study_from_text(one.replace("count: 3", "count: 9")), "s")]
    assert many[:3] == few
    assert many[3] not in few


def test_another_seed_draws_other_values(text: str) -> None:
    first, second = (list(points_of(study_from_text(t), "s")) for t in (text, text.replace("seed: 3", "seed: 4")))
    assert first[0].values != second[0].values


def test_a_law_setting_is_no_scene_value(text: str) -> None:
    point = next(points_of(study_from_text(text.replace("grid:", "grid:\n  law.integrator: [midpoint]")), "s"))
    assert point.law == {"integrator": "midpoint"}
    assert "law.integrator" not in point.values


@pytest.mark.parametrize("scale", ["linear", "log"])
def test_a_range_has_its_ends_exactly_and_even_steps(scale: str) -> None:
    values = Range.model_validate({"from": 0.1, "to": 1e3, "count": 5, "scale": scale}).values()
    assert (values[0], values[-1], len(values)) == (0.1, 1e3, 5)
    steps = [b - a if scale == "linear" else b / a for a, b in zip(values, values[1:], strict=False)]
    assert max(steps) == pytest.approx(min(steps), rel=1e-12)


def test_all_mistakes_are_told_with_their_places(text: str) -> None:
    wrong = text.replace("grid:", "grdi:").replace("count: 3", "count: 0")
    with pytest.raises(SceneError) as caught:
        study_from_text(wrong, "file.yaml")
    places = {(mistake.line, mistake.path) for mistake in caught.value.mistakes}
    assert {(4, "grdi"), (6, "random.count")} <= places


def test_a_study_of_too_many_points_is_refused(text: str) -> None:
    many = text.replace("count: 3", f"count: {MAX_POINTS}")
    with pytest.raises(SceneError, match="at most"):
        study_from_text(many)


def test_a_range_by_factors_needs_positive_ends(text: str) -> None:
    wrong = text.replace("[0, 1]", "{from: 0, to: 1, count: 3, scale: log}")
    with pytest.raises(SceneError, match="linear where an end is not positive"):
        study_from_text(wrong)


@pytest.mark.parametrize("name", study_names())
def test_each_study_that_comes_with_the_project_can_be_run(name: str) -> None:
    study = load_study(find_study(name))
    scene = load_scene(scene_of(study, find_study(name)))
    first = next(points_of(study, scene.name))
    assert scene.with_values(first.values).name == scene.name


def test_an_unknown_study_hears_the_known_ones() -> None:
    with pytest.raises(ArgumentError, match="struck_discs"):
        find_study("nothing")


def test_a_scene_that_the_system_cannot_look_up_is_refused_by_name(study: Study, tmp_path: Path) -> None:
    """A name longer than any file's (found by wrong input), and links that lead in a circle."""
    (tmp_path / "a.yaml").symlink_to("b.yaml")
    (tmp_path / "b.yaml").symlink_to("a.yaml")
    for scene in ("9" * 1000 + ".yaml", "a.yaml"):
        with pytest.raises(ArgumentError, match="scene = "):
            scene_of(study.model_copy(update={"scene": scene}), tmp_path / "study.yaml")


@pytest.mark.parametrize("ends", [(1e9, 1e-320), (1e-320, 1e9)])
def test_a_range_by_factors_may_span_more_than_any_number(ends: tuple[float, float]) -> None:
    first, middle, last = Range.model_validate({"from": ends[0], "to": ends[1], "count": 3, "scale": "log"}).values()
    wanted = math.sqrt(1e9) * math.sqrt(1e-320)  # the product itself has lost digits
    assert (first, last) == ends and middle == pytest.approx(wanted, rel=1e-10)  # rounding of logarithms of size 700
