"""Compile kernels, and pass nested tuples of arrays to them as one pointer.

`kernel` compiles with numba, caches on disk, uses no fastmath and *no allocator*: `_nrt=False` leaves out the memory
runtime, so a kernel that would allocate does not compile. The compiler thus checks that kernels do not allocate.

`block` passes a NamedTuple of arrays, also a nested one, to kernels as one pointer. Numba passes a tuple member by
member, some 1,300 numbers for a whole world; a step then took 150 s to compile and 60 µs to run. With a pointer it
takes a tenth of the compile time and a hundredth of the run time. In Python a block has the attributes of its tuple.

Only what a scene calls for is compiled: a flag that is off (`flag`) is part of a block's type, and kernels that need it
are replaced by a constant. `IAPB_COMPILE=whole` compiles everything once for all scenes, which many scenes share.
"""

from __future__ import annotations

import ctypes
import hashlib
import inspect
import os
import struct
import warnings
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from llvmlite import ir
from numba import typeof
from numba.core import cgutils, config, imputils, types
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    infer_getattr,
    lower_getattr_generic,
    models,
    register_model,
    typeof_impl,
    unbox,
)

from iapb.inlining import compile_as_whole

# Files without kernels that decide what is compiled: how, and constants that kernels read.
_READ_BY_KERNELS = ("compiled.py", "inlining.py", "run.py", "joints.py", "arrays.py", "geometry.py")


def _stamped_files() -> list[Path]:
    """All files of the engine whose text decides what is compiled."""
    return [path for path in sorted(Path(__file__).parent.rglob("*.py"))
            if path.name in _READ_BY_KERNELS or b"@kernel" in path.read_bytes()]


