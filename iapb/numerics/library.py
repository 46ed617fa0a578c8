"""The engine's library: the compiled kernels in one file beside this one, checked and loaded.

The file carries a text, its manifest: what it was made from, and the kernels that it has. It is
loaded only if it was made for this platform from the files that lie beside it. In a checkout a
stale one is made again; an installed one is refused.
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import os
import platform
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from iapb.errors import IapbError

PACKAGE = Path(__file__).resolve().parents[1]
PATH = PACKAGE / "engine.so"
MARK = b"iapb engine library: "  # before the manifest
NUMBERS = {"int": ctypes.c_int64, "float": ctypes.c_double, "bool": ctypes.c_bool}
# Files without kernels that decide what is compiled, and how: the compiler, the layout of blocks and
# arguments, and constants that kernels read.
_DECIDE = (
    "bitcode.py",
    "engine.py",
    "rehearsal.py",
    "compiled.py",
    "library.py",
    "copying.py",
    "run.py",
    "joints.py",
    "arrays.py",
    "geometry.py",
)


def sources() -> Iterator[Path]:
    """Yield the files that decide what the library does."""
    for path in sorted(PACKAGE.rglob("*.py")):
        if path.name in _DECIDE or b"\n@kernel" in path.read_bytes():
            yield path


def stamp() -> str:
    """Return a hash of the files that decide what the library does, and the platform."""
    digest = hashlib.sha256()
    for path in sources():
        digest.update(f"{path.relative_to(PACKAGE)}\0".encode() + path.read_bytes())
    processor = os.environ.get("IAPB_BUILD_FOR", platform.machine())
    return f"{sys.platform} {processor} {digest.hexdigest()}"


def manifest_of(path: Path) -> dict[str, Any]:
    """Return the manifest of a library; an empty one if the file is missing or is no library."""
    content = path.read_bytes() if path.is_file() else b""
    text = content.partition(MARK)[2].partition(b"\0")[0]
    return dict(json.loads(text)) if text else {}


class Library:
    """A loaded library.

    kernels : for each kernel, written ``module.name(kinds of arguments)``, its symbol and the kinds
        of its results
    """

    def __init__(self, path: Path, kernels: dict[str, tuple[str, list[str]]]) -> None:
        try:
            # PyDLL keeps the interpreter's lock during a call, for all calls share scratch.
            self._loaded = ctypes.PyDLL(str(path))
        except OSError as error:
            raise IapbError(f"the engine's library cannot be loaded: {error}") from error
        self.kernels = kernels

    def entry(self, name: str, kinds: str) -> Callable[..., Any] | None:
        """Return a kernel as a Python function of arguments of these kinds; None if it has none."""
        found = self.kernels.get(f"{name}({kinds})")
        if found is None:
            return None
        symbol, results = found
        return _python_function(getattr(self._loaded, symbol), kinds.split(", "), results)


def words_of_array(array: np.ndarray) -> tuple[int, ...]:
    """Return an array as kernels take it: two empty words, size, bytes of an item, address, shape
    and strides."""
    address = array.__array_interface__["data"][0]
    return 0, 0, array.size, array.itemsize, address, *array.shape, *array.strides


def _python_function(code: Any, kinds: list[str], results: list[str]) -> Callable[..., Any]:
    """Return a function that packs its arguments into words of 8 bytes and runs the code.

    The code is int f(result*, error**, words*), as numba makes it.
    """
    code.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_char_p)
    code.restype = ctypes.c_int32
    names = [f"a{k}" for k in range(len(kinds))]
    form = ""
    words = []
    for name, kind in zip(names, kinds, strict=True):
        if "[" in kind:
            dimensions = int(kind.partition("[")[2].rstrip("]"))
            form += f"{5 + 2 * dimensions}q"
            words.append(f"*words_of_array({name})")
        else:
            form += "d" if kind == "float" else "q"
            words.append(name if kind in NUMBERS else f"{name}.address")
    fields = [(f"r{k}", NUMBERS[kind]) for k, kind in enumerate(results)]
    returned = ", ".join(f"result.{name}" for name, _ in fields)
    scope = {
        "code": code,
        "pack": struct.Struct(form).pack,
        "words_of_array": words_of_array,
        "Result": type("Result", (ctypes.Structure,), {"_fields_": fields}),
        "byref": ctypes.byref,
        "error": ctypes.byref(ctypes.c_void_p()),
    }
    # Made from text: a loop over the arguments would take as long as a small kernel.
    text = f"""
def call({", ".join(names)}):
    result = Result()
    if code(byref(result), error, pack({", ".join(words)})):
        raise ZeroDivisionError("a kernel divides by zero")
    return {f"({returned})" if fields else None}
"""
    exec(text, scope)
    return scope["call"]


@cache
def library() -> Library:
    """Return the library, loaded once.

    Raises
    ------
    IapbError
        The library is missing, or was made for another platform or from other files.
    """
    wanted = stamp()
    manifest = manifest_of(PATH)
    if manifest.get("stamp") != wanted and (PACKAGE.parent / "pyproject.toml").is_file():
        make()
        manifest = manifest_of(PATH)
    if manifest.get("stamp") != wanted:
        raise IapbError(
            f"the engine's library {PATH} is missing, or was made for another version or platform: "
            "install iapb again"
        )
    return Library(PATH, manifest["kernels"])


def make() -> None:
    """Make the library of a checkout, in a process of its own, and say so."""
    print("A file with kernels changed: compiling the engine ...", file=sys.stderr, flush=True)
    started = time.monotonic()
    done = subprocess.run(
        [sys.executable, "-m", "iapb.building.engine"],
        cwd=PACKAGE.parent,
        stdout=sys.stderr,
        check=False,
    )
    if done.returncode:
        raise IapbError(
            "the engine was not compiled: see the message above; `make setup` installs numba"
        )
    print(f"Compiling took {time.monotonic() - started:.0f} s.", file=sys.stderr, flush=True)
