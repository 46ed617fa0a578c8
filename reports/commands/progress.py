"""Progress bars: one for steps of a simulation, one for the stages of a longer piece of work."""

from __future__ import annotations

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
def stage_progress() -> Iterator[Callable[[str, int, int], None]]:
    """Show which stage is at work and how far it is: progress(stage, done, total)."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    if not console.is_terminal:  # a log: a line per stage, as it begins
        begun: set[str] = set()

        def log(stage: str, done: int, total: int) -> None:
            if stage not in begun:
                console.print(f"{stage} ...", highlight=False)
                begun.add(stage)

        yield log
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
