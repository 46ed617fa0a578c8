"""Search for counterexamples by hypothesis, among impacts of small integers and powers of ten: they
shrink well."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from hypothesis import HealthCheck, Phase, assume, find, settings
from hypothesis import strategies as st
from hypothesis.errors import Flaky, NoSuchExample
from hypothesis.extra.numpy import arrays

from verification.impacts import Floats, ImpactCase, cradle_rows
from verification.laws.counterexample import tangents_are_independent

SHARES = st.sampled_from([1.0, 0.0, 0.5])


def whole(least: int, largest: int) -> st.SearchStrategy[float]:
    """Integers as doubles."""
    return st.integers(least, largest).map(float)


def mass_matrix(draw: st.DrawFn, d: int, largest_exponent: int) -> Floats:
    """M = T D Tᵀ with T unit triangular of small integers and D powers of ten; κ is up to about
    10^largest_exponent."""
    powers = draw(arrays(float, d, elements=whole(-largest_exponent, 0)))
    T = np.tril(draw(arrays(float, (d, d), elements=whole(-1, 1))), -1) + np.eye(d)
    mass = T * 10.0**powers @ T.T
    return 0.5 * (mass + mass.T)


def contact_jacobian(draw: st.DrawFn, d: int) -> Floats:
    """Rows of integers; some are close to the previous row, at a distance of a power of ten, and
    some are zero."""
    c = draw(st.integers(0, 5))
    rows = draw(arrays(float, (c, d), elements=whole(-3, 3)))
    for i in range(1, c):
        if draw(st.booleans()):  # close to the row before, at a distance from 0.1 to rounding
            rows[i] = rows[i - 1] + 10.0 ** -draw(st.integers(1, 16)) * rows[i]
    return rows


def velocity(draw: st.DrawFn, mass: Floats) -> Floats:
    """Small integers as v or as Lᵀv, or M's lightest direction as v."""
    drawn = draw(arrays(float, len(mass), elements=whole(-3, 3)))
    kind = draw(st.sampled_from(["v", "u", "light"]))
    if kind == "u":
        return np.linalg.solve(np.linalg.cholesky(mass).T, drawn)
    return np.linalg.eigh(mass)[1][:, 0] if kind == "light" else drawn


@st.composite
def impacts(
    draw: st.DrawFn, kind: str = "equality", largest_exponent: int | None = None
) -> ImpactCase:
    """An impact for a contract, with κ(M) up to about 10^largest_exponent; "unequal" has a
    restitution for each row.

    Where contacts only push, every contact approaches in half of the draws, and e is in [0, 1];
    with friction each has one or two integer tangents.
    """
    pushing = kind in ("unilateral", "frictional")
    d = draw(st.integers(1, 4))
    if draw(st.booleans()):
        mass: Floats = np.diag(10.0 ** draw(arrays(float, d, elements=whole(-4, 0))))
        rows = cradle_rows(d)
        translations = np.ones((1, d))
    else:
        mass = mass_matrix(draw, d, largest_exponent or (2 if pushing else 8))
        rows = contact_jacobian(draw, d)
        translations = None
    v = velocity(draw, mass)
    if pushing and draw(st.booleans()):
        rows = np.where((rows @ v > 0.0)[:, None], -rows, rows)
    e = SHARES if pushing else SHARES | st.just(-1.0) | st.floats(-1.0, 1.0)
    case = ImpactCase(mass, rows, v, draw(e), "whole numbers", translations)
    shares = arrays(float, len(rows), elements=SHARES)
    if kind == "unequal":
        return replace(case, unequal=draw(shares))
    if kind == "frictional":
        shape = len(rows), draw(st.integers(1, 2)), d
        tangents = draw(arrays(float, shape, elements=whole(-2, 2)))
        case = replace(case, tangents=tangents, friction=draw(shares), translations=None)
        assume(tangents_are_independent(case))
    return case


def search_counterexample(
    fails: Callable[[ImpactCase], bool], examples: int, seed: int, kind: str
) -> ImpactCase | None:
    """Search impacts of a kind and shrink the first failure; None if there is none, or if an impact
    fails only now and then."""
    profile = settings(
        max_examples=examples,
        database=None,
        deadline=None,
        phases=(Phase.generate, Phase.shrink),
        suppress_health_check=list(HealthCheck),
    )
    try:
        return find(impacts(kind), fails, settings=profile, random=random.Random(seed))
    except (NoSuchExample, Flaky):
        return None
