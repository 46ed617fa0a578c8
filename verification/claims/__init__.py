"""The claims ledger: each claim of the paper as a Check with a verdict over a range of conditions.

`check_claims` checks the claims; `CLAIMS` maps each id to its claim. A claim is a `Check` named
after its id, in one of the files of `_FILES`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from typing import Any

from iapb.errors import ArgumentError
from iapb.names import one_of
from iapb.run import Run
from reference.worlds import run_world
from verification.check import Check, Study
from verification.finding import Failure, Finding, attempt, with_failures

_FILES = (
    "algebraic",
    "arm",
    "peg",
    "walls",
    "socket",
    "speed",
)
_MADE = {
    claim.key: claim
    for file in _FILES
    for claim in vars(import_module(f"{__name__}.{file}")).values()
    if isinstance(claim, Check)
}
CLAIMS: dict[str, Check] = {key: _MADE[key] for key in sorted(_MADE)}


def check_claims(
    run: Callable[..., Run] = run_world,
    depth: str = "quick",
    ids: Sequence[str] | None = None,
    progress: Callable[[int, int, str], None] | None = None,
    **options: Any,
) -> tuple[Finding, ...]:
    """Check the paper's claims and return one finding each; exceptions are recorded as failures of
    their claim.

    Parameters
    ----------
    run : (scene, world, rendering) -> Run; called once for each distinct simulation
    depth : "quick" (about a minute) or "full"
    ids : the claims to check; default all
    progress : called as progress(number of claims done, number of claims, id of the next claim)
    options : `asked`, as in `Study`

    Raises
    ------
    ArgumentError
        An unknown depth or claim.
    """
    chosen = tuple(CLAIMS) if ids is None else tuple(ids)
    if unknown := [name for name in chosen if name not in CLAIMS]:
        raise ArgumentError("ids", unknown, one_of(unknown[0], CLAIMS, "some of "))
    study = Study(run, depth, **options)
    say = progress or (lambda *_: None)
    results = []
    for done, name in enumerate(chosen):
        say(done, len(chosen), name)
        failures: list[Failure] = []
        study.failures = failures
        result = (
            attempt(name, partial(CLAIMS[name].finding, study), failures)
            or CLAIMS[name].not_computed()
        )
        results.append(with_failures(result, failures))
    say(len(chosen), len(chosen), "")
    return tuple(results)
