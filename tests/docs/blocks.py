"""The fenced blocks of a Markdown document, and what each of them means to the tests.

    ```python            executed, in order, in one namespace for the document; a ```text block right after it is
                         what it printed
    ```console           "$ " starts a command (iapb, cat, pytest); the lines after it are its output
    ```yaml, ```python   whose first line is "# some/file.yaml" or "# some/file.py": that file is written
    ```diff              first line "# some/file.py": lines with "+" are added to that file beside its " " lines
    ```sh                only read: every `make` target must exist
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("iapb", "reference", "verification", "reports")

_FILE_LINE = re.compile(r"^# ([\w./-]+\.(?:py|yaml))$")
_FENCE = "```"


@dataclass(frozen=True)
class Block:
    """One thing to do: `kind` is python, command, file, diff or sh; `expected` is the output printed below it."""

    document: str
    line: int  # of the opening fence, or of the command
    kind: str
    source: str
    path: str = ""
    expected: str | None = None
    expected_lines: tuple[int, int] = (0, 0)  # of the output in the document, first and one past the last (from 0)

    @property
    def id(self) -> str:
        """Place in words."""
        return f"{self.document}:{self.line}"


def read_blocks(path: Path, name: str) -> list[Block]:
    """Return the blocks of a document in order."""
    found: list[Block] = []
    lines = path.read_text(encoding="utf-8").splitlines()
    start = None
    for number, line in enumerate(lines):
        if not line.startswith(_FENCE):
            continue
        if start is None:
            start = number
            continue
        _add(found, name, lines[start][len(_FENCE):].strip(), start, lines[start + 1 : number])
        start = None
    return found


def _add(found: list[Block], name: str, language: str, start: int, body: list[str]) -> None:
    named = _FILE_LINE.match(body[0]) if body else None
    text = "\n".join(body) + "\n"
    if language == "text":
        if not found or found[-1].kind != "python" or found[-1].expected is not None:
            raise ValueError(f"{name}:{start + 1}: a text block must follow a python block")
        found[-1] = replace(found[-1], expected=text, expected_lines=(start + 1, start + 1 + len(body)))
    elif language == "console":
        found.extend(_commands(name, start, body))
    elif language == "diff" and named:
        found.append(Block(name, start + 1, "diff", "\n".join(body[1:]), named.group(1)))
    elif language in ("python", "yaml") and named:
        found.append(Block(name, start + 1, "file", text, named.group(1)))
    elif language in ("python", "sh"):
        found.append(Block(name, start + 1, language, text))
    else:
        raise ValueError(f"{name}:{start + 1}: a block of kind {language!r} is shown but never checked")


def _commands(name: str, start: int, body: list[str]) -> list[Block]:
    places = [k for k, line in enumerate(body) if line.startswith("$ ")]
    blocks = []
    for place, after in zip(places, [*places[1:], len(body)], strict=True):
        output = "\n".join(body[place + 1 : after]) + "\n"
        span = (start + place + 2, start + after + 1)
        blocks.append(Block(name, start + place + 2, "command", body[place][2:], "", output, span))
    return blocks
