"""The engine gives the same bits with any BLAS kernel, any instruction set of numpy, any code of
the C library."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from tests.iapb import same_bits

SETTINGS = {
    "a processor of 2004": {
        "OPENBLAS_CORETYPE": "Prescott",
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA",
        "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4",
    },
    "a processor of 2013": {"OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": "X86_V4"},
}


def _hashes(settings: dict[str, str]) -> dict[str, str]:
    command = [sys.executable, same_bits.__file__]
    done = subprocess.run(
        command, env=os.environ | settings, capture_output=True, text=True, check=True
    )
    return dict(json.loads(done.stdout))


@pytest.fixture(scope="module")
def here() -> dict[str, str]:
    """Hashes under the settings of the tests."""
    return same_bits.hashes()


@pytest.mark.parametrize("setting", SETTINGS)
def test_runs_and_impacts_have_the_same_bits(setting: str, here: dict[str, str]) -> None:
    assert _hashes(SETTINGS[setting]) == here
