"""One impact, resolved by each way that is timed: calls that give v⁺; kernels repeat themselves in compiled code."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from iapb import resolve_impact
from iapb.compiled import block
from iapb.contact.kernels.impact import make_impact_work
from iapb.errors import MissingDependencyError
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solvers import solve
from verification.cost.loops import repeat_impact
from verification.impacts import ImpactCase

Floats = NDArray[np.float64]
Call = Callable[[], Floats]


def engine_call(case: ImpactCase, method: str) -> Call:
    """`resolve_impact` by a method, checks and all."""
    return lambda: resolve_impact(
        case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution, method=method
    ).velocity


class KernelCall:
    """The kernel on arrays that are allocated once; M is factored and the rows are copied within the call."""

    def __init__(self, case: ImpactCase) -> None:
        self.mass, self.v = np.ascontiguousarray(case.mass_matrix), case.velocity.copy()
        self.columns, self.restitution = np.ascontiguousarray(case.contact_jacobian.T), case.restitution
        d, c = len(self.v), case.contacts
        self.lower, self.v_plus, self.momentum = np.zeros((d, d)), np.zeros(d), np.zeros(d)
        self.work = block(make_impact_work(d, c))

    def repeated(self, times: int) -> None:
        """Resolve the impact `times` times."""
        repeat_impact(self.mass, self.lower, self.v, self.restitution, self.columns, self.work, self.v_plus,
                      self.momentum, times)

    def __call__(self) -> Floats:
        """v⁺ (d,)."""
        self.repeated(1)
        return self.v_plus


class LemkeCall:
    """Lemke's kernel on the same arrays."""

    def __init__(self, case: ImpactCase) -> None:
        try:
            import quantecon  # noqa: F401
        except ImportError as error:
            raise MissingDependencyError("quantecon", "Lemke kernel", "pip install quantecon") from error
        self.case = case

    def repeated(self, times: int) -> Floats:
        """Resolve the impact `times` times; v⁺ of the last."""
        from verification.cost.lemke_kernel import repeat_lemke

        case = self.case
        found: Floats = repeat_lemke(case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution, times)
        return found

    def __call__(self) -> Floats:
        """v⁺ (d,)."""
        return self.repeated(1)


def solver_call(case: ImpactCase, name: str) -> Call:
    """A solver by name, with the problem made anew at each call."""
    def call() -> Floats:
        problem = ImpactProblem.from_impact(case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution)
        return solve(problem, name).velocity_plus

    return call
