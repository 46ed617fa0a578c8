"""Sphinx: the pages of docs/ and the reference of the code, from its docstrings (`make docs`)."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

project, author = "iapb", "The iapb authors"
extensions = ["sphinx.ext.autodoc", "sphinx.ext.mathjax", "numpydoc", "myst_parser"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["pictures"]
html_theme, html_title = "alabaster", "iapb"
html_theme_options = {
    "description": "Rigid contact by impulses and penalties",
    "page_width": "1100px",
    "sidebar_width": "220px",
}
html_sidebars = {"**": ["about.html", "navigation.html", "searchbox.html"]}
html_copy_source = False
suppress_warnings = [
    "ref.python"
]  # two packages have a Study and a Table each; a signature's short name fits both
default_role = "code"  # `name` in a docstring is a name of the code
smartquotes = False
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False
numpydoc_use_plots = False

# Signs of formulas that reStructuredText would take for markup: |u| is a norm, J* a name, p_ a
# symbol.
_MARKUP = re.compile(r"(``.+?``|`[^`]+`)|([|*]|(?<=\w)_(?!\w))")
_ELSEWHERE = re.compile(
    r"\[([^\]]+)\]\((?:iapb|reference|verification|reports|scenes|[A-Z])[^)]*\)"
)


def _plain_formulas(
    _app: Any, _what: str, _name: str, _object: Any, _options: Any, lines: list[str]
) -> None:
    lines[:] = [
        _MARKUP.sub(lambda found: found.group(1) or "\\" + found.group(2), line) for line in lines
    ]


def _inside(_app: Any, name: str, source: list[str]) -> None:
    """README.md is the first page; what it links to outside docs/ is not among these pages, its
    path is shown."""
    if name == "index":
        readme = (ROOT / "README.md").read_text(encoding="utf-8").replace("](docs/", "](")
        source[0] = _ELSEWHERE.sub(r"\1", readme) + source[0]
    source[0] = source[0].replace("](../README.md", "](index.md")


def setup(app: Any) -> None:
    """Connect the two."""
    app.connect("autodoc-process-docstring", _plain_formulas, priority=400)  # before numpydoc
    app.connect("source-read", _inside)
