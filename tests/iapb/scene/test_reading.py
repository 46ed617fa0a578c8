"""A wrong scene file hears all of its mistakes at once, each where it stands; a damaged one never breaks the reader."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iapb.errors import ArgumentError, Mistake, SceneError
from iapb.scene import Scene, find_scene, load_scene, scene_from_text

GOOD = """\
name: small
rate: 1e3
duration: 0.5
bodies:
  - name: disc
    joint: planar
    mass: 1
    inertia: 1e-3
    shapes:
      - {kind: circle, radius: 0.02}
walls:
  - {name: floor, kind: half_plane, point: [0, 0], normal: [0, 1]}
contact:
  friction: 0.2
hand:
  body: disc
"""


def mistakes(text: str) -> dict[str, Mistake]:
    """Return the mistakes of a wrong scene by field path."""
    with pytest.raises(SceneError) as caught:
        scene_from_text(text, "wrong.yaml")
    return {mistake.path: mistake for mistake in caught.value.mistakes}


def test_good_scene_keeps_its_text_and_reads_yaml_numbers() -> None:
    scene = scene_from_text(GOOD)
    assert (scene.rate, scene.step, scene.steps) == (1000.0, 1e-3, 500)
    assert scene.bodies[0].inertia == 1e-3
    assert scene.source_text == GOOD


def test_all_mistakes_at_once_with_line_column_path_value_and_expectation() -> None:
    wrong = (
        GOOD.replace("rate: 1e3", "rate: fast")
        .replace("mass: 1\n", "mass: -1\n")
        .replace("radius: 0.02", "radius: 0")
        .replace("normal: [0, 1]", "normal: [0, 0], colour: red")
        .replace("friction: 0.2", "fricton: 0.2")
        .replace("body: disc", "body: disk")
    )
    found = mistakes(wrong)
    lines = wrong.splitlines()
    places = {path: (m.line, lines[m.line - 1][m.column - 1 :], m.value) for path, m in found.items()}
    assert places == {
        "rate": (2, "fast", "'fast'"),
        "bodies[0].mass": (7, "-1", "-1"),
        "bodies[0].shapes[0].radius": (10, "0}", "0"),
        "walls[0].normal": (12, "[0, 0], colour: red}", "[0, 0]"),
        "walls[0].colour": (12, "colour: red}", "'red'"),
        "contact.fricton": (14, "fricton: 0.2", "0.2"),
        "hand.body": (16, "disk", "'disk'"),
    }
    assert "did you mean friction?" in found["contact.fricton"].expected
    assert all(mistake.file == "wrong.yaml" and mistake.expected for mistake in found.values())


def test_a_misspelt_choice_is_guessed_and_a_strange_one_is_not() -> None:
    found = mistakes(GOOD.replace("joint: planar", "joint: plannar").replace("kind: half_plane", "kind: halfplane"))
    assert found["bodies[0].joint"].expected.endswith("or 'planar'; did you mean planar?")
    assert found["walls[0].kind"].expected.endswith("; did you mean half_plane?")
    assert "did you mean" not in mistakes(GOOD.replace("joint: planar", "joint: 3"))["bodies[0].joint"].expected


def test_message_of_a_mistake_reads_as_an_editor_expects() -> None:
    found = mistakes(GOOD.replace("rate: 1e3", "rate: 0"))
    assert str(found["rate"]) == "wrong.yaml:2:7: rate = 0: expected a number >= 1e-12"


def test_missing_field_is_placed_at_the_part_that_lacks_it() -> None:
    found = mistakes(GOOD.replace("    joint: planar\n", "").replace(", radius: 0.02", ""))
    assert (found["bodies[0].joint"].line, found["bodies[0].joint"].value) == (5, "(missing)")
    assert (found["bodies[0].shapes[0].radius"].line, found["bodies[0].shapes[0].radius"].column) == (9, 9)


def test_default_that_does_not_fit_is_called_a_default() -> None:
    found = mistakes(GOOD.replace("    inertia: 1e-3\n", ""))
    assert found["bodies[0].inertia"].value == "0.0 (default)"
    assert "planar joint" in found["bodies[0].inertia"].expected


def test_repeated_keys_are_refused_beside_other_mistakes() -> None:
    found = mistakes(GOOD.replace("rate: 1e3", "rate: 1\nrate: 2").replace("mass: 1\n", "mass: x\n"))
    assert (found["rate"].line, found["rate"].expected) == (3, "each field once")
    assert found["bodies[0].mass"].line == 8


@pytest.mark.parametrize(
    ("text", "line", "word"),
    [
        ("name: [1, 2\nrate: 3\n", 2, "YAML"),
        ("name: 'open\n", 2, "YAML"),
        ("\tname: x\n", 1, "YAML"),
        ("name: \x00\n", 1, "YAML"),
        ('name: "\\UFFFFFFFF"\n', 1, "YAML"),
        ("name: !!python/object/apply:os.getcwd []\n", 1, "tags"),
        ("a: 1\n---\nb: 2\n", 2, "document"),
        ("a: *b\n", 1, "alias"),
        ("a: &x [1, *x]\n", 1, "levels"),
        ("? [1, 2]\n: 3\n", 1, "name of a field"),
        ("a: " + "[" * 100 + "]" * 100, 1, "levels"),
        ("a: &a [" + "1, " * 400 + "1]\nb: &b [" + "*a, " * 400 + "*a]\nc: [" + "*b, " * 9 + "*b]\n", 1, "smaller"),
        ("#" * 1_000_001, 1, "at most 1000000"),
    ],
)
def test_what_is_no_document_is_one_mistake_with_its_line(text: str, line: int, word: str) -> None:
    found = mistakes(text)
    assert list(found) == ["(file)"]
    assert found["(file)"].line == line
    assert word in found["(file)"].expected


@pytest.mark.parametrize("text", ["", "---\n", "3\n", "[]\n", "just words\n", "~\n"])
def test_what_is_no_mapping_is_refused(text: str) -> None:
    assert mistakes(text)["(file)"].expected == "a mapping of fields"


def test_aliases_of_plain_values_work() -> None:
    scene = scene_from_text(
        GOOD.replace("point: [0, 0]", "point: &p [0, 1]").replace("body: disc", "body: disc\n  point: *p")
    )
    assert scene.hand is not None and scene.hand.point == (0.0, 1.0)


@pytest.mark.parametrize(
    "word", [".nan", ".inf", "1e999", "yes", "0x10", "1_000", "'1'", "true", "null", "[1]", "9" * 5000]
)
def test_only_finite_numbers_are_numbers(word: str) -> None:
    assert "contact.friction" in mistakes(GOOD.replace("friction: 0.2", f"friction: {word}"))


def test_files_that_cannot_be_read_say_why(tmp_path) -> None:
    with pytest.raises(ArgumentError, match="No such file"):
        load_scene(tmp_path / "absent.yaml")
    with pytest.raises(ArgumentError, match="directory"):
        load_scene(tmp_path)
    path = tmp_path / "latin.yaml"
    path.write_bytes(b"name: a\ntitle: \xe9\xff\n")
    with pytest.raises(SceneError, match=r"latin.yaml:2:1.*UTF-8"):
        load_scene(path)


def test_validation_from_python_is_checked_the_same_way() -> None:
    with pytest.raises(ValueError, match="name of a body"):
        Scene.model_validate(scene_from_text(GOOD).resolved() | {"hand": {"body": "nobody"}})


SOURCES = ["peg_corner", "two_link_arm_a", "wall_1d"]
TEXTS = [
    find_scene(name).read_text().partition("name:")[2] for name in SOURCES
]  # without the opening comment
TOKENS = [
    "~", "null", "true", "yes", ".nan", ".inf", "1e999", "-1", "0", "1e-400", "9" * 400, "0x1F", "1_0", "''", '"', "'",
    "[]", "{}", "[[[[", "}", "]", "-", "- ", ":", ": ", "? ", "&a ", "*a", "*missing", "<<: *a", "!!float ", "!x ",
    "!!python/object/apply:os.abort []", "!!binary aGk=", "|", ">", "|9", "%YAML 1.1", "---", "...", "#", "@", "`",
    "\t", "\r", "\n", "\n\n  ", "\x00", "\x85", "\u2028", "\ufeff", "\ud7ff", "é", "\U0001f600", '"\\x"', '"\\uD800"',
    "2001-01-01", "1:30", "world", "peg", "kind", "name", "box", "planar", "e" * 3000,
]

place = st.floats(0.0, 1.0)
mutation = st.one_of(
    st.tuples(st.just("insert"), place, st.sampled_from(TOKENS)),
    st.tuples(st.just("replace"), place, st.sampled_from(TOKENS)),
    st.tuples(st.just("insert"), place, st.text(max_size=5)),
    st.tuples(st.just("drop"), place, st.integers(1, 30)),
    st.tuples(st.just("cut"), place, st.none()),
    st.tuples(st.just("drop_line"), place, st.none()),
    st.tuples(st.just("repeat_line"), place, st.none()),
    st.tuples(st.just("indent"), place, st.integers(-3, 3)),
)


def damaged(text: str, kind: str, where: float, what: object) -> str:
    """Return the text with one damage at a relative place."""
    at = int(where * len(text))
    lines = text.split("\n")
    line = int(where * (len(lines) - 1))
    if kind == "insert":
        return f"{text[:at]}{what}{text[at:]}"
    if kind == "drop":
        return text[:at] + text[at + int(str(what)) :]
    if kind == "cut":
        return text[:at]
    if kind == "replace":  # the value of a line
        head, colon, _ = lines[line].partition(":")
        lines[line] = f"{head}{colon} {what}"
    elif kind == "drop_line":
        del lines[line]
    elif kind == "repeat_line":
        lines.insert(line, lines[line])
    else:
        by = int(str(what))
        lines[line] = " " * by + lines[line] if by > 0 else lines[line][-by:]
    return "\n".join(lines)


@settings(max_examples=max(300, settings.default.max_examples))  # type: ignore[union-attr]
@given(st.sampled_from(TEXTS), st.lists(mutation, min_size=1, max_size=4))
def test_damaged_file_is_a_scene_or_a_scene_error(
    text: str, mutations: list[tuple[str, float, object]]
) -> None:
    text = "name:" + text
    for kind, where, what in mutations:
        text = damaged(text, kind, where, what)
    check(text)


@given(st.text(alphabet=st.sampled_from("[]{}:,-?&*!|>'\"%@#~ \n\tab01.e"), max_size=60))
def test_any_text_is_a_scene_or_a_scene_error(text: str) -> None:
    check(text)


@pytest.mark.parametrize(
    "unit", ["[", "{a: ", "- ", "? ", "a:\n ", "&a ", "*a ", "!a ", "'", '"', "|\n", "a: &a [*a,", "\\"]
)
def test_endless_repetition_ends_soon(unit: str) -> None:
    check(unit * (50_000 // len(unit)))


def check(text: str) -> None:
    """Read a text; a refusal carries mistakes with places inside the file."""
    try:
        scene_from_text(text)
    except SceneError as refusal:
        assert refusal.mistakes
        for mistake in refusal.mistakes:
            assert 1 <= mistake.line <= len(text.splitlines()) + 2
            assert mistake.column >= 1
            assert mistake.path
            assert mistake.expected


@pytest.mark.parametrize("name", [None, 3, b"peg_corner", {}, "a\0b", "a" * 5000, "a/" + "b" * 5000,
                                  "a" * 5000 + ".yaml"], ids=lambda name: repr(name)[:9])
def test_what_cannot_be_a_scene_is_named(name):
    with pytest.raises(ArgumentError, match="^scene = "):
        find_scene(name)
