"""The topics of the report, in reading order: one module with `compute(runner, depth, progress)`, and one line here."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

from reports.pages.records import Topic
from reports.runner import Runner

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
