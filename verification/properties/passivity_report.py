"""What the passivity kit found: a verdict per law, the worst case, a counterexample. `print(report)` is for people."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from verification.properties.bounds import KIT, Bounds
from verification.properties.case import ImpactCase, LawResidual
from verification.properties.pasteable import as_test


@dataclass(frozen=True)
class LawVerdict:
    """What became of one law over all impacts.

    Attributes
    ----------
    checked, failures : impacts the law applied to, and those that broke it.
    worst : the residual with the largest value / tolerance (None if the law never applied).
    largest : largest value of the residual, whatever its tolerance.
    largest_case : the impact that breaks the law with the largest residual; None if none does.
    fault : first complaint where the resolver raised or returned nothing usable.
    error : what the law itself raised; it was not tried any further.
    """

    law: str
    statement: str
    checked: int
    failures: int
    worst: LawResidual | None
    worst_case: ImpactCase | None
    largest: float
    largest_case: ImpactCase | None = None
    fault: str = ""
    error: Exception | None = None

    @property
    def passed(self) -> bool:
        """No impact broke the law, and the law could be tried."""
        return self.failures == 0 and self.error is None

    def __str__(self) -> str:
        mark = "kept  " if self.passed else "BROKEN"
        worst = f"worst {self.worst.value:.2e} of {self.worst.tolerance:.2e}" if self.worst else "-"
        line = f"  {mark} {self.statement}: {self.failures} of {self.checked}, {worst}"
        return f"{line}\n         {self.fault}" if self.fault else line


@dataclass(frozen=True)
class PassivityReport:
    """Verdict of `check_passivity`.

    Attributes
    ----------
    impacts : random impacts that every law was tried on, after `families.ADVERSE` adverse ones.
    unfinished : why these are fewer than were asked for; empty if they are not.
    counterexample, counterexample_law : the smallest one found, of the first broken law; None if there is none.
    tested : the resolver, for the import line of the pasted test.
    """

    resolver: str
    impacts: int
    seed: int
    verdicts: tuple[LawVerdict, ...]
    counterexample: ImpactCase | None
    counterexample_law: str
    unfinished: str = ""
    bounds: Bounds = KIT
    tested: Any = None

    @property
    def passed(self) -> bool:
        """Every law holds on every impact asked for."""
        return not self.unfinished and all(verdict.passed for verdict in self.verdicts)

    @property
    def broken_laws(self) -> tuple[str, ...]:
        """Names of the laws that some impact broke."""
        return tuple(verdict.law for verdict in self.verdicts if not verdict.passed)

    @property
    def worst(self) -> LawVerdict:
        """The law that came closest to its tolerance, or exceeded it most."""
        return max(self.verdicts, key=lambda verdict: verdict.worst.ratio if verdict.worst else 0.0)

    def verdict(self, law: str) -> LawVerdict:
        """The verdict on the law of that name."""
        return next(verdict for verdict in self.verdicts if verdict.law == law)

    @property
    def counterexample_test(self) -> str:
        """The counterexample as a test to paste, or an empty text."""
        if self.counterexample is None:
            return ""
        return as_test(self.counterexample, self.counterexample_law, self.bounds, self.tested)

    def __repr__(self) -> str:
        """The same text: pytest shows the repr of what stands behind an `assert ..., report`."""
        return str(self)

    def __str__(self) -> str:
        word = "passed" if self.passed else "NOT FINISHED" if not self.broken_laws else "FAILED"
        lines = [f"{self.resolver}: {word} on {self.impacts} impacts"]
        if self.unfinished:
            lines.append(f"  {self.unfinished}")
        lines += [str(verdict) for verdict in self.verdicts]
        worst = self.worst
        if worst.worst is not None and worst.worst_case is not None:
            family = worst.worst_case.family or "an impact"
            lines.append(f"  worst case: {worst.law} at {worst.worst.ratio:.2g} of its tolerance, {family}")
        if self.counterexample is not None:
            lines += ["", f"counterexample to {self.counterexample_law}, as a test:", "", self.counterexample_test]
        return "\n".join(lines)
