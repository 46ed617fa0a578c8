"""Quantities that several pages quote. They are marked in the HTML, to check that value and verdict agree everywhere.

A Part or Finding names the quantities in its sentence; nothing here recognises words. The verdicts of findings and of
their parts, which also appear on several pages, are marked in the same way.
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
    """A quantity in a sentence: its name, its value as written there, and its verdict ("" without a verdict)."""

    name: str
    value: str
    verdict: str = ""


def marks(said: Part | Finding) -> tuple[Mark, ...]:
    """Return the quantities to mark in the sentence of a part, or in the answer of a finding.

    In the sentence of a part, the verdict is that of the part. In an answer, it is the verdict of the part that has the
    quantity, or that of the finding if no part has it.
    """
    if isinstance(said, Part):
        return tuple(Mark(name, value, said.verdict) for name, value in said.quantities)
    judged = {name: part.verdict for part in said.parts for name, _ in part.quantities}
    return tuple(Mark(name, value, judged.get(name, said.verdict)) for name, value in said.quantities)


def marked(text: str, given: tuple[Mark, ...]) -> str:
    """Return escaped text with marks such as ``<data value="impacts certified" data-verdict="mixed">12</data>``."""
    for name, value, verdict in given:
        verdict = f' data-verdict="{verdict}"' if verdict else ""
        text = said_as(str(escape(value))).sub(rf'<data value="{name}"{verdict}>\g<0></data>', text)
    return text


def judged(key: str, verdict: str) -> Markup:
    """Return the HTML attributes that state which verdict an element shows, and of what."""
    return Markup('data-of="{}" data-verdict="{}"').format(key, verdict)


def contradictions(pages: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """Return the quantities for which the pages give different values or verdicts, with all of these."""
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
    """Return the quantities that appear on no page, so that `contradictions` does not check them."""
    said = {name for page in pages.values() for name, _, _ in _MARKED.findall(page)}
    return tuple(name for name in QUANTITIES if name not in said)
