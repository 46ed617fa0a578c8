"""Named impacts and motions on which solvers fail, each with source, reason, exact truth and a
verdict per method."""

from verification.hard_cases.case import HardCase as HardCase
from verification.hard_cases.case import TrajectoryCase as TrajectoryCase
from verification.hard_cases.catalogue import HARD_CASES as HARD_CASES
from verification.hard_cases.judge import judge_hard_case as judge_hard_case
