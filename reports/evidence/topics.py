"""The topics of the report, in reading order: one module with `compute(runner, depth, progress)`, and one line here."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from reports.pages.records import Finding, Topic
from reports.runner import Runner
from verification.finding import NOT_COMPUTED

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


def failed_topic(name: str, failure: Exception, folder: Path) -> Topic:
    """A topic in place of one that could not be computed: it says why; where it happened goes to a file in `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}-failed.txt"
    path.write_text("".join(traceback.format_exception(failure)), encoding="utf-8")
    why = (str(failure).splitlines() or ["no reason given"])[0]
    sentence = f"Not computed, after {type(failure).__name__}: {why} ({path.name} says where)."
    title = name.replace("-", " ").capitalize()
    return Topic(name, title, "", (Finding(sentence, NOT_COMPUTED),), verdict=sentence, failed=True)
