"""Progress of long work: bars on a terminal, plain lines in a log, and a message when kernels are compiled."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Thread
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, TextColumn, TimeElapsedColumn
from rich.text import Text

from iapb.compiling import compiling_told, to_stderr

SILENCE = 30.0  # [s] between two lines of a log


@contextmanager
def step_progress(title: str) -> Iterator[Callable[[int, int], None]]:
    """Show the steps done of one simulation: progress(done, total)."""
    with _shown(f"{title}: steps", transient=True) as progress:
        yield lambda done, total: progress(f"{title}: steps", done, total)


@contextmanager
def stage_progress() -> Iterator[Callable[[str, int, int], None]]:
    """Show which stage is running and how far it is: progress(stage, done, total)."""
    with _shown() as progress:
        yield progress


@contextmanager
def _shown(begun: str = "", transient: bool = False) -> Iterator[Callable[[str, int, int], None]]:
    """Show the progress of stages; on a terminal, the stage `begun` is shown before its first report."""
    console = Console(stderr=True)
    if not console.is_terminal or console.is_dumb_terminal:
        with compiling_told(to_stderr), _reminded(StageLog(to_stderr, begun)) as log:
            yield log
        return
    with _bars(console, transient) as bars, compiling_told(bars.console.print):
        tasks: dict[str, Any] = {begun: bars.add_task(begun, total=None)} if begun else {}

        def progress(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=total)
            bars.update(tasks[stage], completed=done, total=total)

        yield progress


def _bars(console: Any, transient: bool) -> Progress:
    name = TextColumn("{task.description}", markup=False)  # a scene's name may hold brackets
    number = _Number()
    # Only output to the same terminal is printed above the bars: a redirected stdout must not be sent to stderr.
    return Progress(name, BarColumn(), number, TimeElapsedColumn(), console=console, transient=transient,
                    redirect_stdout=sys.stdout.isatty())


class _Number(ProgressColumn):
    """A progress column with the numbers "done" and "total", once the total is known."""

    def render(self, task: Any) -> Text:
        """Return the text beside the bar."""
        return Text("starting" if task.total is None else f"{task.completed:,.0f}/{task.total:,.0f}")


class StageLog:
    """Progress as lines: one when a stage begins, and one for each reminder while the stage is still running.

    Parameters
    ----------
    write : takes a line
    begun : a stage that has been announced already
    """
    def __init__(self, write: Callable[[str], None], begun: str = "") -> None:
        self._write, self._stages, self._start = write, {begun}, time.monotonic()
        self._now, self._reminded = ("", 0, 0), ""

    def __call__(self, stage: str, done: int, total: int) -> None:
        """Record how far a stage is."""
        self._now = (stage, done, total)
        if stage not in self._stages:
            self._stages.add(stage)
            self._write(f"{stage} ...")

    def remind(self) -> None:
        """Print how far the work is, unless its stage is done or was not the current one at the last reminder."""
        stage, done, total = self._now
        if stage == self._reminded and done < total:
            self._write(f"{stage}: {done:,} of {total:,} after {(time.monotonic() - self._start) / 60.0:.1f} min")
        self._reminded = stage


@contextmanager
def _reminded(log: StageLog) -> Iterator[StageLog]:
    """Call `remind` every SILENCE seconds from a separate thread, because a single step may take minutes."""
    over = Event()

    def remind() -> None:
        while not over.wait(SILENCE):
            log.remind()

    thread = Thread(target=remind, daemon=True)
    thread.start()
    try:
        yield log
    finally:
        over.set()
        thread.join()
