"""Kernels that kernels call leave bitcode only, and the caller has all that it needs."""

from __future__ import annotations

from typing import Any

import llvmlite.binding as llvm
import numpy as np
import pytest
from numba.core import config

from iapb.inlining import compile_as_whole

pytestmark = pytest.mark.skipif(bool(config.DISABLE_JIT), reason="nothing is compiled")


# as the engine's, but not cached: from the cache nothing would be compiled
kernel = compile_as_whole


@kernel
def _square(x: float) -> float:
    return x * x


@kernel
def _never_squared(x: float) -> float:
    if len((x, x)) > 2:  # the optimiser sees that this is never so, the lowering does not
        return _square(x)
    return x


@kernel
def _squared_if(wanted: bool, x: float) -> float:
    return _square(x) if wanted else x


@kernel
def _entry(values: Any, k: int) -> Any:
    return values[k]


@kernel
def _sum(values: Any) -> Any:
    total = _never_squared(0.0) + _squared_if(False, 0.0)
    for k in range(values.shape[0]):
        total += _squared_if(True, _entry(values, k))
    return total - _entry(values, 0) * _entry(values, 0)


def test_the_caller_has_all_that_it_calls_and_only_it_becomes_machine_code() -> None:
    assert _sum(np.array([1.0, 2.0, 3.0])) == 4.0 + 9.0
    assert len(_sum.overloads) == 1 and not _square.overloads and not _squared_if.overloads and not _entry.overloads
    assert _entry(np.array([3, 4]), 1) == 4 and len(_entry.overloads) == 1  # Python can call the inner kernel, too


def test_what_is_not_inlined_has_no_name_that_another_library_could_be_given(monkeypatch: pytest.MonkeyPatch) -> None:
    """The loader would take it for its own of that name, though LLVM may have changed how it is called."""
    monkeypatch.setattr("iapb.inlining._INLINE_UP_TO", -10_000)
    caller = compile_as_whole(_sum.py_func)
    assert caller(np.array([1.0, 2.0])) == 4.0
    (version,) = caller.overloads.values()
    parts = [part for part in version.library._final_module.functions if not part.is_declaration]
    kept = [part for part in parts if "_sum" not in part.name]
    assert kept and all(part.linkage == llvm.Linkage.private for part in kept)
