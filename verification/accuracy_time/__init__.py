"""What accuracy a method gives for its time: problems, methods, measurement. Records only."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from verification.accuracy_time.kernels import KernelTime as KernelTime
    from verification.accuracy_time.kernels import kernel_times as kernel_times
    from verification.accuracy_time.measure import Measurement as Measurement
    from verification.accuracy_time.measure import Quartiles as Quartiles
    from verification.accuracy_time.measure import work_precision as work_precision
    from verification.accuracy_time.methods import METHODS as METHODS
    from verification.accuracy_time.problems import TimedProblem as TimedProblem
    from verification.accuracy_time.problems import timed_problems as timed_problems

_HOME = {
    "KernelTime": "kernels",
    "kernel_times": "kernels",
    "Measurement": "measure",
    "Quartiles": "measure",
    "work_precision": "measure",
    "METHODS": "methods",
    "TimedProblem": "problems",
    "timed_problems": "problems",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'verification.accuracy_time' has no attribute {name!r}")
    value = getattr(import_module(f"verification.accuracy_time.{_HOME[name]}"), name)
    globals()[name] = value
    return value
