"""A sound resolver passes the kit at every size and seed: a hundred seeds in `make deep`, known
hard ones always."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from iapb import resolve_impact
from reference.complementarity import ImpactProblem, solve
from reference.exact import exact_impact
from tests.verification.laws.faults import moreau, newton, poisson
from verification import check_passivity
from verification.laws import sound_resolver
from verification.laws.bounds import ONE_SIDED

# hours, or seconds
SEEDS, IMPACTS = (100, 5000) if os.environ.get("IAPB_HYPOTHESIS_PROFILE") == "deep" else (1, 100)


def whole_numbers(M: Any, J: Any, v: Any, e: Any) -> Any:
    """A list of Python integers where the answer is whole, such as at e = −1: as good as an
    array."""
    v_plus = sound_resolver(M, J, v, e)
    return (
        [int(x) if x == int(x) else float(x) for x in v_plus]
        if np.all(v_plus == np.round(v_plus))
        else v_plus
    )


def exact(M: Any, J: Any, v: Any, e: Any) -> Any:
    """Rational numbers, rounded once: rows dependent to 1e-14 are independent here."""
    return np.array(exact_impact(0.5 * (M + M.T), J, v, e).velocity, float)


def by(solver: str, M: Any, J: Any, v: Any, e: Any) -> Any:
    return solve(ImpactProblem.from_impact(M, J, v, e), solver).velocity_plus if len(J) else v


SOUND: dict[str, tuple[str, Callable[..., Any]]] = {
    "iapb": ("equality", resolve_impact),
    "svd": ("equality", sound_resolver),
    "whole numbers": ("equality", whole_numbers),
    "newton": ("unilateral", newton),
    "poisson": ("unilateral", poisson),
    "moreau": ("frictional", moreau),
    "iapb poisson": ("unilateral", partial(resolve_impact, method="poisson")),
    "exact": ("equality", exact),
    "lemke": ("unilateral", partial(by, "lemke")),
    "cvxpy_clarabel": ("unilateral", partial(by, "cvxpy_clarabel")),
}
# The bounds that docs/resolvers.md names for solvers that iterate.
ITERATED = {"cvxpy_clarabel": replace(ONE_SIDED, least=1e-4, restitution=1e-4)}


@pytest.mark.parametrize("seed", range(SEEDS))
@pytest.mark.parametrize("name", SOUND)
def test_a_sound_resolver_passes_at_every_seed(name: str, seed: int) -> None:
    contract, resolver = SOUND[name]
    report = check_passivity(
        resolver,
        contract=contract,
        impacts=IMPACTS if name == "iapb" else max(IMPACTS // 3, 30),
        seed=seed,
        search=0,
        patience=np.inf,
        unequal_restitution=name == "iapb",
        bounds=ITERATED.get(name),
    )
    assert report.passed and all(verdict.checked > 0 for verdict in report.verdicts), report
    assert (
        report.counterexample is None
        and report.counterexample_test == ""
        and report.worst.worst.ratio <= 1.0
    )
