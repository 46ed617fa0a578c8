"""The option `--json` prints one JSON object on standard output instead of sentences; exit statuses do not change."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from dataclasses import asdict, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

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
    """Print a value as JSON: dataclasses by their fields, arrays as lists, NaN and infinity as null."""
    print(json.dumps(_plain(value), indent=1, ensure_ascii=False, allow_nan=False))


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, bool | int | str) and not isinstance(value, Enum):
        return value
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, Enum):
        return _plain(value.value)
    if isinstance(value, Path):
        return str(value)
    if is_dataclass(value) and not isinstance(value, type):
        return _plain(asdict(value))
    if hasattr(value, "_asdict"):
        return _plain(value._asdict())
    if isinstance(value, Mapping):
        return {str(name): _plain(each) for name, each in value.items()}
    return [_plain(each) for each in value]
