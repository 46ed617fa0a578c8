"""What a command shows: its answer as sentences and tables or as JSON, and the progress of its
work."""

from __future__ import annotations

import json
import sys
import textwrap
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Event, Thread
from typing import TYPE_CHECKING, Annotated, Any

import typer

from iapb.errors import IapbError, harmless, to_stderr
from reports.store.keys import plain

if TYPE_CHECKING:
    from verification.table import Table

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of sentences.")]
WIDTH = 80  # of the lines
SILENCE = 30.0  # [s] between two lines of a log
_WIDEST = 26  # of a column; longer texts go on in the next line
_GAP = 2  # characters between columns
_LONGEST_ERROR = 400  # characters


@dataclass(frozen=True)
class Answer:
    """What a command returns: `facts` are printed with --json, otherwise `lines` are; exit statuses
    do not differ."""

    facts: Any
    lines: Sequence[str | Table]
    status: int = 0

    def text(self, json_: bool) -> str:
        """Return what the command prints; in JSON NaN and infinity are null."""
        if json_:
            finite = json.loads(json.dumps(plain(self.facts)), parse_constant=lambda _: None)
            return json.dumps(finite, indent=1, ensure_ascii=False)
        return "\n".join(line if isinstance(line, str) else table_text(line) for line in self.lines)


def one_line(name: Any) -> str:
    """Return a name, which may hold line ends, on one line."""
    return "\\n".join(str(name).splitlines())


def said(error: Exception, path: Any) -> str:
    """Return on one line what an error says, without the path that begins it; foreign errors with
    their kind."""
    kind = "" if isinstance(error, IapbError) else f"{type(error).__name__}: "
    return kind + one_line(" ".join(str(error).removeprefix(f"{path}: ").split()))[:_LONGEST_ERROR]


def sentence(text: str, mark: str = "") -> str:
    """Return a wrapped sentence after its mark; the following lines are indented by the length of
    the mark."""
    return textwrap.fill(
        text,
        WIDTH,
        initial_indent=mark,
        subsequent_indent=" " * len(mark),
        break_on_hyphens=False,
        break_long_words=False,
    )


def table_text(table: Table) -> str:
    """Return a table as text. A table that is too wide continues below, with its first column
    repeated."""
    from rich.console import Console

    columns = [
        _Column(title, [_text(row[k], table.digits) for row in table.cells])
        for k, title in enumerate(table.titles)
    ]
    blocks = [columns[:1]]
    for column in columns[1:]:
        if {*column.cells} <= {"-"}:
            continue
        wide = sum(one.width + _GAP for one in [*blocks[-1], column])
        if len(blocks[-1]) > 1 and wide > WIDTH + _GAP:
            blocks.append(columns[:1])
        blocks[-1].append(column)
    console = Console(width=1000, color_system=None, markup=False, emoji=False, highlight=False)
    with console.capture() as printed:
        for block in blocks:
            console.print(_printed(block))
            console.print()
    lines = [line.rstrip() for line in printed.get().splitlines()]
    return "\n".join(lines).rstrip()


class _Column:
    """One column: its title, whose unit has a line of its own, its cells, and its width."""

    def __init__(self, title: str, cells: list[str]) -> None:
        name, bracket, unit = title.partition(" [")
        self.title = f"{name}\n[{unit}" if bracket else name
        self.cells = cells
        lines = (line for cell in cells for line in textwrap.wrap(cell, _WIDEST))
        self.width = max(map(len, [*lines, *name.split(" "), f"[{unit}"]))


def _printed(columns: list[_Column]) -> Any:
    from rich.box import Box
    from rich.table import Table

    rule = Box("    \n    \n -- \n    \n    \n    \n    \n    \n", ascii=True)
    printed = Table(box=rule, show_edge=False, pad_edge=False, padding=(0, _GAP - 1, 0, 0))
    for number, column in enumerate(columns):
        side: Any = "right" if number else "left"
        printed.add_column(column.title, width=column.width, justify=side, overflow="fold")
    for row in zip(*(column.cells for column in columns), strict=True):
        printed.add_row(*row)
    return printed


def _text(value: Any, digits: int) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def duration(seconds: float) -> str:
    """Return a time as text in a suitable unit."""
    for unit, factor in (("s", 1.0), ("ms", 1e3)):
        if seconds * factor >= 1.0:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds * 1e6:.3g} µs"


@contextmanager
def stage_progress(
    begun: str = "", transient: bool = False
) -> Iterator[Callable[[str, int, int], None]]:
    """Show which stage is running and how far it is: progress(stage, done, total); also that
    kernels are compiled.

    On a terminal these are bars: the stage `begun` is shown before its first report, `transient`
    bars vanish at the end. In a log these are lines, without one at the start of the stage `begun`.
    """
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    if not console.is_terminal or console.is_dumb_terminal:
        with _logged(begun) as log:
            yield log
        return
    name = TextColumn("{task.description}", markup=False)  # a scene's name may hold brackets
    # Only output to the same terminal is printed above the bars: a redirected stdout must not be
    # sent to stderr.
    bars = Progress(
        name,
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=console,
        transient=transient,
        redirect_stdout=sys.stdout.isatty(),
    )
    with bars:
        tasks = {harmless(begun): bars.add_task(harmless(begun), total=None)} if begun else {}

        def progress(stage: str, done: int, total: int) -> None:
            stage = harmless(stage)  # a scene's name
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=total)
            bars.update(tasks[stage], completed=done, total=total)

        yield progress


@contextmanager
def _logged(begun: str) -> Iterator[Callable[[str, int, int], None]]:
    """Write a line when a stage begins, and every SILENCE seconds, as a single step may take
    minutes, how far it is."""
    stages = {begun: (0, 0)}
    start = time.monotonic()
    over = Event()

    def progress(stage: str, done: int, total: int) -> None:
        if stage not in stages:
            to_stderr(f"{stage} ...")
        stages[stage] = done, total

    def remind() -> None:
        before = set[str]()
        while not over.wait(SILENCE):
            going = {stage: far for stage, far in stages.copy().items() if far[0] < far[1]}
            for stage in before.intersection(going):
                done, total = going[stage]
                to_stderr(
                    f"{stage}: {done:,} of {total:,} after {(time.monotonic() - start) / 60.0:.1f} min"
                )
            before = set(going)

    thread = Thread(target=remind, daemon=True)
    thread.start()
    try:
        yield progress
    finally:
        over.set()
        thread.join()