def _source_stamp() -> str:
    """Hash these files. Numba alone would keep a cached kernel after a change of a kernel that it calls."""
    digest = hashlib.sha256()
    for path in _stamped_files():
        digest.update(str(path.relative_to(Path(__file__).parent)).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


_STAMP = _source_stamp()


def _stamp_of(function: Callable[..., Any]) -> str:
    """Hash the files that a kernel depends on: all kernels of the engine, and its own file if that lies elsewhere."""
    path = Path(inspect.getfile(function))
    if path.is_relative_to(Path(__file__).parent):
        return _STAMP
    return hashlib.sha256(_STAMP.encode() + path.read_bytes()).hexdigest()


class Absent:
    """A flag that is off, whose kernels are not compiled; false."""

    def __bool__(self) -> bool:
        return False

    def __int__(self) -> int:
        return 0


ABSENT = Absent()


def flag(on: bool) -> Any:
    """Return the value of a flag in a block; kernels that need a flag which is off are not compiled."""
    return True if on else False if os.environ.get("IAPB_COMPILE") == "whole" else ABSENT


def kernel(function: Callable[..., Any] | None = None, *, needs: str = "", otherwise: Any = None) -> Any:
    """Compile a function as a kernel (see the module's docstring), cached until a file with kernels changes.

    needs : flags (see `flag`), separated by blanks; if all are off in a block among the arguments, kernels that call
        this one get the constant `otherwise` in its place
    """
    if function is None:
        return partial(kernel, needs=needs, otherwise=otherwise)
    if config.DISABLE_JIT:
        return function
    flags = frozenset(needs.split())

    def is_absent(kinds: Sequence[types.Type]) -> bool:
        return bool(flags) and any(isinstance(kind, BlockType) and flags <= kind.absent for kind in kinds)

    compiled = compile_as_whole(function, is_absent, otherwise, fastmath=False, _nrt=False)
    try:
        compiled.enable_caching()
    except RuntimeError:  # no cache folder is writable, for example in a system-wide installation
        warnings.warn("kernels are compiled anew in each process, half a minute: neither the package's folder nor the "
                      "user's cache can be written; NUMBA_CACHE_DIR names one that can", stacklevel=1)  # fmt: skip
        return compiled
    compiled._cache._cache_file._source_stamp = _stamp_of(function)  # numba has no public way to say this
    return compiled


class Entry:
    """A kernel that Python calls again and again with arguments of one set of types.

    Numba looks up the type of each argument at each call, which takes about 5 µs for a block. An Entry does so only at
    its first call. The caller must keep the dtype, dimensions and layout of all arrays.
    """

    def __init__(self, function: Any) -> None:
        self._function = function
        self._compiled: Callable[..., Any] | None = function if config.DISABLE_JIT else None

    def __call__(self, *arguments: Any) -> Any:
        """Call the kernel."""
        if self._compiled is None:
            self._compiled = self.taking(*arguments)
        return self._compiled(*arguments)

    def taking(self, *examples: Any) -> Callable[..., Any]:
        """Return the machine code's own Python function for arguments of these types."""
        if config.DISABLE_JIT:
            return self._function
        kinds = self._function, tuple(_kind(example) for example in examples)
        if kinds not in _CODES:
            _CODES[kinds] = self._function.compile(kinds[1])
        return _CODES[kinds]


@kernel
def copy_into(target, source):
    """Do target[:] = source for vectors of equal length; a slice assignment might make a hidden copy."""
    for k in range(target.shape[0]):
        target[k] = source[k]


class AbsentType(types.Boolean):
    """Type of a flag that is off."""


_ABSENT_TYPE = AbsentType("absent")


class BlockType(types.Type):
    """Numba's type of a block: its fields, each with its type and its place (in words of 8 bytes); its absent flags."""

    def __init__(self, name: str, fields: tuple[tuple[str, types.Type], ...]) -> None:
        self.fields = fields
        places, words = [], 0
        for _, kind in fields:
            places.append(words)
            words += _words(kind)
        self.places = tuple(places)
        self.absent: frozenset[str] = frozenset(field for field, kind in fields if isinstance(kind, AbsentType)).union(
            *(kind.absent for _, kind in fields if isinstance(kind, BlockType)))
        super().__init__(f"{name}({', '.join(f'{field}: {kind}' for field, kind in fields)})")

    def find(self, name: str) -> tuple[types.Type, int]:
        """Type and place of a field."""
        for (field, kind), place in zip(self.fields, self.places, strict=True):
            if field == name:
                return kind, place
        raise AttributeError(name)


class Block:
    """A NamedTuple of arrays, numbers and further such tuples, laid out in memory for kernels.

    The block refers to the arrays and keeps them alive. Numbers are copied and cannot change.
    """

    block_type: BlockType
    address: int  # of the layout in memory

    def __init__(self, content: Any) -> None:
        members = [block(value) if _is_named_tuple(value) else value for value in content]
        self._content = content._replace(**dict(zip(content._fields, members, strict=True)))
        kinds = tuple(map(_kind, members))
        self.block_type = _block_type_of(type(content).__name__, content._fields, kinds)
        words = [word for member in members for word in _layout(member)]
        self._memory = np.array(words, dtype=np.int64)
        self.address = self._memory.ctypes.data

    def __reduce__(self) -> Any:
        """Refuse copy and pickle: a copy would hold the address of this block's memory."""
        raise TypeError("compiled state cannot be copied or pickled; start another Simulation of the scene")

    def arrays(self) -> list[np.ndarray]:
        """Return all arrays, including those of nested blocks."""
        nested = [member.arrays() for member in self._content if isinstance(member, Block)]
        return [*(member for member in self._content if isinstance(member, np.ndarray)), *chain(*nested)]

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # as when unpickling
            raise AttributeError(name)
        return getattr(self._content, name)


_CODES: dict[Any, Callable[..., Any]] = {}  # kernel and types -> its machine code


def columns(name: str, arrays: Mapping[str, Any]) -> Any:
    """Return a NamedTuple of named arrays, for `block`."""
    return _columns_of(name, tuple(arrays))(**arrays)


@cache
def _columns_of(name: str, fields: tuple[str, ...]) -> Any:
    """Make the class once: only the garbage collector frees a class, and a live loop switches the collector off."""
    return namedtuple(name, fields)


def block(content: Any) -> Any:
    """Lay a NamedTuple out for kernels; see the module's docstring."""
    return content if isinstance(content, Block) else Block(content)


def _is_named_tuple(value: Any) -> bool:
    return isinstance(value, tuple) and hasattr(value, "_fields")


# Cache of types: numba takes 20 µs to find the type of an array, and a simulation has hundreds.
_KINDS: dict[Any, types.Type] = {}
_NUMBERS = {bool: types.boolean, int: types.intp, float: types.float64}
_BLOCK_TYPES: dict[Any, tuple[BlockType, tuple[types.Type, ...]]] = {}


def _kind(value: Any) -> types.Type:
    if type(value) is np.ndarray:
        known = value.dtype.str, value.ndim, value.flags.num
        if known not in _KINDS:
            _KINDS[known] = typeof(value)
        return _KINDS[known]
    if isinstance(value, Block):
        return value.block_type
    if type(value) in _NUMBERS:
        return _NUMBERS[type(value)]
    if value is ABSENT:
        return _ABSENT_TYPE
    return types.boolean if isinstance(value, np.bool_) else typeof(value)


def _block_type_of(name: str, fields: tuple[str, ...], kinds: tuple[types.Type, ...]) -> BlockType:
    known = name, fields, tuple(map(id, kinds))
    if known not in _BLOCK_TYPES:  # the kinds are stored too, so that no other object gets their ids
        _BLOCK_TYPES[known] = BlockType(name, tuple(zip(fields, kinds, strict=True))), kinds
    return _BLOCK_TYPES[known][0]


def _words(kind: types.Type) -> int:
    """Return the number of words of a field: a pointer, a number, or numba's array structure (5, shape, strides)."""
    return 5 + 2 * kind.ndim if isinstance(kind, types.Array) else 1


def address_of(array: Any) -> int:
    """Return the address of an array's first entry, four times faster than numpy does."""
    try:
        return ctypes.addressof(_NOTHING.from_buffer(array))
    except (TypeError, ValueError, BufferError):  # read-only, or not in one piece
        place: int = array.__array_interface__["data"][0]
        return place


_NOTHING = ctypes.c_char * 0


def _layout(value: Any) -> list[int]:
    """Return a field as words. An array has no reference counter, for the block keeps it alive."""
    if isinstance(value, np.ndarray):
        place = address_of(value)
        return [0, 0, value.size, value.itemsize, place, *value.shape, *value.strides]
    if isinstance(value, Block):
        return [value.address]
    if isinstance(value, float):
        return list(struct.unpack("q", struct.pack("d", value)))
    return [int(value)]


@register_model(BlockType)
class _BlockModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: BlockType) -> None:
        super().__init__(manager, kind, ir.IntType(64).as_pointer())


