"""Command lines as an input: words of valid ones lost, doubled, exchanged and damaged, then run in this process.

Only commands that end soon are run; a line that would start longer work (`verify`, `prove` …) has a wrong word in it.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
from pathlib import Path

from iapb.errors import IapbError
from reports.fuzz.mutate import TOKENS, Rng

_LINES = (
    "run peg_corner --set duration=0.05",
    "run two_discs --world PB --set duration=0.05 --set contact.restitution=0.5",
    "run peg_corner --rendering scale --set duration=0.05 --set bodies.peg.position=[0.03,-0.01,0]",
    "effects peg_corner --world ideal", "effects arm_obstacles", "inspect run.h5 --impacts 1", "schema",
    "store check results", "store gc results --dry-run", "sweep no_study --workers 1", "verify --recheck run.h5",
    "reproduce --figure fig99",
)  # fmt: skip
_LONG = ("verify", "prove", "reproduce", "compare", "bench")
_DEBUG = "--debug"  # shows a traceback, as it is asked to
_WORDS = (
    "--world", "--set", "--out", "--rendering", "--", "-", "--help", "run", "effects", "inspect", "schema", "store",
    "CBuc", "ideal", "peg_room", "wall_1d", ".", "/", "a=b", "=", "duration=0.01", "rate=1e999", "bodies.peg.mass=0",
    "walls=[]", "bodies=[]", "couplings=~", "hand=", "bodies.9.mass=1", "contact..x=1", "name=..", "-1", "--impacts",
    "run.h5", "table.h5", "results", "", "contact.friction=0.3", "check", "gc",
)  # fmt: skip
_ENDS = (0, 1, 2)


class LineError(Exception):
    """A command line ended in a way that none may: another status, no message, a traceback in the text."""


def lines() -> dict[str, bytes]:
    """The valid lines, as JSON lists of words."""
    return {f"{number:02d}.json": json.dumps(line.split()).encode() for number, line in enumerate(_LINES)}


def damaged_line(sample: bytes, other: bytes, rng: Rng) -> bytes:
    """Return a line with words changed, as JSON."""
    words = json.loads(sample)
    for _ in range(int(rng.choice([1, 1, 1, 2, 3]))):
        at = int(rng.integers(len(words) + 1))
        pool = _WORDS if rng.random() < 0.7 else TOKENS
        known, kind = pool[int(rng.integers(len(pool)))], int(rng.integers(5))
        if kind == 0:
            words.insert(at, known)
        elif kind == 1 and at < len(words):
            words[at] = known
        elif kind == 2:
            words = words[:at] + words[at + 1 :]
        elif kind == 3 and at < len(words):
            words[at] = words[at][: int(rng.integers(1 + len(words[at])))] + known
        else:
            words += json.loads(other)[1:]
    return json.dumps(words).encode()


def run_line(path: Path) -> None:
    """Run a line where the files it may name are; it must end with 0, 1 or 2, and say why where it is not 0.

    Raises
    ------
    IapbError
        With the message, where the line was refused as it should be.
    LineError
        Where it ended in another way.
    """
    words = _without_long_work(json.loads(path.read_bytes()))
    status, said, complained = _called(words, path.parent)
    if status not in _ENDS or "Traceback" in complained:
        raise LineError(f"{words}: ended with {status}: {complained}")
    if status and not (complained.strip() or said.strip()):
        raise LineError(f"{words}: ended with {status} and said nothing")
    if status:
        raise IapbError(complained.strip())


def _without_long_work(words: list[str]) -> list[str]:
    """A line that might start long work gets an option that no command has."""
    words = [word for word in words if word != _DEBUG]
    return [*words, "--no-such-option"] if set(words) & set(_LONG) else words


def _called(words: list[str], folder: Path) -> tuple[int, str, str]:
    from reports.cli import main
    from reports.fuzz.samples import result_files

    for place in (folder, folder / "results"):
        place.mkdir(exist_ok=True)
        for name, content in result_files().items():
            if not (place / name).exists():
                (place / name).write_bytes(content)
    out, error, before = io.StringIO(), io.StringIO(), Path.cwd()
    os.chdir(folder)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
            status = main(words)
    finally:
        os.chdir(before)
    return status, out.getvalue(), error.getvalue()
