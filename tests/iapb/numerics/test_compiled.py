"""Blocks hand whole rooms of arrays to kernels; a kernel cannot allocate, and Python calls the
library's kernels."""

from __future__ import annotations

import subprocess
import sys
from typing import NamedTuple

import numba
import numpy as np
import pytest
from numba.core.errors import NumbaError

from iapb.building.bitcode import BlockType, dispatcher_of
from iapb.numerics.compiled import Block, block, kinds_of
from iapb.numerics.library import library
from iapb.numerics.linalg import cholesky


def growing_list(x):
    made = [x[0]]
    made.append(x[1])
    return made[-1]


ALLOCATE = [lambda x: np.zeros(3)[0], lambda x: (x + x)[0], growing_list]


@pytest.mark.parametrize("function", ALLOCATE)
def test_a_kernel_that_would_allocate_does_not_compile(function):
    with pytest.raises(NumbaError):
        dispatcher_of(function).compile((numba.float64[::1],))


@pytest.mark.parametrize(
    "function", [lambda x: x[1:][0], lambda x: (x[0], x[1])[1]]
)  # neither a slice nor a tuple
def test_a_kernel_without_allocation_compiles_without_fastmath(function):
    dispatcher = dispatcher_of(function)
    dispatcher.compile((numba.float64[::1],))
    assert dispatcher.overloads and dispatcher.targetoptions["fastmath"] is False


@numba.njit
def largest_pivot(matrix, lower):
    cholesky(matrix, lower)
    return lower[0, 0]


def test_a_kernel_of_a_user_calls_those_of_the_engine():
    assert largest_pivot(np.diag([9.0, 4.0]), np.zeros((2, 2))) == 3.0


def test_a_kernel_runs_as_python_for_kinds_of_arguments_that_the_library_has_not():
    lower = np.zeros((2, 2), np.float32)
    assert cholesky(np.diag([9.0, 4.0]).astype(np.float32), lower) == 0 and lower[1, 1] == 2.0
    assert library().entry(cholesky.name, kinds_of([lower, lower])) is None


WORK = """
from iapb.numerics.compiled import Kernel

as_python, found_in_library = set(), Kernel.find

def find(kernel, kinds):
    found = found_in_library(kernel, kinds)
    if found is kernel.function:
        as_python.add(f"{kernel.name}({kinds})")
    return found

Kernel.find = find

import numpy as np
from iapb import find_scene, load_scene, simulate
from verification.certificate import certify
from iapb.advice.checks import check_scene
from iapb.contact.impact import resolve_frictional_impact, resolve_impact, resolve_impacts
from iapb.scene import scene_names
from iapb.system import coupling_of
from verification.laws.bulk import judged_impacts

for name in scene_names():
    scene = load_scene(find_scene(name))
    check_scene(scene)
    for world in ("IAPB", "PB"):
        run = simulate(scene, world=world, steps=60)
        run.pose, run.energy
    certify(simulate(scene, steps=60))
matrix, v = np.eye(2), np.array([-1.0, -1.0])
resolve_impact(matrix.T, [[1, 0]], v[::-1], [0.5])
resolve_impact(matrix, matrix, v, [0.5, 0.25])
resolve_impacts(matrix[None], matrix[None], v[None], 0.5)
resolve_frictional_impact(matrix, matrix[:1], matrix[1:], v, 0.5, 0.1)
judged_impacts("light directions", 20)
print(sorted(as_python))
"""


def test_python_calls_the_library_alone():
    """Else a kernel would run as Python, a hundred times as slow, with nobody the wiser.

    In a process of its own: in this one the kernels have been found already.
    """
    done = subprocess.run([sys.executable, "-c", WORK], capture_output=True, text=True)
    assert done.stdout == "[]\n", done.stderr


class Inner(NamedTuple):
    flag: bool
    table: np.ndarray  # (n, m)


class Outer(NamedTuple):
    count: int
    inner: Inner
    small: np.ndarray


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
    assert len(churn) == 200 and made.inner.table[-1, -1] == 1.0


def test_a_block_is_made_once_and_has_the_names_of_its_content_alone():
    made = block(outer()._asdict())
    assert block(made) is made and isinstance(made.inner, Block) and made.count == 3
    with pytest.raises(AttributeError):
        made.nothing  # noqa: B018
    with pytest.raises(NumbaError, match="nothing"):
        dispatcher_of(lambda b: b.nothing).compile((numba.typeof(made),))


def test_kinds_of_blocks_differ_where_their_members_do():
    same = block(outer())
    other = block(outer(small=np.array([300], np.int64)))
    assert block(outer(count=9, inner=Inner(False, np.ones((5, 1))))).kind_name == same.kind_name
    assert other.kind_name != same.kind_name
    assert isinstance(numba.typeof(same), BlockType) and numba.typeof(same) != numba.typeof(other)
