"""The answer of a command: facts for `--json`, lines and tables for a person, and the exit status."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from typing import Annotated, Any

import typer

from reports.commands.lines import table_lines
from reports.store.keys import plain
from verification.table import Table

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of sentences.")]


@dataclass(frozen=True)
class Answer:
    """What a command returns: `facts` are printed with --json, otherwise `lines` are; exit statuses do not differ."""

    facts: Any
    lines: Sequence[str | Table]
    status: int = 0

    def give(self, json_: bool) -> None:
        """Print the answer; end the command with the status if it is not 0."""
        if json_:
            print_json(self.facts)
        else:
            print_lines(self.lines)
        if self.status:
            raise typer.Exit(self.status)


def print_lines(lines: Iterable[str | Table]) -> None:
    """Print sentences and tables."""
    for line in lines:
        print(line if isinstance(line, str) else "\n".join(table_lines(line)))


@contextmanager
def facts_of(json_: bool) -> Iterator[dict[str, Any]]:
    """Yield a dictionary to fill, for a command that prints while it works.

    With --json it is printed at the end; until then, sentences go to standard error.
    """
    facts: dict[str, Any] = {}
    if not json_:
        yield facts
        return
    try:
        with redirect_stdout(sys.stderr):
            yield facts
    except typer.Exit:
        print_json(facts)
        raise
    print_json(facts)


def print_json(value: Any) -> None:
    """Print a value as JSON: records by their fields, arrays as lists, NaN and infinity as null."""
    finite = json.loads(json.dumps(plain(value)), parse_constant=lambda _: None)
    print(json.dumps(finite, indent=1, ensure_ascii=False))
