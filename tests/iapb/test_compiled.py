"""Blocks hand whole rooms of arrays to kernels; kernels cannot allocate, and that is checked by the
compiler."""

from __future__ import annotations

import ast
import importlib.util
import pickle
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numba.core.errors import NumbaError

import iapb.run
from iapb.compiled import Block, _stamped_files, block, flag, kernel

ENGINE = Path(iapb.run.__file__).parent


def growing_list(x):
    made = [x[0]]
    made.append(x[1])
    return made[-1]


ALLOCATE = [lambda x: np.zeros(3)[0], lambda x: (x + x)[0], growing_list]


@pytest.mark.parametrize("function", ALLOCATE)
def test_a_kernel_that_would_allocate_does_not_compile(function):
    with pytest.raises(NumbaError):
        kernel(function)(np.array([1.0, 2.0, 3.0]))


@pytest.mark.parametrize(
    "function", [lambda x: x[1:][0], lambda x: (x[0], x[1])[1]]
)  # neither a slice nor a tuple
def test_a_kernel_without_allocation_compiles_without_fastmath(function):
    x = np.array([1.0, 2.0, 3.0])
    assert (
        kernel(function)(x) == function(x) and kernel(function).targetoptions["fastmath"] is False
    )


# --- blocks
# -----------------------------------------------------------------------------------------------------------


class Inner(NamedTuple):
    flag: bool
    table: np.ndarray  # (n, m)


class Outer(NamedTuple):
    count: int
    inner: Inner
    small: np.ndarray


@kernel
def read(b):
    return b.inner.table[-1, -1] + b.small[0] + b.inner.flag


def outer(**values):
    given = {
        "count": 3,
        "inner": Inner(True, np.arange(6.0).reshape(2, 3)),
        "small": np.array([7], np.int8),
    }
    return Outer(**given | values)


def test_a_block_keeps_its_arrays_alive():
    made = block(outer(inner=Inner(True, np.ones((60, 60)))))
    churn = [np.full(3600, np.nan) for _ in range(200)]
    assert len(churn) == 200 and read(made) == 9.0


def test_a_block_is_made_once_and_has_the_names_of_its_content_alone():
    made = block(outer()._asdict())
    assert block(made) is made and isinstance(made.inner, Block) and made.count == 3
    with pytest.raises(AttributeError):
        made.nothing  # noqa: B018
    with pytest.raises(NumbaError, match="nothing"):
        kernel(lambda b: b.nothing)(made)


def test_types_of_blocks_differ_where_their_fields_do_and_survive_a_file():
    same, other = block(outer()), block(outer(small=np.array([300], np.int64)))
    assert block(outer(count=9, inner=Inner(False, np.ones((5, 1))))).block_type == same.block_type
    assert other.block_type != same.block_type
    assert read(other) == 306.0  # compiled anew, with another width
    assert pickle.loads(pickle.dumps(same.block_type)) == same.block_type


def test_the_stamp_of_kernels_covers_every_file_whose_constants_they_read():
    """Else a changed constant would leave the machine code made with the old one in use."""
    stamped = set(_stamped_files())
    assert stamped >= {
        ENGINE / name for name in ("contact/geometry.py", "run.py", "compiled.py", "inlining.py")
    }
    for path in stamped:
        for node in ast.walk(ast.parse(path.read_text())):
            constants = [
                name.name
                for name in getattr(node, "names", ())
                if isinstance(node, ast.ImportFrom)
                and str(node.module).startswith("iapb")
                and name.name.lstrip("_").isupper()
            ]
            home = ENGINE.parent.joinpath(*str(getattr(node, "module", "")).split(".")).with_suffix(
                ".py"
            )
            assert home in stamped or set(constants) <= {"FORCES"}, (
                path,
                constants,
            )  # those Python reads


def test_a_kernel_outside_the_engine_is_compiled_anew_when_its_own_file_changes(tmp_path):
    path, x = tmp_path / "own_kernel.py", np.array([2.0])
    for factor in (3.0, 5.0):
        path.write_text(
            f"from iapb.compiled import kernel\n\n\n@kernel\ndef scaled(x):\n    return {factor} * x[0]\n"
        )
        spec = importlib.util.spec_from_file_location("own_kernel", path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        assert module.scaled(x) == factor * 2.0


class Flags(NamedTuple):
    first: Any
    second: Any


@kernel(needs="first second", otherwise=-1)
def needing(flags, x):
    return x


@kernel
def calling(flags, x):
    return needing(flags, x) + (10 if flags.first else 0)


@pytest.mark.parametrize("how", ["lean", "whole"])
def test_a_kernel_whose_flags_are_all_off_is_not_compiled(
    how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("IAPB_COMPILE", how)
    found = {
        (a, b): calling(block(Flags(flag(a), flag(b))), 3)
        for a in (False, True)
        for b in (False, True)
    }
    off = -1 if how == "lean" else 3
    assert found == {(False, False): off, (False, True): 3, (True, False): 13, (True, True): 13}
