"""Run kernels from the engine's library, and pass nested tuples of arrays to them as one pointer.

`kernel` marks a function as a kernel: it allocates nothing, calls only kernels, and gives no index
below zero.
`iapb.building` compiles each kernel that Python calls, with all kernels that it needs, into one
shared library when the package is built. A call from Python then runs the library's code. It is
compiled for given kinds of arguments; for any others the kernel runs as Python, with the same bits.
With ``NUMBA_DISABLE_JIT=1`` every kernel runs as Python.

`block` lays a NamedTuple or dict of arrays out in memory, also a nested one, so that a kernel takes
a whole world as one pointer. In Python a block has the attributes of its content.
"""

from __future__ import annotations

import hashlib
import os
import struct
from collections.abc import Callable
from functools import cache, update_wrapper
from typing import Any

import numpy as np

from iapb.numerics.library import library, words_of_array

AS_PYTHON = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")


class Kernel:
    """A function that the library runs for the kinds of arguments that it was compiled for."""

    def __init__(self, function: Callable[..., Any]) -> None:
        update_wrapper(self, function)
        self.function = function
        self._found: dict[str, Callable[..., Any]] = {}

    def __call__(self, *arguments: Any) -> Any:
        """Call the kernel."""
        return self.taking(*arguments)(*arguments)

    def taking(self, *examples: Any) -> Callable[..., Any]:
        """Return the function for arguments of the examples' kinds; it does not check them."""
        kinds = kinds_of(examples)
        if kinds not in self._found:
            self._found[kinds] = self.find(kinds)
        return self._found[kinds]

    def find(self, kinds: str) -> Callable[..., Any]:
        """Return the library's function for these kinds, or the Python function if it has none."""
        return library().entry(self.name, kinds) or self.function

    @property
    def name(self) -> str:
        """Module and name."""
        return f"{self.function.__module__}.{self.function.__name__}"


def kernel(function: Callable[..., Any]) -> Any:
    """Mark a function as a kernel (see the module's docstring)."""
    return function if AS_PYTHON else Kernel(function)


class Entry:
    """A kernel that Python always calls with the same kinds of arguments; it looks at them once.

    The caller keeps to the dtype, dimensions and layout of all arrays of the first call.
    """

    def __init__(self, kernel: Any) -> None:
        self._kernel = kernel
        self._function: Callable[..., Any] | None = None

    def __call__(self, *arguments: Any) -> Any:
        """Call the kernel."""
        if self._function is None:
            kernel = self._kernel
            self._function = kernel if AS_PYTHON else kernel.taking(*arguments)
        return self._function(*arguments)


@kernel
def copy_into(target, source):
    """Do target[:] = source for vectors of equal length; a slice assignment might make a hidden
    copy."""
    for k in range(len(target)):
        target[k] = source[k]


class Block:
    """A NamedTuple or dict of arrays, numbers and further such content, laid out in memory for
    kernels.

    The block refers to the arrays and keeps them alive. Numbers are copied and cannot change.

    Attributes
    ----------
    members : the content by name; nested content is a block
    kind_name : name of the type, with a hash of the names and kinds of the members
    address : of the memory
    """

    def __init__(self, content: Any) -> None:
        given = content if isinstance(content, dict) else content._asdict()
        self.members = {name: _member(value) for name, value in given.items()}
        vars(self).update(self.members)
        self.kind_name = _kind_name(
            type(content).__name__, tuple(self.members), kinds_of(self.members.values())
        )
        words = [word for value in self.members.values() for word in words_of(value)]
        self._memory = np.array(words, np.int64)
        self.address = self._memory.ctypes.data

    def __reduce__(self) -> Any:
        """Refuse copy and pickle: a copy would hold the address of this block's memory."""
        raise TypeError(
            "compiled state cannot be copied or pickled; start another Simulation of the scene"
        )

    def arrays(self) -> list[np.ndarray]:
        """Return all arrays, including those of nested blocks."""
        found = [value for value in self.members.values() if isinstance(value, np.ndarray)]
        nested = [value for value in self.members.values() if isinstance(value, Block)]
        return found + [array for each in nested for array in each.arrays()]


def block(content: Any) -> Any:
    """Lay a NamedTuple or a dict out for kernels; see the module's docstring."""
    return content if isinstance(content, Block) else Block(content)


def _member(value: Any) -> Any:
    return block(value) if isinstance(value, dict) or hasattr(value, "_fields") else value


@cache
def _kind_name(name: str, members: tuple[str, ...], kinds: str) -> str:
    content = f"{members} {kinds}".encode()
    return f"{name}_{hashlib.blake2b(content, digest_size=8).hexdigest()}"


def kinds_of(values: Any) -> str:
    """Return the kinds of arguments, or of the members of a block, as one text."""
    return ", ".join([kind_of(value) for value in values])


def kind_of(value: Any) -> str:
    """Return the kind of an argument. Two values of one kind have the same layout in memory."""
    if isinstance(value, np.ndarray):
        return _array_kind(value.dtype.str, value.ndim, value.flags.c_contiguous)
    if isinstance(value, Block):
        return value.kind_name
    if isinstance(value, bool | np.bool_):
        return "bool"
    if isinstance(value, int | np.integer):
        return "int"
    if isinstance(value, float):
        return "float"
    return type(value).__name__


@cache
def _array_kind(dtype: str, dimensions: int, contiguous: bool) -> str:
    return f"{dtype}[{dimensions}{'' if contiguous else ', strided'}]"


def words_of(value: Any) -> tuple[int, ...]:
    """Return an argument as words of 8 bytes. The caller keeps its arrays alive."""
    if isinstance(value, np.ndarray):
        return words_of_array(value)
    if isinstance(value, Block):
        return (value.address,)
    if isinstance(value, float):
        return struct.unpack("q", struct.pack("d", value))
    return (int(value),)
