"""Blocks hand whole rooms of arrays to kernels; kernels cannot allocate, and that is checked by the compiler."""

from __future__ import annotations

import ast
import gc
import importlib.util
import math
import pickle
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit
from numba.core.errors import NumbaError

import iapb.run
from iapb.compiled import (
    _STAMP,
    Block,
    _source_stamp,
    _stamped_files,
    address_of,
    block,
    copy_into,
    flag,
    kernel,
)

ENGINE = Path(iapb.run.__file__).parent


def zeros(x):
    made = np.zeros(3)
    made[0] = x[0]
    return made[0]


def empty_like(x):
    made = np.empty_like(x)
    made[0] = x[0]
    return made[0]


def copy(x):
    return x.copy()[0]


def expression(x):
    return (x + x)[0]


def fancy(x):
    return x[x > 0.0][0]


def growing_list(x):
    made = [x[0]]
    made.append(x[1])
    return made[-1]


def view(x):
    """A slice is no allocation."""
    return x[1:][0]


def tuples(x):
    """Nor is a tuple."""
    y = (x[0], x[1])
    return y[0] + y[1]


@pytest.mark.parametrize("function", [zeros, empty_like, copy, expression, fancy, growing_list])
def test_a_kernel_that_would_allocate_does_not_compile(function):
    x = np.array([1.0, 2.0, 3.0])
    assert njit(function)(x) == function(x)  # numba itself would
    with pytest.raises(NumbaError):
        kernel(function)(x)


@pytest.mark.parametrize("function", [view, tuples])
def test_a_kernel_without_allocation_compiles(function):
    x = np.array([1.0, 2.0, 3.0])
    assert kernel(function)(x) == function(x)


def test_kernels_are_compiled_without_fastmath_and_call_no_blas():
    dots = (ast.MatMult,)
    for path in ENGINE.rglob("*.py"):
        if "kernels" not in path.parts and path.name != "kernels.py":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            assert not (isinstance(node, ast.BinOp) and isinstance(node.op, dots)), path
            assert not (isinstance(node, ast.Attribute) and node.attr in ("dot", "linalg", "matmul", "einsum")), path
            assert not (isinstance(node, ast.keyword) and node.arg == "fastmath"), path
    assert kernel(view).targetoptions["fastmath"] is False


# --- blocks -----------------------------------------------------------------------------------------------------------


class Inner(NamedTuple):
    flag: bool
    table: np.ndarray  # (n, m)


class Outer(NamedTuple):
    count: int
    inner: Inner
    weight: float
    vector: np.ndarray
    mask: np.ndarray
    small: np.ndarray


@kernel
def read(b, out):
    out[0] = b.count
    out[1] = b.weight
    out[2] = 1.0 if b.inner.flag else 0.0
    out[3] = b.inner.table.shape[0]
    out[4] = b.inner.table.shape[1]
    total = 0.0
    for i in range(b.inner.table.shape[0]):
        for j in range(b.inner.table.shape[1]):
            total += (i + 1) * (j + 2) * b.inner.table[i, j]
    out[5] = total
    out[6] = b.vector[-1]
    hits = 0
    for k in range(b.mask.shape[0]):
        if b.mask[k]:
            hits += k + 1
    out[7] = hits
    out[8] = b.small[0]


@kernel
def write(b):
    b.vector[0] = 42.0
    b.inner.table[0, 0] = -1.0
    b.mask[0] = not b.mask[0]


def outer(count=3, flag=True, weight=0.5, shape=(2, 3), mask=(True, False, True)):
    table = np.arange(float(math.prod(shape))).reshape(shape)
    return Outer(count, Inner(flag, table), weight, np.array([1.5, -2.5]), np.array(mask), np.array([7], np.int8))


@given(st.integers(-(2**62), 2**62), st.booleans(), st.floats(allow_nan=False), st.tuples(*[st.integers(1, 4)] * 2),
       st.lists(st.booleans(), min_size=1, max_size=5))
def test_a_kernel_reads_from_a_block_what_python_reads(count, flag, weight, shape, mask):
    made, out = block(outer(count, flag, weight, shape, mask)), np.zeros(9)
    read(made, out)
    table = made.inner.table
    total = sum((i + 1) * (j + 2) * table[i, j] for i in range(shape[0]) for j in range(shape[1]))
    hits = sum(k + 1 for k, on in enumerate(mask) if on)
    assert out.tolist() == [float(count), weight, float(flag), *shape, total, -2.5, hits, 7.0]


def test_a_kernel_writes_to_the_arrays_themselves():
    plain = outer()
    write(block(plain))
    assert plain.vector[0] == 42.0 and plain.inner.table[0, 0] == -1.0 and not plain.mask[0]


