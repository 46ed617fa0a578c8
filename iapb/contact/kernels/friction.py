"""Tangential impulses within Coulomb's discs: sweeps over the contacts, each stopped or held at its limit."""

from __future__ import annotations

import math

from iapb.compiled import kernel

# sin² of the angle between two tangents' rows below which one is a multiple of the other, but for rounding.
SINGULAR = 1e-12


@kernel
def friction_sweeps(free, slip, radius, inertia, p, moved, velocity, sweeps, still):
    """Sweep p_i ← where w_i = 0, or proj(p_i − w_i / ρ_i), in discs |p_i| ≤ radius_i; w = slip + B Bᵀ p; p in place.

    free : (k m, d) rows B, by which tangential impulses move the group while the normal velocities are kept
    slip : (k m,) tangential velocity without friction; radius : (k,) μ p_n; inertia : (k,) ρ ≥ ‖B_i B_iᵀ‖
    moved : (d,) scratch for Bᵀ p, so that a sweep is linear in the contacts; velocity : (m,) scratch.
    Stops after the sweep that makes no velocity above `still`; returns the largest that the last one made [m/s].
    """
    count, size, fastest = radius.shape[0], velocity.shape[0], 0.0
    for _ in range(sweeps):
        combine(free, p, moved)  # anew in every sweep: rounding does not add up
        fastest = 0.0
        for i in range(count):
            if inertia[i] > 0.0:
                fastest = max(fastest, _slide(free, slip, radius[i], inertia[i], p, moved, velocity, i * size))
        if fastest <= still:
            break
    return fastest


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
    """Move one contact's impulse to where it stops the slip, or towards its limit; return the velocity this made."""
    size = velocity.shape[0]
    for a in range(size):
        velocity[a] = slip[first + a] + along(free[first + a], moved)
    fastest = math.sqrt(along(velocity, velocity))
    if not _stops(free, radius, p, velocity, first):
        square = 0.0
        for a in range(size):
            velocity[a] = p[first + a] - velocity[a] / inertia
            square += velocity[a] * velocity[a]
        length = math.sqrt(square)
        share = radius / length if length > radius else 1.0
        for a in range(size):
            velocity[a] *= share
        fastest = 0.0
        for a in range(size):
            fastest = max(fastest, inertia * abs(velocity[a] - p[first + a]))
    for a in range(size):
        change = velocity[a] - p[first + a]
        p[first + a] += change
        for k in range(moved.shape[0]):
            moved[k] += change * free[first + a, k]
    return fastest


@kernel
def _stops(free, radius, p, velocity, first):
    """Replace the slip of a contact with two tangents by the impulse that stops it, if that is within the limit.

    One step of length 1/ρ would take κ(B_i B_iᵀ) sweeps to get there: a lever makes it hundreds.
    """
    if velocity.shape[0] != 2:
        return False
    x, y = free[first], free[first + 1]
    xx, yy, xy = along(x, x), along(y, y), along(x, y)
    det = xx * yy - xy * xy
    if det <= SINGULAR * xx * yy:
        return False
    one = p[first] - (yy * velocity[0] - xy * velocity[1]) / det
    two = p[first + 1] - (xx * velocity[1] - xy * velocity[0]) / det
    if one * one + two * two > radius * radius:
        return False
    velocity[0], velocity[1] = one, two
    return True
