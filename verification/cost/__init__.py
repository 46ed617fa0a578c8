"""What accuracy a method gives for its time: problems, methods, measurement. Records only."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from verification.cost.kernels import KernelTime as KernelTime
    from verification.cost.kernels import kernel_times as kernel_times
    from verification.cost.measure import Measurement as Measurement
    from verification.cost.measure import Quartiles as Quartiles
    from verification.cost.measure import work_precision as work_precision
    from verification.cost.methods import METHODS as METHODS
    from verification.cost.problems import TimedProblem as TimedProblem
    from verification.cost.problems import timed_problems as timed_problems

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
        raise AttributeError(f"module 'verification.cost' has no attribute {name!r}")
    value = getattr(import_module(f"verification.cost.{_HOME[name]}"), name)
    globals()[name] = value
    return value
