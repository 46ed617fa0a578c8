"""What every test shares: the hypothesis profiles, and how kernels overflow that run as Python."""

from __future__ import annotations

import os

import numpy as np
from hypothesis import HealthCheck, settings

from iapb.numerics.compiled import AS_PYTHON

# No deadline in any profile: a first call may load a package.
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
if AS_PYTHON:
    np.seterr(over="ignore", under="ignore", invalid="ignore")  # as silent as in compiled kernels
