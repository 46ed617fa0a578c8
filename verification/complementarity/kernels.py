"""A loop around the engine's impact kernel, compiled, to time the kernel without calls from Python."""

from __future__ import annotations

from iapb.compiled import kernel
from iapb.contact.kernels.cholesky import cholesky
from iapb.contact.kernels.impact import factored_impact, rank_tolerance


@kernel
def repeat_impact(mass_matrix, lower, v, restitution, columns, work, v_plus, momentum, times):
    """Factor M, copy the rows and resolve the impact, `times` times."""
    d, count = columns.shape
    for _ in range(times):
        cholesky(mass_matrix, lower)
        for k in range(d):
            for i in range(count):
                work.columns[k, i] = columns[k, i]
        factored_impact(mass_matrix, lower, v, restitution, count, rank_tolerance(lower), d, True, work, v_plus,
                        momentum)
