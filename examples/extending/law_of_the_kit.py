"""A law of the kit: an elastic impact, resolved twice, gives the initial velocity.

The decorator adds it to the laws of equality. It returns a residual and its tolerance, or None where
the law does not apply.

Prints:
    resolve_impact ()
    half_elastic ('reflected_back',)
"""

from dataclasses import replace
from typing import Any

import numpy as np

from iapb import resolve_impact
from verification import check_passivity
from verification.laws.bounds import law
from verification.laws.contracts import CONTRACTS
from verification.laws.resolver import outcome


@law(CONTRACTS["equality"].laws, "reflected_back", "e = 1, resolved twice, gives v⁻ back")
def reflected_back(case: Any, resolver: Any, bounds: Any) -> tuple[float, float] | None:
    """Resolve the elastic impact again, from its result."""
    if not case.is_separated:  # the rank of the rows is a matter of rounding
        return None
    elastic = replace(case, restitution=1.0)
    back = outcome(resolver, replace(elastic, velocity=outcome(resolver, elastic)))
    return case.distance(back, case.velocity), bounds.comparison(case)


def half_elastic(M: np.ndarray, J: np.ndarray, v: np.ndarray, e: float) -> np.ndarray:
    """Return the result for e/2: a planted fault."""
    return resolve_impact(M, J, v, 0.5 * e).velocity


for resolver in (resolve_impact, half_elastic):
    report = check_passivity(resolver, laws=["reflected_back"], impacts=50)
    print(resolver.__name__, report.broken_laws)