@typeof_impl.register(Block)
def _block_type(value: Block, context: Any) -> BlockType:
    return value.block_type


@unbox(BlockType)
def _unbox_block(kind: BlockType, value: Any, context: Any) -> NativeValue:
    address = context.pyapi.object_getattr_string(value, "address")
    pointer = context.pyapi.long_as_voidptr(address)
    context.pyapi.decref(address)
    is_error = cgutils.is_not_null(context.builder, context.pyapi.err_occurred())
    return NativeValue(context.builder.bitcast(pointer, ir.IntType(64).as_pointer()), is_error=is_error)


@infer_getattr
class _BlockAttributes(AttributeTemplate):
    key = BlockType

    def generic_resolve(self, kind: BlockType, name: str) -> types.Type | None:
        found = dict(kind.fields).get(name)
        return types.boolean if isinstance(found, AbsentType) else found


@lower_getattr_generic(BlockType)
def _read_field(context: Any, builder: Any, kind: BlockType, value: Any, name: str) -> Any:
    """Load a field: an array structure, a nested block's address, or a number."""
    field, place = kind.find(name)
    word = builder.gep(value, [ir.Constant(ir.IntType(64), place)], inbounds=True)
    if isinstance(field, AbsentType):
        return context.get_constant(types.boolean, False)
    if isinstance(field, types.Boolean):
        result = builder.icmp_unsigned("!=", builder.load(word), ir.Constant(ir.IntType(64), 0))
    else:
        result = builder.load(builder.bitcast(word, context.get_value_type(field).as_pointer()))
    return imputils.impl_ret_borrowed(context, builder, field, result)
