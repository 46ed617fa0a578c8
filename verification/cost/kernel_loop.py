"""The compiled loop around the factored impact; apart, so that numba is imported only where it runs."""

from __future__ import annotations

from typing import Any

from iapb.compiled import kernel
from iapb.contact.kernels.impact import factored_impact


@kernel
def repeat_factored(
    mass: Any,
    lower: Any,
    v: Any,
    restitution: Any,
    columns: Any,
    tolerance: Any,
    work: Any,
    v_plus: Any,
    momentum: Any,
    calls: Any,
) -> None:
    """Resolve the same impact `calls` times, the copy of its rows into the scratch included."""
    d, c = columns.shape
    for _ in range(calls):
        for k in range(d):
            for i in range(c):
                work.columns[k, i] = columns[k, i]
        factored_impact(mass, lower, v, restitution, c, tolerance, d, True, work, v_plus, momentum)
