"""What the kit prints fails as printed: with a fresh resolver, by the law and the kind of fault that it
names."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable
from itertools import count
from typing import Any

import numpy as np
import pytest

from iapb.errors import ArgumentError
from tests.verification.laws.faults import makes_stale_jacobian
from verification import check_passivity
from verification.impacts import Floats
from verification.laws import LAWS, ImpactCase, sound_resolver
from verification.laws.bounds import KIT
from verification.laws.child import Child
from verification.laws.planted import makes_stale_answers, makes_warm_start
from verification.laws.resolver import ResolverFault


def makes_counter() -> Callable[..., Floats]:
    """Returns a resolver whose every fiftieth answer is a tenth too fast."""
    number = count(1)
    return lambda *given: sound_resolver(*given) * (1.1 if next(number) % 50 == 0 else 1.0)


def hangs(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Cycles for ever with three contacts or more."""
    while len(J) > 2:
        pass
    return sound_resolver(M, J, v, e)


def run(text: str, law: str, resolver: Callable[..., Any]) -> None:
    exec(f"{text}\n\ntest_{law}()", {"resolver": resolver})


MAKERS = [makes_counter, makes_stale_jacobian, makes_stale_answers, makes_warm_start]


@pytest.mark.thorough
@pytest.mark.parametrize("make", MAKERS)
def test_what_depends_on_earlier_calls_is_printed_with_them(make: Callable[[], Any]) -> None:
    """The printed test fails with a fresh resolver, and without the calls it does not name it does
    not."""
    report = check_passivity(make(), impacts=60, search=20)
    shown = report.found[0]
    assert shown.fresh and "depends on earlier calls" in report
    with pytest.raises(AssertionError, match=shown.law):
        run(report.counterexample_test, shown.law, make())
    if shown.earlier:
        residual = LAWS[shown.law].check(shown.case, make(), KIT)
        assert residual is not None and residual.passed


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (hangs, "gave no answer within 0.5 s"),
        (lambda *_: ctypes.string_at(0), "by SIGSEGV"),
        (lambda *_: os._exit(0), "by status 0"),
    ],
)
def test_a_call_that_never_returns_is_ended(fault: Callable[..., Any], words: str) -> None:
    report = check_passivity(
        fault, impacts=1, search=0, laws=["kinetic_energy"], call_limit=0.5, own_process=True
    )
    assert words in report.found[0].fault and words in report and not report.passed
    if fault is hangs:
        assert report.found[0].case.contacts > 2
        with pytest.raises(ResolverFault, match=words):
            run(report.counterexample_test, "kinetic_energy", hangs)


def test_a_child_is_the_resolver_and_starts_anew() -> None:
    def counts(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
        calls.append(e)
        J *= 0.0
        return v * len(calls)

    calls: list[float] = []
    case = ImpactCase(np.eye(2), np.ones((1, 2)), np.ones(2), 0.5)
    child = Child(counts, 5.0)
    given = case.given()
    try:
        assert child(*given)[0] == 1.0 and not given[1].any() and child(*case.given())[0] == 2.0
        child.restart()
        assert child(*case.given())[0] == 1.0 and not calls
    finally:
        child.close()


def test_no_process_of_its_own_where_none_can_be_forked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr("os.fork")
    with pytest.raises(ArgumentError, match="own_process"):
        check_passivity(sound_resolver, impacts=1, own_process=True)
    report = check_passivity(makes_counter(), impacts=20, search=0)
    assert report.found[0].fresh is None and not report.passed
