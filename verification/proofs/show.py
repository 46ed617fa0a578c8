"""Checked proofs as plain records, and formulas and proofs as text and as LaTeX that latex2mathml can convert."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import groupby

from verification.proofs.cases import Case
from verification.proofs.steps import Cofactor, Factors, Step
from verification.proofs.words import ANY, ONE, Expression, Fact

YES, NO, NOT_APPLICABLE = "yes", "no", "not applicable"


@dataclass(frozen=True)
class Line:
    """One line of a printed proof: its words and, if there is one, its formula as text and as LaTeX."""

    words: str
    text: str = ""
    latex: str = ""


@dataclass(frozen=True)
class StepRecord:
    """A checked step: claim, reason, certificate term by term, and whether the check accepted it."""

    claim: Line
    because: str
    certificate: tuple[Line, ...]
    accepted: bool
    refusal: str = ""


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
    verdict: str
    problems: tuple[str, ...]
    seconds: float = field(compare=False)
    sympy: str = NOT_APPLICABLE  # whether SymPy and Coq accept the proof too: YES, NO, or why there is no answer
    coq: str = NOT_APPLICABLE

    @property
    def holds(self) -> bool:
        return self.verdict == "proved"

    def as_text(self) -> str:
        """Return the whole proof as plain text, readable without the code."""
        lines = [f"{self.title}   [{self.name}]", self.source,
                 f"verdict: {self.verdict}   ({1e3 * self.seconds:.0f} ms)",
                 *(f"  open: {problem}" for problem in self.problems), "", "STATEMENT", f"  {plain(self.statement)}"]
        for title, rows in (
            ("HYPOTHESES", map(_formula, self.hypotheses)),
            ("NOTATION", map(_formula, self.definitions)),
            ("CONCLUSIONS", map(_formula, self.conclusions)),
            ("PROOF", (row for number, step in enumerate(self.steps, 1) for row in _step(number, step))),
            ("EACH HYPOTHESIS IS NEEDED", (row for case in self.needed for row in _refutation(case))),
            ("WRONG TWINS", (row for twin in self.twins for row in _refutation(twin))),
            ("ASSUMED ABOUT ROUNDING", map(plain, self.assumed)),
            ("MEASURED ON THE COMPILED CODE", map(plain, self.measured)),
            ("REMARKS", map(plain, self.remarks)),
        ):
            body = [f"  {row}" for row in rows]
            lines += ["", title, *body] if body else []
        return "\n".join(lines) + "\n"


_SYMBOLS = {
    r"\top": "T", r"\dagger": "†", r"\leq": "≤", r"\geq": "≥", r"\succeq": "⪰", r"\succ": "≻", r"\in": "∈",
    r"\tfrac12": "½", r"\frac12": "½", r"\cdot": "·", r"\bar": "bar ", r"\neq": "≠", r"\perp": "⊥", r"\sum": "Σ",
    r"\sqrt": "√", r"\dot": "dot ", r"\,": " ", r"\;": " ", r"\|": "‖", r"\partial": "∂", r"\approx": "≈",
    r"\times": "×", r"\max": "max", r"\alpha": "α", r"\beta": "β", r"\gamma": "γ", r"\delta": "δ", r"\Delta": "Δ",
    r"\epsilon": "ε", r"\kappa": "κ", r"\lambda": "λ", r"\sigma": "σ", r"\mu": "μ", r"\rho": "ρ", r"\tau": "τ",
    r"\eta": "η", r"\omega": "ω", r"\varphi": "φ", r"\Phi": "Φ", r"\Lambda": "Λ",
}  # fmt: skip
_GREEK = {mark: latex for latex, mark in _SYMBOLS.items() if mark.isalpha() and not mark.isascii() and mark != "Σ"}
_RAISED = {"⁻¹": "-1", "⁺": "+", "⁻": "-", "†": r"\dagger"}
_LOWERED = dict(zip("₀₁₂₃₄₅₆₇₈₉ₙₑₕₖₜₛᵣᵢ", "0123456789nehktsri", strict=True))
_POWERS = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
_RELATIONS = {"=": "=", "≠": r"\neq", "<": "<", "≤": r"\leq", ">": ">", "≥": r"\geq", "⪰": r"\succeq", "≻": r"\succ"}


def plain(prose: str) -> str:
    """Return prose with LaTeX between dollar signs in a form that is readable on a terminal."""
    prose = re.sub(r"\\begin{pmatrix}(.*?)\\end{pmatrix}", lambda m: f"[{m[1].strip()}]", prose)
    prose = prose.replace(r" \\ ", "; ").replace(" & ", " ").replace(r"\{", "(").replace(r"\}", ")")
    prose = re.sub(r"\\frac{([^{}]*)}{([^{}]*)}", r"(\1)/(\2)", prose)
    prose = re.sub(r"\^{([^{}]+[-+/ ][^{}]*)}", r"^(\1)", prose)
    for mark in sorted(_SYMBOLS, key=len, reverse=True):
        prose = prose.replace(mark, _SYMBOLS[mark])
    return re.sub(r"\\?[\${}]", "", prose)


def text(value: Expression) -> str:
    """Return an expression as text on one line, as a sum of terms that the reader reads again."""
    return _sum(value, str, lambda name, power: name + (str(power).translate(_POWERS) if power > 1 else ""),
                lambda name: name + "ᵀ", " ")


def latex(value: Expression) -> str:
    """Return an expression in LaTeX, as a sum of terms."""
    return _sum(value, latex_number, lambda name, power: latex_name(name) if power == 1 else
                f"{{{latex_name(name)}}}^{{{power}}}", lambda name: f"{{{latex_name(name)}}}^{{\\top}}",
                r" \, ").replace("−", "-")


def _sum(value: Expression, write: Callable[[Fraction], str], power: Callable[[str, int], str],
         flipped: Callable[[str], str], gap: str) -> str:  # fmt: skip
    pieces: list[str] = []
    unit = "" if value.rows in (ANY, "1") else "I"  # a bare number among matrices is a multiple of the identity
    for (scalars, word), coefficient in value.ordered():
        factors = [power(name, len(list(group))) for name, group in groupby(scalars)]
        factors += [flipped(each.name) if each.flipped else power(each.name, 1) for each in word] or [unit] * bool(unit)
        number = [] if abs(coefficient) == 1 and factors else [write(abs(coefficient))]
        sign = "−" if coefficient < 0 else "+" if pieces else ""
        pieces.append((f" {sign} " if pieces else sign) + gap.join(number + factors))
    return "".join(pieces) or "0"


def latex_name(name: str) -> str:
    """Return the LaTeX form of a Unicode name such as M⁻¹, γ⁺ or J₁."""
    upper = "".join(_RAISED[mark] for mark in re.findall("|".join(_RAISED), name))
    name = re.sub("|".join(_RAISED), "", name)
    lower = "".join(_LOWERED.get(each, "") for each in name)
    base = "".join(_GREEK.get(each, each) for each in name if each not in _LOWERED)
    return base + (f"_{{{lower}}}" if lower else "") + (f"^{{{upper}}}" if upper else "")


def latex_number(value: Fraction) -> str:
    sign = "-" if value < 0 else ""
    return str(value) if value.denominator == 1 else f"{sign}\\frac{{{abs(value.numerator)}}}{{{value.denominator}}}"


def fact_line(fact: Fact) -> Line:
    """Return a fact as a line: its name in words and its formula."""
    identity = fact.rhs == ONE and fact.lhs.rows not in (ANY, "1")  # then 1 stands for the identity matrix
    right = ("I", "I") if identity else (text(fact.rhs), latex(fact.rhs))
    return Line(f"{fact.name} (entry by entry)" if fact.entrywise else fact.name,
                f"{text(fact.lhs)} {fact.relation} {right[0]}",
                f"{latex(fact.lhs)} {_RELATIONS[fact.relation]} {right[1]}")  # fmt: skip


def number_line(says: str, left: Fraction, relation: str, right: Fraction) -> Line:
    """Return a comparison of two rationals as a line; a long rational is written as its decimal value."""
    words = [str(each) if len(str(each)) <= 24 else f"{float(each):.6g} (exact rational of {len(str(each))} characters)"
             for each in (left, right)]  # fmt: skip
    maths = f"{latex_number(left)} {_RELATIONS[relation]} {latex_number(right)}"
    return Line(says, f"{words[0]} {relation} {words[1]}", maths if len(maths) < 160 else "")


def step_lines(step: Step, reasons: Callable[[Factors], Iterable[Fact]]) -> tuple[Line, ...]:
    """Return the certificate of a step, term by term; `reasons` gives the facts that make a term non-negative."""
    if step.sources:
        return (Line("from " + " and ".join(f"'{fact.name}'" for fact in step.sources)),)
    return (*(_term_line(factors, reasons(factors)) for factors in step.terms), *map(_cofactor_line, step.cofactors))


def _cofactor_line(cofactor: Cofactor) -> Line:
    left, fact, right = cofactor
    both = fact_line(fact)
    plain_, maths = (f"[{each.rpartition(' = ')[0]} {sign} {_bracketed(each.rpartition(' = ')[2])}]"
                     for each, sign in ((both.text, "−"), (both.latex, "-")))  # fmt: skip
    if left != ONE:
        plain_, maths = f"{_bracketed(text(left))} · {plain_}", f"{_bracketed(latex(left))} {maths}"
    if right != ONE:
        plain_, maths = f"{plain_} · {_bracketed(text(right))}", f"{maths} {_bracketed(latex(right))}"
    return Line(f"by '{fact.name}'", plain_, maths)


def _bracketed(formula: str) -> str:
    """Return the formula, in brackets if a sum or a sign could be misread without them."""
    misread = formula[0] in "-−" or any(mark in formula for mark in (" + ", " − ", " - "))
    return f"({formula})" if misread else formula


def _term_line(factors: Factors, reasons: Iterable[Fact]) -> Line:
    names = " and ".join(f"'{fact.name}'" for fact in reasons)
    return Line(f"non-negative by {names}" if names else "a square",
                " · ".join(_bracketed(text(factor)) for factor in factors),
                r" \, ".join(_bracketed(latex(factor)) for factor in factors))  # fmt: skip


def case_lines(case: Case, names: Mapping[str, Expression]) -> tuple[Line, ...]:
    """Return an exact case as one line per letter."""
    return tuple(_value_line(name, rows, scalar=names[name].rows == ANY) for name, rows in case.items())


def _value_line(name: str, rows: tuple[tuple[Fraction, ...], ...], *, scalar: bool) -> Line:
    if scalar:
        return Line("", f"{name} = {rows[0][0]}", f"{latex_name(name)} = {latex_number(rows[0][0])}")
    body = r" \\ ".join(" & ".join(map(latex_number, row)) for row in rows)
    return Line("", f"{name} = [{'; '.join(' '.join(map(str, row)) for row in rows)}]",
                f"{latex_name(name)} = \\begin{{pmatrix}} {body} \\end{{pmatrix}}")


def _formula(line: Line) -> str:
    return f"{line.words}:   {line.text}" if line.text else line.words


def _step(number: int, step: StepRecord) -> list[str]:
    rows = [f"{number}. {_formula(step.claim)}" + ("" if step.accepted else "   REFUSED: " + step.refusal)]
    rows += [f"     {plain(step.because)}"] if step.because else []
    if any(line.text for line in step.certificate):
        rows.append("     certificate (the difference of both sides, or the value, is the sum of):")
    return rows + [f"       {line.text}   [{line.words}]" if line.text else f"     {line.words}"
                   for line in step.certificate]  # fmt: skip


def _refutation(refutation: Refutation) -> list[str]:
    verdict = "refuted" if refutation.refuted else "NOT REFUTED"
    rows = [f"{plain(refutation.title)}: {verdict}", f"     false claim: {_formula(refutation.claim)}"]
    case = ",  ".join(line.text for line in refutation.case)
    rows += [f"     exact case:  {case}"] if case else []
    return rows + ([f"     {plain(refutation.note)}"] if refutation.note else [])
