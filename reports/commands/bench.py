"""`iapb bench`: error and energy gain against time for the impact methods."""

from __future__ import annotations


def bench() -> None:
    """Time the impact methods and the cvxpy QP against their error, warm and interleaved."""
    from rich.console import Console
    from rich.table import Table

    from reports.commands.progress import stage_progress
    from reports.evidence.accuracy import compute
    from reports.figures.numbers import format_cell
    from verification.accuracy_time import kernel_times

    with stage_progress() as progress:
        numbers = compute(lambda done, total: progress("methods on problems", done, total))
    table = Table(title="What a microsecond buys", caption=numbers.note)
    for heading in numbers.columns:
        table.add_column(heading, overflow="fold")
    for row in numbers.rows:
        table.add_row(*(format_cell(value, 3) for value in row))
    console = Console(width=max(140, Console().width))
    console.print(table)
    print("Kernels alone, factored against the printed formula:")
    for found in kernel_times():
        print(f"  d = {found.coordinates}, c = {found.contacts}: {found.factored.median * 1e6:.2f} µs against "
              f"{found.printed.median * 1e6:.1f} µs, a factor of {found.ratio:.0f}")
