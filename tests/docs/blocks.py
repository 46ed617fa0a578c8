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
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
_FENCED = re.compile(r"^```(\w+)\n(.*?)^```$", flags=re.M | re.S)
_FILE_LINE = re.compile(r"# ([\w./-]+\.(?:py|yaml|toml))\n")
_COMMAND = re.compile(r"^\$ (.*)\n((?:(?!\$ ).*\n)*)", flags=re.M)


@dataclass
class Block:
    """One thing to do: `kind` is python, command, file, diff or sh.

    id : document and line; path : of a file to write or change
    expected, span : the output printed below it, and where the document has it; None without output
    """

    id: str
    kind: str
    source: str
    path: str = ""
    expected: str | None = None
    span: tuple[int, int] = (0, 0)


def read_blocks(name: str) -> list[Block]:
    """Return the blocks of a document in order."""
    text = (ROOT / name).read_text(encoding="utf-8")
    found: list[Block] = []
    for fenced in _FENCED.finditer(text):
        language, body = fenced.groups()
        place, named = f"{name}:{text.count(chr(10), 0, fenced.start()) + 1}", _FILE_LINE.match(body)
        if language == "text" and found[-1].kind == "python" and found[-1].expected is None:
            found[-1].expected, found[-1].span = body, fenced.span(2)
        elif language == "console":
            found += [Block(place, "command", command[1], "", command[2], tuple(fenced.start(2) + k for k in
                                                                                  command.span(2)))
                      for command in _COMMAND.finditer(body)]  # fmt: skip
        elif language in ("diff", "python", "yaml") and named:
            found.append(Block(place, "diff" if language == "diff" else "file",
                               body[named.end():] if language == "diff" else body, named[1]))  # fmt: skip
        elif language in ("python", "sh"):
            found.append(Block(place, language, body))
        else:
            raise ValueError(f"{place}: a block of kind {language!r} is shown but never checked")
    return found
