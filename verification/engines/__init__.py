"""Compare engines on the fixed scenes by energy, momentum and overlap, at two choices of settings."""

from verification.engines.record import EngineRecord
from verification.engines.study import SETTINGS, compare_engines, installed
from verification.engines.verdict import sentence, verdict

__all__ = ["SETTINGS", "EngineRecord", "compare_engines", "installed", "sentence", "verdict"]
