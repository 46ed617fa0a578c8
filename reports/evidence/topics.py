"""The stages of the evidence in reading order, and the topics of the report: each is one line
here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from typing import Any

from reference.worlds import run_world
from reports.evidence.energy import CERTIFIED_RUNS
from reports.runner import Runner
from verification import claims
from verification.claims import peg
from verification.cost.accuracy import work_precision
from verification.cost.effects import effects_of_scenes
from verification.finding import NOT_COMPUTED, Failure, Finding, Part, finding_of
from verification.proofs import check_all
from verification.proofs.show import ProofRecord
from verification.table import Table

Progress = Callable[[int, int], None]

# key of the finding -> module and name of its topic: a `Topic`, or a function (run, depth,
# progress)
TOPICS: dict[str, str] = {
    "hard-cases": "verification.hard_cases.topic:TOPIC",
    "stability": "verification.stability.topic:TOPIC",
    "complementarity": "verification.complementarity.topic:TOPIC",
    "haptic-rate": "verification.haptic_rate:TOPIC",
    "survival": "reports.evidence.survival:compute",
    # last: it certifies the runs of all others
    "energy": "reports.evidence.energy:TOPIC",
}


def _topic(name: str) -> Any:
    module, topic = TOPICS[name].split(":")
    return getattr(import_module(module), topic)


def failed_topic(name: str, failure: Failure) -> Finding:
    """Return a substitute for a topic that could not be computed; it says why."""
    sentence = f"Not computed, after {failure.error}: {failure.reason}."
    key = name.replace(" ", "-")
    title = name.replace("-", " ").capitalize()
    return finding_of(key, title, "", (Part(sentence, NOT_COMPUTED),), answer=sentence)


@dataclass(frozen=True)
class Plan:
    """How a stage is computed: the type of its records, and (runner, depth, progress, failures) ->
    records.

    timed : True if the stage measures times, so that nothing may run beside it
    """

    kind: Any
    compute: Callable[..., Any]
    timed: bool = False


# end of the name of the stage that has the checks of a timed topic that measure no time
AHEAD = ", without times"
CLAIM_STAGES = ("claims", "claims on the peg", "claims on times")


def stage_of(claim: str) -> str:
    """Return the stage that checks a claim; those on the peg share runs, and take as long as all
    others together."""
    if claims.CLAIMS[claim].columns.timed:
        return "claims on times"
    return "claims on the peg" if hasattr(peg, claim) else "claims"


def checked_claims(
    stage: str, runner: Runner, depth: str, progress: Progress, failures: list[Failure]
) -> tuple[Finding, ...]:
    """Check the claims of a stage, with runs from the store; each claim lists the runs that it
    uses."""

    def begin(done: int, total: int, claim: str) -> None:
        runner.user = claim
        progress(done, total)

    ids = [claim for claim in claims.CLAIMS if stage_of(claim) == stage]
    found = claims.check_claims(
        partial(runner, keep=False),
        depth,
        ids,
        progress=begin,
        asked=runner.use_again,
        simulate=run_world,
    )
    failures += [
        replace(one, case=f"{claim.key}, {one.case}") if one.case != claim.key else one
        for claim in found
        for one in claim.failures
    ]
    return found


def _plans_of(name: str) -> dict[str, Plan]:
    """Return the plan of a topic, timed if one of its checks has a column of times, and that of its
    other checks.

    The other checks are computed first, beside other stages, so that little runs alone.
    """
    topic = _topic(name)
    checks = getattr(topic, "checks", ())
    timed = any(check.columns.timed for check in checks)
    ahead = [check for check in checks if not check.columns.timed and check.key != CERTIFIED_RUNS]
    if len(ahead) == len(checks):
        return {
            name: Plan(
                Finding, lambda runner, depth, progress, failures: topic(runner, depth, progress)
            )
        }
    return {
        name + AHEAD: Plan(dict[str, Table], partial(topic.measure, ahead)),
        name: Plan(
            Finding,
            lambda runner, depth, progress, failures, known=None: topic(
                runner, depth, progress, known
            ),
            timed,
        ),
    }


def plans() -> dict[str, Plan]:
    """Return the plan of every stage by name."""
    return {
        **{
            stage: Plan(
                tuple[Finding, ...], partial(checked_claims, stage), stage == "claims on times"
            )
            for stage in CLAIM_STAGES
        },
        "proofs": Plan(tuple[ProofRecord, ...], lambda *given: check_all(*given[2:])),
        "accuracy": Plan(
            Table,
            lambda runner, depth, progress, failures: work_precision(
                progress=progress, failures=failures
            ),
            timed=True,
        ),
        **{stage: plan for name in TOPICS for stage, plan in _plans_of(name).items()},
        "effects": Plan(dict[str, Table], lambda *given: effects_of_scenes(*given[2:]), timed=True),
    }
