"""The claims ledger: each claim of the paper as a computation with a verdict over a range of conditions.

Each claim has its own file. `check_claims` checks the claims; `CLAIMS` maps each id to its claim.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module

from iapb.errors import ArgumentError
from iapb.names import one_of
from verification.claims.claim import Claim
from verification.claims.study import Ahead, Asked, Runner, Study, run_directly
from verification.finding import VERDICTS, Column, Failure, Finding, Table, attempt, with_failures

_FILES = (
    "c01_one_collision",
    "c02_redundant_collisions",
    "c03_rows_removed",
    "c04_elastic",
    "c05_complementarity",
    "c06_coordinates",
    "c07_plastic",
    "c08_passive",
    "c09_no_impulse",
    "c10_trajectory",
    "c11_forces",
    "c12_saturate_spread",
    "c13_limited_trajectory",
    "c14_limited_forces",
    "c15_settling",
    "c16_together",
    "c17_energy_lost",
    "c18_false_collisions",
    "c19_haptic_rate",
    "c20_damping_bound",
    "c21_impulses_or_damping",
    "c22_cost",
)
CLAIMS: dict[str, Claim] = {
    claim.id: claim for claim in (import_module(f"{__name__}.{file}").CLAIM for file in _FILES)
}

__all__ = ["CLAIMS", "VERDICTS", "Claim", "Column", "Finding", "Study", "Table", "check_claims"]


def check_claims(
    run: Runner = run_directly,
    depth: str = "quick",
    ids: Sequence[str] | None = None,
    progress: Callable[[int, int, str], None] | None = None,
    asked: Asked | None = None,
    ahead: Ahead | None = None,
) -> tuple[Finding, ...]:
    """Check the paper's claims and return one finding each; exceptions are recorded as failures of their claim.

    Parameters
    ----------
    run : (scene, world, rendering) -> Run; called once for each distinct simulation
    depth : "quick" (about a minute) or "full"
    ids : the claims to check; default all
    progress : called as progress(number of claims done, number of claims, id of the next claim)
    asked : called as asked(scene, world, rendering) whenever a claim uses a run, even if an earlier claim made that run
    ahead : makes many runs at once on several cores (see `Study`)

    Raises
    ------
    ArgumentError
        An unknown depth or claim.
    """
    unknown = [name for name in ids or () if name not in CLAIMS]
    if unknown:
        raise ArgumentError("ids", unknown, one_of(unknown[0], CLAIMS, "some of "))
    chosen = tuple(CLAIMS) if ids is None else tuple(ids)
    study, results = Study(run, depth, asked=asked, ahead=ahead), []
    for done, name in enumerate(chosen):
        if progress is not None:
            progress(done, len(chosen), name)
        failures: list[Failure] = []
        study.failures = failures
        result = attempt(name, partial(CLAIMS[name].check, study), failures) or CLAIMS[name].not_computed()
        results.append(with_failures(result, failures))
    if progress is not None:
        progress(len(chosen), len(chosen), "")
    return tuple(results)
