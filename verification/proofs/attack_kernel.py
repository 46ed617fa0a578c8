"""Calls the engine's impact kernel on a batch, so that a million impacts take seconds."""

from __future__ import annotations

import numpy as np

from iapb.compiled import kernel
from iapb.contact.kernels.impact import factored_impact, make_impact_work, rank_tolerance


def resolve_batch(mass_matrix, lower, columns, velocity, restitution, v_plus) -> None:  # type: ignore[no-untyped-def]
    """v⁺ (n, d) of n impacts: M, L (n, d, d), the rows of J as columns (n, d, c), v (n, d), e (n,)."""
    d, c = columns.shape[1:]
    _resolve(mass_matrix, lower, columns, velocity, restitution, make_impact_work(d, c), np.empty(d), v_plus)


@kernel
def _resolve(mass_matrix, lower, columns, velocity, restitution, work, momentum, v_plus):  # type: ignore[no-untyped-def]
    d, c = columns.shape[1], columns.shape[2]
    for n in range(velocity.shape[0]):
        for k in range(d):
            for i in range(c):
                work.columns[k, i] = columns[n, k, i]
        factored_impact(
            mass_matrix[n],
            lower[n],
            velocity[n],
            restitution[n],
            c,
            rank_tolerance(lower[n]),
            d,
            True,
            work,
            v_plus[n],
            momentum,
        )
