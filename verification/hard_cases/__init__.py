"""Named impacts that break solvers: each with its source, why it is hard, exact truth, and a verdict per method."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from verification.hard_cases.case import HardCase as HardCase
    from verification.hard_cases.catalogue import HARD_CASES as HARD_CASES
    from verification.hard_cases.verdict import HardCaseVerdict as HardCaseVerdict
    from verification.hard_cases.verdict import judge_hard_case as judge_hard_case
    from verification.hard_cases.verdict import judge_hard_cases as judge_hard_cases

_HOME = {
    "HardCase": "case",
    "HARD_CASES": "catalogue",
    "HardCaseVerdict": "verdict",
    "judge_hard_case": "verdict",
    "judge_hard_cases": "verdict",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'verification.hard_cases' has no attribute {name!r}")
    value = getattr(import_module(f"verification.hard_cases.{_HOME[name]}"), name)
    globals()[name] = value
    return value
