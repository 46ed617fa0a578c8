"""`check_passivity(resolver)`: does anybody's impact resolver ever create energy, and does it keep the other laws?"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from reference.one_thread import one_thread
from verification.properties.bounds import KIT, Bounds
from verification.properties.case import ImpactCase, Resolver
from verification.properties.families import ADVERSE, adverse_cases, draw_case, with_unequal_restitution
from verification.properties.laws import LAWS, UNEQUAL_LAWS
from verification.properties.passivity_report import LawVerdict, PassivityReport
from verification.properties.pasteable import name_of
from verification.properties.shrink import search_counterexample, shrink
from verification.properties.tally import Tally, residual_of

NOTABLE = 1e-6  # a counterexample with a residual above this is looked for first: nobody calls it rounding
LARGEST_CONDITION = 1e8  # κ(M) of the default families; beyond it plain Cholesky loses what the laws compare
IMPACTS = 5000  # by default: about a minute for a resolver of 50 µs a call
PATIENCE = 600.0  # [s] ten times that


def check_passivity(
    resolver: Resolver,
    *,
    impacts: int = IMPACTS,
    seed: int = 0,
    search: int = 200,
    bounds: Bounds = KIT,
    largest_condition: float = LARGEST_CONDITION,
    unequal_restitution: bool = False,
    patience: float = PATIENCE,
    progress: Callable[[int, int], None] | None = None,
) -> PassivityReport:
    """Run every law against `resolver` and return the report.

    Parameters
    ----------
    resolver : called as resolver(mass_matrix (d, d), contact_jacobian (c, d), velocity (d,), restitution) with
        float64 arrays (copies; c = 0 included) and one e in [−1, 1] for all rows, each an equality; returns v⁺
        as an array or as an object with `.velocity`.
    impacts : random impacts drawn by numpy. `families.ADVERSE` more come first: elastic ones on nearly equal rows.
    seed : of the draw; the same seed gives the same impacts.
    search : examples hypothesis may try to find and shrink a counterexample (0 = shrink the drawn one only).
    bounds : tolerances; `verification.properties.bounds`.
    largest_condition : largest κ(M) drawn.
    unequal_restitution : also call the resolver with an array (c,) of restitutions in [0, 1], one per row, and ask
        what holds for any law of them: no energy, M(v⁺ − v⁻) in range(Jᵀ), momentum, the same bits, own arguments.
    patience : seconds after which no further impact is tried; then the report is not passed, and says so.
    progress : called with (impacts done, impacts) after each.

    Returns
    -------
    PassivityReport
        `passed`, each law with its worst case, and the smallest counterexample found, as a test to paste.

    Examples
    --------
    >>> def test_my_resolver():
    ...     report = check_passivity(my_resolver)
    ...     assert report.passed, report
    """
    ends = time.monotonic() + patience
    tallies = {name: Tally(name, law) for name, law in LAWS.items()}
    if unequal_restitution:
        tallies |= {name: Tally(name, law) for name, law in UNEQUAL_LAWS.items()}
    with one_thread():
        done = _try_all(tallies, resolver, bounds, _Draw(impacts, seed, largest_condition), ends, progress)
        verdicts = tuple(tally.verdict() for tally in tallies.values())
        broken = next((verdict for verdict in verdicts if not verdict.passed), None)
        example = None if broken is None else _counterexample(broken, resolver, bounds, search, seed, ends)
    late = "" if done == impacts else f"too slow: {done} of {impacts} impacts in {patience:g} s"
    law = broken.law if broken else ""
    return PassivityReport(name_of(resolver), done, seed, verdicts, example, law, late, bounds, resolver)


@dataclass(frozen=True)
class _Draw:
    impacts: int
    seed: int
    largest_condition: float


def _try_all(tallies: dict[str, Tally], resolver: Resolver, bounds: Bounds, draw: _Draw, ends: float,
             progress: Callable[[int, int], None] | None) -> int:
    """Put every impact to every law; return for how many random ones there was time."""
    for done, (case, mixed) in enumerate(_drawn(draw, any(name in UNEQUAL_LAWS for name in tallies)), 1 - ADVERSE):
        for name, tally in tallies.items():
            if time.monotonic() > ends:
                return max(0, done - 1)
            tally.add(mixed if name in UNEQUAL_LAWS else case, resolver, bounds)
        if progress is not None and done > 0:
            progress(done, draw.impacts)
    return draw.impacts


def _drawn(draw: _Draw, unequal: bool) -> Iterator[tuple[ImpactCase, ImpactCase]]:
    """Yield the adverse impacts, then the random ones: each with one e, and with unequal ones if that is asked for."""
    rng, other, adverse = (np.random.default_rng(seed) for seed in (draw.seed, [draw.seed, 1], [draw.seed, 2]))
    for case in adverse_cases(adverse):
        yield case, with_unequal_restitution(adverse, case) if unequal else case
    for _ in range(draw.impacts):
        case = draw_case(rng, draw.largest_condition)
        yield case, with_unequal_restitution(other, case) if unequal else case


def _counterexample(
    broken: LawVerdict, resolver: Resolver, bounds: Bounds, search: int, seed: int, ends: float
) -> ImpactCase | None:
    """The smallest one found: by hypothesis, else the largest failure drawn, shrunk as far as there is time."""
    unequal = broken.law in UNEQUAL_LAWS
    for least in (NOTABLE, 0.0):
        fails = partial(_fails, broken.law, resolver, bounds, least, ends)
        found = search_counterexample(fails, search, seed, unequal) if search and time.monotonic() < ends else None
        if found is None and broken.largest_case is not None and fails(broken.largest_case):
            found = broken.largest_case
        if found is not None:
            return shrink(found, fails)
    return None


def _fails(name: str, resolver: Resolver, bounds: Bounds, least: float, ends: float, case: ImpactCase) -> bool:
    """Whether the law is broken, by at least `least`; never when the time is over."""
    if time.monotonic() > ends:
        return False
    residual, _ = residual_of((LAWS | UNEQUAL_LAWS)[name], case, resolver, bounds)
    return residual is not None and not residual.passed and not residual.value < least
