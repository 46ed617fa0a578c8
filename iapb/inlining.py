"""Kernels that are called by kernels: typed and lowered once, but optimised only inside the kernel that Python calls.

Numba optimises every function together with all that it calls, and makes machine code of it, and does so again in
each caller: at a depth of eight the innermost kernel was compiled eight times, two thirds of the time of a first call.
Here a kernel that another one calls leaves only its bitcode; the one that Python calls takes the bitcode of all that it
needs and is optimised as a whole, once.
"""

from __future__ import annotations

from typing import Any

from numba import jit, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering


class BitcodeLibrary(JITCodeLibrary):
    """What a kernel leaves for its callers: its own bitcode, and the libraries that this needs in turn."""

    def _optimize_functions(self, ll_module: Any) -> None:
        """Nothing is optimised: a call that is optimised away would leave a caller linked later without its callee."""
        ll_module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        """Nothing is linked, optimised or made machine code."""
        self._finalized = True

    def needed(self) -> list[Any]:
        """This library and all that it calls, each once."""
        found: dict[Any, None] = {self: None}
        for library in self._linking_libraries:
            found.update(dict.fromkeys(library.needed() if isinstance(library, BitcodeLibrary) else [library]))
        return list(found)


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
        state.targetctx.insert_user_function(key, state.cr.fndesc, state.library.needed())
        state.cr = state.cr._replace(cfunc=key)
        return True


class BitcodeCompiler(CompilerBase):
    """Numba's passes, the last of which leaves bitcode."""

    def define_pipelines(self) -> list[Any]:
        """One pipeline: no object mode, no parallel loops."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        lowering = next(index for index, (kind, _) in enumerate(passes.passes) if "Lowering" in kind.__name__)
        _, said = passes.passes[lowering]
        passes.passes[lowering] = (BitcodeLowering, said)
        passes.finalize()
        return [passes]


def called_from_kernels(compiled: Any) -> None:
    """Let kernels that call `compiled`, what `njit` made of a function, take its bitcode: the same, options and all."""
    bitcode_alone = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": BitcodeCompiler}
    inner = jit(**compiled.targetoptions, **bitcode_alone)(compiled.py_func)

    def add_overload(result: Any) -> None:
        inner.overloads[tuple(result.signature.args)] = result

    def get_call_template(arguments: Any, keywords: Any) -> Any:
        """One version for all constants: the optimiser sees them when it inlines."""
        return inner.get_call_template(tuple(types.unliteral(kind) for kind in arguments), keywords)

    inner.add_overload = add_overload  # Python never calls it: no machine code to be found by its argument types
    compiled.get_call_template = get_call_template
    compiled.get_overload = inner.get_overload
