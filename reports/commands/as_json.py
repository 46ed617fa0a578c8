"""The option `--json` prints one JSON object on standard output instead of sentences; exit statuses do not change."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from typing import Annotated, Any

import typer

from reports.store.keys import plain

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of sentences.")]


@contextmanager
def facts_of(json_: bool) -> Iterator[dict[str, Any]]:
    """Yield a dictionary to fill. With --json it is printed at the end; until then, sentences go to standard error."""
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
