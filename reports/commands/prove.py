"""`iapb prove [NAME]`: check all proofs, or print one so that a reader can follow it without the code."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from reports.show import Answer, Json
from verification.proofs import all_proofs, check
from verification.proofs.coq_development import NO_ANSWER, statements, theorems


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
    facts: dict[str, list[dict[str, Any]]] = {
        "statements": [{key: getattr(one, key) for key in ("name", "title", "verdict", "seconds")} for one in records],
        "theorems": [], "coq": []}  # fmt: skip
    lines = [f"{one.verdict:<8} {one.seconds:6.2f} s  {one.name:<36} {one.title}" for one in records]
    lines.append(f"{sum(one.holds for one in records)} of {len(records)} statements proved in "
                 f"{sum(one.seconds for one in records):.1f} s; each wrong twin is refuted by an exact "
                 "counterexample.")  # fmt: skip
    if name is not None:
        lines = [records[0].as_text()]
    for theorem in (*about_code, *in_coq):
        verdict = {True: "accepted", False: "refused", None: theorem.coq}[theorem.holds]
        plain = {"name": theorem.name, "verdict": verdict, "axioms": theorem.axioms, "error": theorem.error}
        about = {"says": theorem.says} if theorem in about_code else {}
        facts["theorems" if about else "coq"].append(plain | about)
        lines.append(f"Coq: {verdict:<8} {theorem.name:<36} {''.join(f'{said}; ' for said in about.values())}axioms: "
                     f"{theorem.error or ', '.join(theorem.axioms) or '-'}")
    refused = any(theorem.holds is False or theorem.coq == NO_ANSWER for theorem in (*about_code, *in_coq))
    return Answer(facts, lines, int(refused or (json_ or name is None) and not all(one.holds for one in records)))
