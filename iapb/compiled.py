"""Compile kernels, and pass nested tuples of arrays to them as one pointer.

`kernel` compiles with numba, caches on disk, uses no fastmath and *no allocator*: `_nrt=False`
leaves out the memory runtime, so a kernel that would allocate does not compile. The compiler thus
checks that kernels do not allocate.

`block` passes a NamedTuple or dict of arrays, also a nested one, to kernels as one pointer. Numba
passes a tuple member by member, some 1,300 numbers for a whole world; a step then took 150 s to
compile and 60 µs to run. With a pointer it takes a tenth of the compile time and a hundredth of the
run time. In Python a block has the attributes of its content.

Only what a scene calls for is compiled: a flag that is off (`flag`) is part of a block's type, and
kernels that need it are replaced by a constant. `IAPB_COMPILE=whole` compiles everything once for
all scenes, which many scenes share.
"""

from __future__ import annotations

import gc
import hashlib
import inspect
import os
import warnings
from collections.abc import Callable, Sequence
from functools import cache, partial
from itertools import accumulate
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

from iapb.compiling import compiling_told, to_stderr
from iapb.inlining import compile_as_whole

# Files without kernels that decide what is compiled: how, and constants that kernels read.
_READ_BY_KERNELS = ("compiled.py", "inlining.py", "run.py", "joints.py", "arrays.py", "geometry.py")


def _stamped_files() -> list[Path]:
    """All files of the engine whose text decides what is compiled."""
    return [
        path
        for path in sorted(Path(__file__).parent.rglob("*.py"))
        if path.name in _READ_BY_KERNELS or b"@kernel" in path.read_bytes()
    ]


# Numba alone would keep a cached kernel after a change of a kernel that it calls.
_STAMP = hashlib.sha256(
    b"\0".join(b"%s %s" % (path.name.encode(), path.read_bytes()) for path in _stamped_files())
)


def _stamp_of(function: Callable[..., Any]) -> str:
    """Hash the files that a kernel depends on: those of the engine, and its own file if that lies
    elsewhere."""
    path, digest = Path(inspect.getfile(function)), _STAMP.copy()
    if not path.is_relative_to(Path(__file__).parent):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def flag(on: bool) -> Any:
    """Return the value of a flag in a block; kernels that need a flag which is off, None, are not
    compiled."""
    return True if on else False if os.environ.get("IAPB_COMPILE") == "whole" else None


def kernel(
    function: Callable[..., Any] | None = None, *, needs: str = "", otherwise: Any = None
) -> Any:
    """Compile a function as a kernel (see the module's docstring), cached until a file with kernels
    changes.

    needs : flags (see `flag`), separated by blanks; if all are off in a block among the arguments,
        kernels that call this one get the constant `otherwise` in its place
    """
    if function is None:
        return partial(kernel, needs=needs, otherwise=otherwise)
    if config.DISABLE_JIT:
        return function
    flags = frozenset(needs.split())

    def is_absent(kinds: Sequence[types.Type]) -> bool:
        return bool(flags) and any(
            isinstance(kind, BlockType) and flags <= kind.absent for kind in kinds
        )

    compiled = compile_as_whole(function, is_absent, otherwise, fastmath=False, _nrt=False)
    try:
        compiled.enable_caching()
    except RuntimeError:  # no cache folder is writable, for example in a system-wide installation
        warnings.warn(
            "kernels are compiled anew in each process, half a minute: neither the package's "
            "folder nor the "
            "user's cache can be written; NUMBA_CACHE_DIR names one that can",
            stacklevel=1,
        )
        return compiled
    compiled._cache._cache_file._source_stamp = _stamp_of(
        function
    )  # numba has no public way to say this
    return compiled


class Entry:
    """A kernel that Python calls again and again with arguments of one set of types.

    Numba looks up the type of each argument at each call, which takes about 5 µs for a block. An
    Entry does so only at its first call. The caller must keep the dtype, dimensions and layout of
    all arrays.
    """

    def __init__(self, function: Any) -> None:
        self._function = function
        self._compiled: Callable[..., Any] | None = None

    def __call__(self, *arguments: Any) -> Any:
        """Call the kernel."""
        if self._compiled is None:
            with compiling_told(to_stderr):
                self._compiled = self.taking(*arguments)
        return self._compiled(*arguments)

    def taking(self, *examples: Any) -> Callable[..., Any]:
        """Return the machine code's own Python function for arguments of these types."""
        return (
            self._function if config.DISABLE_JIT else _code(self._function, *map(_kind, examples))
        )


@cache  # numba takes 30 µs to find the code again
def _code(function: Any, *kinds: types.Type) -> Any:
    collects = gc.isenabled()
    gc.disable()  # a tenth of the time of compiling
    try:
        return function.compile(kinds)
    finally:
        if collects:
            gc.enable()


