"""How far a long piece of work is: bars on a terminal, plain lines in a log; and a word when kernels are compiled."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from reports.compiling import compiling_told

if TYPE_CHECKING:
    from rich.progress import Progress

SILENCE = 30.0  # [s] after which a log gets another line


@contextmanager
def step_progress(title: str) -> Iterator[Callable[[int, int], None]]:
    """Show the steps done of one simulation: progress(done, total)."""
    with _shown(f"{title}: steps", transient=True) as progress:
        yield lambda done, total: progress(f"{title}: steps", done, total)


@contextmanager
def stage_progress() -> Iterator[Callable[[str, int, int], None]]:
    """Show which stage is at work and how far it is: progress(stage, done, total)."""
    with _shown() as progress:
        yield progress


@contextmanager
def _shown(begun: str = "", transient: bool = False) -> Iterator[Callable[[str, int, int], None]]:
    """Show stages; one that has `begun` before its first report is shown at once on a terminal."""
    from rich.console import Console

    console = Console(stderr=True)
    if not console.is_terminal or console.is_dumb_terminal:
        with compiling_told(to_log):
            yield log_of_stages(to_log, begun)
        return
    with _bars(console, transient) as bars, compiling_told(bars.console.print):
        tasks: dict[str, Any] = {begun: bars.add_task(begun, total=None)} if begun else {}

        def progress(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=total)
            bars.update(tasks[stage], completed=done, total=total)

        yield progress


def _bars(console: Any, transient: bool) -> Progress:
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    name = TextColumn("{task.description}", markup=False)  # a scene's name may hold brackets
    number = TextColumn("{task.completed}/{task.total}")
    # Only what goes to the same terminal is moved above the bars: a redirected stdout must not end up on stderr.
    return Progress(name, BarColumn(), number, TimeElapsedColumn(), console=console, transient=transient,
                    redirect_stdout=sys.stdout.isatty())


def log_of_stages(write: Callable[[str], None], begun: str = "") -> Callable[[str, int, int], None]:
    """Return progress(stage, done, total) that writes a line as a stage begins, and after every SILENCE of its work."""
    start, last, stages = time.monotonic(), [time.monotonic()], {begun}

    def log(stage: str, done: int, total: int) -> None:
        now = time.monotonic()
        if stage not in stages:
            stages.add(stage)
            write(f"{stage} ...")
        elif now - last[0] < SILENCE or done >= total:
            return
        else:
            write(f"{stage}: {done:,} of {total:,} after {(now - start) / 60.0:.1f} min")
        last[0] = now

    return log


def to_log(line: str) -> None:
    """Write a line to stderr now."""
    print(line, file=sys.stderr, flush=True)
