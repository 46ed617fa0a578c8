"""The report: one self-contained HTML file, made from plain records and stored runs.

    page = build_report(Evidence(inputs=..., claims=..., ...))
    write_report("out/report.html", page)
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from iapb.errors import ArgumentError
from reports.figures import RECIPES
from reports.figures.figure import Recipe
from reports.pages.builder import build_page
from reports.pages.records import Evidence

LARGEST_REPORT = 8_000_000  # bytes: a report that cannot be mailed is not read


def build_report(evidence: Evidence, recipes: Sequence[Recipe] = RECIPES) -> str:
    """Return the report as one HTML document that needs nothing else: no network, no script.

    Parameters
    ----------
    evidence
        What there is to show; what is not there is printed as "not computed in this run".
    recipes
        The figures; by default all of ours.
    """
    return build_page(evidence, recipes)


def write_report(path: str | Path, page: str) -> Path:
    """Write the page in one step (a reader never sees half of it) and return its path.

    Raises
    ------
    ArgumentError
        If the page is larger than LARGEST_REPORT.
    """
    content = page.encode()
    if len(content) > LARGEST_REPORT:
        raise ArgumentError("page", f"{len(content)} bytes", f"at most {LARGEST_REPORT} bytes")
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    partial = target.with_name(target.name + ".partial")
    partial.write_bytes(content)
    os.replace(partial, target)
    return target
