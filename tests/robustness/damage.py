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


def changes(rng: Rng) -> range:
    """Return a range of a random number of changes."""
    return range(int(rng.integers(1, 1 + _MOST_CHANGES)))


def chosen(rng: Rng, values: Any) -> Any:
    """Return one of the values."""
    return values[int(rng.integers(len(values)))]


def damaged_bytes(content: bytes, rng: Rng) -> bytes:
    """Return the bytes with some flipped, lost, repeated, replaced or cut off."""
    for _ in changes(rng):
        at, length = int(rng.integers(len(content) + 1)), int(2 ** rng.uniform(0, 8))
        before, piece, after = content[:at], content[at : at + length], content[at + length :]
        flipped = bytes([content[at] ^ (1 << int(rng.integers(8)))]) + content[at + 1 :] if at < len(content) else b""
        content = before + chosen(rng, [flipped, after, piece + piece + after, rng.bytes(len(piece)) + after,
                                        bytes(len(piece)) + after, b"\xff" * len(piece) + after, b""])  # fmt: skip
    return content


def damaged_text(text: str, rng: Rng, other: str = "") -> bytes:
    """Return the text with tokens put in, lines and words lost, moved or repeated, or the end of another text."""
    for _ in changes(rng):
        at, lines = int(rng.integers(len(text) + 1)), text.split("\n")
        line, to = (int(rng.integers(len(lines))) for _ in range(2))
        words = lines[line].split(" ")
        words[int(rng.integers(len(words)))] = token = str(chosen(rng, TOKENS))
        shifted = " " * int(rng.integers(1, 4)) + lines[line] if rng.random() < 0.5 else lines[line].lstrip()
        text = chosen(rng, [
            text[:at] + token + text[at:],
            text[:at] + text[at + int(rng.integers(1, 30)) :],
            text[:at] + chr(int(rng.integers(1, 0xD7FF))) + text[at:],
            text[:at] + (other[int(rng.integers(len(other))) :] if other else ""),
            "\n".join([*lines[:line], " ".join(words), *lines[line + 1 :]]),
            "\n".join([*lines[:line], shifted, *lines[line + 1 :]]),
            "\n".join(lines[:line] + lines[line + 1 :]),
            "\n".join([*lines[:to], lines[line], *lines[to:]]),
        ])  # fmt: skip
    return damaged_bytes(text.encode(), rng) if rng.random() < 0.1 else text.encode()


def damaged_values(plain: Any, rng: Rng) -> Any:
    """Return plain values (mappings, lists, numbers, texts) with some replaced, lost, renamed, repeated or nested."""
    plain = copy.deepcopy(plain)
    for _ in changes(rng):
        places = list(_places(plain))
        if not places:
            return plain
        (owner, key), (other, where) = chosen(rng, places), chosen(rng, places)
        kind, taken = int(rng.integers(7)), copy.deepcopy(other[where])
        if kind <= 1:
            owner[key] = copy.deepcopy(chosen(rng, VALUES))
        elif kind == 2:
            del owner[key]
        elif kind == 3:
            owner[key] = taken
        elif kind == 4 and isinstance(owner, list):
            owner.insert(key, taken)
        elif kind == 4:
            owner[f"{key}s"] = owner.pop(key)
        elif kind == 5 and isinstance(owner[key], int | float):
            owner[key] = float(owner[key]) * float(10.0 ** rng.integers(-12, 12)) * float(rng.choice([-1.0, 1.0]))
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
