"""A proof as an HTML fragment with MathML, readable without a script."""

from __future__ import annotations

import re
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from verification.proofs.statement import Line, ProofRecord, Refutation, StepRecord


def formula_html(latex: str) -> str:
    """One inline formula as MathML."""
    from latex2mathml.converter import convert

    return convert(latex)


def prose_html(prose: str) -> str:
    """Prose whose LaTeX stands between dollar signs."""
    parts = re.split(r"\$([^$]+)\$", prose)
    return "".join(formula_html(part) if i % 2 else escape(part) for i, part in enumerate(parts))


def proof_html(record: ProofRecord) -> str:
    """The whole proof; headings start at h4 so that a page can put it under its own."""
    parts = [
        f'<article class="proof" id="proof-{escape(record.name)}">',
        f"<h3>{escape(record.title)}</h3>",
        f'<p class="source">{escape(record.source)}; verdict: <strong>{escape(record.verdict)}</strong></p>',
        f"<p>{prose_html(record.statement)}</p>",
        _list("Hypotheses", [_line(line) for line in record.hypotheses]),
        _list("Notation", [_line(line) for line in record.definitions]),
        _list("Conclusions", [_line(line) for line in record.conclusions]),
        _list("Proof", [_step(step) for step in record.steps], "ol"),
        _list("Each hypothesis is needed", [_refutation(case) for case in record.needed]),
        _list("Wrong twins", [_refutation(twin) for twin in record.twins]),
        _list("Remarks", [prose_html(remark) for remark in record.remarks]),
        "</article>",
    ]
    return "\n".join(part for part in parts if part)


def _list(title: str, items: list[str], kind: str = "ul") -> str:
    if not items:
        return ""
    body = "".join(f"<li>{item}</li>" for item in items)
    return f"<h4>{title}</h4><{kind}>{body}</{kind}>"


def _line(line: Line) -> str:
    formula = formula_html(line.latex) if line.latex else escape(line.text)
    return f"{escape(line.words)}: {formula}" if formula and line.words else formula or escape(line.words)


def _step(step: StepRecord) -> str:
    reason = f" <em>({prose_html(step.because)})</em>" if step.because else ""
    certificate = "".join(f"<li>{_line(line)}</li>" for line in step.certificate)
    details = (
        f"<details><summary>certificate</summary><ul>{certificate}</ul></details>" if certificate else ""
    )
    refusal = "" if step.accepted else f" <strong>refused: {escape(step.refusal)}</strong>"
    return _line(step.claim) + reason + refusal + details


def _refutation(refutation: Refutation) -> str:
    verdict = "refuted" if refutation.refuted else "not refuted"
    case = ", ".join(_line(line) for line in refutation.case)
    return (
        f"{prose_html(refutation.title)} ({verdict}): {_line(refutation.claim)}"
        + (f"; exact case: {case}" if case else "")
        + (f". {prose_html(refutation.note)}" if refutation.note else "")
    )
