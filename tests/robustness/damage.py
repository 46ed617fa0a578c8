"""Damage: bytes, texts and plain values changed at random, by a generator that the caller seeds."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import numpy as np

Rng = np.random.Generator

# What trips readers: signs of YAML, XML and JSON, numbers at the edges, texts that are no text.
TOKENS = (
    "~", "null", "true", ".nan", ".inf", "nan", "inf", "1e999", "-1", "0", "1e-400", "9" * 400, "0x1F", "1_0", "''",
    '"', "'", "[]", "{}", "[[[[", "}", "]", "- ", ": ", "? ", "&a ", "*a", "<<: *a", "|", ">", "%YAML 1.1", "---",
    "...", "!!python/object/apply:os.abort []", "#", "@", "`", "\t", "\r", "\n", "\n\n  ", "\x00", "\x85", "\u2028",
    "\ufeff", "\U0001f600", '"\\uD800"', "2001-01-01", "world", "kind", "name", "e" * 3000, "<", ">", "</robot>",
    "<![CDATA[", "]]>", "<!DOCTYPE a [<!ENTITY b 'c'>]>", "&b;", "&#0;", "<?xml version='1.1'?>", "<link/>",
    "../../../etc/passwd", "/dev/zero", "-0", "+1", "1e308", "-1e308", "5e-324", "2147483648",
    "-9223372036854775809", "== END ==", "(", ")",
)  # fmt: skip
VALUES: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 0.0, -0.0, 1e-13, 1e-12, 1e9, -1e9, 1.1e9, 1e308, 5e-324, 10**17, "", " ", "x",
    "world", "planar", "../x", "/", "a\x00b", "robots/six_axis_arm.urdf", [], {}, [[]], [0], [0, 0], [0, 0, 0],
    [1e9] * 3, [0, 0, 0, 1], {"kind": "circle", "radius": 1e-12}, {"kind": "sphere", "radius": 1e9}, {"name": "peg"},
    ["a"] * 50,
)  # fmt: skip
_MOST_CHANGES = 4  # per case: more, and the first mistake hides the others
_NEST = 40  # levels; a scene has seven


def damaged_bytes(content: bytes, rng: Rng) -> bytes:
    """Return the bytes with some flipped, lost, repeated, replaced or cut off."""
    for _ in range(int(rng.integers(1, 1 + _MOST_CHANGES))):
        at, length = int(rng.integers(len(content) + 1)), int(2 ** rng.uniform(0, 8))
        piece, kind = content[at : at + length], int(rng.integers(6))
        if kind == 0 and at < len(content):
            content = content[:at] + bytes([content[at] ^ (1 << int(rng.integers(8)))]) + content[at + 1 :]
        elif kind == 1:
            content = content[:at] + content[at + length :]
        elif kind == 2:
            content = content[:at] + piece + content[at:]
        elif kind == 3:
            content = content[:at] + rng.bytes(len(piece)) + content[at + len(piece) :]
        elif kind == 4:
            content = content[:at] + bytes([int(rng.choice([0, 255]))]) * len(piece) + content[at + len(piece) :]
        else:
            content = content[:at]
    return content


def damaged_text(text: str, rng: Rng, other: str = "") -> bytes:
    """Return the text with tokens put in, lines and words lost, moved or repeated, or the end of another text."""
    for _ in range(int(rng.integers(1, 1 + _MOST_CHANGES))):
        at, token = int(rng.integers(len(text) + 1)), TOKENS[int(rng.integers(len(TOKENS)))]
        lines, kind = text.split("\n"), int(rng.integers(9))
        line, to = (int(rng.integers(len(lines))) for _ in range(2))
        if kind == 0:
            text = text[:at] + token + text[at:]
        elif kind == 1:
            text = text[:at] + text[at + int(rng.integers(1, 30)) :]
        elif kind == 2:
            text = "\n".join(_with_word(lines, line, token, rng))
        elif kind == 3:
            text = "\n".join(lines[:line] + lines[line + 1 :])
        elif kind == 4:
            text = "\n".join([*lines[:to], lines[line], *lines[to:]])
        elif kind == 5:
            lines[line] = " " * int(rng.integers(1, 4)) + lines[line] if rng.random() < 0.5 else lines[line].lstrip()
            text = "\n".join(lines)
        elif kind == 6 and other:
            text = text[:at] + other[int(rng.integers(len(other))) :]
        elif kind == 7:
            text = text[:at] + chr(int(rng.integers(1, 0xD7FF))) + text[at:]
        elif rng.random() < 0.3:
            text = text[:at]
    return damaged_bytes(text.encode(), rng) if rng.random() < 0.1 else text.encode()


def _with_word(lines: list[str], line: int, token: str, rng: Rng) -> list[str]:
    """Replace one word of a line: a value, most often."""
    words = lines[line].split(" ")
    words[int(rng.integers(len(words)))] = token
    return [*lines[:line], " ".join(words), *lines[line + 1 :]]


def damaged_values(plain: Any, rng: Rng) -> Any:
    """Return plain values (mappings, lists, numbers, texts) with some replaced, lost, renamed, repeated or nested."""
    plain = copy.deepcopy(plain)
    for _ in range(int(rng.integers(1, 1 + _MOST_CHANGES))):
        places = list(_places(plain))
        if not places:
            return plain
        owner, key = places[int(rng.integers(len(places)))]
        kind, value = int(rng.integers(6)), copy.deepcopy(VALUES[int(rng.integers(len(VALUES)))])
        if kind <= 1:
            owner[key] = value
        elif kind == 2:
            del owner[key]
        elif kind == 3:
            _copy_beside(owner, key, plain, places, rng)
        elif kind == 4:
            owner[key] = _scaled(owner[key], rng)
        else:
            for _ in range(int(rng.choice([1, 1, 2, _NEST]))):
                owner[key] = [owner[key]] if rng.random() < 0.5 else {"name": owner[key]}
    return plain


def _places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Yield every (mapping or list, key) of plain values."""
    if isinstance(value, dict | list):
        for key in list(value) if isinstance(value, dict) else range(len(value)):
            yield value, key
            yield from _places(value[key])


def _copy_beside(owner: Any, key: Any, plain: Any, places: list[tuple[Any, Any]], rng: Rng) -> None:
    """A value from elsewhere takes this place, or one more item joins a list, or a field gets another name."""
    other, where = places[int(rng.integers(len(places)))]
    taken = copy.deepcopy(other[where])
    if isinstance(owner, list):
        owner.insert(key, taken if rng.random() < 0.5 else copy.deepcopy(owner[key]))
    elif rng.random() < 0.5:
        owner[key] = taken
    else:
        owner[f"{key}s"] = owner.pop(key)


def _scaled(value: Any, rng: Rng) -> Any:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    return float(value) * float(10.0 ** rng.integers(-12, 12)) * float(rng.choice([-1.0, 1.0]))
