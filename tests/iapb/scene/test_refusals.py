"""One table of refusals: what a scene may not say, the field that is named, and the line; no text
breaks the reader."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.errors import ArgumentError, SceneError
from iapb.scene import Scene, find_scene, load_scene, scene_from_text
from tests.given import data_of

PLANE = """\
name: full
rate: 1000
duration: 1
gravity: [0, -9.81]
bodies:
  - {name: base, joint: fixed}
  - {name: slide, parent: base, joint: prismatic, axis: [2, 0], mass: 1}
  - {name: arm, parent: slide, joint: revolute, center_of_mass: [0.1, 0], mass: 1, shapes: [{kind: box, size: [1, 2]}]}
  - {name: puck, joint: planar, mass: 1, inertia: 1, shapes: [{kind: circle, radius: 0.1}]}
  - {name: foot, joint: fixed}
walls:
  - {name: floor, kind: half_plane, point: [0, 0], normal: [0, 1]}
  - {name: post, kind: circle, radius: 0.1}
  - {name: wedge, kind: polygon, vertices: [[0, 0], [1, 0], [0, 1]]}
contact: {friction: 0.2}
hand: {body: arm}
device: {force_limit: [1, 1], position_resolution: [0, 0], damping: [0, 0]}
couplings:
  four_channel: {stiffness: [1, 1], damping: [1, 1]}
  unilateral: {stiffness: [1, 1], damping: [1, 1]}
"""
SPACE = """\
name: full
dimensions: 3
rate: 1000
duration: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: thing, joint: free_flyer, mass: 1, inertia: [1, 2, 3]}
  - {name: wheel, joint: continuous, axis: [0, 0, 1], inertia: [0, 0, 1]}
walls:
  - {name: floor, kind: half_space, point: [0, 0, 0], normal: [0, 0, 1]}
