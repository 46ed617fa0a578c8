"""The verdict on one law in the making, impact by impact; and counts of many cases that can be added."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from verification.properties.bounds import Bounds
from verification.properties.case import ImpactCase, LawResidual, Resolver, ResolverFault
from verification.properties.laws import Law
from verification.properties.passivity_report import LawVerdict


@dataclass
class Tally:
    """Counts, and the worst case so far."""

    name: str
    law: Law
    checked: int = 0
    failures: int = 0
    fault: str = ""
    error: Exception | None = None
    largest: float = -np.inf
    worst: LawResidual | None = None
    worst_case: ImpactCase | None = field(default=None, repr=False)
    largest_failure: float = -np.inf
    largest_case: ImpactCase | None = field(default=None, repr=False)

    def add(self, case: ImpactCase, resolver: Resolver, bounds: Bounds) -> None:
        """Try one impact; a law that raises is not tried again."""
        if self.error is not None:
            return
        try:
            residual, complaint = residual_of(self.law, case, resolver, bounds)
        except Exception as error:
            self.error, self.fault = error, f"the law itself raised {type(error).__name__}: {error}"
            return
        if residual is None:
            return
        self.checked += 1
        self.failures += not residual.passed
        self.fault = self.fault or complaint
        self.largest = max(self.largest, residual.value)
        if self.worst is None or residual.ratio > self.worst.ratio:
            self.worst, self.worst_case = residual, case
        if not residual.passed and (self.largest_case is None or residual.value > self.largest_failure):
            self.largest_failure, self.largest_case = residual.value, case

    def verdict(self) -> LawVerdict:
        """What became of it."""
        return LawVerdict(self.name, self.law.statement, self.checked, self.failures, self.worst, self.worst_case,
                          self.largest, self.largest_case, self.fault, self.error)


def residual_of(law: Law, case: ImpactCase, resolver: Resolver, bounds: Bounds) -> tuple[LawResidual | None, str]:
    """The law's residual; infinite, with the complaint, where the resolver gave nothing usable."""
    try:
        return law.check(case, resolver, bounds), ""
    except ResolverFault as fault:
        return LawResidual("", np.inf, 0.0), str(fault)


@dataclass(frozen=True)
class LawCount:
    """One law over some cases; `worst` is the residual nearest to its tolerance, or furthest above it."""

    law: str
    checked: int
    failures: int
    worst: LawResidual | None


@dataclass
class RunningCount:
    """The same in the making, case by case."""

    checked: int = 0
    failures: int = 0
    worst: LawResidual | None = None
    worst_ratio: float = -np.inf

    def add(self, residual: LawResidual) -> bool:
        """Count one case; return whether it keeps the law."""
        ratio = residual.ratio
        self.checked += 1
        self.failures += not ratio <= 1.0
        if self.worst is None or ratio > self.worst_ratio:
            self.worst, self.worst_ratio = residual, ratio
        return ratio <= 1.0

    def count(self, law: str) -> LawCount:
        """What there is so far."""
        return LawCount(law, self.checked, self.failures, self.worst)


def added(one: LawCount, other: LawCount) -> LawCount:
    """Add the counts of two sets of cases of one law."""
    residuals = [count.worst for count in (one, other) if count.worst is not None]
    worst = max(residuals, key=lambda residual: residual.ratio, default=None)
    return LawCount(one.law, one.checked + other.checked, one.failures + other.failures, worst)


def residual_count(residuals: Iterable[LawResidual]) -> LawCount:
    """Count many cases of one law."""
    total = RunningCount()
    for residual in residuals:
        total.add(residual)
    return total.count("")
