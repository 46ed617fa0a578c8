"""The terms of the report and what they mean. Every page lists the terms that it uses, under "Terms
on this page".

Each term is defined here only. A definition may use other terms; the page then lists these, too.
"""

from __future__ import annotations

import re
import tomllib
from html import unescape
from importlib.resources import files

from markupsafe import Markup

from reports.pages.formulas import prose

_TEXTS = tomllib.loads(files(__package__).joinpath("templates/terms.toml").read_text("utf-8"))
TERMS: dict[str, tuple[str, str]] = {
    form: (term, meaning) for form, (term, meaning) in _TEXTS["terms"].items()
}
HEADINGS: dict[str, str] = _TEXTS["headings"]
PLACE = "<!-- terms -->"
_NOT_READ = re.compile(r"<(script|style|nav|head)\b.*?</\1>|<[^>]*>", re.DOTALL)
_PATTERNS = {form: re.compile(rf"(?<![\w-])(?:{form})(?![\w-])") for form in TERMS}


def readable(page: str) -> str:
    """Return what a reader of an HTML page sees: its text, without tags, script, style and
    navigation."""
    return " ".join(unescape(_NOT_READ.sub(" ", page)).split())


def terms_of(text: str) -> tuple[str, ...]:
    """Return the patterns of the terms in a text and in the meanings of these terms, in the order
    of TERMS."""
    found: set[str] = set()
    fresh = text
    while fresh:
        new = [
            form
            for form, pattern in _PATTERNS.items()
            if form not in found and pattern.search(fresh)
        ]
        found.update(new)
        fresh = " ".join(" ".join(TERMS[form]) for form in new)
    return tuple(form for form in TERMS if form in found)


def explained(page: str) -> str:
    """Return a page with the list of its terms at PLACE."""
    listed = [TERMS[form] for form in terms_of(readable(page))]
    lines = Markup("").join(
        Markup("<dt>{}</dt><dd>{}</dd>\n").format(term, prose(said)) for term, said in listed
    )
    block = f'<details class="numbers terms"><summary>Terms on this page</summary>\n<dl>\n{lines}</dl>\n</details>'
    return page.replace(PLACE, block if listed else "", 1)
