"""What every test shares: the hypothesis profiles, and how interpreted kernels overflow."""

from __future__ import annotations

import os

os.environ.setdefault("IAPB_COMPILE", "whole")  # many scenes share one set of kernels; a test of its own compiles less

import numpy as np
from hypothesis import HealthCheck, settings
from numba.core import config

# No deadline in any profile: the first call of a compiled kernel takes seconds, the next one microseconds.
settings.register_profile(
    "quick", deadline=None, max_examples=60, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile(
    "deep", deadline=None, max_examples=3000, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile(os.environ.get("IAPB_HYPOTHESIS_PROFILE", "quick"))
if config.DISABLE_JIT:
    np.seterr(over="ignore", under="ignore", invalid="ignore")  # as silent as in compiled kernels
