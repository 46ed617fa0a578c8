"""Named impacts and motions on which solvers fail, each with source, reason, exact truth and a verdict per method."""

from __future__ import annotations

from typing import TYPE_CHECKING

from iapb.lazy import lazy_names

if TYPE_CHECKING:
    from verification.hard_cases.case import CaseAbsent as CaseAbsent
    from verification.hard_cases.case import HardCase as HardCase
    from verification.hard_cases.case import HardCaseVerdict as HardCaseVerdict
    from verification.hard_cases.case import TrajectoryCase as TrajectoryCase
    from verification.hard_cases.catalogue import HARD_CASES as HARD_CASES
    from verification.hard_cases.judge import judge_hard_case as judge_hard_case
    from verification.hard_cases.judge import judge_hard_cases as judge_hard_cases

_HOME = {
    "CaseAbsent": ".case",
    "HardCase": ".case",
    "TrajectoryCase": ".case",
    "HARD_CASES": ".catalogue",
    "HardCaseVerdict": ".case",
    "judge_hard_case": ".judge",
    "judge_hard_cases": ".judge",
}

__getattr__, __dir__, __all__ = lazy_names(__name__, _HOME)
