"""Verdicts in words: whether a run met its scene's law, and one sentence per engine."""

from __future__ import annotations

from collections.abc import Sequence

from verification.engines.record import EngineRecord

# A peer with springs for contacts cannot be exact; a hundredth of the start's energy, momentum and speed is what a
# user of the engine would not notice, and what no engine misses by rounding.
CLOSE = 1e-2
STAYS = 1e-3  # [m] a hundredth of the bodies' size
NEVER_RISES = 1e-6  # share of energy: what rounding leaves of 60 000 steps, with room

MET, MISSED, FAILED, MISSING = "met", "missed", "failed", "not installed"


def verdict(record: EngineRecord) -> str:
    """One of MET, MISSED, FAILED and MISSING."""
    if record.missing:
        return MISSING
    if record.failure:
        return FAILED
    if record.rests:
        return MET if (record.drift or 0.0) <= STAYS else MISSED
    errors = (record.energy_error, record.momentum_error, record.velocity_error)
    return MET if all(abs(error or 0.0) <= CLOSE for error in errors) else MISSED


def sentence(records: Sequence[EngineRecord]) -> str:
    """What one engine's runs with one choice of settings came to."""
    first = records[0]
    if first.missing:
        return f"{first.title} is not installed here: {first.missing}"
    met = [record for record in records if verdict(record) == MET]
    at = "at its own settings" if first.choice == "own" else f"at a step of {1e3 * (first.step or 0.0):g} ms"
    parts = [f"{first.title} {first.version}, {at}, meets the law of {len(met)} of {len(records)} scenes"]
    missed = [f"{record.scene.replace('_', ' ')} ({_worst(record)})" for record in records if record not in met]
    if missed:
        parts.append("it misses " + ", ".join(missed))
    gains = [record for record in records if (record.energy_gain or 0.0) > NEVER_RISES]
    if gains:
        most = max(gains, key=lambda record: record.energy_gain or 0.0)
        parts.append(f"energy rises in {len(gains)}, most by {most.energy_gain:.2g} of it in "
                     f"{most.scene.replace('_', ' ')}")  # fmt: skip
    else:
        parts.append("energy never rises")
    return "; ".join(parts) + "."


def _worst(record: EngineRecord) -> str:
    """The number that misses, in words."""
    if record.failure:
        return "failed: " + record.failure.rstrip(".")
    if record.rests:
        return f"moves by {record.drift:.2g} m"
    errors = {"energy": record.energy_error, "momentum": record.momentum_error, "velocity": record.velocity_error}
    name, value = max(errors.items(), key=lambda item: abs(item[1] or 0.0))
    return f"{name} off by {abs(value or 0.0):.2g}"
