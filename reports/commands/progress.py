"""Progress bars: one for steps of a simulation, one for the stages of a longer piece of work."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def step_progress(title: str) -> Iterator[Callable[[int, int], None]]:
    """Show steps done; before the first chunk it says that kernels may be compiling."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed}/{task.total} steps"),
               TimeRemainingColumn())  # fmt: skip
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(f"{title} (the first time, a minute or two of compiling)", total=None)

        def progress(done: int, total: int) -> None:
            bar.update(task, description=title, completed=done, total=total)

        yield progress


@contextmanager
def stage_progress(parts: int = 1) -> Iterator[Callable[[str, int, int], None]]:
    """Show which stage is at work and how far it is: progress(stage, done, total).

    In a log: a line per stage as it begins, and one more after each of `parts` equal parts of it but the last.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    if not console.is_terminal:
        yield _log_of_stages(lambda line: console.print(line, highlight=False), parts)
        return
    columns = (TextColumn("{task.description:<48}"), BarColumn(), TextColumn("{task.completed}/{task.total}"),
               TimeElapsedColumn())  # fmt: skip
    with Progress(*columns, console=console) as bar:
        tasks: dict[str, object] = {}

        def progress(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(stage, total=total)
            bar.update(tasks[stage], completed=done, total=total)  # type: ignore[arg-type]

        yield progress


def _log_of_stages(write: Callable[[str], None], parts: int) -> Callable[[str, int, int], None]:
    """Return progress(stage, done, total) that writes a line when a stage begins or enters another part."""
    began, part_of = time.monotonic(), dict[str, int]()

    def log(stage: str, done: int, total: int) -> None:
        part = min(parts * done // total if total else 0, parts - 1)
        if stage not in part_of:
            write(f"{stage} ...")
        elif part > part_of[stage]:
            write(f"{stage}: {done:,} of {total:,} after {(time.monotonic() - began) / 60.0:.1f} min")
        part_of[stage] = part

    return log
