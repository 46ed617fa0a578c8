"""What every test shares: the hypothesis profiles, how interpreted kernels overflow, who
compiles."""

from __future__ import annotations

import os

os.environ.setdefault(
    "IAPB_COMPILE", "whole"
)  # many scenes share one set of kernels; a test of its own compiles less

from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import HealthCheck, settings
from numba.core import config
from numba.core.dispatcher import Dispatcher

# No deadline in any profile: the first call of a compiled kernel takes seconds, the next one
# microseconds.
settings.register_profile(
    "quick",
    deadline=None,
    max_examples=60,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.register_profile(
    "deep", deadline=None, max_examples=3000, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile(os.environ.get("IAPB_HYPOTHESIS_PROFILE", "quick"))
if config.DISABLE_JIT:
    np.seterr(over="ignore", under="ignore", invalid="ignore")  # as silent as in compiled kernels


def compile_alone(dispatcher: Any, signature: Any, plain: Any = Dispatcher.compile) -> Any:
    """Compile a kernel of the engine while no other worker does: the others wait, and read it from
    numba's cache."""
    import fcntl

    if dispatcher._cache.cache_path is None or not dispatcher.py_func.__module__.startswith(
        "iapb."
    ):
        return plain(dispatcher, signature)
    folder = Path(dispatcher._cache.cache_path)
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / f"{dispatcher.py_func.__qualname__}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        return plain(dispatcher, signature)


if "PYTEST_XDIST_WORKER" in os.environ:
    Dispatcher.compile = compile_alone
