"""Links of the documents lead somewhere."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from blocks import ROOT

PAGES = ("README.md", "docs/scenes.md", "docs/resolvers.md", "docs/report.md", "docs/tutorial.md", "docs/extending.md",
         "docs/notation.md", "docs/equations.md", "docs/architecture.md")  # fmt: skip
LINK = re.compile(r"\]\(([^)\s]+)\)")


def anchors(path: Path) -> set[str]:
    """Anchors that a page's headings make."""
    headings = re.findall(r"^#+ (.+)$", path.read_text(encoding="utf-8"), flags=re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("name", PAGES)
def test_links(name: str) -> None:
    page = ROOT / name
    for target in LINK.findall(page.read_text(encoding="utf-8")):
        if target.startswith("http"):
            continue
        path, _, anchor = target.partition("#")
        found = (page.parent / path) if path else page
        assert found.exists(), f"{name}: {target} leads nowhere"
        assert not anchor or anchor in anchors(found), f"{name}: {found.name} has no heading for #{anchor}"


def test_a_dead_anchor_would_be_seen() -> None:
    assert "a-claim" in anchors(ROOT / "docs/extending.md")
    assert "no-such-heading" not in anchors(ROOT / "docs/extending.md")
