"""Checked proofs as plain records and as text."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction

from verification.proofs.cases import Case
from verification.proofs.steps import Known, Step, reasons
from verification.proofs.words import ANY, ONE, Expression, Fact

YES = "yes"
NO = "no"
NOT_APPLICABLE = "not applicable"


@dataclass(frozen=True)
class Line:
    """One line of a printed proof: its words and, if there is one, its formula."""

    words: str
    text: str = ""


@dataclass(frozen=True)
class StepRecord:
    """A checked step: claim, reason, certificate term by term, and why the check refused it, if it
    did."""

    claim: Line
    because: str = ""
    certificate: tuple[Line, ...] = ()
    refusal: str = ""

    @property
    def accepted(self) -> bool:
        return not self.refusal


@dataclass(frozen=True)
class Refutation:
    """A false statement, an exact case, and whether the case refutes the statement."""

    title: str
    claim: Line
    case: tuple[Line, ...]
    note: str
    refuted: bool


@dataclass(frozen=True)
class ProofRecord:
    """A proof as plain data, with everything that the command line and the report show."""

    name: str
    title: str
    source: str
    statement: str
    hypotheses: tuple[Line, ...]
    definitions: tuple[Line, ...]
    steps: tuple[StepRecord, ...]
    conclusions: tuple[Line, ...]
    needed: tuple[Refutation, ...]
    twins: tuple[Refutation, ...]
    remarks: tuple[str, ...]
    assumed: tuple[str, ...]
    measured: tuple[str, ...]
    problems: tuple[str, ...]
    seconds: float = field(compare=False)
    # whether SymPy accepts the proof too: YES, NO, or why there is no answer
    sympy: str = NOT_APPLICABLE

    @property
    def holds(self) -> bool:
        return not self.problems

    @property
    def verdict(self) -> str:
        return "proved" if self.holds else "not proved"

    def as_text(self) -> str:
        """Return the whole proof as plain text, readable without the code."""
        lines = [
            f"{self.title}   [{self.name}]",
            self.source,
            f"verdict: {self.verdict}   ({1e3 * self.seconds:.0f} ms)",
            *(f"  open: {problem}" for problem in self.problems),
            "",
            "STATEMENT",
            f"  {plain(self.statement)}",
        ]
        for title, rows in (
            ("HYPOTHESES", map(_formula, self.hypotheses)),
            ("NOTATION", map(_formula, self.definitions)),
            ("CONCLUSIONS", map(_formula, self.conclusions)),
            (
                "PROOF",
                (row for number, step in enumerate(self.steps, 1) for row in _step(number, step)),
            ),
            (
                "EACH HYPOTHESIS IS NEEDED",
                (row for case in self.needed for row in _refutation(case)),
            ),
            ("FALSE VARIANTS", (row for twin in self.twins for row in _refutation(twin))),
            ("ASSUMED ABOUT ROUNDING", map(plain, self.assumed)),
            ("MEASURED ON THE COMPILED CODE", map(plain, self.measured)),
            ("REMARKS", map(plain, self.remarks)),
        ):
            body = [f"  {row}" for row in rows]
            lines += ["", title, *body] if body else []
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


def fact_line(fact: Fact) -> Line:
    """Return a fact as a line: its name in words and its formula."""
    return Line(f"{fact.name} (entry by entry)" if fact.entrywise else fact.name, str(fact))


def number_line(says: str, left: Fraction, relation: str, right: Fraction) -> Line:
    """Return a comparison of two rationals as a line; a long rational is written as its decimal
    value."""
    both = [str(each).replace("-", "−") for each in (left, right)]
    first, second = (
        each
        if len(each) <= _LONG
        else f"{float(value):.6g} (exact rational of {len(each)} characters)"
        for each, value in zip(both, (left, right), strict=True)
    )
    return Line(says, f"{first} {relation} {second}")


def step_lines(step: Step, known: Known) -> tuple[Line, ...]:
    """Return the certificate of a step, term by term, with the facts that make a term non-negative
    or zero."""
    if step.sources:
        return (Line("from " + " and ".join(f"'{fact.name}'" for fact in step.sources)),)
    reasoned = []
    for factors in step.terms:
        names = " and ".join(f"'{fact.name}'" for fact in reasons(factors, known))
        reasoned.append(f"non-negative by {names}" if names else "a square")
    reasoned += [f"by '{fact.name}'" for _, fact, _ in step.cofactors]
    return tuple(map(Line, reasoned, products_of(step)))


def products_of(step: Step) -> list[str]:
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
    return [" · ".join(factors) for factors in found]


def _bracketed(value: Expression | str) -> str:
    """Return the formula, in brackets if a sum or a sign could be misread without them."""
    formula = str(value)
    return f"({formula})" if formula[0] == "−" or " + " in formula or " − " in formula else formula


def case_lines(case: Case, names: Mapping[str, Expression]) -> tuple[Line, ...]:
    """Return an exact case as one line per letter."""
    rows = {
        name: "; ".join(" ".join(map(str, row)) for row in value.tolist())
        for name, value in case.items()
    }
    return tuple(
        Line("", f"{name} = {row if names[name].rows == ANY else f'[{row}]'}")
        for name, row in rows.items()
    )


def _formula(line: Line) -> str:
    return f"{line.words}:   {line.text}" if line.text else line.words


def _step(number: int, step: StepRecord) -> list[str]:
    rows = [
        f"{number}. {_formula(step.claim)}"
        + ("" if step.accepted else "   REFUSED: " + step.refusal)
    ]
    rows += [f"     {plain(step.because)}"] if step.because else []
    if any(line.text for line in step.certificate):
        rows.append("     certificate (the difference of both sides, or the value, is the sum of):")
    return rows + [
        f"       {line.text}   [{line.words}]" if line.text else f"     {line.words}"
        for line in step.certificate
    ]


def _refutation(refutation: Refutation) -> list[str]:
    verdict = "refuted" if refutation.refuted else "NOT REFUTED"
    rows = [
        f"{plain(refutation.title)}: {verdict}",
        f"     false claim: {_formula(refutation.claim)}",
    ]
    case = ",  ".join(line.text for line in refutation.case)
    rows += [f"     exact case:  {case}"] if case else []
    return rows + ([f"     {plain(refutation.note)}"] if refutation.note else [])
