"""Search for counterexamples by hypothesis, among impacts of small integers and powers of ten: they
shrink well."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from hypothesis import HealthCheck, Phase, assume, find, settings
from hypothesis import strategies as st
from hypothesis.errors import Flaky, NoSuchExample
from hypothesis.extra.numpy import arrays

from verification.impacts import Floats, ImpactCase, cradle_rows
from verification.laws.counterexample import tangents_are_independent


def whole(least: int, largest: int) -> st.SearchStrategy[float]:
    """Integers as doubles."""
    return st.integers(least, largest).map(float)


@st.composite
def mass_matrices(draw: st.DrawFn, d: int, largest_exponent: int) -> Floats:
    """M = T D Tᵀ with T unit triangular of small integers and D powers of ten; κ is up to about
    10^largest_exponent."""
    powers = draw(arrays(float, d, elements=whole(-largest_exponent, 0)))
    entries = draw(arrays(float, (d, d), elements=whole(-1, 1)))
    T = np.tril(entries, -1) + np.eye(d)
    mass = T * 10.0**powers @ T.T
    return 0.5 * (mass + mass.T)


@st.composite
def contact_jacobians(draw: st.DrawFn, d: int) -> Floats:
    """Rows of integers; some are close to the previous row, at a distance of a power of ten, and
    some are zero."""
    c = draw(st.integers(0, 5))
    rows = draw(arrays(float, (c, d), elements=whole(-3, 3)))
    for i in range(1, c):
        if draw(st.booleans()):  # close to the row before, at a distance from 0.1 to rounding
            rows[i] = rows[i - 1] + 10.0 ** -draw(st.integers(1, 16)) * rows[i]
    return rows


@st.composite
def velocities(draw: st.DrawFn, mass: Floats) -> Floats:
    """Small integers as v or as Lᵀv, or M's lightest direction as v."""
    drawn = draw(arrays(float, len(mass), elements=whole(-3, 3)))
    kind = draw(st.sampled_from(["v", "u", "light"]))
    if kind == "u":
        return np.linalg.solve(np.linalg.cholesky(mass).T, drawn)
    return np.linalg.eigh(mass)[1][:, 0] if kind == "light" else drawn


@st.composite
def impact_cases(draw: st.DrawFn, largest_exponent: int = 8) -> ImpactCase:
    """An impact with κ(M) up to about 10^largest_exponent."""
    d = draw(st.integers(1, 4))
    e = st.sampled_from([1.0, 0.0, -1.0, 0.5]) | st.floats(-1.0, 1.0)
    if draw(st.booleans()):
        mass: Floats = np.diag(10.0 ** draw(arrays(float, d, elements=whole(-4, 0))))
        return ImpactCase(
            mass, cradle_rows(d), draw(velocities(mass)), draw(e), "cradle", np.ones((1, d))
        )
    mass = draw(mass_matrices(d, largest_exponent))
    rows = draw(contact_jacobians(d))
    return ImpactCase(mass, rows, draw(velocities(mass)), draw(e), "whole numbers")


def of_contacts(case: ImpactCase) -> st.SearchStrategy[Any]:
    """A share for each contact, simple numbers in [0, 1]."""
    return arrays(float, case.contacts, elements=st.sampled_from([1.0, 0.0, 0.5]))


@st.composite
def unequal_cases(draw: st.DrawFn) -> ImpactCase:
    """An impact with a separate restitution for each row."""
    case = draw(impact_cases())
    return replace(case, unequal=draw(of_contacts(case)))


@st.composite
def one_sided_cases(draw: st.DrawFn) -> ImpactCase:
    """An impact whose contacts only push, e in [0, 1]; in half of the draws every contact
    approaches."""
    case = draw(impact_cases(largest_exponent=2))
    rows = case.contact_jacobian
    if draw(st.booleans()):
        rows = np.where((rows @ case.velocity > 0.0)[:, None], -rows, rows)
    return replace(case, contact_jacobian=rows, restitution=draw(st.sampled_from([1.0, 0.0, 0.5])))


@st.composite
def frictional_cases(draw: st.DrawFn) -> ImpactCase:
    """An impact as in `one_sided_cases` with one or two integer tangents per contact, and μ."""
    case = draw(one_sided_cases())
    shape = case.contacts, draw(st.integers(1, 2)), case.coordinates
    case = replace(
        case,
        tangents=draw(arrays(float, shape, elements=whole(-2, 2))),
        friction=draw(of_contacts(case)),
        translations=None,
    )
    assume(tangents_are_independent(case))
    return case


# Strategies for the search of counterexamples: one per contract, and one with a restitution per
# row.
SEARCHED = {
    "equality": impact_cases,
    "unequal": unequal_cases,
    "unilateral": one_sided_cases,
    "frictional": frictional_cases,
}


def search_counterexample(
    fails: Callable[[ImpactCase], bool], examples: int, seed: int, kind: str
) -> ImpactCase | None:
    """Search impacts of a kind of SEARCHED and shrink the first failure; None if there is none, or
    if an impact fails only now and then."""
    profile = settings(
        max_examples=examples,
        database=None,
        deadline=None,
        phases=(Phase.generate, Phase.shrink),
        suppress_health_check=list(HealthCheck),
    )
    try:
        return find(SEARCHED[kind](), fails, settings=profile, random=random.Random(seed))
    except (NoSuchExample, Flaky):
        return None
