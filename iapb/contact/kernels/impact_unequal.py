"""An impact whose contacts differ in restitution: Poisson's law by two LCPs, then the energy clamp."""

from __future__ import annotations

from iapb.compiled import kernel
from iapb.contact.kernels.impact import apply_change, whiten_impact
from iapb.contact.kernels.unilateral import poisson_impulses


@kernel
def poisson_impact(mass_matrix, lower, v, restitution, count, clamped, work, push, impulses, v_plus, momentum):
    """Resolve `count` rows, given as columns of `work.columns`, each with its own e in [0, 1].

    Writes v⁺, the generalized impulse M(v⁺ − v⁻) and the impulses along the rows; returns (number of rows that
    push, clamp), and (−1, 1) where the active-set method did not converge: nothing is resolved then.
    """
    d = v.shape[0]
    whiten_impact(lower, v, count, work)
    if not poisson_impulses(work.rows, count, work.u[:d], restitution, impulses, work.change[:d], push):
        return -1, 1.0
    clamp = apply_change(mass_matrix, lower, v, clamped, work, v_plus, momentum)
    pushing = 0
    for i in range(count):
        pushing += impulses[i] > 0.0
        impulses[i] = clamp * impulses[i] / work.length[i] if work.length[i] > 0.0 else 0.0
    return pushing, clamp
