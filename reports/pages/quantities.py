"""Quantities that several pages quote: each is marked where it is said, with its verdict, and has one of both.

A Part or Finding names the quantities that its sentence says; nothing here recognises words. So are the verdicts of
findings and of their parts marked, which stand on more than one page.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

from markupsafe import Markup, escape

from verification.finding import QUANTITIES, Finding, Part, said_as

_MARKED = re.compile(r'<data value="([^"]+)"(?: data-verdict="([^"]*)")?>([^<]*)</data>')
_JUDGED = re.compile(r'data-of="([^"]+)" data-verdict="([^"]+)"')


class Mark(NamedTuple):
    """A quantity in a sentence: its name, its value as said there, and its verdict; "" where none is given."""

    name: str
    value: str
    verdict: str = ""


def marks(said: Part | Finding) -> tuple[Mark, ...]:
    """Return what to mark in the sentence of a part, or in the answer of a finding.

    The verdict is that of the part, and in an answer that of the part which has the quantity, else the finding's.
    """
    if isinstance(said, Part):
        return tuple(Mark(name, value, said.verdict) for name, value in said.quantities)
    judged = {name: part.verdict for part in said.parts for name, _ in part.quantities}
    return tuple(Mark(name, value, judged.get(name, said.verdict)) for name, value in said.quantities)


def marked(text: str, given: tuple[Mark, ...]) -> str:
    """Return escaped text with its quantities: ``<data value="impacts certified" data-verdict="mixed">12</data>``."""
    for name, value, verdict in given:
        verdict = f' data-verdict="{verdict}"' if verdict else ""
        text = said_as(str(escape(value))).sub(rf'<data value="{name}"{verdict}>\g<0></data>', text)
    return text


def judged(key: str, verdict: str) -> Markup:
    """Return the attributes that say whose verdict an element shows."""
    return Markup('data-of="{}" data-verdict="{}"').format(key, verdict)


def contradictions(pages: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """Return what the pages give more than one value or verdict, with all of them."""
    said: dict[str, set[str]] = {}
    for page in pages.values():
        for name, verdict, text in _MARKED.findall(page):
            said.setdefault(name, set()).add(" ".join(text.split()))
            if verdict:
                said.setdefault(f"verdict on {name}", set()).add(verdict)
        for name, verdict in _JUDGED.findall(page):
            said.setdefault(f"verdict on {name}", set()).add(verdict)
    return {name: tuple(sorted(texts)) for name, texts in said.items() if len(texts) > 1}


def unsaid(pages: Mapping[str, str]) -> tuple[str, ...]:
    """Return the quantities that no page says: a check of them would see nothing."""
    said = {name for page in pages.values() for name, _, _ in _MARKED.findall(page)}
    return tuple(name for name in QUANTITIES if name not in said)
