"""Studies of the mechanics, no files written. `STUDIES` has them by name, each `study(depth, failures)`.

Each returns a Table with the outcome of every row; its note says what must hold, and how closely.
Timing (`robot_timing.time_robots`) stands apart: its figures belong to a machine.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from importlib import import_module

from verification.finding import Failure, Table, attempt

__all__ = ["STUDIES", "check_mechanics"]

# name: (module, function)
STUDIES = {
    "random trees": ("robots", "compare_trees"),
    "joint kinds": ("own_robots", "compare_kinds"),
    "scenes": ("own_robots", "compare_scenes"),
    "URDF texts": ("own_robots", "compare_written"),
    "robots": ("robots", "compare_robots"),
    "power balance": ("power_balance", "power_balance"),
    "positive definite": ("power_balance", "positive_definite"),
    "tumbling": ("tumbling", "tumbling"),
    "coordinate invariance": ("coordinate_invariance", "coordinate_invariance"),
    "operating": ("operating", "operating"),
}


def check_mechanics(
    depth: str = "quick",
    progress: Callable[[int, int], None] | None = None,
    failures: list[Failure] | None = None,
) -> dict[str, Table]:
    """Run every study and return its table by name; `progress(done, total)` after each.

    `failures` receives the cases that raise, and studies that do as a whole; without it that passes through.
    """
    found: dict[str, Table] = {}
    for done, (name, (module, function)) in enumerate(STUDIES.items(), 1):
        cases: list[Failure] | None = None if failures is None else []
        table = attempt(name, partial(_table, module, function, depth, cases), failures)
        if failures is not None:
            failures += [replace(one, case=f"{name}, {one.case}") for one in cases or ()]
        if table is not None:
            found[name] = table
        if progress is not None:
            progress(done, len(STUDIES))
    return found


def _table(module: str, function: str, depth: str, failures: list[Failure] | None) -> Table:
    study: Callable[..., Table] = getattr(import_module(f"{__name__}.{module}"), function)
    return study(depth=depth, failures=failures)
