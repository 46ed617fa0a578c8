"""`iapb prove [NAME]`: check all proofs, or print one so that a reader can follow it without the
code."""

from __future__ import annotations

from typing import Annotated

import typer

from reports.show import Answer, Json
from verification.proofs import all_proofs, check


def prove(
    name: Annotated[
        str | None, typer.Argument(help="A statement; default: check and list all.")
    ] = None,
    json_: Json = False,
) -> Answer:
    """Check every machine-checked statement, or print the proof of one."""
    records = [check(each) for each in (all_proofs() if name is None else (name,))]
    keys = ("name", "title", "verdict", "seconds")
    facts = {"statements": [{key: getattr(one, key) for key in keys} for one in records]}
    lines = [
        f"{one.verdict:<8} {one.seconds:6.2f} s  {one.name:<36} {one.title}" for one in records
    ]
    lines.append(
        f"{sum(one.holds for one in records)} of {len(records)} statements proved in "
        f"{sum(one.seconds for one in records):.1f} s; each wrong twin is refuted by an exact "
        "counterexample."
    )
    if name is not None:
        lines = [records[0].as_text()]
    return Answer(
        facts, lines, int((json_ or name is None) and not all(one.holds for one in records))
    )
