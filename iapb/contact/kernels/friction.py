"""Tangential impulses within Coulomb's discs: sweeps over the contacts, each stopped or held at its limit."""

from __future__ import annotations

import math

from iapb.compiled import kernel


@kernel
def friction_sweeps(coupling, slip, radius, inertia, p, velocity, sweeps, still):
    """Sweep p_i ← proj(p_i − w_i / ρ_i) on discs |p_i| ≤ radius_i, with w = slip + G p; write p in place.

    coupling : (k m, k m) G = B Bᵀ, tangential velocities that impulses make while the normal ones are kept
    slip : (k m,) tangential velocity without friction; radius : (k,) μ p_n; inertia : (k,) ρ ≥ ‖G_ii‖
    velocity : (m,) scratch. Returns the number of sweeps done, −1 where `sweeps` came first.
    """
    count, size = radius.shape[0], velocity.shape[0]
    for sweep in range(sweeps):
        moved = 0.0
        for i in range(count):
            if inertia[i] > 0.0:
                moved = max(moved, _slide(coupling, slip, radius[i], inertia[i], p, velocity, i * size))
        if moved <= still:
            return sweep + 1
    return -1


@kernel
def _slide(coupling, slip, radius, inertia, p, velocity, first):
    """Move one contact's impulse to where it stops the slip, or to its limit; return the velocity this made."""
    size = velocity.shape[0]
    square = 0.0
    for a in range(size):
        velocity[a] = slip[first + a]
        for j in range(p.shape[0]):
            velocity[a] += coupling[first + a, j] * p[j]
        velocity[a] = p[first + a] - velocity[a] / inertia
        square += velocity[a] * velocity[a]
    length = math.sqrt(square)
    share = radius / length if length > radius else 1.0
    moved = 0.0
    for a in range(size):
        new = share * velocity[a]
        moved = max(moved, inertia * abs(new - p[first + a]))
        p[first + a] = new
    return moved
