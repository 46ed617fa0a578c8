"""Optimise each kernel that Python calls once, together with all kernels that it calls.

Numba optimises and compiles every function together with its callees, and repeats this in each
caller. At a call depth of eight the innermost kernel was compiled eight times, which took two
thirds of the time of a first call. Here a kernel that only kernels call is kept as bitcode. The
kernel that Python calls takes the bitcode of all its callees and is optimised once as a whole. No
other code can call those parts, so LLVM inlines most of them and merges repeated loads from a
block: a step of the resting peg takes 0.6 times as long.
"""

from __future__ import annotations

import inspect
from functools import cached_property
from typing import Any

import llvmlite.binding as llvm
from numba import jit, types
from numba.core import typed_passes, untyped_passes
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import NativeLowering, NopythonTypeInference

# Cost up to which LLVM inlines a call; with its default of 225 the effects of a step are not
# inlined. Measured on resting steps: 500 and 1,000 are equally fast; from 5,000 on, a step of the
# peg takes a tenth longer.
_INLINE_UP_TO = 500


class WholeLibrary(JITCodeLibrary):
    """The library of a kernel that Python calls, with all libraries that it needs."""

    def _optimize_functions(self, ll_module: Any) -> None:
        """Do not optimise: if a call were optimised away, a caller linked later would lack the
        callee."""
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        """Run LLVM's whole pipeline, with functions of other libraries made private to this one.

        They are private, not internal: the loader may confuse an internal function with one of the
        same name in another library, while LLVM may have changed its calling convention.
        """
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == llvm.Linkage.linkonce_odr:
                function.linkage = "private"
        tuning = llvm.create_pipeline_tuning_options(speed_level=3)
        tuning.loop_vectorization, tuning.inlining_threshold = True, _INLINE_UP_TO
        builder = llvm.create_pass_builder(self._codegen._tm, tuning)
        builder.getModulePassManager().run(self._final_module, builder)


class BitcodeLibrary(WholeLibrary):
    """The library of a kernel that kernels call: its own bitcode, and the libraries that it
    needs."""

    def finalize(self) -> None:
        """Do not link, optimise or generate machine code."""
        self._finalized = True

    @cached_property
    def needed(self) -> list[Any]:
        """This library and all libraries that it calls, each once; complete as soon as the library
        is finalised."""
        found: dict[Any, None] = {self: None}
        for library in self._linking_libraries:
            found.update(
                dict.fromkeys(library.needed if isinstance(library, BitcodeLibrary) else [library])
            )
        return list(found)


@register_pass(mutates_CFG=True, analysis_only=False)
class BitcodeLowering(NativeLowering):
    """Lower to bitcode; callers find the function by a key in place of its machine code."""

    _name = "bitcode_lowering"

    def run_pass(self, state: Any) -> bool:
        """Run numba's own lowering into a library without machine code."""
        state.library = BitcodeLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        state.library.finalize()
        key = object()
        state.targetctx.insert_user_function(key, state.cr.fndesc, state.library.needed)
        state.cr = state.cr._replace(cfunc=key)
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class WholeLowering(NativeLowering):
    """Lower to machine code, optimised as a whole."""

    _name = "whole_lowering"

    def run_pass(self, state: Any) -> bool:
        """Run numba's own lowering into a `WholeLibrary`, which numba can cache."""
        state.library = WholeLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return bool(super().run_pass(state))


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
)


class WholeCompiler(CompilerBase):
    """Compiler of a kernel that Python calls: one short pipeline with another lowering, no object
    mode."""

    lowering: type[NativeLowering] = WholeLowering

    def define_pipelines(self) -> list[Any]:
        """Return the passes."""
        manager = PassManager("kernel")
        for each in (*_PASSES, self.lowering, typed_passes.NoPythonBackend):
            manager.add_pass(each, each.name())
        manager.finalize()
        return [manager]


class BitcodeCompiler(WholeCompiler):
    """Compiler of a kernel that kernels call."""

    lowering = BitcodeLowering


def compile_as_whole(
    function: Any, is_absent: Any = lambda kinds: False, otherwise: Any = None, **options: Any
) -> Any:
    """Compile a function as numba's `njit` does, with one version for Python and one for kernels
    that call it.

    For argument types with is_absent(types), kernels get a third version, which returns the
    constant `otherwise`.
    """
    options |= {"nopython": True, "no_cfunc_wrapper": True}
    compiled = jit(pipeline_class=WholeCompiler, **options)(function)

    def bitcode_of(python: Any) -> Any:
        made = jit(pipeline_class=BitcodeCompiler, no_cpython_wrapper=True, **options)(python)

        def add_overload(result: Any) -> None:
            made.overloads[tuple(result.signature.args)] = result

        made.add_overload = (
            add_overload  # Python never calls it, so it needs no machine code by argument types
        )
        return made

    parameters = ", ".join(inspect.signature(function).parameters)
    compiled.bitcode, constant = (
        bitcode_of(function),
        bitcode_of(eval(f"lambda {parameters}: {otherwise!r}")),
    )

    def version(arguments: Any) -> Any:
        return constant if is_absent(arguments) else compiled.bitcode

    def get_call_template(arguments: Any, keywords: Any) -> Any:
        """Use one version for all constant arguments: the optimiser sees the constants when it
        inlines."""
        plain = tuple(map(types.unliteral, arguments))
        return version(plain).get_call_template(plain, keywords)

    compiled.get_call_template = get_call_template
    compiled.get_overload = lambda arguments: version(arguments).get_overload(arguments)
    return compiled
