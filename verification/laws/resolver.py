"""Calls of any resolver with checks of its answer."""

from __future__ import annotations

import pickle
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np

from iapb.errors import IapbError
from verification.impacts import Floats, ImpactCase

Resolver = Callable[..., Any]  # called with `ImpactCase.given()`
# relative gain in plain doubles; for κ(M) well above 1e4 the kit's bounds allow more than this
SUSPICIOUS = 1e-9
REMEMBERED = 2000  # calls that a `Watched` resolver remembers


class ResolverFault(IapbError):
    """A resolver raised an exception, or returned no finite velocity of the right shape."""


class Watched:
    """A resolver whose every answer is checked for energy, whichever law made the call.

    suspects : (case, v⁺) of answers that seem to gain energy in plain doubles; the kit checks them
        in double-double.
    calls : the pickled arguments of the last calls.
    """

    def __init__(self, resolver: Resolver) -> None:
        self.resolver = resolver
        self.suspects: list[tuple[ImpactCase, Floats]] = []
        self.calls: deque[bytes] = deque(maxlen=REMEMBERED)

    def __call__(self, *given: Any) -> Any:
        self.calls.append(pickle.dumps(given))
        return self.resolver(*given)

    def forget(self) -> None:
        """Drop what belongs to the check: reports travel between processes."""
        self.resolver = print
        self.calls.clear()

    def look_at(self, case: ImpactCase, v_plus: Floats) -> None:
        """Add the answer to `suspects` if its kinetic energy exceeds that before the impact by more
        than SUSPICIOUS."""
        before = float(case.velocity @ (case.mass_matrix @ case.velocity))
        after = float(v_plus @ (case.mass_matrix @ v_plus))
        if not after <= before * (1.0 + SUSPICIOUS):
            self.suspects.append((case, v_plus))


def own_answer(resolver: Resolver, case: ImpactCase) -> tuple[Floats | ResolverFault, int]:
    """Return v⁺ (d,) or the fault for the unchanged case, and how many arguments the call changed.

    All laws of a case share one call.
    """
    known = case._answers.get(id(resolver))
    if known is None:
        own = case.given()
        given = case.given()
        velocity = _velocity(resolver, given, case)
        changed = sum(not np.array_equal(one, other) for one, other in zip(own, given, strict=True))
        known = case._answers[id(resolver)] = resolver, (velocity, changed)
    answer: tuple[Floats | ResolverFault, int] = known[1]
    return answer


def own_outcome(resolver: Resolver, case: ImpactCase) -> Floats:
    """Return v⁺ (d,) of the unchanged case, from the call that all its laws share."""
    return _usable(own_answer(resolver, case)[0])


def outcome(resolver: Resolver, case: ImpactCase) -> Floats:
    """Call the resolver on copies of the case's arrays and return v⁺ (d,), checked for shape and
    finiteness."""
    return _usable(_velocity(resolver, case.given(), case))


def answer_of(resolver: Resolver, given: tuple[Any, ...]) -> Floats | ResolverFault:
    """Return a copy of v⁺ (d,) for these arguments, or the fault of a resolver that raises or gives
    an unusable answer."""
    shape = given[0].shape[:1]
    try:
        answer = resolver(*given)
    except ResolverFault as fault:
        return fault
    except (
        Exception
    ) as error:  # a foreign resolver may raise anything: that is its fault, not an error of the kit
        return ResolverFault(f"raised {type(error).__name__}: {error}")
    try:
        velocity = np.asarray(getattr(answer, "velocity", answer))
    except Exception as error:  # as foreign as the resolver
        return ResolverFault(f"returned {type(answer).__name__}, which is no array: {error}")
    if velocity.dtype.kind not in "fiu" or velocity.shape != shape:
        return ResolverFault(
            f"returned {velocity.dtype} of shape {velocity.shape}, not float {shape}"
        )
    velocity = velocity.astype(np.float64)
    if not np.all(np.isfinite(velocity)):
        return ResolverFault("returned a number that is not finite")
    return velocity


def _usable(velocity: Floats | ResolverFault) -> Floats:
    if isinstance(velocity, ResolverFault):
        raise velocity
    return velocity


def _velocity(
    resolver: Resolver, given: tuple[Any, ...], case: ImpactCase
) -> Floats | ResolverFault:
    """Return v⁺ or the fault; a `Watched` resolver looks at the answer."""
    velocity = answer_of(resolver, given)
    if isinstance(resolver, Watched) and not isinstance(velocity, ResolverFault):
        resolver.look_at(case, velocity)
    return velocity
