"""The verdict of one impact method, or of one world, on one hard case."""

from __future__ import annotations

from dataclasses import dataclass

RESTITUTION_TOLERANCE = 1e-8  # as the kit asks of anybody's resolver
HANGS_ON_ROUNDING = "hangs on rounding"
_NONE = float("nan")


@dataclass(frozen=True)
class HardCaseVerdict:
    """One method or world on one case; NaN where a quantity does not apply or was not delivered.

    Attributes
    ----------
    verdict : "stable", "gains energy", "restitution unmet", "wrong motion", "refused", "timed out", "out of memory",
        "failed", or HANGS_ON_ROUNDING: a method that goes through LAPACK leaves a residual within a factor of ten of
        the tolerance, or moves wrong by more than half of |v⁻|: another BLAS would change what is wrong first.
    note : the error's words where there is no answer.
    energy_gain : impacts (KE⁺ − KE⁻)/KE⁻ exactly, trajectories the largest gain at any instant, as a share of what
        the motion started with or was fed.  energy_bound : what rounding (10 d ε √κ(M)) or the step excuses.
    restitution_residual : max |Jᵢv⁺ + e Jᵢv⁻| / (‖Aᵢ‖ |u|); Poisson's law: the fastest approach left,
        likewise; trajectories: see `verification.hard_cases.restitution`.
    forward_error : |v⁺ − truth| / |v⁻| in the kinetic metric, or the case's own distance from its law.
    forward_bound : what the conditioning, or the law's own step and stiffness, excuses.
    rank, exact_rank : as used, and of the meant Jacobian; trajectories: the largest rank of an impact, and None.
    clamp : factor of the energy clamp.
    seconds : median time of one call, or of one step [s].
    """

    case: str
    method: str
    verdict: str
    note: str = ""
    energy_gain: float = _NONE
    energy_bound: float = _NONE
    restitution_residual: float = _NONE
    forward_error: float = _NONE
    forward_bound: float = _NONE
    rank: int = 0
    exact_rank: int | None = 0
    clamp: float = _NONE
    seconds: float = _NONE

    @property
    def is_stable(self) -> bool:
        """Whether every number is within its bound."""
        return self.verdict == "stable"
