"""Fill the ten templates with records, numbers and figures; every page is self-contained."""

from __future__ import annotations

import base64
import hashlib
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from posixpath import dirname, relpath
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from reports.figures import RECIPES
from reports.figures.condition_map import condition_map
from reports.figures.figure import TEXTS, Figure, Recipe, draw, swatch
from reports.figures.numbers import format_cell, is_number
from reports.pages.formulas import formula, prose
from reports.pages.numbers import FILTERS, is_absent, numbers_of
from reports.pages.page import PAGES
from reports.pages.records import Evidence
from verification import finding
from verification.finding import Failure, Finding, Part
from verification.numbers import NUMBERS, TIMES
from verification.table import Table

# Largest number of table rows on a page, to keep it small; numbers.json has all of them.
ROWS_SHOWN = 200
# Whose numbers the templates may quote, computed or not.
QUOTED = (
    "claims",
    "figures",
    "energy",
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


def draw_all(
    evidence: Evidence, recipes: Iterable[Recipe] = RECIPES, failures: list[Failure] | None = None
) -> list[Figure]:
    """Draw the figures of a report; see `draw` for those that cannot be drawn."""
    inputs = figure_inputs(evidence)
    return [draw(recipe, inputs, failures) for recipe in recipes]


def build_report(evidence: Evidence, drawn: Iterable[Figure] = ()) -> dict[str, str]:
    """Return the HTML of the ten pages by file name, the first page first.

    Missing evidence is printed as "not computed in this run". Every page links to the others and
    needs neither network nor script.
    """
    given = tuple(drawn)
    environment = _environment()
    text = (
        '(() => {\n"use strict";\n'
        + files(__package__).joinpath("scripts/page.js").read_text("utf-8")
        + "})();\n"
    )
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
    # The browser runs only this script and makes no requests; without the script the page is
    # complete.
    policy = f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"
    bare = {
        key: Figure(key, words.get("number", ""), words["title"]) for key, words in TEXTS.items()
    }
    shared = {
        "pages": PAGES,
        "script": Markup(text),
        "policy": policy,
        "evidence": evidence,
        "topics": {topic.key: topic for topic in evidence.topics},
        "numbers": numbers_of(evidence, QUOTED),
        "figures": bare | {figure.key: figure for figure in given},
        "run_counts": Counter(user for run in evidence.runs for user in run.used_by),
        "maps": {claim.key: map_of(claim) for claim in evidence.claims},
    }
    return link_across(
        {
            page.file: environment.get_template(page.template).render(shared, page=page)
            for page in PAGES
        }
    )


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
    scenes = {f"scene/{name}": scene for name, scene in evidence.scenes.items()}
    tables = {
        f"{topic.key}/{name}": table
        for topic in (*evidence.claims, *evidence.topics)
        for name, table in topic.tables.items()
    }
    return {**scenes, **tables, **evidence.inputs}


def map_of(claim: Finding) -> Figure | None:
    """Return a map of where a claim holds, over its two decisive conditions; None if it holds
    everywhere."""
    table = claim.tables.get(claim.key)
    if not claim.axes or claim.verdict == finding.REPRODUCED or table is None or not table.rows:
        return None
    caption = f"Each place is a pair of values of the axes; smaller dot: {claim.key} holds in only some trials there."
    return condition_map(
        f"map-{claim.key}", f"Where {claim.key} holds", caption, table, *claim.axes
    )


def ranked(found: Iterable[Any]) -> list[Any]:
    """Return claims, topics or parts, the worst verdict first."""
    return sorted(found, key=lambda one: finding.WORST_FIRST.index(one.verdict))


def badge_words(topic: Finding) -> str:
    """Return the summary of a topic for the first page: how many of its findings fail."""
    failing, total = sum(part.verdict == finding.REFUTED for part in topic.parts), len(topic.parts)
    if failing and total > 1:
        return f"{failing} of {total} findings {'fails' if failing == 1 else 'fail'}"
    missing = topic.key == "proofs" and any(part.optional for part in topic.parts)
    return FINDINGS[topic.verdict] + ", as far as checked" * missing


def judged(part: Part) -> str:
    """Return the verdict on a part in words: whether its target is met, if it has one."""
    met = (
        {finding.REPRODUCED: "met", finding.MIXED: "in part", finding.REFUTED: "missed"}
        if part.target
        else FINDINGS
    )
    return (
        part.outcome if part.role or part.region else met.get(part.verdict, FINDINGS[part.verdict])
    )


def counted(part: Part) -> str:
    """Return as text in how many of the decided trials a part holds, how many cannot tell, and its
    region's counts."""
    if not part.decided and not part.unknown:
        return "no trials" if part.verdict == finding.NOT_TESTABLE else ""
    unknown = f" ({part.unknown} more cannot tell)" if part.unknown else ""
    cases = f" ({part.cases} cases in these trials)" if part.cases else ""
    if not (region := part.region):
        return f"{part.held} of {part.decided}{cases}{unknown}"
    share = f"; {region.share:.0%} of the tested range" if region.share else ""
    both = (region.others, "other"), (region.fresh, "new")
    confirmed = " and ".join(f"{count} {which}" for count, which in both if count)
    without = " (new trials not counted)" if region.fresh else ""
    return (
        f"(range chosen from {region.searched} trials, confirmed by {confirmed} trials{share}); "
        f"over all "
        f"conditions{without} {part.held} of {part.decided}{cases}{unknown}"
    )


def tables_without(topic: Finding, figures: Sequence[Figure]) -> tuple[tuple[str, Table], ...]:
    """Return the names and tables of a topic that are neither drawn in a figure nor quoted."""
    drawn = {name for figure in figures for name in figure.inputs}
    drawn |= {f"{topic.key}/{name}" for name in (NUMBERS, TIMES)}
    return tuple(
        (name, table) for name, table in topic.tables.items() if f"{topic.key}/{name}" not in drawn
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
        badge_words=badge_words,
        counted=counted,
        tables_without=tables_without,
        ranked=ranked,
        title=lambda name: name[:1].upper() + name[1:],
        **FILTERS,
    )
    environment.globals |= {"rows_shown": ROWS_SHOWN}
    environment.tests["numeric"] = is_number
    environment.tests["absent"] = is_absent
    return environment


def _labelled(panel: Any) -> Markup:
    """Return a panel with its description: its SVG as an image, or its table."""
    label = Markup('aria-label="{}"').format(panel.alt)
    drawn = str(panel.svg)  # not Markup, which would escape what replaces its text
    return Markup(
        drawn.replace("<table ", f"<table {label} ", 1)
        if panel.is_table
        else drawn.replace("<svg ", f'<svg role="img" {label} ', 1)
    )
