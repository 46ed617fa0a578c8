"""Judge methods and worlds on hard cases: one verdict each, in numbers and in words."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from iapb.errors import ArgumentError
from iapb.names import one_of
from reference.one_thread import one_thread
from verification.finding import Failure, of_each
from verification.hard_cases.case import AnyCase, CaseAbsent, HardCase
from verification.hard_cases.catalogue import HARD_CASES
from verification.hard_cases.judge_impact import METHODS, judge_impact
from verification.hard_cases.judge_trajectory import Simulate, judge_trajectory, run_in_world
from verification.hard_cases.verdict import HardCaseVerdict


def judge_hard_cases(
    methods: Iterable[str] | None = None, cases: Iterable[str] | None = None, simulate: Simulate = run_in_world,
    failures: list[Failure] | None = None,
) -> tuple[HardCaseVerdict, ...]:
    """Return the verdict of each method or world on each case.

    Parameters
    ----------
    methods : names of impact methods and of worlds; default all that a case is about.
    cases : names in `HARD_CASES`, by default all of them. Cases of files that are absent are left out: ask
        `HARD_CASES[name]()` for the reason, which it raises as `CaseAbsent`.
    simulate : how a scene is run in a world: ``simulate(scene, world) -> Run``.
    failures : receives what raises anything but an `IapbError`, which is a verdict; without it that passes through.

    Returns
    -------
    tuple of HardCaseVerdict
        one for each pair of case and method: the verdict in a word, and the numbers that it follows from.

    Raises
    ------
    ArgumentError
        If there is no such case.
    """
    wanted = None if methods is None else tuple(methods)
    names = tuple(HARD_CASES if cases is None else cases)
    for name in names:
        if name not in HARD_CASES:
            raise ArgumentError("cases", name, one_of(name, HARD_CASES))
    found = (verdict for name in names for verdict in _of(name, wanted, simulate, failures))
    with one_thread():
        return tuple(found)


def methods_for(case: AnyCase) -> tuple[str, ...]:
    """The impact methods or the worlds that a case is about."""
    if isinstance(case, HardCase):
        return METHODS if case.methods is None else case.methods
    return case.worlds


def judge_hard_case(case: AnyCase, method: str, simulate: Simulate = run_in_world) -> HardCaseVerdict:
    """Return the verdict of one method on one impact, or of one world on one trajectory."""
    if isinstance(case, HardCase):
        return judge_impact(case, method)
    return judge_trajectory(case, method, simulate)


def _of(
    name: str, wanted: tuple[str, ...] | None, simulate: Simulate, failures: list[Failure] | None
) -> Iterator[HardCaseVerdict]:
    try:
        case = HARD_CASES[name]()
    except CaseAbsent:
        return
    methods = (method for method in methods_for(case) if wanted is None or method in wanted)
    yield from of_each(methods, lambda method: [judge_hard_case(case, method, simulate)], failures,
                       lambda method: f"{name}, {method}")  # fmt: skip
