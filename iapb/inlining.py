"""How kernels are optimised: once, all that one needs together, inside the kernel that Python calls.

Numba optimises every function together with all that it calls, makes machine code of it, and does so again in each
caller: at a depth of eight the innermost kernel was compiled eight times, two thirds of the time of a first call.
Here a kernel that another one calls leaves only its bitcode; the one that Python calls takes the bitcode of all that it
needs and is optimised as a whole, once. As nothing else can call those parts, most of them are inlined, and what they
load from a block is loaded once: a step of the resting peg takes six tenths of the time.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import llvmlite.binding as llvm
from numba import jit, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering

# Cost up to which LLVM inlines a call; its own 225 keeps the effects of a step apart. Measured on resting steps: 500
# and 1,000 are alike, from 5,000 on the peg's takes a tenth longer.
_INLINE_UP_TO = 500


class BitcodeLibrary(JITCodeLibrary):
    """What a kernel leaves for its callers: its own bitcode, and the libraries that this needs in turn."""

    def _optimize_functions(self, ll_module: Any) -> None:
        """Nothing is optimised: a call that is optimised away would leave a caller linked later without its callee."""
        ll_module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        """Nothing is linked, optimised or made machine code."""
        self._finalized = True

    @cached_property
    def needed(self) -> list[Any]:
        """This library and all that it calls, each once; asked for when it is finalised, so nothing is added later."""
        found: dict[Any, None] = {self: None}
        for library in self._linking_libraries:
            found.update(dict.fromkeys(library.needed if isinstance(library, BitcodeLibrary) else [library]))
        return list(found)


class WholeLibrary(JITCodeLibrary):
    """A kernel that Python calls, with all that it needs."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        """LLVM's whole pipeline; what came from other libraries becomes a part of this one that nobody else calls.

        Private, not internal: the loader takes an internal function for that of the same name in another library, while
        LLVM may have changed how it is called.
        """
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == llvm.Linkage.linkonce_odr:
                function.linkage = "private"
        tuning = llvm.create_pipeline_tuning_options(speed_level=3)
        tuning.loop_vectorization, tuning.inlining_threshold = True, _INLINE_UP_TO
        builder = llvm.create_pass_builder(self._codegen._tm, tuning)
        builder.getModulePassManager().run(self._final_module, builder)


@register_pass(mutates_CFG=True, analysis_only=False)
class BitcodeLowering(NativeLowering):
    """Lower to bitcode; callers find the function by a key that takes the place of its machine code."""

    _name = "bitcode_lowering"

    def run_pass(self, state: Any) -> bool:
        """Numba's own lowering into a library that makes no machine code."""
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
        """Numba's own lowering into a library of ours, which can be cached as numba's own can."""
        state.library = WholeLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return bool(super().run_pass(state))


class _Compiler(CompilerBase):
    """Numba's passes with another lowering: one pipeline, no object mode, no parallel loops."""

    lowering: type[NativeLowering]

    def define_pipelines(self) -> list[Any]:
        """Replace numba's lowering."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        at = next(index for index, (kind, _) in enumerate(passes.passes) if kind is NativeLowering)
        passes.passes[at] = (self.lowering, "lowering")
        passes.finalize()
        return [passes]


class BitcodeCompiler(_Compiler):
    """For a kernel that kernels call."""

    lowering = BitcodeLowering


class WholeCompiler(_Compiler):
    """For a kernel that Python calls."""

    lowering = WholeLowering


def compile_as_whole(function: Any, **options: Any) -> Any:
    """What numba's `njit` would make of a function, with a version for Python and one for kernels that call it."""
    compiled = jit(nopython=True, pipeline_class=WholeCompiler, **options)(function)
    inner = jit(nopython=True, pipeline_class=BitcodeCompiler, no_cpython_wrapper=True, no_cfunc_wrapper=True,
                **options)(function)

    def add_overload(result: Any) -> None:
        inner.overloads[tuple(result.signature.args)] = result

    def get_call_template(arguments: Any, keywords: Any) -> Any:
        """One version for all constants: the optimiser sees them when it inlines."""
        return inner.get_call_template(tuple(types.unliteral(kind) for kind in arguments), keywords)

    inner.add_overload = add_overload  # Python never calls it: no machine code to be found by its argument types
    compiled.get_call_template = get_call_template
    compiled.get_overload = inner.get_overload
    return compiled
