"""Engines side by side on the fixed scenes: what each did with energy, momentum and overlap, at which settings."""

from verification.engines.record import EngineRecord
from verification.engines.study import SETTINGS, compare_engines, installed
from verification.engines.verdict import sentence, verdict

__all__ = ["SETTINGS", "EngineRecord", "compare_engines", "installed", "sentence", "verdict"]
