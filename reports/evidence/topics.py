"""The topics of the report, in reading order: one module with `compute(runner, depth, progress)`, and one line here."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

from reports.runner import Runner
from verification.finding import NOT_COMPUTED, Failure, Finding, Part, finding_of

# id of the topic -> module of reports.evidence
TOPICS: dict[str, str] = {
    "mechanics": "mechanics",
    "scene-ledger": "scenes",
    "stability": "stability",
    "complementarity": "complementarity",
    "engines": "engines",
    "haptic-rate": "haptic_rate",
    "survival": "survival",
}


def compute_topic(name: str, runner: Runner, depth: str, progress: Callable[[int, int], None]) -> Finding:
    """Compute one topic."""
    topic: Finding = import_module(f"reports.evidence.{TOPICS[name]}").compute(runner, depth, progress)
    return topic


def failed_topic(name: str, failure: Failure) -> Finding:
    """A topic in place of one that could not be computed: it says why."""
    sentence = f"Not computed, after {failure.error}: {failure.reason}."
    title = name.replace("-", " ").capitalize()
    return finding_of(name, title, "", sentence, (Part(sentence, NOT_COMPUTED),))
