"""How far the kit reaches: resolvers that are sound but for a rare or remote condition, and after how many impacts."""

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
    """A resolver whose v⁺ is 1e-3 too fast under a condition: energy is made where e is near one."""
    return lambda *impact: sound_resolver(*impact) * (1.001 if condition(*impact) else 1.0)


def _rarely(probability: float) -> Condition:
    rng = np.random.default_rng(11)
    return lambda *_: bool(rng.random() < probability)


def _every(calls: int) -> Condition:
    number = count(1)
    return lambda *_: next(number) % calls == 0


# condition of an error -> impacts within which the kit must find it; behind: those that it took with seed 0.
CONDITIONS: dict[str, tuple[Condition, int]] = {
    "d > 20": (lambda M, J, v, e: len(v) > 20, 100),  # 36
    "d > 35": (lambda M, J, v, e: len(v) > 35, 200),  # 86
    "c > 120": (lambda M, J, v, e: len(J) > 120, 50),  # 6
    "c > 400": (lambda M, J, v, e: len(J) > 400, 400),  # 306
    "an entry of M above 1e4": (lambda M, J, v, e: M.max() > 1e4, 50),  # 4
    "M below 1e-6": (lambda M, J, v, e: M.max() < 1e-6, 50),  # 5
    "an entry of J above 1e5": (lambda M, J, v, e: np.abs(J).max(initial=0.0) > 1e5, 50),  # 1
    "speeds above 1e6": (lambda M, J, v, e: np.abs(v).max() > 1e6, 50),  # 5
    "speeds below 1e-6": (lambda M, J, v, e: 0.0 < np.abs(v).max() < 1e-6, 100),  # 18
    "a coordinate at rest": (lambda M, J, v, e: not v.all(), 50),  # 8
    "equal rows": (lambda M, J, v, e: len(np.unique(J, axis=0)) < len(J), 50),  # 1
    "e below -0.9": (lambda M, J, v, e: e < -0.9, 50),  # 1
    "more rows than 4 d": (lambda M, J, v, e: len(J) > 4 * len(v), 50),  # 6
    "one call in 1,000": (_every(1000), 200),  # 77
    "one call in 1,000, at random": (_rarely(1e-3), 200),  # 84
}
UNSOUND: dict[str, tuple[Callable[..., Floats], int]] = {
    **{name: (_where(condition), impacts) for name, (condition, impacts) in CONDITIONS.items()},
    "rows shorter than 1e-9 dropped":
        (lambda M, J, v, e: sound_resolver(M, J[np.linalg.norm(J, axis=1) > 1e-9], v, e), 50),  # 8
    "speeds below 1e-6 taken for rest":
        (lambda M, J, v, e: v if np.abs(v).max() < 1e-6 else sound_resolver(M, J, v, e), 100),  # 24
    "twelve rows at most": (lambda M, J, v, e: sound_resolver(M, J[:12], v, e), 50),  # 3
    "1e-12 m/s from rest": (lambda M, J, v, e: sound_resolver(M, J, v, e) + (0.0 if v.any() else 1e-12), 50),  # 10
    "1e-10 added to the diagonal of M":
        (lambda M, J, v, e: sound_resolver(M + 1e-10 * np.eye(len(v)), J, v, e), 50),  # 8
}
# Beyond reach: found or not by luck, or never (see the notes of `check_passivity`).
BEYOND: dict[str, Condition] = {
    "3 calls in a million, at random": _rarely(3e-6),
    "d > 80": lambda M, J, v, e: len(v) > 80,
    "c > 1,000": lambda M, J, v, e: len(J) > 1000,
    "speeds above 1e20": lambda M, J, v, e: np.abs(v).max() > 1e20,
}


@pytest.mark.parametrize("name", UNSOUND)
def test_every_unsound_resolver_is_found(name: str) -> None:
    resolver, impacts = UNSOUND[name]
    report = check_passivity(resolver, impacts=impacts, search=0)
    assert not report.passed and report.broken_laws, report


@pytest.mark.parametrize("name", BEYOND)
def test_what_the_kit_cannot_find_is_known(name: str) -> None:
    """A change that brings one of these within reach moves it to the table above."""
    assert check_passivity(_where(BEYOND[name]), impacts=100, search=0).passed


def test_a_gain_on_large_impacts_is_shrunk_as_far_as_it_is_large() -> None:
    report = check_passivity(_where(CONDITIONS["c > 120"][0]), impacts=100, search=20)
    assert report.counterexample is not None and report.counterexample.contacts == 121
    assert report.counterexample_law == "kinetic_energy" and "np.array" in report.counterexample_test


def test_a_resolver_may_answer_with_python_integers() -> None:
    """At e = −1 on whole numbers the answer is whole; a list of them is an answer as good as an array."""

    def whole(M: Floats, J: Floats, v: Floats, e: Any) -> Any:
        v_plus = sound_resolver(M, J, v, e)
        return [int(x) if x == int(x) else float(x) for x in v_plus] if np.all(v_plus == np.round(v_plus)) else v_plus

    report = check_passivity(whole, impacts=200, search=0)
    assert report.passed, report
