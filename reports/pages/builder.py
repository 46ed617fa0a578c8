"""Fill the ten templates with records, numbers and figures; every page is self-contained."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from posixpath import dirname, relpath
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from reports.figures import RECIPES
from reports.figures.condition_map import condition_map
from reports.figures.figure import TEXTS, Figure, Recipe, draw, swatch
from reports.figures.figure import numbers_of as figure_numbers
from reports.figures.numbers import format_cell, is_number
from reports.pages.cells import by_agreement, method_map
from reports.pages.first import count_claims
from reports.pages.formulas import formula, prose
from reports.pages.numbers import FILTERS, is_absent, numbers_of
from reports.pages.page import PAGES
from reports.pages.records import Evidence
from verification import finding
from verification.claims.numbers import LEFT_OPEN
from verification.claims.peg import ALL_THREE, FEWER, LARGER, NEARER, SETTLES
from verification.claims.socket import JUMP
from verification.claims.walls import BOTH, SOONER
from verification.claims.walls import SETTLES as SETTLED
from verification.finding import Failure, Finding, Part

# Largest number of table rows on a page, to keep it small; numbers.json has all of them.
ROWS_SHOWN = 200
# Whose numbers the templates may quote, computed or not.
QUOTED = (
    "energy",
    "claims",
    "data",
    "figures",
    "proofs",
    "complementarity",
    "hard-cases",
    "stability",
    "accuracy",
    "haptic-rate",
    "effects",
    "survival",
    "port",
)
# The mark of each verdict, of each kind of outcome of a claim, and of the parts that decide
# nothing. Marks differ in shape as well as in colour.
OUTCOMES = (*finding.VERDICTS, *finding.KINDS, finding.MISPRINT, finding.BEYOND)
OUTCOME_MARKS = dict(zip(OUTCOMES, "✓◐≈✕○…" + "✓✓◐≈✕○…" + "≠·", strict=True))
OUTCOME_CLASSES = dict(
    zip(
        OUTCOMES,
        (
            "good",
            "where",
            "limited",
            "bad",
            "open",
            "absent",
            "good",
            "good",
            "where",
            "limited",
            "bad",
            "open",
            "absent",
            "limited",
            "open",
        ),
        strict=True,
    )
)
FINDINGS = finding.IN_WORDS | {
    finding.MIXED: "holds in part"
}  # in words, for checks that are no claims
# Claims with a map of where they hold: its horizontal axis, its vertical axis, and one map for each
# value of a third column.
MAPS = {
    "C10": ("tilt", "clearance", "part"),
    "C13": ("tilt", "clearance", "coordinate"),
    "C15": ("tilt", "clearance", "part"),
    "C18": (JUMP, "coherence distance", "damping"),
    "C21": ("stiffness", "rate", "against"),
}
# Parts of ours that the ledger shows beside the paper's; the others are folded.
OURS_SHOWN = {
    "C10": (f"{NEARER}, {ALL_THREE}",),
    "C15": (f"{FEWER}, {LARGER}", f"{SETTLES}, {LARGER}"),
    "C21": (f"{BOTH}, {SETTLED}", f"{BOTH}, {SOONER}"),
}


def draw_all(
    evidence: Evidence, recipes: Iterable[Recipe] = RECIPES, failures: list[Failure] | None = None
) -> list[Figure]:
    """Draw the figures of a report; see `draw` for those that cannot be drawn."""
    inputs = figure_inputs(evidence)
    return [draw(recipe, inputs, failures) for recipe in recipes]


def build_report(
    evidence: Evidence, drawn: Iterable[Figure] = (), depth: str = ""
) -> dict[str, str]:
    """Return the HTML of the ten pages by file name, the first page first.

    Missing evidence is printed as "not computed in this run". Every page links to the others; it
    runs no script and asks for nothing.
    """
    given = tuple(drawn)
    environment = _environment()
    bare = {
        key: Figure(key, words.get("number", ""), words["title"]) for key, words in TEXTS.items()
    }
    shared = {
        "pages": PAGES,
        "evidence": evidence,
        "topics": {topic.key: topic for topic in evidence.topics},
        "numbers": numbers_of(evidence, QUOTED) | {"figures": figure_numbers(given)},
        "figures": bare | {figure.key: figure for figure in given},
        "run_counts": Counter(user for run in evidence.runs for user in run.used_by),
        "maps": {claim.key: map_of(claim) for claim in evidence.claims},
        "ours_shown": OURS_SHOWN,
        "kinds": count_claims(evidence.claims),
        "depth": depth,
        "left_open": evidence.numbers.get("claims", {}).get(LEFT_OPEN),
    }
    return link_across(
        {
            page.file: environment.get_template(f"{page.id}.html.j2").render(shared, page=page)
            for page in PAGES
        }
    )


def figure_page(figure: Figure) -> str:
    """Return a page of one figure, with its legend, caption and numbers."""
    return _environment().get_template("figure.html.j2").render(figure=figure)


def link_across(pages: Mapping[str, str]) -> dict[str, str]:
    """Change each link to an id on another page, such as ``href="#C10"``, to a link to that page.

    Raises
    ------
    KeyError
        No page has the id.
    """
    ids = {name: frozenset(re.findall(r'\sid="([^"]+)"', page)) for name, page in pages.items()}
    home = {id: name for name in reversed(list(pages)) for id in ids[name]}

    def linked(name: str, page: str) -> str:
        def link(found: re.Match[str]) -> str:
            if found[1] in ids[name]:
                return found[0]
            return f'<a href="{relpath(home[found[1]], dirname(name) or ".")}#{found[1]}"'

        return re.sub(r'<a href="#([^"]+)"', link, page)

    return {name: linked(name, page) for name, page in pages.items()}


def figure_inputs(evidence: Evidence) -> dict[str, Any]:
    """Return all possible inputs of figures by name: runs, scenes, and the tables of claims and
    topics."""
    tables = {
        f"{topic.key}/{name}": table
        for topic in (*evidence.claims, *evidence.topics)
        for name, table in topic.tables.items()
    }
    return {**tables, **evidence.inputs}


def map_of(claim: Finding) -> Figure | None:
    """Return a map of where a claim holds, over its two decisive conditions; None if it has none."""
    table = claim.tables.get(claim.key)
    if claim.key not in MAPS or table is None or not table.rows:
        return None
    if "part" in table.keys:
        stated = {part.name for part in claim.parts if part.role in finding.DECIDING}
        table = table.only(name in stated for name in table["part"])
    caption = "Smaller dot: it holds in only some trials there."
    title = f"Where {claim.key} holds"
    return condition_map(f"map-{claim.key}", title, caption, table, *MAPS[claim.key])


def stated(parts: Iterable[Part], shown: Sequence[str]) -> list[Part]:
    """Return the parts that the ledger shows: the paper's, misprints, and those of ours in
    `shown`."""
    return [
        part
        for part in parts
        if part.role in (*finding.DECIDING, finding.MISPRINT) or part.name in shown
    ]


def unstated(parts: Iterable[Part], shown: Sequence[str]) -> list[Part]:
    """Return the parts that the ledger folds."""
    every = tuple(parts)
    seen = stated(every, shown)
    return [part for part in every if part not in seen]


def judged(part: Part) -> str:
    """Return the verdict on a part in words: whether its target is met, if it has one."""
    met = (
        {finding.REPRODUCED: "met", finding.MIXED: "in part", finding.REFUTED: "missed"}
        if part.limit is not None
        else FINDINGS
    )
    return (
        part.outcome if part.role or part.region else met.get(part.verdict, FINDINGS[part.verdict])
    )


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("reports.pages", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(
        cell=format_cell,
        formula=formula,
        prose=prose,
        swatch=swatch,
        svg=_labelled,
        mark=OUTCOME_MARKS.__getitem__,
        outcome_class=OUTCOME_CLASSES.__getitem__,
        judged=judged,
        stated=stated,
        unstated=unstated,
        method_map=method_map,
        by_agreement=by_agreement,
        title=lambda name: name[:1].upper() + name[1:],
        **FILTERS,
    )
    environment.globals |= {"rows_shown": ROWS_SHOWN}
    environment.tests["numeric"] = is_number
    environment.tests["absent"] = is_absent
    return environment


def _labelled(panel: Any) -> Markup:
    """Return the SVG of a panel as an image with its description."""
    label = escape(panel.alt)
    return Markup(panel.svg.replace("<svg ", f'<svg role="img" aria-label="{label}" ', 1))