"""
FULL = scene_from_text(PLANE)
FULL_SPACE = scene_from_text(SPACE)

REFUSED = data_of(__file__, "refused.yaml")
LONG = {
    "title": ["x" * 2001],
    "source": ["x" * 2001],
    "hand.force_function": [["9" * 1900, "0", "0"], ["-" * 1900 + "1", "0", "0"]],
}
TABLE = [
    (scene, path, sum(values, []))
    for scene, space in ((FULL, "plane"), (FULL_SPACE, "space"))
    for path, values in REFUSED[space].items()
]
TABLE += [(FULL, path, values) for path, values in LONG.items()]


@pytest.mark.parametrize(("scene", "path", "values"), TABLE, ids=[row[1] for row in TABLE])
def test_every_field_refuses_what_it_cannot_take(
    scene: Scene, path: str, values: list[Any]
) -> None:
    field = path.split(".")[-1]
    for value in values:
        with pytest.raises(SceneError) as caught:
            scene.with_values({path: value})
        near = [
            m
            for m in caught.value.mistakes
            if field in m.path or m.path.startswith(path.split(".")[0])
        ]
        assert near, (
            f"{path} = {value!r} was refused, but the mistake points elsewhere: {caught.value}"
        )


def field_names(part: Any) -> set[str]:
    """Return the names of all fields below a plain value."""
    items = part.values() if isinstance(part, dict) else part if isinstance(part, list) else ()
    return set(part if isinstance(part, dict) else ()).union(*map(field_names, items))


def test_no_field_is_left_out_above() -> None:
    tried = {path.split(".")[-1] for path in REFUSED["plane"]}
    assert field_names(FULL.resolved()) - tried == {
        "contact",
        "hand",
        "couplings",
        "four_channel",
        "unilateral",
    }


WRITTEN = [
    *REFUSED["written"],
    ["friction: 0.2", f"friction: {'9' * 5000}", "contact.friction", 15],
]


@pytest.mark.parametrize(("old", "new", "field", "line"), WRITTEN)
def test_a_mistake_stands_at_its_line(old: str, new: str, field: str, line: int) -> None:
    text = next(text for text in (PLANE, SPACE) if old in text).replace(old, new, 1)
    with pytest.raises(SceneError) as caught:
        scene_from_text(text, "wrong.yaml")
    found = {mistake.path: mistake for mistake in caught.value.mistakes}
    assert field in found and found[field].line == line, found
    assert all(mistake.file == "wrong.yaml" and mistake.expected for mistake in found.values())


def test_all_mistakes_come_at_once_as_an_editor_expects_them() -> None:
    wrong = (
        PLANE.replace("rate: 1000", "rate: 0")
        .replace("mass: 1, inertia", "mass: -1, inertia")
        .replace("friction: 0.2", "fricton: 0.2")
        .replace("body: arm", "body: am")
    )
    with pytest.raises(SceneError) as caught:
        scene_from_text(wrong, "wrong.yaml")
    places = [
        (m.line, wrong.splitlines()[m.line - 1][m.column - 1 :][:7], m.path)
        for m in caught.value.mistakes
    ]
    assert places == [
        (2, "0", "rate"),
        (9, "-1, ine", "bodies[3].mass"),
        (15, "fricton", "contact.fricton"),
        (16, "am}", "hand.body"),
    ]
    assert str(caught.value.mistakes[0]).startswith(
        "wrong.yaml:2:7: rate = 0: expected a number >= "
    )
    assert "did you mean friction?" in caught.value.mistakes[2].expected
    with pytest.raises(SceneError) as caught:
        FULL.with_values({"bodies.puck.mass": -1, "contact.frition": 3, "device.delay": 2.5})
    assert {m.path for m in caught.value.mistakes} == {
        "bodies[3].mass",
        "contact.frition",
        "device.delay",
    }


NO_DOCUMENT = [
    *REFUSED["no document"],
    ["a: " + "[" * 100 + "]" * 100, 1, "levels"],
    ["a: " + "[" * 5_000, 1, "YAML"],
    [f"a: &a [{'1, ' * 400}1]\nb: &b [{'*a, ' * 400}*a]\nc: [{'*b, ' * 9}*b]\n", 1, "smaller"],
    ["#" * 1_000_001, 1, "at most 1000000"],
]


@pytest.mark.parametrize(("text", "line", "word"), NO_DOCUMENT)
def test_what_is_no_document_is_one_mistake_with_its_line(text: str, line: int, word: str) -> None:
    with pytest.raises(SceneError) as caught:
        scene_from_text(text)
    (mistake,) = caught.value.mistakes
    assert (mistake.path, mistake.line) == ("(file)", line) and word in mistake.expected


def test_files_that_cannot_be_read_say_why(tmp_path: Path) -> None:
    for path in (tmp_path / "absent.yaml", tmp_path, 0, None):  # 0 would be the standard input
        with pytest.raises(ArgumentError, match="^path = "):
            load_scene(path)  # type: ignore[arg-type]
    path = tmp_path / "latin.yaml"
    path.write_bytes(b"name: a\ntitle: \xe9\xff\n")
    with pytest.raises(SceneError, match=r"latin.yaml:2:1.*UTF-8"):
        load_scene(path)


@pytest.mark.parametrize(
    "name",
    [
        None,
        b"peg_corner",
        "a\0b",
        "a/" + "b" * 5000,
    ],
    ids=lambda name: repr(name)[:9],
)
def test_what_cannot_be_a_scene_is_named(name: Any) -> None:
    with pytest.raises(ArgumentError, match="^scene = "):
        find_scene(name)


@pytest.mark.parametrize("path", ["bodies.peg_2.mass", "contact.friction.x", "", 3])
def test_paths_that_lead_nowhere_are_named(path: Any) -> None:
    with pytest.raises(ArgumentError) as caught:
        FULL.with_values({path: 1})
    assert caught.value.value == path


@pytest.mark.parametrize(
    "values",
    [
        None,
        {"hand.force": (x for x in (1, 2, 3))},
        {"gravity": {0.0, 9.0}},
    ],
    ids=["none", "generator", "set"],
)
def test_new_values_of_a_wrong_kind_are_named(values: Any) -> None:
    with pytest.raises(ArgumentError, match="^values = "):
        FULL.with_values(values)


junk = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=8)
    | st.binary(max_size=4),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=4)
    ),
    max_leaves=8,
)


@given(
    st.dictionaries(
        st.sampled_from(REFUSED["junk"]),
        junk,
        min_size=1,
        max_size=2,
    )
)
def test_no_value_whatever_ends_in_another_error(values: dict[str, Any]) -> None:
    try:
        changed = FULL.with_values(values)
    except (SceneError, ArgumentError):
        return
    assert scene_from_text(changed.source_text).resolved() == changed.resolved()


@given(st.text(alphabet=st.sampled_from("[]{}:,-?&*!|>'\"%@#~ \n\tab01.e"), max_size=60))
def test_any_text_is_a_scene_or_a_scene_error(text: str) -> None:
    try:
        scene_from_text(text)
    except SceneError as refusal:
        assert refusal.mistakes
        for mistake in refusal.mistakes:
            assert 1 <= mistake.line <= len(text.splitlines()) + 2 and mistake.column >= 1
            assert mistake.path and mistake.expected
