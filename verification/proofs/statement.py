"""A statement as the kernel reads it from its text: facts, steps to check, and exact cases."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from iapb.errors import ArgumentError
from verification.proofs.cases import Case, completed, read_case, refuse_sizes
from verification.proofs.layout import Block, Entry
from verification.proofs.steps import Cofactor, Factors, Refused
from verification.proofs.words import (
    ANY,
    Expression,
    Fact,
    Product,
    Reader,
    letter,
    names_in,
    product,
)

_INFERENCES = ("cancelling", "dividing", "dominating")


@dataclass
class Task:
    """A step as its text gives it: the claim, and by what it follows."""

    claim: Fact
    entry: Entry
    method: str = ""
    terms: list[Factors] = field(default_factory=list)
    cofactors: list[Cofactor] = field(default_factory=list)


class Statement:
    """A statement as the kernel reads it.

    `given` holds the facts of each hypothesis, `definitions` name expressions and assume nothing,
    `tasks` are the steps. `cases` are exact values; the one named "" satisfies every hypothesis, so
    the theorem is not vacuous.
    """

    def __init__(self, block: Block) -> None:
        self.block = block
        self.cases = dict[str, Case]()
        self.names = {name: letter(name, *shape) for name, shape in block.shapes.items()}
        for name, formula in block.abbreviations:
            self.names[name] = Reader(self.names).expression(formula)
        self.reader = Reader(self.names)
        self.hypotheses = [(entry, self._facts(entry)) for entry in block.all("given")]
        self.given = [fact for _, facts in self.hypotheses for fact in facts]
        self.definitions = [fact for entry in block.all("where") for fact in self._facts(entry)]
        taken: set[str] = set()
        for definition in self.definitions:
            _refuse_assumption(definition, self.names, taken)
            taken |= names_in(definition.lhs) | names_in(definition.rhs)
        self.tasks: list[Task] = []
        for entry in block.all("lemma", "show", "sum", "by"):
            self._read_step(entry)
        self.conclusions = [task.claim for task in self.tasks if task.entry.key == "show"]
        for entry in block.all("case"):
            name, _, values = entry.formula.rpartition(":")
            self.cases[name] = read_case(values, block.shapes)

    def case(self, text: str) -> Case:
        """Return the values of a case, with those of the definitions."""
        name, _, values = text.rpartition(":")
        case = completed(
            read_case(values, self.block.shapes, self.cases.get(name, {})), self.definitions
        )
        refuse_sizes(case, self.block.shapes)
        return case

    def _facts(self, entry: Entry) -> list[Fact]:
        return [self.reader.fact(each, entry.words) for each in entry.formula.split(";")]

    def _read_step(self, entry: Entry) -> None:
        if entry.key in ("lemma", "show"):
            self.tasks.append(Task(self.reader.fact(entry.formula, entry.words), entry))
        elif entry.formula in _INFERENCES:
            self.tasks[-1].method = entry.formula
        elif entry.key == "by":
            self.tasks[-1].cofactors += map(_cofactor, self.reader.products(entry.formula))
        else:
            terms = self.reader.products(entry.formula)
            self.tasks[-1].terms += [
                tuple(x for x in term if isinstance(x, Expression)) for term in terms
            ]


def _refuse_assumption(definition: Fact, names: Mapping[str, Expression], taken: set[str]) -> None:
    """Raise ArgumentError if the definition could be false for some values of the letters.

    `taken` holds the letters of the definitions before.
    """
    left = definition.lhs
    right = definition.rhs
    new = names_in(left)
    alone = len(new) == 1 and left == names[min(new)]
    fits = definition.relation == "=" and (left.rows != ANY or right.is_number)
    if not alone or not fits or new & (taken | names_in(right)):
        raise ArgumentError(
            "where",
            definition.name,
            "one letter that its right side and earlier ones lack = a value of its size",
        )


def _cofactor(factors: Product) -> Cofactor:
    """Return what stands left of the equation in square brackets, the equation, and what stands
    right of it."""
    at = [i for i, each in enumerate(factors) if isinstance(each, Fact)]
    if len(at) != 1:
        raise Refused("a cofactor has one equation in square brackets")
    left = factors[: at[0]]
    right = factors[at[0] + 1 :]
    return product(left), factors[at[0]], product(right)  # type: ignore[arg-type, return-value]
