"""A kernel has all that it calls, and shares no name with other libraries."""

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


def test_what_a_kernel_calls_is_inlined_or_has_no_name_for_other_libraries(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The loader would take it for its own of that name, though LLVM may have changed how it is
    called."""
    monkeypatch.setattr("iapb.inlining._INLINE_UP_TO", -10_000)
    caller = compile_as_whole(_sum.py_func)
    assert caller(np.array([1.0, 2.0])) == 4.0
    (version,) = caller.overloads.values()
    parts = [part for part in version.library._final_module.functions if not part.is_declaration]
    kept = [part for part in parts if "_sum" not in part.name]
    assert kept and all(part.linkage == llvm.Linkage.private for part in kept)
