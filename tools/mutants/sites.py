"""Every place where an operator applies to the physics, and a sample of them that depends on a seed only."""

from __future__ import annotations

import ast
import hashlib
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code

from tools.mutants.operators import OPERATORS

PHYSICS = (
    "iapb/mechanics/kernels/*.py",
    "iapb/mechanics/mechanism.py",
    "iapb/mechanics/integrators.py",
    "iapb/mechanics/energy.py",
    "iapb/contact/kernels/*.py",
    "iapb/contact/contacts.py",
    "iapb/contact/impact_methods.py",
    "iapb/contact/resting.py",
    "iapb/haptics/kernels.py",
    "iapb/haptics/kernels/*.py",
)
_BLANK_AFTER_BRACKET = re.compile(r"([\[(]) +")  # cosmic-ray writes one before numbers
MODULE_LEVEL = ""  # the "function" of a line outside all functions


@dataclass(frozen=True)
class Mutant:
    """One change of one file: the operator's n-th place in it."""

    file: str
    operator: str
    occurrence: int
    number: int  # of the line
    line: str
    function: str  # qualified name, or MODULE_LEVEL

    def source(self, text: str) -> str:
        """The file's text with the change."""
        changed = mutate_code(text, OPERATORS[self.operator], self.occurrence)
        if changed is None:
            raise LookupError(f"{self.file} has no place {self.occurrence} for {self.operator}")
        return str(changed)

    def becomes(self, text: str) -> str:
        """The changed line (a dropped statement of several lines: its first)."""
        line = self.source(text).splitlines()[self.number - 1].strip()
        return _BLANK_AFTER_BRACKET.sub(r"\1", line)


def physics_files(root: Path) -> list[str]:
    """Files of the physics, relative to the root, in order."""
    return sorted({str(path.relative_to(root)) for pattern in PHYSICS for path in root.glob(pattern)})


def functions(text: str) -> dict[str, range]:
    """Qualified name of each function -> its lines."""
    found: dict[str, range] = {}

    def visit(node: ast.AST, prefix: str) -> None:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.FunctionDef | ast.ClassDef):
                name = f"{prefix}{child.name}"
                if isinstance(child, ast.FunctionDef):
                    found[name] = range(child.lineno, (child.end_lineno or child.lineno) + 1)
                visit(child, f"{name}." if isinstance(child, ast.ClassDef) else f"{name}.<locals>.")

    visit(ast.parse(text), "")
    return found


def _not_code(text: str) -> set[int]:
    """Lines of type hints of named tuples and of the messages of errors: no test should pin them."""
    lines: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.AnnAssign) and node.value is None or isinstance(node, ast.Raise):
            lines.update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return lines


def _function_at(number: int, spans: dict[str, range]) -> str:
    """The innermost function that holds a line."""
    holding = [name for name, lines in spans.items() if number in lines]
    return min(holding, key=lambda name: len(spans[name]), default=MODULE_LEVEL)


def places(file: str, text: str) -> Iterator[Mutant]:
    """All mutants of one file."""
    lines, spans, nodes, skipped = text.splitlines(), functions(text), list(ast_nodes(get_ast(text))), _not_code(text)
    for name, operator in OPERATORS.items():
        positions = [position for node in nodes for position in operator.mutation_positions(node)]
        for occurrence, ((number, _), _) in enumerate(positions):
            if number not in skipped:
                line = lines[number - 1].strip()
                yield Mutant(file, name, occurrence, number, line, _function_at(number, spans))


def all_places(root: Path, only: str = "") -> list[Mutant]:
    """All mutants of the files whose path contains `only`."""
    files = [file for file in physics_files(root) if only in file]
    return [mutant for file in files for mutant in places(file, (root / file).read_text())]


def sample(root: Path, count: int, seed: int, only: str = "") -> list[Mutant]:
    """The `count` mutants with the smallest hash of seed and content: an edit elsewhere does not change them."""
    drawn: list[tuple[str, Mutant]] = []
    seen: Counter[tuple[str, ...]] = Counter()
    for mutant in all_places(root, only):
        content = (mutant.file, mutant.function, mutant.line, mutant.operator)
        seen[content] += 1
        drawn.append((hashlib.sha256(repr((seed, content, seen[content])).encode()).hexdigest(), mutant))
    return [mutant for _, mutant in sorted(drawn, key=lambda pair: pair[0])[:count]]
