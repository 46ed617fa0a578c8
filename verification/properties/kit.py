"""`check_passivity(resolver)`: does anybody's impact resolver ever create energy, and does it keep the other laws?"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from verification.properties.bounds import KIT, Bounds
from verification.properties.case import ImpactCase, LawResidual, Resolver, ResolverFault
from verification.properties.families import draw_case
from verification.properties.laws import LAWS
from verification.properties.shrink import search_counterexample, shrink
from verification.threads import one_thread

NOTABLE = 1e-6  # a counterexample with a residual above this is looked for first: nobody calls it rounding
LARGEST_CONDITION = 1e8  # κ(M) of the default families; beyond it plain Cholesky loses what the laws compare


@dataclass(frozen=True)
class LawVerdict:
    """What became of one law over all impacts.

    Attributes
    ----------
    checked, failures : impacts the law applied to, and those that broke it.
    worst : the residual with the largest value / tolerance (None if the law never applied).
    largest : largest value of the residual, whatever its tolerance.
    fault : first complaint where the resolver raised or returned nothing usable.
    """

    law: str
    statement: str
    checked: int
    failures: int
    worst: LawResidual | None
    worst_case: ImpactCase | None
    largest: float
    fault: str = ""

    @property
    def passed(self) -> bool:
        """No impact broke the law."""
        return self.failures == 0


@dataclass(frozen=True)
class PassivityReport:
    """Verdict of `check_passivity`; `print(report)` is meant for people."""

    resolver: str
    impacts: int
    seed: int
    verdicts: tuple[LawVerdict, ...]
    counterexample: ImpactCase | None
    counterexample_law: str

    @property
    def passed(self) -> bool:
        """Every law holds on every impact tried."""
        return all(verdict.passed for verdict in self.verdicts)

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
        return as_test(self.counterexample, self.counterexample_law) if self.counterexample else ""

    def __str__(self) -> str:
        lines = [f"{self.resolver}: {'passed' if self.passed else 'FAILED'} on {self.impacts} impacts"]
        for verdict in self.verdicts:
            mark = "kept  " if verdict.passed else "BROKEN"
            worst = f"worst {verdict.worst.value:.2e} of {verdict.worst.tolerance:.2e}" if verdict.worst else "-"
            lines.append(f"  {mark} {verdict.statement}: {verdict.failures} of {verdict.checked}, {worst}")
            if verdict.fault:
                lines.append(f"         {verdict.fault}")
        return "\n".join([*lines, self.counterexample_test]).rstrip()


def check_passivity(
    resolver: Resolver,
    *,
    impacts: int = 1500,
    seed: int = 0,
    search: int = 200,
    bounds: Bounds = KIT,
    largest_condition: float = LARGEST_CONDITION,
) -> PassivityReport:
    """Run every law against `resolver` and return the report.

    Parameters
    ----------
    resolver : called as resolver(mass_matrix (d, d), contact_jacobian (c, d), velocity (d,), restitution) with
        float64 arrays (copies; c = 0 included) and one e in [−1, 1] for all rows, each an equality; returns v⁺
        as an array or as an object with `.velocity`.
    impacts : random impacts drawn by numpy.
    seed : of the draw; the same seed gives the same impacts.
    search : examples hypothesis may try to find and shrink a counterexample (0 = shrink the drawn one only).
    bounds : tolerances; `verification.properties.bounds`.
    largest_condition : largest κ(M) drawn.

    Examples
    --------
    >>> def test_my_resolver():
    ...     report = check_passivity(my_resolver)
    ...     assert report.passed, report
    """
    rng = np.random.default_rng(seed)
    cases = [draw_case(rng, largest_condition) for _ in range(impacts)]
    with one_thread():
        verdicts = tuple(_judge(name, resolver, bounds, cases) for name in LAWS)
        broken = next((verdict for verdict in verdicts if not verdict.passed), None)
        example = None if broken is None else _counterexample(broken, resolver, bounds, search, seed)
    name = getattr(resolver, "__qualname__", None) or repr(resolver)
    return PassivityReport(name, impacts, seed, verdicts, example, broken.law if broken else "")


def _judge(name: str, resolver: Resolver, bounds: Bounds, cases: list[ImpactCase]) -> LawVerdict:
    checked, failures, fault, largest = 0, 0, "", -np.inf
    worst: LawResidual | None = None
    worst_case: ImpactCase | None = None
    for case in cases:
        residual, complaint = _residual(name, case, resolver, bounds)
        if residual is None:
            continue
        checked += 1
        failures += not residual.passed
        fault = fault or complaint
        largest = max(largest, residual.value)
        if worst is None or residual.ratio > worst.ratio:
            worst, worst_case = residual, case
    return LawVerdict(name, LAWS[name].statement, checked, failures, worst, worst_case, largest, fault)


def _residual(name: str, case: ImpactCase, resolver: Resolver, bounds: Bounds) -> tuple[LawResidual | None, str]:
    """The law's residual; infinite, with the complaint, where the resolver gave nothing usable."""
    try:
        return LAWS[name].check(case, resolver, bounds), ""
    except ResolverFault as fault:
        return LawResidual(name, np.inf, 0.0), str(fault)


def _counterexample(
    broken: LawVerdict, resolver: Resolver, bounds: Bounds, search: int, seed: int
) -> ImpactCase | None:
    for least in (NOTABLE, 0.0):
        fails = partial(_fails, broken.law, resolver, bounds, least)
        found = search_counterexample(fails, search, seed) if search else None
        if found is not None:
            return found
        if broken.worst_case is not None and fails(broken.worst_case):
            return shrink(broken.worst_case, fails)
    return None


def _fails(name: str, resolver: Resolver, bounds: Bounds, least: float, case: ImpactCase) -> bool:
    """Whether the law is broken, by at least `least`."""
    residual, _ = _residual(name, case, resolver, bounds)
    return residual is not None and not residual.passed and not residual.value < least


def as_test(case: ImpactCase, law: str) -> str:
    """Return the case as source of a test of `law`, to paste beside the resolver it breaks."""
    arrays = {
        "mass_matrix": case.mass_matrix,
        "contact_jacobian": case.contact_jacobian,
        "velocity": case.velocity,
    }
    lines = [f"    {name} = np.array({array.tolist()!r}).reshape({array.shape})" for name, array in arrays.items()]
    return "\n".join(
        [
            "import numpy as np",
            "from verification.properties import LAWS, ImpactCase",
            "from verification.properties.bounds import KIT",
            "",
            "# resolver = ...  the one under test",
            "",
            "",
            f"def test_{law}():",
            *lines,
            f"    case = ImpactCase(mass_matrix, contact_jacobian, velocity, {case.restitution!r})",
            f"    residual = LAWS[{law!r}].check(case, resolver, KIT)",
            "    assert residual.passed, residual",
        ]
    )
