"""docs/equations.md: every equation of the paper has a row, and every link leads to a function."""

from __future__ import annotations

import ast
import re

import pytest
from blocks import ROOT

LAST = 41
ROWS = dict(re.findall(r"^\| \((\d+)\) \|.*?\| ([^|]+) \|$", (ROOT / "docs/equations.md").read_text(encoding="utf-8"),
                       flags=re.MULTILINE))  # fmt: skip
LINK = re.compile(r"`([\w/]+\.(?:py|txt)):(\w+)`")


def names(file: str) -> set[str]:
    """Functions and classes that a source defines, or the statements of a text."""
    text = (ROOT / file).read_text(encoding="utf-8")
    if file.endswith(".txt"):
        return set(re.findall(r"^\w+$", text, flags=re.MULTILINE))
    kinds = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
    return {node.name for node in ast.walk(ast.parse(text)) if isinstance(node, kinds)}


def test_every_equation_has_its_row() -> None:
    assert list(ROWS) == [str(number) for number in range(1, LAST + 1)]


@pytest.mark.parametrize("number", ROWS)
def test_the_links_of_an_equation_lead_to_functions(number: str) -> None:
    links = LINK.findall(ROWS[number])
    assert links or ROWS[number].startswith("not used, because ")
    for file, name in links:
        assert (ROOT / file).is_file(), f"({number}): there is no {file}"
        assert name in names(file), f"({number}): {file} has no {name}"
    assert len(links) == len(re.findall(r"\.(?:py|txt)", ROWS[number])), f"({number}): a path without a function"


def test_a_dead_link_would_be_seen() -> None:
    assert LINK.findall("`iapb/contact/impact.py:nothing`") == [("iapb/contact/impact.py", "nothing")]
    assert "nothing" not in names("iapb/contact/impact.py")
