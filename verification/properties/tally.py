"""The verdict on one law in the making, impact by impact."""

from __future__ import annotations

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
    largest: float = -np.inf
    worst: LawResidual | None = None
    worst_case: ImpactCase | None = field(default=None, repr=False)

    def add(self, case: ImpactCase, resolver: Resolver, bounds: Bounds) -> None:
        """Try one impact."""
        residual, complaint = residual_of(self.law, case, resolver, bounds)
        if residual is None:
            return
        self.checked += 1
        self.failures += not residual.passed
        self.fault = self.fault or complaint
        self.largest = max(self.largest, residual.value)
        if self.worst is None or residual.ratio > self.worst.ratio:
            self.worst, self.worst_case = residual, case

    def verdict(self) -> LawVerdict:
        """What became of it."""
        return LawVerdict(self.name, self.law.statement, self.checked, self.failures, self.worst, self.worst_case,
                          self.largest, self.fault)


def residual_of(law: Law, case: ImpactCase, resolver: Resolver, bounds: Bounds) -> tuple[LawResidual | None, str]:
    """The law's residual; infinite, with the complaint, where the resolver gave nothing usable."""
    try:
        return law.check(case, resolver, bounds), ""
    except ResolverFault as fault:
        return LawResidual("", np.inf, 0.0), str(fault)
