"""Kernels as numba sees them: a block is one pointer, and a kernel compiles to bitcode.

numba loads this module by itself (an entry point), so that a kernel of yours, under `numba.njit`,
calls those of the engine.

Compiling uses no fastmath and *no allocator*: ``_nrt=False`` leaves out the memory runtime, so a
kernel that would allocate does not compile.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, cached_property
from itertools import accumulate
from typing import Any
from unittest.mock import patch

from llvmlite import ir
from numba import jit, typeof, types
from numba.core import imputils, typed_passes, untyped_passes
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import NativeLowering, NopythonTypeInference
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    infer_getattr,
    lower_getattr_generic,
    models,
    register_model,
    typeof_impl,
)
from numba.np import arrayobj

from iapb.numerics.compiled import Block, Kernel

WORD = ir.IntType(64)


class BlockType(types.Type):
    """Numba's type of a block: its members, each with its type and its place in words."""

    def __init__(self, name: str, members: dict[str, types.Type]) -> None:
        self.members = members
        sizes = (
            5 + 2 * kind.ndim if isinstance(kind, types.Array) else 1 for kind in members.values()
        )
        self.places = dict(zip(members, accumulate(sizes, initial=0), strict=False))
        super().__init__(name)


_BLOCK_TYPES: dict[str, BlockType] = {}


@typeof_impl.register(Block)
def _type_of_block(value: Block, context: Any) -> BlockType:
    if value.kind_name not in _BLOCK_TYPES:
        members = {name: typeof(member) for name, member in value.members.items()}
        _BLOCK_TYPES[value.kind_name] = BlockType(value.kind_name, members)
    return _BLOCK_TYPES[value.kind_name]


@register_model(BlockType)
class _BlockModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: BlockType) -> None:
        super().__init__(manager, kind, WORD.as_pointer())


@infer_getattr
class _BlockAttributes(AttributeTemplate):
    key = BlockType

    def generic_resolve(self, kind: BlockType, name: str) -> types.Type | None:
        return kind.members.get(name)


@lower_getattr_generic(BlockType)
def _read_member(context: Any, builder: Any, kind: BlockType, value: Any, name: str) -> Any:
    """Load a member: an array structure, a nested block's address, or a number."""
    member = kind.members[name]
    word = builder.gep(value, [ir.Constant(WORD, kind.places[name])], inbounds=True)
    if isinstance(member, types.Boolean):
        result = builder.icmp_unsigned("!=", builder.load(word), ir.Constant(WORD, 0))
    else:
        result = builder.load(builder.bitcast(word, context.get_value_type(member).as_pointer()))
    return imputils.impl_ret_borrowed(context, builder, member, result)


# Kernels to bitcode


class BitcodeLibrary(JITCodeLibrary):
    """The library of a kernel: its own bitcode, not optimised, and the libraries that it needs."""

    def _optimize_functions(self, ll_module: Any) -> None:
        """Do not optimise: if a call were optimised away, a caller linked later would lack it."""
        ll_module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        """Do not link, optimise or generate machine code."""
        self._finalized = True

    @cached_property
    def needed(self) -> list[Any]:
        """This library and all that it calls, each once; complete as soon as it is finalised."""
        found: dict[Any, None] = {self: None}
        for each in self._linking_libraries:
            found.update(dict.fromkeys(each.needed if isinstance(each, BitcodeLibrary) else [each]))
        return list(found)


def _plain_index(context: Any, builder: Any, kind: Any, index: Any, size: Any) -> Any:
    """Return an index as it is: in a kernel none is negative, so none counts from the end."""
    return context.cast(builder, index, kind, types.intp)


@register_pass(mutates_CFG=True, analysis_only=False)
class BitcodeLowering(NativeLowering):
    """Lower to bitcode; callers find the function by a key in place of its machine code."""

    _name = "bitcode_lowering"

    def run_pass(self, state: Any) -> bool:
        """Run numba's own lowering into a library without machine code."""
        state.library = BitcodeLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        with patch.object(arrayobj, "fix_integer_index", _plain_index):
            super().run_pass(state)
        state.library.finalize()
        key = object()
        state.targetctx.insert_user_function(key, state.cr.fndesc, state.library.needed)
        state.cr = state.cr._replace(cfunc=key)
        return True


# Of numba's passes, those that a kernel needs: it has no closures, generators, with-blocks or
# expressions of arrays.
_PASSES = (
    untyped_passes.TranslateByteCode,
    untyped_passes.FixupArgs,
    untyped_passes.IRProcessing,
    untyped_passes.RewriteSemanticConstants,
    untyped_passes.DeadBranchPrune,
    untyped_passes.GenericRewrites,
    untyped_passes.ReconstructSSA,
    untyped_passes.DeadBranchPrune,
    NopythonTypeInference,
    typed_passes.PreLowerStripPhis,
    typed_passes.IRLegalization,
    BitcodeLowering,
    typed_passes.NoPythonBackend,
)


class BitcodeCompiler(CompilerBase):
    """Compiler of a kernel: one short pipeline, no object mode."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes."""
        manager = PassManager("kernel")
        for each in _PASSES:
            manager.add_pass(each, each.name())
        manager.finalize()
        return [manager]


@cache
def dispatcher_of(function: Callable[..., Any]) -> Any:
    """Return numba's dispatcher of a kernel's function, which compiles to bitcode."""
    made = jit(
        pipeline_class=BitcodeCompiler,
        nopython=True,
        no_cfunc_wrapper=True,
        no_cpython_wrapper=True,
        fastmath=False,
        _nrt=False,
    )(function)
    found = made.get_call_template

    def add_overload(result: Any) -> None:
        """Python never calls it, so it needs no machine code by argument types."""
        made.overloads[tuple(result.signature.args)] = result

    def get_call_template(arguments: Any, keywords: Any) -> Any:
        """Use one version for all constants: the optimiser sees them when it inlines."""
        return found(tuple(map(types.unliteral, arguments)), keywords)

    made.add_overload = add_overload
    made.get_call_template = get_call_template
    return made


@typeof_impl.register(Kernel)
def _type_of_kernel(value: Kernel, context: Any) -> Any:
    """A kernel that a kernel calls is its dispatcher."""
    return typeof(dispatcher_of(value.function))


def ready() -> None:
    """Do nothing: to import this module is enough for numba."""
