"""Checked proofs as plain records, with their text."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from verification.proofs.cases import Case, Comparison
from verification.proofs.steps import Known, Step, reasons
from verification.proofs.words import ANY, ONE, Expression, Fact

YES = "yes"
NO = "no"
NOT_APPLICABLE = "not applicable"


@dataclass(frozen=True)
class StepRecord:
    """A checked step: claim, reason, the products of its certificate with a reason for each, and
    why the check refused it, if it did. An inference has reasons without products."""

    claim: str
    because: str = ""
    products: tuple[str, ...] = ()
    reasons: tuple[str, ...] = ()
    refusal: str = ""

    @property
    def accepted(self) -> bool:
        return not self.refusal

    def lines(self, number: int) -> list[str]:
        """Return what is printed of the step."""
        refused = "" if self.accepted else f"   REFUSED: {self.refusal}"
        rows = [f"{number}. {self.claim}{refused}"]
        rows += [f"     {plain(self.because)}"] if self.because else []
        if not self.products:
            return rows + [f"     {reason}" for reason in self.reasons]
        rows.append("     certificate (the difference of both sides, or the value, is the sum of):")
        each = zip(self.products, self.reasons, strict=True)
        return rows + [f"       {product}   [{reason}]" for product, reason in each]


@dataclass(frozen=True)
class Refutation:
    """A false statement, an exact case, and whether the case refutes the statement."""

    title: str
    claim: str
    case: str
    note: str
    refuted: bool

    @property
    def lines(self) -> list[str]:
        """What is printed of it."""
        verdict = "refuted" if self.refuted else "NOT REFUTED"
        rows = [f"{plain(self.title)}: {verdict}", f"     false claim: {self.claim}"]
        rows += [f"     exact case:  {self.case}"] if self.case else []
        return rows + ([f"     {plain(self.note)}"] if self.note else [])


@dataclass(frozen=True)
class ProofRecord:
    """A proof as plain data: what the report shows, and its text, readable without the code.

    sympy : whether SymPy accepts the proof, too
    """

    name: str
    title: str
    source: str
    statement: str
    steps: tuple[StepRecord, ...]
    needed: tuple[Refutation, ...]
    twins: tuple[Refutation, ...]
    problems: tuple[str, ...]
    sympy: str
    sections: dict[str, tuple[str, ...]]
    seconds: float = field(compare=False)

    @property
    def holds(self) -> bool:
        return not self.problems

    @property
    def verdict(self) -> str:
        return "proved" if self.holds else "not proved"

    def as_text(self) -> str:
        """Return the whole proof as plain text."""
        lines = [
            f"{self.title}   [{self.name}]",
            self.source,
            f"verdict: {self.verdict}   ({1e3 * self.seconds:.0f} ms)",
            *(f"  open: {problem}" for problem in self.problems),
        ]
        for title, rows in self.sections.items():
            lines += ["", title, *(f"  {row}" for row in rows)] if rows else []
        return "\n".join(lines) + "\n"


_SYMBOLS = {
    r"\top": "T",
    r"\dagger": "†",
    r"\leq": "≤",
    r"\geq": "≥",
    r"\succeq": "⪰",
    r"\succ": "≻",
    r"\in": "∈",
    r"\tfrac12": "½",
    r"\frac12": "½",
    r"\cdot": "·",
    r"\bar": "bar ",
    r"\neq": "≠",
    r"\perp": "⊥",
    r"\sum": "Σ",
    r"\sqrt": "√",
    r"\dot": "dot ",
    r"\,": " ",
    r"\;": " ",
    r"\|": "‖",
    r"\partial": "∂",
    r"\approx": "≈",
    r"\times": "×",
    r"\max": "max",
    r"\alpha": "α",
    r"\beta": "β",
    r"\gamma": "γ",
    r"\delta": "δ",
    r"\Delta": "Δ",
    r"\epsilon": "ε",
    r"\kappa": "κ",
    r"\lambda": "λ",
    r"\sigma": "σ",
    r"\mu": "μ",
    r"\rho": "ρ",
    r"\tau": "τ",
    r"\eta": "η",
    r"\omega": "ω",
    r"\varphi": "φ",
    r"\Phi": "Φ",
    r"\Lambda": "Λ",
}
_LONG = 60  # characters of a rational that is still written out


def plain(prose: str) -> str:
    """Return prose with LaTeX between dollar signs in a form that is readable on a terminal."""
    prose = re.sub(r"\\begin{pmatrix}(.*?)\\end{pmatrix}", lambda m: f"[{m[1].strip()}]", prose)
    prose = prose.replace(r" \\ ", "; ").replace(" & ", " ").replace(r"\{", "(").replace(r"\}", ")")
    prose = re.sub(r"\\frac{([^{}]*)}{([^{}]*)}", r"(\1)/(\2)", prose)
    prose = re.sub(r"\^{([^{}]+[-+/ ][^{}]*)}", r"^(\1)", prose)
    for mark in sorted(_SYMBOLS, key=len, reverse=True):
        prose = prose.replace(mark, _SYMBOLS[mark])
    return re.sub(r"\\?[\${}]", "", prose)


def lines_of(facts: Iterable[Fact]) -> tuple[str, ...]:
    """Return each fact as a line: its name in words and its formula."""
    return tuple(f"{fact.name}{' (entry by entry)' * fact.entrywise}:   {fact}" for fact in facts)


def number_line(compared: Comparison) -> str:
    """Return a comparison of two rationals as a line; a long rational is written as its decimal
    value."""
    sides = []
    for value in (compared.left, compared.right):
        exact = str(value).replace("-", "−")
        long = f"{float(value):.6g} (exact rational of {len(exact)} characters)"
        sides.append(exact if len(exact) <= _LONG else long)
    return f"{compared.says}:   {f' {compared.relation} '.join(sides)}"


def reasons_of(step: Step, known: Known) -> tuple[str, ...]:
    """Return why each product of a certificate is not negative or zero, or from which facts an
    inference follows."""
    if step.sources:
        return ("from " + " and ".join(f"'{fact.name}'" for fact in step.sources),)
    found = []
    for factors in step.terms:
        names = " and ".join(f"'{fact.name}'" for fact in reasons(factors, known))
        found.append(f"non-negative by {names}" if names else "a square")
    return (*found, *(f"by '{fact.name}'" for _, fact, _ in step.cofactors))


def products_of(step: Step) -> tuple[str, ...]:
    """Return the products of a certificate as text: the terms, then the cofactors."""
    found = [[_bracketed(factor) for factor in factors] for factors in step.terms]
    for left, fact, right in step.cofactors:
        one, other = str(fact).split(" = ")
        found.append(
            [
                *[_bracketed(left)] * (left != ONE),
                f"[{one} − {_bracketed(other)}]",
                *[_bracketed(right)] * (right != ONE),
            ]
        )
    return tuple(" · ".join(factors) for factors in found)


def _bracketed(value: Expression | str) -> str:
    """Return the formula, in brackets if a sum or a sign could be misread without them."""
    formula = str(value)
    return f"({formula})" if formula[0] == "−" or " + " in formula or " − " in formula else formula


def case_line(case: Case, names: Mapping[str, Expression]) -> str:
    """Return an exact case as a line with the value of each letter."""
    values = []
    for name, value in case.items():
        rows = "; ".join(" ".join(map(str, row)) for row in value.tolist())
        values.append(f"{name} = {rows if names[name].rows == ANY else f'[{rows}]'}")
    return ",  ".join(values)
