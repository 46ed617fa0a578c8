"""Formulas as text and as LaTeX that latex2mathml can convert."""

from __future__ import annotations

from fractions import Fraction
from itertools import groupby

from verification.proofs.algebra import (
    Definite,
    Entrywise,
    Equation,
    Expression,
    Fact,
    Letter,
    NonNegative,
    Nonzero,
    Term,
)
from verification.proofs.exact import Instance, Matrix
from verification.proofs.statement import Line
from verification.proofs.steps import (
    Cancelling,
    Cofactor,
    Dividing,
    Dominating,
    Exact,
    Identity,
    Pairing,
    Square,
    Step,
)
from verification.proofs.steps import Term as SumTerm

_SUPERSCRIPTS = {"⁻¹": "-1", "⁺": "+", "⁻": "-", "†": r"\dagger", "²": "2", "′": r"\prime"}
_SUBSCRIPTS = {**dict(zip("₀₁₂₃₄₅₆₇₈₉", "0123456789", strict=True)), "ₙ": "n", "ᵣ": "r", "ₑ": "e", "ᵢ": "i", "ⱼ": "j",
               "ₖ": "k", "ₚ": "p", "ₜ": "t", "ₓ": "x", "ₛ": "s"}  # fmt: skip
_GREEK = {
    "α": r"\alpha", "β": r"\beta", "γ": r"\gamma", "λ": r"\lambda", "μ": r"\mu", "σ": r"\sigma", "ω": r"\omega",
    "δ": r"\delta", "Δ": r"\Delta", "Λ": r"\Lambda", "τ": r"\tau", "ρ": r"\rho", "Φ": r"\Phi", "η": r"\eta",
    "φ": r"\varphi",
}  # fmt: skip
RELATIONS = {"=": "=", "≠": r"\neq", "<": "<", "≤": r"\leq", ">": ">", "≥": r"\geq"}


def text(value: Expression) -> str:
    """Return an expression as text on one line, as a sum of terms."""
    return _sum(value, _text_term)


def latex(value: Expression) -> str:
    """Return an expression in LaTeX, as a sum of terms."""
    return _sum(value, _latex_term)


def _sum(value: Expression, write) -> str:  # type: ignore[no-untyped-def]
    pieces: list[str] = []
    unit = "" if value.rows in ("*", "1") else "I"  # a bare number among matrices is a multiple of the identity
    for term, coefficient in value.ordered():
        sign = "−" if coefficient < 0 else "+"
        piece = write(term, abs(coefficient), unit)
        pieces.append(f" {sign} {piece}" if pieces else ("−" if sign == "−" else "") + piece)
    joined = "".join(pieces) or "0"
    return joined.replace("−", "-") if write is _latex_term else joined


def _text_term(term: Term, coefficient: Fraction, unit: str) -> str:
    scalars, word = term
    factors = [name + _raised(len(list(group))) for name, group in groupby(scalars)]
    factors += [letter.name + ("ᵀ" if letter.flipped else "") for letter in word] if word else [unit] * bool(unit)
    number = [] if coefficient == 1 and factors else [str(coefficient)]
    return " ".join(number + factors)


def _raised(power: int) -> str:
    return "" if power == 1 else "".join("⁰¹²³⁴⁵⁶⁷⁸⁹"[int(digit)] for digit in str(power))


def _latex_term(term: Term, coefficient: Fraction, unit: str) -> str:
    scalars, word = term
    factors = []
    for name, group in groupby(scalars):
        power = len(list(group))
        factors.append(latex_name(name) if power == 1 else f"{{{latex_name(name)}}}^{{{power}}}")
    factors += [_latex_letter(letter) for letter in word] if word else [unit] * bool(unit)
    number = [] if coefficient == 1 and factors else [latex_number(coefficient)]
    return r" \, ".join(number + factors)


def _latex_letter(letter: Letter) -> str:
    name = latex_name(letter.name)
    return f"{{{name}}}^{{\\top}}" if letter.flipped else name


def latex_name(name: str) -> str:
    """Return the LaTeX form of a Unicode name such as M⁻¹, γ⁺ or J₁."""
    base, lower, upper, rest = "", "", "", name
    while rest:
        raised = next((mark for mark in _SUPERSCRIPTS if rest.startswith(mark)), None)
        if raised is not None:
            upper += _SUPERSCRIPTS[raised]
            rest = rest[len(raised) :]
            continue
        character, rest = rest[0], rest[1:]
        if character in _SUBSCRIPTS:
            lower += _SUBSCRIPTS[character]
        else:
            base += _GREEK.get(character, character)
    return base + (f"_{{{lower}}}" if lower else "") + (f"^{{{upper}}}" if upper else "")


def latex_number(value: Fraction) -> str:
    if value.denominator == 1:
        return str(value.numerator)
    sign = "-" if value < 0 else ""
    return f"{sign}\\frac{{{abs(value.numerator)}}}{{{value.denominator}}}"


