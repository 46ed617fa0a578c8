"""The layout of statements as text; the formulas in them are read elsewhere, by each of the two
kernels on its own.

A statement starts with its name at the margin. Each entry is indented by two or four spaces and
starts with a keyword; what is indented further continues it. Keywords:

title, source, says       prose, with LaTeX between dollar signs; so are remark, assumed, measured
letters  M N: d d, v: d, e    matrices with their sizes, vectors, scalars (without sizes)
let      W = J N Jᵀ; ...  abbreviations
case     M=1 e=0          exact values for which all hypotheses hold (the witness);
                          `case NAME: ...` has a name
where    the definition of a letter; it assumes nothing
given    a hypothesis (several, separated by semicolons, if they state one property)
use      takes over the entries of another statement
lemma    a step of the proof; show: one that is a conclusion
sum      the terms of the last step that are not negative
by       its cofactors, with equations in square brackets; or cancelling, dividing, dominating
numbers  a comparison of numbers; without a formula those that the module `numbers` computes
false    a false comparison, with a title as a twin
twin     a false variant

An entry has the parts  WORDS :: FORMULA @ CASE -- NOTE;  only the formula is needed. The formula
fails in the case: for a hypothesis while all others hold and a conclusion is false, for a twin
while all hypotheses hold. A case may start from a named case (`NAME: e=2`); without a name it
starts from the witness.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

from iapb.errors import ArgumentError
from iapb.names import one_of

FOLDER = Path(__file__).with_name("statements")
# In reading order; the file `shared` has letters and lemmas for all and states nothing itself.
FILES = (
    "theorems",
    "redundant_rows",
    "consequences",
    "resting_contact",
    "resolver",
    "impact_laws",
    "errata",
    "floating_point",
    "exact_instances",
)
_PROSE = {"title", "source", "says", "remark", "assumed", "measured"}
_KEYS = _PROSE | {
    "letters",
    "let",
    "case",
    "where",
    "given",
    "use",
    "lemma",
    "show",
    "sum",
    "by",
    "numbers",
    "false",
    "twin",
}


class Entry(NamedTuple):
    """One entry of a statement: the keyword and the parts of its text."""

    key: str
    words: str
    formula: str
    case: str = ""
    note: str = ""


@dataclass(frozen=True)
class Block:
    """The text of a statement, entry by entry."""

    name: str
    entries: tuple[Entry, ...]

    def all(self, *keys: str) -> list[Entry]:
        """Return the entries with one of these keywords."""
        return [entry for entry in self.entries if entry.key in keys]

    def prose(self, key: str) -> tuple[str, ...]:
        """Return the texts of a keyword of prose."""
        return tuple(entry.formula for entry in self.all(key))

    @property
    def shapes(self) -> dict[str, tuple[str, ...]]:
        """The letters with their sizes; a scalar has none."""
        found: dict[str, tuple[str, ...]] = {}
        for group in (group for entry in self.all("letters") for group in entry.formula.split(",")):
            names, _, sizes = group.partition(":")
            shape = tuple(sizes.split())
            sized = len(shape) < 3 and all(size.isidentifier() or size == "1" for size in shape)
            if not sized or "I" in names.split():
                raise ArgumentError("letters", group, "names but I: one or two sizes (names, or 1)")
            found |= dict.fromkeys(names.split(), (*shape, "1") if len(shape) == 1 else shape)
        return found

    @property
    def abbreviations(self) -> list[tuple[str, str]]:
        """The names and formulas of `let`."""
        both = (
            each.partition("=") for entry in self.all("let") for each in entry.formula.split(";")
        )
        found = [(name.strip(), formula.strip()) for name, _, formula in both]
        names = [*self.shapes, "I", *(name for name, _ in found)]
        if len(set(names)) < len(names):
            raise ArgumentError("let", names, "names that are not taken")
        return found


def all_names() -> tuple[str, ...]:
    """Return the names of all statements, in reading order."""
    return tuple(name for file in FILES for name in _texts(file))


def names_in(file: str) -> tuple[str, ...]:
    """Return the names of the statements of a file."""
    return tuple(_texts(file))


def block(name: str) -> Block:
    """Return the statement of this name as text; ArgumentError if there is none."""
    return read(name, text_of(name))


def text_of(name: str) -> str:
    """Return the lines of a statement, without its name."""
    if name not in all_names():
        raise ArgumentError("name", name, one_of(name, all_names()))
    return next(_texts(file)[name] for file in FILES if name in _texts(file))


def read(name: str, text: str) -> Block:
    """Return the block of these lines, with the letters that all statements share."""
    return Block(name, (*_entries(_texts("shared")["letters"]), *_entries(text)))


@cache
def _texts(file: str) -> dict[str, str]:
    """Return the lines of each statement of a file by name."""
    found: dict[str, str] = {}
    for line in (FOLDER / f"{file}.txt").read_text(encoding="utf-8").splitlines(keepends=True):
        if line.strip() and not line.startswith(("#", " ")):
            found[line.strip()] = ""
        elif line.startswith(" "):
            found[next(reversed(found))] += line
    return found


def _entries(text: str) -> Iterator[Entry]:
    joined: list[str] = []
    for line in text.splitlines():
        if line.startswith("     ") and joined:
            joined[-1] += " " + line.strip()
        else:
            joined.append(line.strip())
    for key, _, rest in (line.partition(" ") for line in joined):
        if key not in _KEYS:
            raise ArgumentError("statement", key, one_of(key, sorted(_KEYS)))
        if key == "use":
            for name in rest.split(","):
                yield from _entries(_texts("shared")[name.strip()])
        elif key in _PROSE:
            yield Entry(key, "", rest.strip())
        else:
            rest, _, note = rest.partition(" -- ")
            rest, _, case = rest.partition("@")
            words, _, formula = rest.rpartition(" :: ")
            yield Entry(key, words.strip(), formula.strip(), case.strip(), note.strip())
