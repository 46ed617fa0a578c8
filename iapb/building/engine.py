"""Compile the engine's kernels into its library: ``python -m iapb.building.engine.engine``.

The kernels to compile are those that Python calls in a rehearsal (`iapb.building.rehearsal`). Each one is
linked with the bitcode of all kernels that it needs, and optimised once as a whole: no other code
can call those parts, so LLVM inlines most of them and merges repeated loads from a block.

This module and `iapb.building.bitcode` are the only ones of the engine that need numba.
"""

from __future__ import annotations

import fcntl
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from importlib.util import find_spec
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
from numba import typeof, types

from iapb.building.bitcode import dispatcher_of
from iapb.building.rehearsal import Call, rehearsed
from iapb.numerics.compiled import Block, kinds_of
from iapb.numerics.library import MARK, PATH, Library, manifest_of, stamp

# Cost up to which LLVM inlines a call; with its default of 225 the effects of a step are not
# inlined. Measured on resting steps: 500 and 1,000 are equally fast; from 5,000 on, a step of the
# peg takes a tenth longer.
INLINE_UP_TO = 500
BASELINE = "x86-64-v2"  # processors from 2009 on
RESULT_KINDS = {types.int64: "int", types.float64: "float", types.boolean: "bool"}


def machine() -> Any:
    """Return LLVM's target: position-independent code for the baseline of the platform."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    is_x86 = platform.machine() in ("x86_64", "AMD64")
    return llvm.Target.from_default_triple().create_target_machine(
        cpu=os.environ.get("IAPB_BUILD_FOR", BASELINE) if is_x86 else "generic",
        opt=3,
        reloc="pic",
        codemodel="small",
    )


def kinds_of_result(result: types.Type) -> list[str]:
    """Return the kinds of the members of a result."""
    if isinstance(result, types.NoneType):
        return []
    members = result if isinstance(result, types.BaseTuple) else [result]
    return [RESULT_KINDS[types.unliteral(member)] for member in members]


@cache
def entries() -> list[Call]:
    """Return the kernels that Python calls, each with examples of its arguments."""
    return rehearsed()


def symbol_of(number: int) -> str:
    """Return the name of an entry's code."""
    return f"iapb_{number}"


@cache
def bitcode_of(number: int) -> Any:
    """Return an entry as numba compiles it, not yet linked with the kernels that it needs.

    It takes all arguments as one block, so that Python calls every kernel alike.
    """
    kernel, examples = entries()[number]
    names = [f"a{k}" for k in range(len(examples))]
    arguments = Block(dict(zip(names, examples, strict=True)))
    given = ", ".join(f"given.{name}" for name in names)
    whole = dispatcher_of(eval(f"lambda given: kernel({given})", {"kernel": kernel}))
    whole.compile((typeof(arguments),))
    (compiled,) = whole.overloads.values()
    return compiled


def object_of(number: int) -> bytes:
    """Return the object code of an entry with all kernels that it needs."""
    compiled = bitcode_of(number)
    target = machine()
    module = llvm.parse_assembly("")
    module.triple = target.triple
    module.data_layout = str(target.target_data)
    for each in compiled.library.needed:
        module.link_in(each._final_module, preserve=True)
    for value in (*module.functions, *module.global_variables):
        if not value.is_declaration:
            value.linkage = "internal"
    entry = module.get_function(compiled.fndesc.llvm_func_name)
    entry.name = symbol_of(number)
    entry.linkage = "external"
    tuning = llvm.create_pipeline_tuning_options(speed_level=3)
    tuning.loop_vectorization = True
    tuning.inlining_threshold = INLINE_UP_TO
    builder = llvm.create_pass_builder(target, tuning)
    builder.getModulePassManager().run(module, builder)
    return bytes(target.emit_object(module))


# What numba's code calls, as numba defines it; and the manifest.
STUBS = """
#include <math.h>
double numba_frexp(double x, int *e) {
    if (isfinite(x) && x != 0.0) return frexp(x, e);
    *e = 0;
    return x;
}
double numba_ldexp(double x, int e) { return ldexp(x, e); }
double numba_nextafter(double x, double towards) { return nextafter(x, towards); }
const char iapb_manifest[] = %s;
"""


def build(path: Path) -> None:
    """Compile all entries and link them into the library."""
    kernels = {}
    parts = []
    for number, (kernel, examples) in enumerate(entries()):
        results = kinds_of_result(bitcode_of(number).signature.return_type)
        kernels[f"{kernel.name}({kinds_of(examples)})"] = symbol_of(number), results
    with (
        tempfile.TemporaryDirectory() as folder,
        ProcessPoolExecutor(mp_context=get_context("fork")) as pool,  # it has the bitcode, too
    ):
        for number, content in enumerate(pool.map(object_of, range(len(kernels)))):
            parts.append(Path(folder, f"{number}.o"))
            parts[-1].write_bytes(content)
        manifest = MARK.decode() + json.dumps({"stamp": stamp(), "kernels": kernels})
        stubs = Path(folder, "stubs.c")
        stubs.write_text(STUBS % json.dumps(manifest), encoding="utf-8")
        made = path.with_suffix(f".{os.getpid()}")
        options = ["-O2", "-shared", "-fPIC", "-s", "-o", made, stubs, *parts, "-lm"]
        subprocess.run([*c_compiler(), *map(str, options)], check=True)
        Library(made, kernels)  # it can be loaded: no symbol is missing
        made.replace(path)


def c_compiler() -> list[str]:
    """Return the command of the C compiler: cc, or ziglang's."""
    if shutil.which("cc"):
        return ["cc"]
    if find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    raise SystemExit("To build iapb, install a C compiler (cc) or the package ziglang.")


def main(path: Path = PATH) -> None:
    """Make the library, unless another process has just made it."""
    with path.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if manifest_of(path).get("stamp") != stamp():
            build(path)


if __name__ == "__main__":
    main()
