"""Quantities that sentences of several pages quote: each is marked where it is said, and has one text in the report."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import partial

# name -> how sentences say it; the group is its value. To add a quantity: a line here.
QUANTITIES: dict[str, re.Pattern[str]] = {
    "impacts certified": re.compile(r"of (\d[\d,]*) impacts in [\d,]+ runs of the engine"),
    "adverse impacts certified": re.compile(r"(\d[\d,]*)(?: random impacts)? drawn to provoke a gain"),
    "time of a peg step": re.compile(r"peg(?:_corner| in the corner)(?:[^.;<]|\.\d){0,60}?(\d[\d.]*\s[µm]s)"),
    "exponent of bodies": re.compile(r"bodies(?:[^.;<]|\.\d){0,80}?exponent(?:[^.;<\d]){0,40}(\d[\d.]*\d)"),
    "hard cases of the engine": re.compile(r"stable on (\d+ of \d+) hard cases"),
    "speed targets": re.compile(r"(\d+ of \d+) speed targets"),
}
_MARKED = re.compile(r'<data value="([^"]+)">([^<]*)</data>')


def marked(text: str) -> str:
    """Return escaped text in which every quantity carries its name: ``<data value="impacts certified">12</data>``."""
    for name, pattern in QUANTITIES.items():
        text = pattern.sub(partial(_named, name), text)
    return text


def _named(name: str, found: re.Match[str]) -> str:
    start, end = (edge - found.start() for edge in found.span(1))
    said = found.group()
    return f'{said[:start]}<data value="{name}">{said[start:end]}</data>{said[end:]}'


def contradictions(pages: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """Return the quantities that the pages quote with more than one text, with all of their texts."""
    said: dict[str, set[str]] = {}
    for page in pages.values():
        for name, text in _MARKED.findall(page):
            said.setdefault(name, set()).add(" ".join(text.split()))
    return {name: tuple(sorted(texts)) for name, texts in said.items() if len(texts) > 1}
