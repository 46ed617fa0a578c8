"""What a resolver made of one impact, as plain numbers: a reader of a counterexample need not call the resolver."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from verification.properties.case import Floats, ImpactCase, Resolver, ResolverFault, outcome, own_outcome
from verification.properties.engine_laws import ENGINE_LAWS


@dataclass(frozen=True)
class Struck:
    """An impact and the velocity after it: once, or once for each budget of rows that the law tries.

    rows : (k,) rows that the resolver might use.
    velocity_after : (k, d), NaN where the resolver gave no finite velocity; `complaint` says why.
    """

    case: ImpactCase
    rows: tuple[int, ...]
    velocity_after: Floats
    complaint: str = ""


def strike(part: str, case: Any, resolver: Resolver) -> Struck | None:
    """Return what comes of a case of a part: by `resolver` or, in the engine's own parts, by the engine.

    None where the case is no impact: a wall in the hand, two rooms, a device that limits an impulse.
    """
    if not isinstance(case, ImpactCase):
        return None
    if part not in ENGINE_LAWS:
        return _struck(case, (case.contacts,), (partial(own_outcome, resolver),))
    ours = ENGINE_LAWS[part].ours
    if part != "truncation":
        return _struck(case, (case.contacts,), (partial(outcome, ours),))
    budgets = tuple(range(min(case.contacts, case.coordinates) + 1))
    return _struck(case, budgets, tuple(partial(outcome, partial(_in_budget, ours, rows)) for rows in budgets))


def _in_budget(subject: Callable[..., Any], rows: int, *impact: Any) -> Any:
    return subject(*impact, rows)


def _struck(case: ImpactCase, rows: tuple[int, ...], calls: tuple[Callable[[ImpactCase], Floats], ...]) -> Struck:
    after, complaints = np.full((len(rows), case.coordinates), np.nan), []
    for velocity, call in zip(after, calls, strict=True):
        try:
            velocity[:] = call(case)
        except ResolverFault as fault:
            complaints.append(str(fault))
    return Struck(case, rows, after, "; ".join(complaints))
