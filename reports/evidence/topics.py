"""The topics of the report in reading order: each is one line here, a `Topic` or a function (run, depth, progress)."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

from reports.runner import Runner
from verification.finding import NOT_COMPUTED, Failure, Finding, Part, finding_of

# key of the finding -> module and name of its topic
TOPICS: dict[str, str] = {
    "energy-gains": "verification.laws.topic:energy_gains",
    "properties": "verification.laws.topic:properties",
    "mechanics": "verification.mechanics.mechanics:mechanics",
    "scene-ledger": "verification.scenes.ledger:scene_ledger",
    "stability": "verification.stability.topic:contact_stability",
    "complementarity": "verification.complementarity.topic:TOPIC",
    "engines": "verification.engines:engines",
    "haptic-rate": "verification.haptic_rate:TOPIC",
    "survival": "reports.evidence.survival:compute",
    "exact-energy": "reports.evidence.exact_energy:TOPIC",  # last: it certifies the runs of all others
}


def compute_topic(name: str, runner: Runner, depth: str, progress: Callable[[int, int], None]) -> Finding:
    """Compute one topic."""
    module, function = TOPICS[name].split(":")
    topic: Finding = getattr(import_module(module), function)(runner, depth, progress)
    return topic


def failed_topic(name: str, failure: Failure) -> Finding:
    """Return a substitute for a topic that could not be computed; it says why."""
    sentence = f"Not computed, after {failure.error}: {failure.reason}."
    key, title = name.replace(" ", "-"), name.replace("-", " ").capitalize()
    return finding_of(key, title, "", sentence, (Part(sentence, NOT_COMPUTED),))