@kernel
def copy_into(target, source):
    """Do target[:] = source for vectors of equal length; a slice assignment might make a hidden
    copy."""
    for k in range(target.shape[0]):
        target[k] = source[k]


OFF = typeof(None)  # type of a flag that is off


class BlockType(types.Type):
    """Numba's type of a block: its fields, each with its type and its place (in words of 8 bytes);
    its absent flags."""

    def __init__(self, name: str, fields: dict[str, types.Type]) -> None:
        self.fields, kinds = fields, fields.values()
        self.places = dict(zip(fields, accumulate(map(_words, kinds), initial=0), strict=False))
        self.absent: frozenset[str] = frozenset(
            name for name, kind in fields.items() if kind is OFF
        ).union(*(kind.absent for kind in kinds if isinstance(kind, BlockType)))
        content = repr(
            list(fields.items())
        ).encode()  # its hash, for numba writes the name into those of functions
        super().__init__(f"{name}_{hashlib.blake2b(content, digest_size=8).hexdigest()}")


@cache  # to write the names of the types of a state takes 0.1 ms
def _type_of(name: str, *fields: tuple[str, types.Type]) -> BlockType:
    return BlockType(name, dict(fields))


class Block:
    """A NamedTuple or dict of arrays, numbers and further such content, laid out in memory for
    kernels.

    The block refers to the arrays and keeps them alive. Numbers are copied and cannot change.
    """

    def __init__(self, content: Any) -> None:
        given = content if isinstance(content, dict) else content._asdict()
        self.members = {
            name: block(value) if isinstance(value, dict) or hasattr(value, "_fields") else value
            for name, value in given.items()
        }
        vars(self).update(self.members)
        self.block_type = _type_of(
            type(content).__name__, *((k, _kind(value)) for k, value in self.members.items())
        )
        self._memory = np.array(
            [word for value in self.members.values() for word in _layout(value)], np.int64
        )
        self.address = self._memory.ctypes.data

    def __reduce__(self) -> Any:
        """Refuse copy and pickle: a copy would hold the address of this block's memory."""
        raise TypeError(
            "compiled state cannot be copied or pickled; start another Simulation of the scene"
        )

    def arrays(self) -> list[np.ndarray]:
        """Return all arrays, including those of nested blocks."""
        found = [value for value in self.members.values() if isinstance(value, np.ndarray)]
        return found + [
            each
            for value in self.members.values()
            if isinstance(value, Block)
            for each in value.arrays()
        ]


def block(content: Any) -> Any:
    """Lay a NamedTuple or a dict out for kernels; see the module's docstring."""
    return content if isinstance(content, Block) else Block(content)


_KINDS: dict[
    Any, types.Type
] = {}  # numba takes 20 µs to find the type of an array, and a simulation has hundreds


def _kind(value: Any) -> types.Type:
    if isinstance(value, Block):
        return value.block_type
    if type(value) is not np.ndarray:
        return typeof(value)
    known = value.dtype.str, value.ndim, value.flags.num
    if known not in _KINDS:
        _KINDS[known] = typeof(value)
    return _KINDS[known]


def _words(kind: types.Type) -> int:
    """Return the number of words of a field: a pointer, a number, or numba's array structure (5,
    shape, strides)."""
    return 5 + 2 * kind.ndim if isinstance(kind, types.Array) else 1


def _layout(value: Any) -> list[int]:
    """Return a field as words. An array has no reference counter, for the block keeps it alive."""
    if isinstance(value, np.ndarray):
        return [0, 0, value.size, value.itemsize, value.ctypes.data, *value.shape, *value.strides]
    if isinstance(value, Block):
        return [value.address]
    return [int(np.float64(value).view(np.int64)) if isinstance(value, float) else int(value or 0)]


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
    return NativeValue(
        context.builder.bitcast(pointer, ir.IntType(64).as_pointer()), is_error=is_error
    )


@infer_getattr
class _BlockAttributes(AttributeTemplate):
    key = BlockType

    def generic_resolve(self, kind: BlockType, name: str) -> types.Type | None:
        found = kind.fields.get(name)
        return types.boolean if found is OFF else found


@lower_getattr_generic(BlockType)
def _read_field(context: Any, builder: Any, kind: BlockType, value: Any, name: str) -> Any:
    """Load a field: an array structure, a nested block's address, or a number."""
    field = kind.fields[name]
    word = builder.gep(value, [ir.Constant(ir.IntType(64), kind.places[name])], inbounds=True)
    if field is OFF:
        return context.get_constant(types.boolean, False)
    if isinstance(field, types.Boolean):
        result = builder.icmp_unsigned("!=", builder.load(word), ir.Constant(ir.IntType(64), 0))
    else:
        result = builder.load(builder.bitcast(word, context.get_value_type(field).as_pointer()))
    return imputils.impl_ret_borrowed(context, builder, field, result)
