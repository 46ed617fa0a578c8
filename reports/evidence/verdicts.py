"""The first page: one sentence per topic, made from the records, never typed in.

The claims have no common verdict: the page shows each with its parts.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from reports.pages.records import Evidence, Verdict
from verification.finding import NOT_COMPUTED, REFUTED, REPRODUCED, Failure, verdict_of_trials, worst

_ENGINE = ("factored", "IAPB")  # what the engine does by default: its impact method, its world


def verdicts(evidence: Evidence) -> tuple[Verdict, ...]:
    """One verdict for each topic that was computed; what failed never counts as holding."""
    failed = {one.stage: one.failures for one in evidence.failed}
    found = {stage: tuple(said(evidence)) for stage, said in _STAGES.items()}
    if evidence.claims:
        failed.pop("claims", None)
    marked = (_marked(found.get(stage, ()), about, failed.get(stage, ())) for stage, about in TITLES.items())
    return (*(verdict for group in marked for verdict in group), *_topics(evidence))


def _marked(found: tuple[Verdict, ...], about: tuple[str, str], failures: Sequence[Failure]) -> Iterator[Verdict]:
    """The verdicts of a stage, with how many of its cases failed."""
    if failures and not found:
        title, link = about
        yield Verdict(title, NOT_COMPUTED, f"Not computed, after {failures[0].error}: {failures[0].reason}.", link)
    for one in found:
        if not failures:
            yield one
            continue
        count = f"{len(failures)} {'case' if len(failures) == 1 else 'cases'} failed."
        yield replace(one, outcome=worst((one.outcome, NOT_COMPUTED)), sentence=f"{one.sentence} {count}")


def _passivity(evidence: Evidence) -> Iterator[Verdict]:
    if evidence.bulk is None:
        return
    totals = {row["method"]: row for row in evidence.bulk.records() if row["condition of M from"] == "all"}
    ours, printed = totals.get("factored"), totals.get("gram_pinv, as printed")
    if ours is None or printed is None:
        return
    gain, share, above = "largest relative energy gain", "gain / (10 d ε √κ)", "above 10 d ε √κ"
    sentence = (f"In {ours['impacts']:,} random impacts the engine's largest relative energy gain is {ours[gain]:.1e}, "
                f"at most {ours[share]:.2g} of its bound 10 d ε √κ(M); the printed formula gains up to "
                f"{printed[gain]:.1e}.")  # fmt: skip
    outcome = REPRODUCED if ours[above] == 0 else REFUTED
    yield Verdict("Passive in floating point", outcome, sentence, "properties")


def _proofs(evidence: Evidence) -> Iterator[Verdict]:
    if not evidence.proofs:
        return
    proved = sum(proof.holds for proof in evidence.proofs)
    twins = sum(len(proof.twins) for proof in evidence.proofs)
    sentence = (f"{proved} of {len(evidence.proofs)} statements are proved by certificates that a machine expanded; "
                f"{twins} wrong twins are refuted by exact counterexamples.")
    yield Verdict("Proofs", REPRODUCED if proved == len(evidence.proofs) else REFUTED, sentence, "proofs")


def _laws(evidence: Evidence) -> Iterator[Verdict]:
    if not evidence.properties:
        return
    kept = sum(law.holds for law in evidence.properties)
    planted = [law for law in evidence.properties if law.fault]
    caught = sum(bool(law.fault_caught) for law in planted)
    sentence = (f"{kept} of {len(evidence.properties)} laws hold on random and nasty impacts; {caught} of "
                f"{len(planted)} planted faults are caught.")
    good = kept == len(evidence.properties) and caught == len(planted)
    yield Verdict("Properties", REPRODUCED if good else REFUTED, sentence, "properties")


def _hard_cases(evidence: Evidence) -> Iterator[Verdict]:
    if not evidence.hard_cases:
        return
    tried = [case for case in evidence.hard_cases if not case.skipped]
    ours = {case.name: next((case.outcomes[name] for name in _ENGINE if name in case.outcomes), "") for case in tried}
    failing = [f"{name} ({outcome or 'not tried'})" for name, outcome in ours.items() if outcome != "stable"]
    skipped = len(evidence.hard_cases) - len(tried)
    sentence = (f"The engine is stable on {len(ours) - len(failing)} of {len(ours)} hard cases with certain answers."
                + (f" Not on: {'; '.join(failing)}." if failing else "")
                + (f" {skipped} were skipped: their files are absent." if skipped else ""))  # fmt: skip
    outcome = verdict_of_trials(outcome == "stable" for outcome in ours.values())
    yield Verdict("Hard cases", outcome, sentence, "hard-cases")


def _topics(evidence: Evidence) -> Iterator[Verdict]:
    for topic in evidence.topics:
        if topic.answer:
            yield Verdict(topic.title, topic.verdict, topic.answer, topic.key, topic.timed)


# stage -> its sentences; stage -> title and section
_STAGES = {
    "bulk impacts": _passivity, "proofs": _proofs, "properties": _laws,
    "hard cases": _hard_cases,
}  # fmt: skip
TITLES = {
    "claims": ("The paper's claims", "claims"), "bulk impacts": ("Passive in floating point", "properties"),
    "proofs": ("Proofs", "proofs"), "properties": ("Properties", "properties"),
    "hard cases": ("Hard cases", "hard-cases"),
}  # fmt: skip
