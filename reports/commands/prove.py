"""`iapb prove [NAME]`: check the proofs, or print one so that it can be followed without the code."""

from __future__ import annotations

from typing import Annotated

import typer


def prove(
    name: Annotated[str | None, typer.Argument(help="A statement; without it all are checked and listed.")] = None,
) -> None:
    """Check every machine-checked statement, or print the proof of one."""
    from verification.proofs import all_proofs, check

    if name is not None:
        print(check(name).as_text())
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
    if failed:
        raise typer.Exit(1)
