"""Size of the project: nodes of the syntax tree per package, against their budget.

Nodes are statements and expressions. Words of docstrings, comments and line breaks cost nothing.
"""

from __future__ import annotations

import ast
import subprocess
import sys
import tomllib
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def nodes_in(source: str) -> int:
    """Return the number of statements and expressions of a module."""
    return sum(isinstance(node, ast.expr | ast.stmt) for node in ast.walk(ast.parse(source)))


def count_nodes() -> Counter[str]:
    """Return the nodes of all tracked Python files by package; files at the top level count as "top
    level"."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "*.py"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    counts: Counter[str] = Counter()
    for name in filter(None, listed.split("\0")):
        package = name.partition("/")[0] if "/" in name else "top level"
        path = ROOT / name
        if path.exists():
            counts[package] += nodes_in(path.read_text(encoding="utf-8"))
    return counts


def main() -> int:
    """Print the nodes of each package beside its budget; return 1 if a package is over it or has
    none."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    budget = project["tool"]["nodes"]
    over = False
    for package, nodes in sorted(count_nodes().items()):
        limit = budget.get(package, 0)
        over |= nodes > limit
        mark = "over the budget" if nodes > limit else ""
        print(f"{package:14s} {nodes:8,d} of {limit:8,d} nodes {mark}".rstrip())
    return int(over)


if __name__ == "__main__":
    sys.exit(main())
