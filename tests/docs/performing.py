"""The fenced blocks of a Markdown document, and `python performing.py DOCUMENT ANSWERS.json`, which
performs them.

    ```python            executed, in order, in one namespace for the document; a ```text block
                         right after it is what it printed
    ```console           "$ " starts a command (iapb, cat, pytest); the lines after it are its
                         output
    ```yaml, ```python   whose first line is "# some/file.yaml" or "# some/file.py": that file is
                         written
    ```sh                only read: every `make` target must exist

The working directory is where files are written.
"""

from __future__ import annotations

import glob
import io
import json
import re
import shlex
import sys
import traceback
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
_FENCED = re.compile(r"^```(\w+)\n(.*?)^```$", flags=re.M | re.S)
_FILE_LINE = re.compile(r"# ([\w./-]+\.(?:py|yaml|toml))\n")
_COMMAND = re.compile(r"^\$ (.*)\n((?:(?!\$ ).*\n)*)", flags=re.M)


@dataclass
class Block:
    """One thing to do: `kind` is python, command, file or sh.

    id : document and line; path : of a file to write or change
    expected, span : the output printed below it, and where the document has it; None without output
    """

    id: str
    kind: str
    source: str
    path: str = ""
    expected: str | None = None
    span: tuple[int, int] = (0, 0)


def read_blocks(name):
    """Return the blocks of a document in order."""
    text = (ROOT / name).read_text(encoding="utf-8")
    found = []
    for fenced in _FENCED.finditer(text):
        language, body = fenced.groups()
        place = f"{name}:{text.count(chr(10), 0, fenced.start()) + 1}"
        named = _FILE_LINE.match(body)
        if language == "text" and found[-1].kind == "python" and found[-1].expected is None:
            found[-1].expected = body
            found[-1].span = fenced.span(2)
        elif language == "console":
            found += [
                Block(
                    place,
                    "command",
                    command[1],
                    "",
                    command[2],
                    tuple(fenced.start(2) + k for k in command.span(2)),
                )
                for command in _COMMAND.finditer(body)
            ]
        elif language in ("python", "yaml") and named:
            found.append(Block(place, "file", body[named.end() :], named[1]))
        elif language in ("python", "sh"):
            found.append(Block(place, language, body))
        else:
            raise ValueError(f"{place}: a block of kind {language!r} is shown but never checked")
    return found


def perform(name):
    """Do every block of a document; a failure is recorded, and the blocks after it are still tried.

    Files are written first: what is imported once would not see a file that comes later.
    """
    namespace = {"__name__": "document"}
    blocks = read_blocks(name)
    answers = [{}] * len(blocks)
    for number, block in sorted(enumerate(blocks), key=lambda pair: pair[1].kind != "file"):
        out = io.StringIO()
        failure = ""
        path = Path(block.path)
        try:
            with redirect_stdout(out), redirect_stderr(out):
                if block.kind == "file":
                    path.parent.mkdir(parents=True, exist_ok=True)
                    path.write_text(block.source, encoding="utf-8")
                elif block.kind == "python":
                    exec(compile(block.source, block.id, "exec"), namespace)
                elif block.kind == "command":
                    _command(shlex.split(block.source))
        except BaseException:  # whatever a documented line does is the finding
            failure = traceback.format_exc()
        answers[number] = {"output": out.getvalue(), "failure": failure}
    return answers


def _command(words):
    """The commands that documents use, in this process: a start of Python for each would take most
    of the time."""
    words = [
        found for word in words for found in (sorted(glob.glob(word)) if "*" in word else [word])
    ]
    if words[0] == "iapb":
        from reports.cli import main

        told = io.StringIO()
        with redirect_stderr(told):
            failed = main(words[1:])
        if failed:  # what it complains about, without its progress
            lines = told.getvalue().splitlines(keepends=True)
            print("".join(line for line in lines if not line.endswith(" ...\n")), end="")
    elif words[0] == "cat":
        print(Path(words[1]).read_text(encoding="utf-8"), end="")
    elif words[0] == "pytest":
        import pytest

        installed = any(point.name == "iapb" for point in entry_points(group="pytest11"))
        # as in a checkout that was installed before it had one
        plugin = [] if installed else ["-p", "pytest_iapb"]
        pytest.main(
            [*plugin, "-p", "no:cacheprovider", "--rootdir", ".", "-c", "/dev/null", *words[1:]]
        )
    else:
        raise ValueError(f"documents may not use the command {words[0]!r}: nothing would check it")


if __name__ == "__main__":
    sys.path.insert(0, ".")
    Path(sys.argv[2]).write_text(json.dumps(perform(sys.argv[1])), encoding="utf-8")