def test_a_block_keeps_its_arrays_alive():
    made, out = block(outer(shape=(60, 60))), np.zeros(9)
    gc.collect()
    churn = [np.full(3600, np.nan) for _ in range(200)]
    read(made, out)
    assert len(churn) == 200 and np.isfinite(out).all() and out[3] == 60


def test_a_block_is_made_once_and_has_the_tuples_names_alone():
    made = block(outer())
    assert block(made) is made and isinstance(made.inner, Block)
    with pytest.raises(AttributeError):
        made.nothing  # noqa: B018
    with pytest.raises(NumbaError, match="nothing"):
        kernel(lambda b: b.nothing)(made)


def test_types_of_blocks_differ_where_their_fields_do_and_survive_a_file():
    same, other = block(outer()), block(outer()._replace(small=np.array([7], np.int64)))
    assert block(outer(count=9, shape=(5, 1))).block_type == same.block_type
    assert other.block_type != same.block_type
    out = np.zeros(9)
    read(other, out)
    assert out[8] == 7.0  # compiled anew, with another width
    assert pickle.loads(pickle.dumps(same.block_type)) == same.block_type


@given(st.lists(st.floats(allow_nan=False), max_size=6))
def test_copy_into_copies(values):
    source, target = np.array(values, float), np.zeros(len(values))
    copy_into(target, source)
    assert np.array_equal(source, target)


def test_the_stamp_of_kernels_covers_every_file_whose_constants_they_read():
    """Else a changed constant would leave the machine code made with the old one in use."""
    stamped = set(_stamped_files())
    assert stamped >= {ENGINE / name for name in ("contact/geometry.py", "run.py", "compiled.py", "inlining.py")}
    assert _read_by_kernels() - stamped == set()


def _read_by_kernels() -> set[Path]:
    """Files of the engine with a kernel, or with what a kernel reads: constants, and what these are made of."""
    trees = {path: ast.parse(path.read_text()) for path in ENGINE.rglob("*.py")}
    open_ = [(path, node.name) for path, tree in trees.items() for node in tree.body
             if isinstance(node, ast.FunctionDef) and "kernel" in map(ast.unparse, node.decorator_list)]
    seen = set()
    while open_:
        path, name = open_.pop()
        if (path, name) in seen:
            continue
        seen.add((path, name))
        for node in trees[path].body:
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("iapb"):
                module = ENGINE.parent.joinpath(*str(node.module).split("."))
                home = module.with_suffix(".py") if module.with_suffix(".py") in trees else module / "__init__.py"
                open_ += [(home, each.name) for each in node.names if (each.asname or each.name) == name]
            elif (isinstance(node, ast.Assign | ast.AnnAssign) and name in _names(node)) or (
                    isinstance(node, ast.FunctionDef) and node.name == name):
                open_ += [(path, each) for each in _names(node)]
    return {path for path, _ in seen}


def test_a_change_of_any_stamped_file_changes_the_stamp(monkeypatch: pytest.MonkeyPatch) -> None:
    before, read, files = _source_stamp(), Path.read_bytes, _stamped_files()
    for changed in files:
        monkeypatch.setattr(Path, "read_bytes", lambda path, changed=changed: read(path) + b"#" * (path == changed))
        assert _source_stamp() != before, changed
    monkeypatch.undo()
    assert len(files) > 20 and _source_stamp() == before == _STAMP


def _names(node: ast.AST) -> set[str]:
    return {each.id for each in ast.walk(node) if isinstance(each, ast.Name)}


def test_a_kernel_outside_the_engine_is_compiled_anew_when_its_own_file_changes(tmp_path):
    path, x = tmp_path / "own_kernel.py", np.array([2.0])
    for factor in (3.0, 5.0):
        path.write_text(f"from iapb.compiled import kernel\n\n\n@kernel\ndef scaled(x):\n    return {factor} * x[0]\n")
        spec = importlib.util.spec_from_file_location("own_kernel", path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        assert module.scaled(x) == factor * 2.0


def test_the_address_of_an_array_is_that_of_its_first_entry() -> None:
    whole = np.arange(12.0).reshape(3, 4)
    fixed = whole.copy()
    fixed.setflags(write=False)
    for array in (whole, whole[1:], whole[:, 1:], whole.T, fixed, np.zeros((0, 3)), np.zeros((2, 0)), np.ones(3, bool)):
        assert address_of(array) == array.__array_interface__["data"][0]


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
def test_a_kernel_whose_flags_are_all_off_is_not_compiled(how: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("IAPB_COMPILE", how)
    found = {(a, b): calling(block(Flags(flag(a), flag(b))), 3) for a in (False, True) for b in (False, True)}
    off = -1 if how == "lean" else 3
    assert found == {(False, False): off, (False, True): 3, (True, False): 13, (True, True): 13}
