"""A proof as plain text: statement, hypotheses, every step with its certificate, false variants, and exact cases."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from verification.proofs.statement import Line, ProofRecord, Refutation, StepRecord


def proof_text(record: ProofRecord) -> str:
    """Return the whole proof as text."""
    lines = [
        f"{record.title}   [{record.name}]",
        f"{record.source}",
        f"verdict: {record.verdict}   ({record.seconds * 1000:.0f} ms)",
        *(f"  open: {problem}" for problem in record.problems),
        "",
        "STATEMENT",
        f"  {plain(record.statement)}",
    ]
    lines += _section("HYPOTHESES", (_formula(line) for line in record.hypotheses))
    lines += _section("NOTATION", (_formula(line) for line in record.definitions))
    lines += _section("CONCLUSIONS", (_formula(line) for line in record.conclusions))
    lines += _section("PROOF", (row for number, step in enumerate(record.steps, 1) for row in _step(number, step)))
    lines += _section("EACH HYPOTHESIS IS NEEDED", (row for case in record.needed for row in _refutation(case)))
    lines += _section("WRONG TWINS", (row for twin in record.twins for row in _refutation(twin)))
    lines += _section("ASSUMED ABOUT ROUNDING", (plain(line) for line in record.assumed))
    lines += _section("MEASURED ON THE COMPILED CODE", (plain(line) for line in record.measured))
    lines += _section("REMARKS", (plain(remark) for remark in record.remarks))
    return "\n".join(lines) + "\n"


def plain(prose: str) -> str:
    """Return prose with LaTeX between dollar signs in a form that is readable on a terminal."""
    from_to = {
        r"\top": "T", r"\dagger": "†", r"\leq": "≤", r"\geq": "≥", r"\succeq": "⪰", r"\succ": "≻", r"\in": "∈",
        r"\tfrac12": "½", r"\frac12": "½", r"\cdot": "·", r"\bar": "bar ", r"\le": "≤", r"\ge": "≥", r"\neq": "≠",
        r"\perp": "⊥", r"\epsilon": "ε", r"\varepsilon": "ε", r"\kappa": "κ", r"\lambda": "λ", r"\alpha": "α",
        r"\gamma": "γ", r"\delta": "δ", r"\Delta": "Δ", r"\sigma": "σ", r"\mu": "μ", r"\sum": "Σ", r"\sqrt": "√",
        r"\rho": "ρ", r"\tau": "τ", r"\eta": "η", r"\dot": "dot ", r"\quad": "  ", r"\,": " ", r"\;": " ",
        r"\infty": "∞", r"\to": "→", r"\times": "×", r"\hat": "^", r"\|": "‖", r"\theta": "θ", r"\ldots": "…",
        r"\omega": "ω", r"\partial": "∂", r"\approx": "≈", r"\varphi": "φ", r"\Phi": "Φ", r"\max": "max",
    }  # fmt: skip
    prose = re.sub(r"\\begin{pmatrix}(.*?)\\end{pmatrix}", lambda m: f"[{m[1].strip()}]", prose)
    prose = prose.replace(r" \\ ", "; ").replace(" & ", " ").replace(r"\{", "(").replace(r"\}", ")")
    prose = re.sub(r"\\frac{([^{}]*)}{([^{}]*)}", r"(\1)/(\2)", prose)
    prose = re.sub(r"\^{([^{}]+[-+/ ][^{}]*)}", r"^(\1)", prose)
    for mark in sorted(from_to, key=len, reverse=True):
        prose = prose.replace(mark, from_to[mark])
    return re.sub(r"\\?[\${}]", "", prose)


def _section(title: str, rows: Iterable[str]) -> list[str]:
    body = [f"  {row}" for row in rows]
    return ["", title, *body] if body else []


def _formula(line: Line) -> str:
    return f"{line.words}:   {line.text}" if line.text else line.words


def _step(number: int, step: StepRecord) -> list[str]:
    mark = "" if step.accepted else "   REFUSED: " + step.refusal
    rows = [f"{number}. {_formula(step.claim)}{mark}"]
    if step.because:
        rows.append(f"     {plain(step.because)}")
    if any(line.text for line in step.certificate):
        rows.append("     certificate (the difference of both sides, or the value, is the sum of):")
    return rows + [f"     {_certificate(line)}" for line in step.certificate]


def _certificate(line: Line) -> str:
    return f"  {line.text}   [{line.words}]" if line.text else line.words


def _refutation(refutation: Refutation) -> list[str]:
    verdict = "refuted" if refutation.refuted else "NOT REFUTED"
    rows = [f"{plain(refutation.title)}: {verdict}", f"     false claim: {_formula(refutation.claim)}"]
    case = ",  ".join(line.text for line in refutation.case)
    if case:
        rows.append(f"     exact case:  {case}")
    return rows + ([f"     {plain(refutation.note)}"] if refutation.note else [])


if TYPE_CHECKING:
    from verification.proofs.statement import Line, ProofRecord, Refutation, StepRecord
