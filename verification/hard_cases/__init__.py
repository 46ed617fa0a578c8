"""Named impacts and motions that break solvers: each with source, reason, certain truth, and a verdict per method."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from verification.hard_cases.case import CaseAbsent as CaseAbsent
    from verification.hard_cases.case import HardCase as HardCase
    from verification.hard_cases.case import TrajectoryCase as TrajectoryCase
    from verification.hard_cases.catalogue import HARD_CASES as HARD_CASES
    from verification.hard_cases.judge import judge_hard_case as judge_hard_case
    from verification.hard_cases.judge import judge_hard_cases as judge_hard_cases
    from verification.hard_cases.verdict import HardCaseVerdict as HardCaseVerdict

_HOME = {
    "CaseAbsent": "case",
    "HardCase": "case",
    "TrajectoryCase": "case",
    "HARD_CASES": "catalogue",
    "HardCaseVerdict": "verdict",
    "judge_hard_case": "judge",
    "judge_hard_cases": "judge",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'verification.hard_cases' has no attribute {name!r}")
    value = getattr(import_module(f"verification.hard_cases.{_HOME[name]}"), name)
    globals()[name] = value
    return value
