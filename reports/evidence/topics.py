"""The topics of the report, in reading order: one module with `compute(runner, depth, progress)`, and one line here."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

from reports.pages.records import Finding, Topic
from reports.runner import Runner
from verification.finding import NOT_COMPUTED, Failure

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


def compute_topic(name: str, runner: Runner, depth: str, progress: Callable[[int, int], None]) -> Topic:
    """Compute one topic."""
    topic: Topic = import_module(f"reports.evidence.{TOPICS[name]}").compute(runner, depth, progress)
    return topic


def failed_topic(name: str, failure: Failure) -> Topic:
    """A topic in place of one that could not be computed: it says why."""
    sentence = f"Not computed, after {failure.error}: {failure.reason}."
    title = name.replace("-", " ").capitalize()
    return Topic(name, title, "", (Finding(sentence, NOT_COMPUTED),), verdict=sentence)
