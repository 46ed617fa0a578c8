"""Contact as a spring and damper: which damping makes a given coefficient of restitution.

Per unit of effective mass, x'' = −k x − b x' while that pushes; contact ends when the force does (Schwager and
Pöschel, Granular Matter 9, 2007). Engines without a coefficient e are given theirs by this.
"""

from __future__ import annotations

from math import atan2, exp, log, pi, sqrt

from iapb.errors import ArgumentError

LOWEST = 0.14  # e of a spring that hardly swings; below, it creeps back and has no half period


def spring_restitution(damping_ratio: float) -> float:
    """e of a spring and damper that do not pull; damping_ratio = b/(2 √k) in [0, 1)."""
    z = damping_ratio
    turning = sqrt(1.0 - z * z)
    return exp(-z / turning * (pi - atan2(2.0 * z * turning, 1.0 - 2.0 * z * z)))


def damping_for(restitution: float, stiffness: float) -> float:
    """b [1/s] for e in [LOWEST, 1] and k [1/s2] per unit of mass, by bisection."""
    if restitution < LOWEST:
        raise ArgumentError("restitution", restitution, f"at least {LOWEST}: a spring that swings")
    if restitution >= 1.0:
        return 0.0
    low, high = 0.0, 0.999
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if spring_restitution(middle) > restitution else (low, middle)
    return 2.0 * low * sqrt(stiffness)


def viscous_dissipation_for(restitution: float, speed: float) -> float:
    """d [s/m] of Hunt and Crossley's force k x (1 + d x') for which a mass that arrives at `speed` leaves with e.

    From the orbit in (x, x'): d v (1 + e) = log((1 + d v) / (1 − e d v)).
    """
    if restitution >= 1.0:
        return 0.0
    low, high = 0.0, (1.0 - 1e-12) / restitution
    for _ in range(100):
        middle = 0.5 * (low + high)
        rest = middle * (1.0 + restitution) - log((1.0 + middle) / (1.0 - restitution * middle))
        low, high = (middle, high) if rest > 0.0 else (low, middle)
    return low / speed
