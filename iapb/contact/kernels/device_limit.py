"""How much of an impulse a device can render in one step (paper section VI)."""

from __future__ import annotations

import numpy as np

from iapb.compiled import kernel


@kernel
def largest_share(impulse, dofs, size, dt, force_limit):
    """Largest common factor in [0, 1] with |share · p_i / Δt| <= the limit of its dof, in floating point too.

    impulse (size,) [N s, N m s] of a group; dofs (size,) its coordinates; force_limit (d,) [N, N m], inf = none
    """
    share = 1.0
    for i in range(size):
        force, limit = abs(impulse[i]) / dt, force_limit[dofs[i]]
        if share * force > limit:
            share = limit / force
    for i in range(size):
        while share * abs(impulse[i]) / dt > force_limit[dofs[i]]:  # the division rounded up: one step back
            share = np.nextafter(share, 0.0)
    return share
