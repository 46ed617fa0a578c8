"""How far the kit reaches: resolvers that are sound but for a rare or remote condition, and after
how many impacts."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from typing import Any

import numpy as np
import pytest

from verification.impacts import Floats
from verification.laws import check_passivity, sound_resolver

Condition = Callable[[Floats, Floats, Floats, Any], bool]


def _where(condition: Condition) -> Callable[..., Floats]:
    """A resolver whose v⁺ is 1e-3 too fast under a condition: energy is made where e is near
    one."""
    return lambda *impact: sound_resolver(*impact) * (1.001 if condition(*impact) else 1.0)


def _every(calls: int) -> Condition:
    number = count(1)
    return lambda *_: next(number) % calls == 0


# condition of an error -> impacts within which the kit must find it
CONDITIONS: dict[str, tuple[Condition, int]] = {
    "d > 35": (lambda M, J, v, e: len(v) > 35, 200),
    "c > 120": (lambda M, J, v, e: len(J) > 120, 50),
    "c > 400": (lambda M, J, v, e: len(J) > 400, 400),
    "an entry of M above 1e4": (lambda M, J, v, e: M.max() > 1e4, 50),
    "M below 1e-6": (lambda M, J, v, e: M.max() < 1e-6, 50),
    "an entry of J above 1e5": (lambda M, J, v, e: np.abs(J).max(initial=0.0) > 1e5, 50),
    "speeds above 1e6": (lambda M, J, v, e: np.abs(v).max() > 1e6, 50),
    "speeds below 1e-6": (lambda M, J, v, e: 0.0 < np.abs(v).max() < 1e-6, 100),
    "a coordinate at rest": (lambda M, J, v, e: not v.all(), 50),
    "equal rows": (lambda M, J, v, e: len(np.unique(J, axis=0)) < len(J), 50),
    "e below -0.9": (lambda M, J, v, e: e < -0.9, 50),
    "one call in 1,000": (_every(1000), 200),
}
UNSOUND: dict[str, tuple[Callable[..., Floats], int]] = {
    **{name: (_where(condition), impacts) for name, (condition, impacts) in CONDITIONS.items()},
    "rows shorter than 1e-9 dropped": (
        lambda M, J, v, e: sound_resolver(M, J[np.linalg.norm(J, axis=1) > 1e-9], v, e),
        50,
    ),
    "twelve rows at most": (lambda M, J, v, e: sound_resolver(M, J[:12], v, e), 50),
    "1e-12 m/s from rest": (
        lambda M, J, v, e: sound_resolver(M, J, v, e) + (0.0 if v.any() else 1e-12),
        50,
    ),
    "1e-10 added to the diagonal of M": (
        lambda M, J, v, e: sound_resolver(M + 1e-10 * np.eye(len(v)), J, v, e),
        50,
    ),
}


@pytest.mark.parametrize("name", UNSOUND)
def test_every_unsound_resolver_is_found(name: str) -> None:
    resolver, impacts = UNSOUND[name]
    laws = (
        ["kinetic_energy", "restitution"]
        if name in CONDITIONS and name != "one call in 1,000"
        else None
    )
    report = check_passivity(resolver, impacts=impacts, search=0, laws=laws)
    assert not report.passed and report.broken_laws, report


def test_a_gain_on_large_impacts_is_shrunk_as_far_as_it_is_large() -> None:
    report = check_passivity(_where(CONDITIONS["c > 120"][0]), impacts=100, search=20)
    assert report.counterexample is not None and report.counterexample.contacts == 121
    assert (
        report.counterexample_law == "kinetic_energy" and "np.array" in report.counterexample_test
    )


def test_an_impact_meets_a_band_of_restitution_several_times() -> None:
    """A band of width 0.02 is 1 % of e: 74 impacts, six draws each, meet it about four times, and
    each is judged."""
    met: set[Any] = set()

    def resolver(M: Floats, J: Floats, v: Floats, e: Any) -> Floats:
        met.add(e)
        return sound_resolver(M, J, v, e)

    assert check_passivity(resolver, impacts=100, search=0).passed and len(met) > 600
    banded = _where(lambda M, J, v, e: 0.3 <= e <= 0.32)
    assert (
        sum(
            not check_passivity(banded, impacts=50, seed=seed, search=0).passed for seed in range(6)
        )
        >= 5
    )
