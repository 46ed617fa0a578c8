"""Make a failing impact smaller while it still fails: fewer rows, fewer coordinates, rounder numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from verification.properties.case import ImpactCase

_DIGITS = (0, 1, 2, 4, 8)


def search_counterexample(
    fails: Callable[[ImpactCase], bool], examples: int, seed: int, unequal: bool = False
) -> ImpactCase | None:
    """Let hypothesis search impacts of whole numbers and shrink what it finds; None if it finds nothing."""
    import random

    from hypothesis import HealthCheck, Phase, find, settings
    from hypothesis.errors import NoSuchExample

    from verification.properties.strategies import impact_cases, unequal_cases

    profile = settings(
        max_examples=examples,
        database=None,
        deadline=None,
        phases=(Phase.generate, Phase.shrink),
        suppress_health_check=list(HealthCheck),
    )
    try:
        return find(unequal_cases() if unequal else impact_cases(), fails, settings=profile, random=random.Random(seed))
    except NoSuchExample:
        return None


def shrink(case: ImpactCase, fails: Callable[[ImpactCase], bool]) -> ImpactCase:
    """Return a smaller case that still fails, greedily; the case itself if nothing smaller does.

    It ends: each step takes away translations, a row, a coordinate, a restitution other than 1, or written digits. What
    it returns follows from the answers of `fails` alone.
    """
    improved = True
    while improved:
        improved = False
        for smaller in _smaller(case):
            if _is_valid(smaller) and fails(smaller):
                case, improved = smaller, True
                break
    return case


def _smaller(case: ImpactCase) -> Iterator[ImpactCase]:
    if case.translations is not None:
        yield replace(case, translations=None)
    for i in range(case.contacts):
        unequal = None if case.unequal is None else np.delete(case.unequal, i)
        yield replace(case, contact_jacobian=np.delete(case.contact_jacobian, i, axis=0), unequal=unequal)
    if case.coordinates > 1 and case.translations is None:
        for k in range(case.coordinates):
            yield _without_coordinate(case, k)
    for e in (1.0, 0.0):
        if case.unequal is None and case.restitution not in (1.0, e):
            yield replace(case, restitution=e)
    for digits in _DIGITS:
        for name in ("velocity", "contact_jacobian", "mass_matrix", "unequal"):
            yield from _rounded(case, name, digits)


def _without_coordinate(case: ImpactCase, k: int) -> ImpactCase:
    return replace(
        case,
        mass_matrix=np.delete(np.delete(case.mass_matrix, k, axis=0), k, axis=1),
        contact_jacobian=np.delete(case.contact_jacobian, k, axis=1),
        velocity=np.delete(case.velocity, k),
    )


def _rounded(case: ImpactCase, name: str, digits: int) -> Iterator[ImpactCase]:
    """The array in `digits` decimals, if that changes it and it was not rounder already."""
    array = getattr(case, name)
    if array is None:
        return
    rounder = np.round(array, digits) + 0.0  # no −0.0
    if _written(rounder) < _written(array):
        yield replace(case, **{name: rounder})


def _written(array: np.ndarray) -> int:
    """Length of the array as text: the measure of roundness, so that shrinking ends."""
    return sum(len(repr(float(x))) for x in array.ravel())


def _is_valid(case: ImpactCase) -> bool:
    """Whether elimination, in floats and in a fixed order, meets no pivot near zero: no BLAS takes part."""
    rows = case.mass_matrix.tolist()
    least = 1e-14 * max(rows[k][k] for k in range(len(rows)))
    for k, pivot_row in enumerate(rows):
        if not pivot_row[k] > least:
            return False
        for row in rows[k + 1 :]:
            factor = row[k] / pivot_row[k]
            row[k:] = [x - factor * y for x, y in zip(row[k:], pivot_row[k:], strict=True)]
    return True
