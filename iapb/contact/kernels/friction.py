"""Tangential impulses within Coulomb's discs: sweeps over the contacts, each stopped or held at its limit."""

from __future__ import annotations

import math

from iapb.compiled import kernel


@kernel
def friction_sweeps(free, slip, radius, inertia, p, moved, velocity, sweeps, still):
    """Sweep p_i ← proj(p_i − w_i / ρ_i) on discs |p_i| ≤ radius_i, with w = slip + B Bᵀ p; write p in place.

    free : (k m, d) rows B, by which tangential impulses move the group while the normal velocities are kept
    slip : (k m,) tangential velocity without friction; radius : (k,) μ p_n; inertia : (k,) ρ ≥ ‖B_i B_iᵀ‖
    moved : (d,) scratch for Bᵀ p, so that a sweep is linear in the contacts; velocity : (m,) scratch.
    Returns the number of sweeps done, −1 where `sweeps` came first.
    """
    count, size = radius.shape[0], velocity.shape[0]
    for sweep in range(sweeps):
        combine(free, p, moved)  # anew in every sweep: rounding does not add up
        fastest = 0.0
        for i in range(count):
            if inertia[i] > 0.0:
                fastest = max(fastest, _slide(free, slip, radius[i], inertia[i], p, moved, velocity, i * size))
        if fastest <= still:
            return sweep + 1
    return -1


@kernel
def combine(rows, weight, out):
    """out (d,) = rowsᵀ weight."""
    for k in range(out.shape[0]):
        out[k] = 0.0
    for j in range(weight.shape[0]):
        for k in range(out.shape[0]):
            out[k] += weight[j] * rows[j, k]


@kernel
def along(row, vector):
    """row · vector."""
    total = 0.0
    for k in range(vector.shape[0]):
        total += row[k] * vector[k]
    return total


@kernel
def _slide(free, slip, radius, inertia, p, moved, velocity, first):
    """Move one contact's impulse to where it stops the slip, or to its limit; return the velocity this made."""
    size = velocity.shape[0]
    square = 0.0
    for a in range(size):
        velocity[a] = p[first + a] - (slip[first + a] + along(free[first + a], moved)) / inertia
        square += velocity[a] * velocity[a]
    length = math.sqrt(square)
    share = radius / length if length > radius else 1.0
    fastest = 0.0
    for a in range(size):
        change = share * velocity[a] - p[first + a]
        fastest = max(fastest, inertia * abs(change))
        p[first + a] += change
        for k in range(moved.shape[0]):
            moved[k] += change * free[first + a, k]
    return fastest
