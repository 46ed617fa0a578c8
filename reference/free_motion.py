"""Free motion of the rigid worlds: the motion of a whole mechanism without forces, integrated over
each step.

Forces and impulses change v at the start of a step. Then the mechanism moves on its own,

    dq/dt = T(q) v,    M(q) dv/dt + B(q, v) = 0,

up to the end of the step. T gives the rates of quaternions and (cos, sin), and the articulated body
algorithm gives dv/dt. The explicit Runge-Kutta method of order eight by Dormand and Prince
integrates (q, v); its error estimate chooses the substeps. The error of a step is near rounding, so
energy and both momenta are constant up to rounding without being enforced. Nothing of this is the
engine's: equations, coordinates and method differ.

If B is zero in every motion, v is constant and q moves along it; this is exact and needs no
integration. Source: Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I (1993),
section II.5; Featherstone, Rigid Body Dynamics Algorithms (2008), chapter 7.
"""

from __future__ import annotations

import numpy as np

from iapb.errors import SolverError
from reference import Floats
from reference.rigid_body import PinocchioMechanism

# Share of |q| or |v| that a substep may err by: twenty roundings.
_ACCURACY = 20.0 * float(np.finfo(np.float64).eps)
_LEAST = 2.0**-12  # of the step: shortest substep, for spins of about 1e6 rad/s at 1 kHz


def free_motion(
    mechanics: PinocchioMechanism, q: Floats, v: Floats, dt: float
) -> tuple[Floats, Floats]:
    """Return q (nq,) and v (d,) after dt [s] without gravity and contacts, from q and v.

    Raises
    ------
    SolverError
        The motion is so fast for the step that even the shortest substep is inaccurate.
    """
    if not mechanics.has_bias or not np.isfinite(v).all():
        return mechanics.integrate(q, v, dt), v
    # shares of the step; halves, so that sums are exact
    state = np.concatenate([q, v])
    left = 1.0
    share = 1.0
    while left > 0.0:
        moved, accurate = _substep(mechanics, state, share * dt)
        if accurate:
            state = moved
            left = left - share
        elif share > _LEAST:
            share *= 0.5
        else:
            raise SolverError(
                f"free motion at {np.abs(v).max():.3g} rad/s or m/s is too fast for a step of {dt:g} s"
            )
    return mechanics.normalize(state[: len(q)]), state[len(q) :]


def _substep(mechanics: PinocchioMechanism, state: Floats, h: float) -> tuple[Floats, bool]:
    """Return (q, v) after h [s], and whether the estimated error is small enough."""
    from scipy.integrate import DOP853

    nq = mechanics.nq
    stages = np.empty((DOP853.n_stages, len(state)))
    for k, row in enumerate(DOP853.A):
        at = state + h * (row[:k] @ stages[:k]) if k else state
        stages[k, :nq] = mechanics.rate(at[:nq], at[nq:])
        stages[k, nq:] = mechanics.free_acceleration(at[:nq], at[nq:])
    moved = state + h * (DOP853.B @ stages)
    # Orders five and three together, of order eight as in Hairer's program; their last coefficient
    # is zero.
    fifth, third = (np.abs(weights[:-1] @ stages) for weights in (DOP853.E5, DOP853.E3))
    error = h * fifth * fifth / np.maximum(np.hypot(fifth, 0.1 * third), np.finfo(np.float64).tiny)
    parts = slice(nq), slice(nq, None)
    return moved, all(error[part].max() <= _ACCURACY * np.abs(moved[part]).max() for part in parts)
