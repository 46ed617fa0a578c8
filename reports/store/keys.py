"""The two hashes of a run: the run key identifies its inputs, the content hash its results."""

from __future__ import annotations

import ast
import hashlib
import json
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from importlib.metadata import version
from importlib.util import cache_from_source
from pathlib import Path
from typing import Any

import numpy as np

from iapb.errors import ArgumentError, RunFileError
from iapb.run import Run
from iapb.scene import scene_folder
from iapb.scene.expressions import syntax_tree
from reports.store.io import blocks, write_whole
from reports.store.schema import GROUPS, RESULT_GROUPS

# Sources that can change a number in a run: the engine, the reference worlds, and the numeric
# packages.
_SOURCES = ("iapb", "reference")
_ROOT = Path(__file__).resolve().parents[2]
_NUMERIC_PACKAGES = ("numpy", "numba", "scipy")


def plain(value: Any) -> Any:
    """Return `value` in the types of JSON: records become mappings, arrays and tuples lists, numpy
    scalars numbers."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if hasattr(value, "_asdict"):
        return plain(value._asdict())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, Enum | Path):
        return plain(value.value) if isinstance(value, Enum) else str(value)
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise ArgumentError(
        "value", value, "records, mappings, sequences, arrays, numbers, texts and None only"
    )


def canonical_json(value: Any) -> str:
    """Return the canonical JSON text of `value`: sorted keys, and floats in their shortest exact
    form."""
    return json.dumps(plain(value), sort_keys=True, separators=(",", ":"), ensure_ascii=False)


@cache
def code_version() -> str:
    """Return a hash of everything that can change a run's numbers.

    It is a hash of sources, not a commit: it knows uncommitted changes, and does not depend on the
    code of the report.
    """
    packages = [f"{package} {version(package)}" for package in _NUMERIC_PACKAGES]
    return hash_of([*packages, *(sources_hash(package) for package in _SOURCES)])


@cache
def evidence_version() -> str:
    """Return a hash of everything that can change a verdict: engine, references, checks, stages,
    scenes and cases."""
    files = sorted(path for path in scene_folder().rglob("*") if path.is_file())
    scenes = {
        path.relative_to(scene_folder()).as_posix(): path.read_text(encoding="utf-8")
        for path in files
    }
    cases = {
        path.relative_to(_ROOT).as_posix(): path.read_text(encoding="utf-8")
        for path in sorted((_ROOT / "verification").rglob("*"))
        if path.suffix in (".yaml", ".xml")
    }
    return hash_of(
        [
            code_version(),
            sources_hash("verification"),
            sources_hash("reports/evidence"),
            scenes,
            cases,
        ]
    )


def hash_of(value: Any) -> str:
    """Return sha256 of the canonical JSON text of `value`, in hexadecimal."""
    return hashlib.sha256(canonical_json(value).encode()).hexdigest()


@cache
def sources_hash(folder: str) -> str:
    """Return a hash of the code of all Python files below a folder of the checkout, without
    comments and docstrings.

    Parsing all sources takes seconds, so the hash of each file's code is cached beside the compiled
    modules.
    """
    files = {
        path.relative_to(_ROOT).as_posix(): path.read_bytes()
        for path in (_ROOT / folder).rglob("*.py")
    }
    if not files:
        raise ArgumentError("folder", folder, "a folder of the checkout with Python files")
    names = {name: hashlib.sha256(source).hexdigest() for name, source in files.items()}
    kept = Path(cache_from_source(__file__)).with_name(
        f"code-{folder.replace('/', '-')}-{sys.version_info.minor}.json"
    )
    known: dict[str, str] = {}
    with suppress(OSError, ValueError, TypeError):
        known = dict(json.loads(kept.read_text(encoding="utf-8")))
    codes = {
        names[name]: known.get(names[name]) or code_hash(source) for name, source in files.items()
    }
    if codes != known:
        with suppress(RunFileError):  # the folder may be read-only
            write_whole(kept, json.dumps(codes))
    return hash_of({name: codes[digest] for name, digest in names.items()})


def code_hash(source: bytes) -> str:
    """Return a hash of Python code that does not depend on comments, docstrings and layout."""
    tree = syntax_tree(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            if ast.get_docstring(node, clean=False) is not None:
                node.body = node.body[1:]
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest()


def run_key(inputs: Mapping[str, Any], code: str | None = None) -> str:
    """Return the run key: sha256 of the inputs and of the code version, in hexadecimal.

    The inputs are everything that determines the run; `code` is by default the engine's version,
    pass another one to include the code of your own law.
    """
    return hash_of({"inputs": inputs, "code": code_version() if code is None else code})


def add_array(digest: Any, name: str, array: Any) -> None:
    """Add one array to a hash: its name, type, shape and bytes (little-endian, row by row)."""
    dtype = array.dtype.newbyteorder("<")
    digest.update(f"{name} {dtype.str} {array.shape}\0".encode())
    for block in blocks(array):
        digest.update(np.ascontiguousarray(block, dtype).tobytes())


def content_hash(run: Run) -> str:
    """Return sha256 of the results, without timings and provenance; an exact repetition gives the
    same hash."""
    digest = hashlib.sha256()
    digest.update(canonical_json(list(result_head(run).values())).encode())
    for name, values in results_of(run):
        add_array(digest, name, values)
    return digest.hexdigest()


def result_head(run: Run) -> dict[str, Any]:
    """Return everything that the content hash covers besides arrays, by name."""
    names = ("dt", "complete", "tool_dofs", "coordinate_names", "velocity_names", "body_names")
    return {name: getattr(run, name) for name in names}


def results_of(run: Run) -> Iterator[tuple[str, Any]]:
    """Yield name and array of every result that the content hash covers."""
    yield "time", run.time
    for group in RESULT_GROUPS:
        quantities, record_of = GROUPS[group]
        for quantity in quantities:
            yield f"{group}/{quantity.name}", getattr(record_of(run), quantity.name)
    for name in sorted(run.energy):
        yield f"energy/{name}", run.energy[name]
