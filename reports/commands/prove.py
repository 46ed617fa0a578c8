"""`iapb prove [NAME]`: check all proofs, or print one so that a reader can follow it without the code."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from reports.commands.as_json import Json, print_json
from verification.proofs import all_proofs, check, load
from verification.proofs.coq_development import NO_ANSWER, Theorem, says, theorems
from verification.proofs.second_tool import CERTIFIED, second_opinion


def prove(
    name: Annotated[str | None, typer.Argument(help="A statement; default: check and list all.")] = None,
    second_tool: Annotated[bool, typer.Option(
        "--second-tool", help="Also check the certificates and the Coq theorems with Coq.")] = False,
    json_: Json = False,
) -> None:
    """Check every machine-checked statement, or print the proof of one."""
    if json_:
        asked = theorems() if second_tool and name is None else ()
        _print_json(all_proofs() if name is None else (name,), second_tool, asked)
        return
    if name is not None:
        print(check(name).as_text())
        _ask_second_tool((name,) if second_tool else ())
        return
    seconds, failed = 0.0, []
    for each in all_proofs():
        record = check(each)
        seconds += record.seconds
        if record.verdict != "proved":
            failed.append(each)
        print(f"{record.verdict:<8} {record.seconds:6.2f} s  {each:<36} {record.title}")
    print(f"{len(all_proofs()) - len(failed)} of {len(all_proofs())} statements proved in {seconds:.1f} s; each wrong "
          "twin is refuted by an exact counterexample.")
    if second_tool:
        for theorem in theorems():
            axioms = theorem.error or ", ".join(theorem.axioms) or "-"
            print(f"Coq: {_verdict(theorem):<8} {theorem.name:<36} {says(theorem.name)}; axioms: {axioms}")
            failed += [theorem.name] * _failed(theorem)
        _ask_second_tool(CERTIFIED)
    if failed:
        raise typer.Exit(1)


def _verdict(theorem: Theorem) -> str:
    return {True: "accepted", False: "refused", None: theorem.coq}[theorem.holds]


def _failed(theorem: Theorem) -> bool:
    return theorem.holds is False or theorem.coq == NO_ANSWER


def _print_json(names: Sequence[str], second_tool: bool, asked: Sequence[Theorem]) -> None:
    """Print the verdicts and the answers of Coq; end with 1 if a statement is not proved or Coq refuses one."""
    records = [check(name) for name in names]
    opinions = [second_opinion(load(name)) for name in names if second_tool and name in CERTIFIED]
    print_json({"statements": [{"name": one.name, "title": one.title, "verdict": one.verdict, "seconds": one.seconds}
                               for one in records], "coq": opinions,
                "theorems": [{"name": one.name, "says": says(one.name), "verdict": _verdict(one), "axioms": one.axioms,
                              "error": one.error} for one in asked]})
    if (any(one.verdict != "proved" for one in records) or any(one.verdict == "refused" for one in opinions)
            or any(_failed(one) for one in asked)):
        raise typer.Exit(1)


def _ask_second_tool(names: tuple[str, ...]) -> None:
    """Print the answer of Coq to each statement; end with 1 if Coq refuses one."""
    opinions = []
    for name in names:
        opinions.append(opinion := second_opinion(load(name)))
        print(f"Coq: {opinion.verdict:<8} {opinion.seconds:6.2f} s  {opinion.name:<36} {opinion.words}")
    if any(opinion.verdict == "refused" for opinion in opinions):
        raise typer.Exit(1)
