"""What the kit prints fails as printed: with a fresh resolver, by the law and the kind of fault that it
names."""

from __future__ import annotations

import ctypes
import subprocess
import sys
import time
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from iapb.errors import ArgumentError
from tests.verification.laws.faults import makes_stale_jacobian
from verification import check_passivity
from verification.impacts import Floats
from verification.laws import LAWS, ImpactCase, PassivityReport, sound_resolver
from verification.laws.bounds import KIT
from verification.laws.child import Child
from verification.laws.planted import makes_stale_answers, makes_warm_start
from verification.laws.resolver import ResolverFault


def makes_counter() -> Callable[..., Floats]:
    """Returns a resolver whose every fiftieth answer is a tenth too fast."""
    number = count(1)
    return lambda *given: sound_resolver(*given) * (1.1 if next(number) % 50 == 0 else 1.0)


def gains_or_raises(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    """Gains energy with two contacts, and needs one."""
    if not len(J):
        raise ValueError("no contacts")
    return sound_resolver(M, J, v, e) * (1.5 if len(J) == 2 else 1.0)


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
def test_a_wrong_answer_and_no_answer_are_both_shown() -> None:
    report = check_passivity(gains_or_raises, impacts=30, search=0)
    gains, raises = report.found
    assert (gains.law, gains.case.contacts, gains.fault) == ("kinetic_energy", 2, "")
    assert raises.case.contacts == 0 and raises.fault == "raised ValueError: no contacts"
    with pytest.raises(AssertionError, match="kinetic_energy"):
        run(report.test_of(gains), gains.law, gains_or_raises)
    with pytest.raises(ResolverFault, match="no contacts"):
        run(report.test_of(raises), raises.law, gains_or_raises)


@pytest.mark.parametrize(
    ("law", "contract"), [("elastic", "equality"), ("separating", "unilateral")]
)
def test_the_calls_shown_are_those_that_the_law_makes(law: str, contract: str) -> None:
    """`elastic` calls with e = 1, `separating` with the normals turned."""
    report = check_passivity(
        lambda M, J, v, e: -0.5 * v, contract=contract, laws=[law], impacts=20, search=0
    )
    given, answer = report.found[0].calls[-1]
    assert np.array_equal(answer, -0.5 * given[2])
    assert given[3] == 1.0 if law == "elastic" else np.all(given[1] @ given[2] >= 0.0)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("fault", "words"),
    [(hangs, "gave no answer within 0.5 s"), (lambda *_: ctypes.string_at(0), "by SIGSEGV")],
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


@pytest.mark.thorough
def test_a_call_that_hangs_is_named_while_it_does(capfd: pytest.CaptureFixture[str]) -> None:
    asleep = [True]

    def sleeps(*given: Any) -> Floats:
        if asleep.pop() if asleep else False:
            time.sleep(4.0)
        return sound_resolver(*given)

    assert check_passivity(sleeps, impacts=2, search=0, call_limit=1.0).passed
    told = capfd.readouterr().err
    assert "sleeps has given no answer for 1 s. The impact:\n  M = [[" in told
    assert told.count("The impact") == 1


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


@pytest.mark.thorough
@pytest.mark.parametrize("make", ["makes_counter", "makes_stale_answers"])
def test_a_printed_test_fails_in_a_fresh_process(make: str, tmp_path: Path) -> None:
    report: PassivityReport = check_passivity(globals()[make](), impacts=60, search=20)
    module = "test_counterexamples" if make == "makes_counter" else "planted"
    package = "tests.verification.laws" if make == "makes_counter" else "verification.laws"
    file = tmp_path / "test_pasted.py"
    given = f"from {package}.{module} import {make}\n\nresolver = {make}()\n"
    file.write_text(f"{given}\n{report.counterexample_test}\n")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(file)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 1 and "1 failed" in done.stdout and "AssertionError" in done.stdout