def fact_line(fact: Fact) -> Line:
    """Return a fact as a line: its name in words and its formula."""
    match fact:
        case Equation():
            right = ("I", "I") if _is_identity(fact) else (text(fact.rhs), latex(fact.rhs))
            return Line(fact.name, f"{text(fact.lhs)} = {right[0]}", f"{latex(fact.lhs)} = {right[1]}")
        case NonNegative():
            mark = ("≥", r"\geq") if fact.value.rows in ("*", "1") else ("⪰", r"\succeq")
        case Definite():
            mark = ("≻", r"\succ")
        case Entrywise():
            mark = ("≥", r"\geq")
        case Nonzero():
            mark = ("≠", r"\neq")
    words = f"{fact.name} (entry by entry)" if isinstance(fact, Entrywise) else fact.name
    return Line(words, f"{text(fact.value)} {mark[0]} 0", f"{latex(fact.value)} {mark[1]} 0")


def _is_identity(fact: Equation) -> bool:
    """Whether the right side is 1 and the left side a matrix, so that the 1 stands for the identity matrix."""
    return fact.rhs == 1 and fact.lhs.rows not in ("*", "1")


def step_claim(step: Step) -> Line:
    if isinstance(step, Exact):
        formula = f"{number_text(step.left)} {step.relation} {number_text(step.right)}"
        maths = f"{latex_number(step.left)} {RELATIONS[step.relation]} {latex_number(step.right)}"
        return Line(step.says, formula, maths if len(maths) < 160 else "")
    return fact_line(step.claim)


def step_lines(step: Step) -> tuple[Line, ...]:
    """Return the certificate of a step, term by term."""
    match step:
        case Exact():
            return ()
        case Cancelling():
            sources = [step.square] if step.definite is None else [step.square, step.definite]
            return (Line("from " + " and ".join(f"'{fact.name}'" for fact in sources)),)
        case Dividing():
            return (Line(f"from '{step.product.name}' and '{step.divisor.name}'"),)
        case Dominating():
            return (Line(f"from '{step.product.name}' and '{step.factor.name}'"),)
        case Identity():
            return tuple(_cofactor_line(cofactor) for cofactor in step.cofactors)
    return tuple(_term_line(t) for t in step.terms) + tuple(_cofactor_line(c) for c in step.cofactors)


def _cofactor_line(cofactor: Cofactor) -> Line:
    left, right, middle = cofactor.left, cofactor.right, cofactor.equation
    words = f"by '{middle.name}'"
    identity_side = _is_identity(middle)
    plain = f"[{text(middle.lhs)} − {'I' if identity_side else _bracketed(text(middle.rhs))}]"
    maths = f"[ {latex(middle.lhs)} - {'I' if identity_side else _bracketed(latex(middle.rhs))} ]"
    if left != 1:
        plain, maths = f"{_bracketed(text(left))} · {plain}", f"{_bracketed(latex(left))} {maths}"
    if right != 1:
        plain, maths = f"{plain} · {_bracketed(text(right))}", f"{maths} {_bracketed(latex(right))}"
    return Line(words, plain, maths)


def _bracketed(formula: str) -> str:
    """Return the formula, in brackets if a sum or a sign could be misread without them."""
    misread = formula[0] in "-−" or any(mark in formula for mark in (" + ", " − ", " - "))
    return f"({formula})" if misread else formula


def _term_line(term: SumTerm) -> Line:
    names = " and ".join(f"'{fact.name}'" for fact in term.facts)
    words = f"non-negative by {names}" if names else "a square"
    number = "" if term.weight == 1 else f"{term.weight} · "
    maths = "" if term.weight == 1 else latex_number(Fraction(term.weight)) + r" \cdot "
    for factor in term.factors:
        number += f"({text(factor.value)}) · "
        maths += f"({latex(factor.value)}) "
    match term.form:
        case None:
            return Line(words, number.rstrip(" ·") or "1", maths)
        case Square():
            outer, inner = term.form.half.T, term.form.half
        case Pairing():
            outer, inner = term.form.left.value.T, term.form.right.value
        case _:
            return Line(words, f"{number}({text(term.form.value)})", f"{maths}({latex(term.form.value)})")
    core = term.form.core
    middle = ("", "") if core is None else (f" ({text(core.value)})", f" ({latex(core.value)})")
    return Line(
        words,
        f"{number}({text(outer)}){middle[0]} ({text(inner)})",
        f"{maths}({latex(outer)}){middle[1]} ({latex(inner)})",
    )


def number_text(value: Fraction) -> str:
    """Return a short rational in full, and a long one as its decimal value."""
    plain = str(value)
    return plain if len(plain) <= 24 else f"{float(value):.6g} (exact rational of {len(plain)} characters)"


def case_lines(given: Instance) -> tuple[Line, ...]:
    """Return an exact instance as one line per letter."""
    return tuple(_value_line(name, value) for name, value in given.values.items())


def _value_line(name: str, value: Matrix | Fraction) -> Line:
    if isinstance(value, Fraction):
        return Line("", f"{name} = {value}", f"{latex_name(name)} = {latex_number(value)}")
    plain = "; ".join(" ".join(str(entry) for entry in row) for row in value)
    body = r" \\ ".join(" & ".join(latex_number(entry) for entry in row) for row in value)
    return Line("", f"{name} = [{plain}]", f"{latex_name(name)} = \\begin{{pmatrix}} {body} \\end{{pmatrix}}")
