"""Impulses at a device of limited force: equation (26) and the three strategies of paper sections V-C and VI.

An impulse is rendered as the force F_env = J_cᵀ p / Δt over one step (26). Where that is more than the device
can give:

- *saturate*: the tool gets the whole impulse, the device each component clipped. Tool and device then lose
  different energies, and the device may even *gain*: clipping changes the direction of the impulse;
- *scale*: tool and device get the same impulse, scaled by one factor for the whole contact group;
- *spread*: scale, and stay in the colliding state until a step's impulse is within reach.

Scaling by one factor s turns the restitution e into s (1 + e) − 1, which lies in [−1, e]: still passive.
Spreading delivers the prescribed loss for e = 0 only: each step restarts Newton's law from the velocity that is
left, so the last impulse is computed from what is left (2 kg at 0.1 m/s, e = 0.5, 15 N, 512 Hz: it leaves with
0.0025 m/s where 0.05 m/s is prescribed).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.contact.kernels.device_limit import largest_share
from iapb.contact.laws import RENDERINGS
from iapb.errors import ArgumentError
from iapb.names import one_of

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class RenderedImpulse:
    """What tool and device get of an impulse in one step (d coordinates)."""

    tool_impulse: Floats  # (d,) [N s, N m s]
    device_force: Floats  # (d,) [N, N m] over the step
    share: float  # factor on the impulse, 1 = all of it
    unfinished: bool  # the group stays in the colliding state (spread)


def render_impulse(
    impulse: ArrayLike, dt: float, force_limit: ArrayLike | None = None, rendering: str = "full"
) -> RenderedImpulse:
    """Return what tool and device get of a generalized impulse J_cᵀ p in a step of length dt.

    Parameters
    ----------
    impulse : (d,) [N s, N m s]
        Impulse of a whole contact group.
    dt : float [s]
        Step length > 0.
    force_limit : (d,) [N, N m], optional
        Largest force of the device per coordinate, > 0, infinity where it has none (coordinates of bodies that
        are not held); default: no limit at all.
    rendering : {"full", "saturate", "scale", "spread"}
        "full" ignores the limit.

    Raises
    ------
    ArgumentError
        Shapes that differ, dt or a limit that is not positive, an impulse that is not finite, an unknown rendering.
    """
    p = np.ascontiguousarray(impulse, np.float64)
    limit = np.full(p.shape, np.inf) if force_limit is None else np.ascontiguousarray(force_limit, np.float64)
    _check(p, dt, limit, rendering)
    if rendering == "full":
        return RenderedImpulse(p.copy(), p / dt, 1.0, False)
    if rendering == "saturate":
        return RenderedImpulse(p.copy(), np.clip(p / dt, -limit, limit), 1.0, False)
    share = float(largest_share(p, np.arange(len(p)), len(p), float(dt), limit))
    return RenderedImpulse(share * p, share * p / dt, share, rendering == "spread" and share < 1.0)


def effective_restitution(restitution: float, share: float) -> float:
    """Return the restitution s (1 + e) − 1 that an impulse scaled by s in [0, 1] amounts to; −1 = no impulse."""
    if not -1.0 <= restitution <= 1.0:
        raise ArgumentError("restitution", restitution, "a number in [-1, 1]")
    if not 0.0 <= share <= 1.0:
        raise ArgumentError("share", share, "a number in [0, 1]")
    return share * (1.0 + restitution) - 1.0


def _check(impulse: Floats, dt: float, limit: Floats, rendering: str) -> None:
    if impulse.ndim != 1 or not np.all(np.isfinite(impulse)):
        raise ArgumentError("impulse", impulse, "a vector of finite numbers")
    if not (math.isfinite(dt) and dt > 0.0):
        raise ArgumentError("dt", dt, "a step length > 0")
    if limit.shape != impulse.shape or not np.all(limit > 0.0):
        raise ArgumentError("force_limit", limit, "one number > 0 per coordinate (infinity: no limit)")
    if rendering not in RENDERINGS:
        raise ArgumentError("rendering", rendering, one_of(rendering, RENDERINGS))
