"""Compare printed output with the output in a document: words exactly, numbers to what another machine may change."""

from __future__ import annotations

import math
import re

RELATIVE = 1e-3  # documents print a few digits
ROUNDING = 1e-6  # numbers below it are rounding noise, which differs from machine to machine

_TIME = re.compile(r"(?<![\w.])[\d.]+(?:e[-+]?\d+)? (?:s|ms|µs)\b")
_HASH = re.compile(r"\b[0-9a-f]{16}(?:[0-9a-f]{48})?\b")
_COMPILING = re.compile(r"Compiling (kernels .*|took .* s\.)")  # a fresh checkout says it
_MEASURED = ("computed in", "it had taken", "seconds", "proved", "passed in", "failed in", " in 0.", "refuted")
_NUMBER = re.compile(r"(?<![\w.])([-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?)")
_FLOAT = re.compile(r"[.e]")


def differs(printed: str, expected: str) -> str:
    """Return the first difference in words, or an empty text; "…" in the document stands for anything."""
    given = lines_of(printed)
    for number, wanted in enumerate(lines_of(expected)):
        if wanted == "…":  # any lines: go on at the next line that fits
            continue
        earlier_gap = number > 0 and lines_of(expected)[number - 1] == "…"
        while given and earlier_gap and not _fits(given[0], wanted):
            given.pop(0)
        if not given:
            return f"the document goes on with {wanted!r}, the program ends"
        if not _fits(given[0], wanted):
            return f"the document says {wanted!r}, the program {given[0]!r}"
        given.pop(0)
    if given and (lines_of(expected) or ["…"])[-1] != "…":
        return f"the program goes on with {given[0]!r}"
    return ""


def lines_of(text: str) -> list[str]:
    """Lines that are not empty, with what the machine decides masked or left out, and spaces joined."""
    lines = []
    for line in text.splitlines():
        if _COMPILING.fullmatch(line):
            continue
        if any(word in line for word in _MEASURED):
            line = _TIME.sub("TIME", line)
        words = _HASH.sub("HASH", line).split()
        if words:
            lines.append(" ".join(words))
    return lines


def _fits(given: str, wanted: str) -> bool:
    if "…" in wanted:
        pattern = ".*".join(re.escape(part) for part in wanted.split("…"))
        return re.fullmatch(pattern, given) is not None
    one, other = _NUMBER.split(given), _NUMBER.split(wanted)
    if len(one) != len(other) or one[::2] != other[::2]:
        return False
    return all(_same(a, b) for a, b in zip(one[1::2], other[1::2], strict=True))


def _same(a: str, b: str) -> bool:
    if not (_FLOAT.search(a) or _FLOAT.search(b)):
        return a == b
    return math.isclose(float(a), float(b), rel_tol=RELATIVE, abs_tol=ROUNDING)
