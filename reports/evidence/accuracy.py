"""Stage: what accuracy costs in time, for impact methods and complementarity solvers."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from verification.finding import Failure, Table, titled


def compute(progress: Callable[[int, int], None], failures: list[Failure] | None = None) -> Table:
    """The table behind the work-precision figure: a row per method and problem."""
    from verification.cost.measure import work_precision

    rows = tuple(_row(found) for found in work_precision(progress=progress, failures=failures))
    return titled(
        ("method", "problem", "time [µs]", "quartiles [µs]", "relative error", "relative energy gain",
         "restitution residual", "failed after [µs]", "outcome"), rows, 3,
        "Medians of warm, interleaved calls from Python; errors against exact rational arithmetic, in the kinetic "
        "metric. A negative gain is a loss and is drawn as none.",
        timed=("time [µs]", "quartiles [µs]", "failed after [µs]"))  # fmt: skip


def _row(found: Any) -> tuple[Any, ...]:
    seconds = found.seconds
    spread = f"{seconds.lower * 1e6:.3g} to {seconds.upper * 1e6:.3g}"
    return (found.method, found.label, _finite(seconds.median * 1e6), spread, _finite(found.forward_error),
            _gain(found.energy_gain), _finite(found.restitution_residual), _finite(found.failed_after * 1e6),
            f"{found.status}: {found.note}" if found.note else found.status)  # fmt: skip


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _gain(value: float) -> float | None:
    """A loss is no gain; the energy that e < 1 takes by right is no error."""
    return max(value, 0.0) if math.isfinite(value) else None
