"""`iapb prove [NAME]`: check all proofs, or print one so that a reader can follow it without the code."""

from __future__ import annotations

from typing import Annotated

import typer

from reports.commands.answer import Answer, Json
from verification.proofs import all_proofs, check
from verification.proofs.coq_development import NO_ANSWER, Theorem, says, statements, theorems


def prove(
    name: Annotated[str | None, typer.Argument(help="A statement; default: check and list all.")] = None,
    second_tool: Annotated[bool, typer.Option(
        "--second-tool", help="Also check the theorems stated in Coq with Coq.")] = False,
    json_: Json = False,
) -> Answer:
    """Check every machine-checked statement, or print the proof of one."""
    names = all_proofs() if name is None else (name,)
    records = [check(each) for each in names]
    in_coq = [theorem for each, theorem in statements().items() if each in names] if second_tool else []
    about_code = theorems() if second_tool and name is None else ()
    facts = {"statements": [{"name": one.name, "title": one.title, "verdict": one.verdict, "seconds": one.seconds}
                            for one in records],
             "coq": [_plain(theorem) for theorem in in_coq],
             "theorems": [{**_plain(theorem), "says": says(theorem.name)} for theorem in about_code]}  # fmt: skip
    if name is not None:
        lines = [records[0].as_text()]
    else:
        lines = [f"{one.verdict:<8} {one.seconds:6.2f} s  {one.name:<36} {one.title}" for one in records]
        lines.append(f"{sum(one.holds for one in records)} of {len(records)} statements proved in "
                     f"{sum(one.seconds for one in records):.1f} s; each wrong twin is refuted by an exact "
                     "counterexample.")  # fmt: skip
    for theorem in (*about_code, *in_coq):
        told = f"{says(theorem.name)}; " if theorem in about_code else ""
        lines.append(f"Coq: {_verdict(theorem):<8} {theorem.name:<36} {told}axioms: "
                     f"{theorem.error or ', '.join(theorem.axioms) or '-'}")
    refused = any(theorem.holds is False or theorem.coq == NO_ANSWER for theorem in (*about_code, *in_coq))
    return Answer(facts, lines, int(refused or (json_ or name is None) and not all(one.holds for one in records)))


def _verdict(theorem: Theorem) -> str:
    return {True: "accepted", False: "refused", None: theorem.coq}[theorem.holds]


def _plain(theorem: Theorem) -> dict[str, object]:
    return {"name": theorem.name, "verdict": _verdict(theorem), "axioms": theorem.axioms, "error": theorem.error}
