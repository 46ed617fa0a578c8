"""Damaged scene files: whatever is done to a valid file, it is a scene or a SceneError, never anything else."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iapb.errors import SceneError
from iapb.scene import find_scene, scene_from_text

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
]  # fmt: skip

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
