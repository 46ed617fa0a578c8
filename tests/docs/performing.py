"""Performs the blocks of one document in a process of its own: `python performing.py DOCUMENT ANSWERS.json`.

The working directory is where files are written; for documents that add to the project it holds a copy of it.
"""

from __future__ import annotations

import glob
import io
import json
import shlex
import sys
import traceback
from contextlib import redirect_stderr, redirect_stdout
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from blocks import Block, read_blocks


def perform(name: str) -> list[dict[str, str]]:
    """Do every block of a document; a failure is recorded, and the blocks after it are still tried.

    Files and lines are written first: what is imported once would not see a line that comes later.
    """
    namespace: dict[str, Any] = {"__name__": "document"}
    blocks = read_blocks(name)
    answers: list[dict[str, str]] = [{}] * len(blocks)
    for number, block in sorted(enumerate(blocks), key=lambda pair: pair[1].kind not in ("file", "diff")):
        out, failure = io.StringIO(), ""
        try:
            with redirect_stdout(out), redirect_stderr(out):
                _perform(block, namespace)
        except BaseException:  # whatever a documented line does is the finding
            failure = traceback.format_exc()
        answers[number] = {"output": out.getvalue(), "failure": failure}
    return answers


def _perform(block: Block, namespace: dict[str, Any]) -> None:
    path = Path(block.path)
    if block.kind == "file":
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(block.source, encoding="utf-8")
    elif block.kind == "diff":
        apply_diff(path, block.source)
    elif block.kind == "python":
        exec(compile(block.source, block.id, "exec"), namespace)
    elif block.kind == "command":
        _command(shlex.split(block.source))


def _command(words: list[str]) -> None:
    """The commands that documents use, in this process: a start of Python for each would take most of the time."""
    words = [found for word in words for found in (sorted(glob.glob(word)) if "*" in word else [word])]
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
        plugin = [] if installed else ["-p", "pytest_iapb"]  # as in a checkout that was installed before it had one
        pytest.main([*plugin, "-p", "no:cacheprovider", "--rootdir", ".", "-c", "/dev/null", *words[1:]])
    else:
        raise ValueError(f"documents may not use the command {words[0]!r}: nothing would check it")


def apply_diff(path: Path, text: str) -> None:
    """Insert the lines with "+" beside those with " ", each of which must be in the file exactly once."""
    lines = path.read_text(encoding="utf-8").splitlines()
    waiting: list[str] = []
    place: int | None = None
    for line in text.splitlines():
        sign, content = line[:1], line[1:]
        if line.strip() in ("…", ""):
            place = None
        elif sign == "+" and place is None:
            waiting.append(content)
        elif sign == "+":
            lines.insert(place, content)
            place += 1
        else:
            if lines.count(content) != 1:
                raise ValueError(f"{path} has the line {content!r} {lines.count(content)} times, not once")
            place = lines.index(content)
            lines[place:place] = waiting
            place += len(waiting) + 1
            waiting = []
    if waiting:
        raise ValueError(f"{path}: no line says where {waiting[0]!r} goes")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.path.insert(0, ".")
    Path(sys.argv[2]).write_text(json.dumps(perform(sys.argv[1])), encoding="utf-8")
