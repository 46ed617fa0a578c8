"""The two hashes of a run: the key says what was asked for, the content hash what came out."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from iapb.errors import ArgumentError
from iapb.run import Run
from reports.store.schema import GROUPS, RESULT_GROUPS

# What can change a number in a run: the engine, the reference worlds, and the numeric packages under them.
_SOURCES = ("iapb", "reference")
_NUMERIC_PACKAGES = ("numpy", "numba", "scipy")


def plain(value: Any) -> Any:
    """Return `value` made of what JSON knows: arrays become lists, numpy scalars numbers, tuples lists."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise ArgumentError("inputs", value, "mappings, sequences, arrays, numbers, texts and None only")


def canonical_json(value: Any) -> str:
    """Return the one JSON text of `value`: keys sorted, floats by their shortest exact form."""
    return json.dumps(plain(value), sort_keys=True, separators=(",", ":"), ensure_ascii=False)


@cache
def code_version() -> str:
    """Return a hash of everything that can change a run's numbers.

    Source text rather than a commit: it also tells apart uncommitted changes, and does not change with
    a change of the report. Taken once per process, when first asked for.
    """
    digest = hashlib.sha256()
    root = Path(__file__).resolve().parents[2]
    for package in _SOURCES:
        for path in sorted((root / package).rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    for package in _NUMERIC_PACKAGES:
        digest.update(f"{package} {version(package)}\0".encode())
    return digest.hexdigest()


def run_key(inputs: Mapping[str, Any], code: str | None = None) -> str:
    """Return the run key: sha256 of the inputs and of the code version, in hexadecimal.

    Parameters
    ----------
    inputs
        Everything that determines the run: resolved scene, law, settings, coupling, duration …
    code
        Version of the code; the engine's by default. Give your own to cover a law of your own.
    """
    text = canonical_json({"inputs": inputs, "code": code_version() if code is None else code})
    return hashlib.sha256(text.encode()).hexdigest()


def add_array(digest: Any, name: str, array: Any) -> None:
    """Feed one array to a hash: its name, type, shape and bytes (little-endian, row by row)."""
    values = np.ascontiguousarray(array)
    values = values.astype(values.dtype.newbyteorder("<"), copy=False)
    digest.update(f"{name} {values.dtype.str} {values.shape}\0".encode())
    digest.update(values.tobytes())


def content_hash(run: Run) -> str:
    """Return sha256 of the results alone: no timings, no provenance; equal bit for bit on a repeat."""
    digest = hashlib.sha256()
    digest.update(canonical_json(list(result_head(run).values())).encode())
    for name, values in results_of(run):
        add_array(digest, name, values)
    return digest.hexdigest()


def result_head(run: Run) -> dict[str, Any]:
    """Return what the content hash covers besides arrays, by name."""
    names = ("dt", "complete", "tool_dofs", "coordinate_names", "velocity_names", "body_names")
    return {name: getattr(run, name) for name in names}


def results_of(run: Run) -> Iterator[tuple[str, Any]]:
    """Yield name and array of every result that the content hash covers."""
    yield "time", run.time
    for group in RESULT_GROUPS:
        quantities, record_of, _ = GROUPS[group]
        for quantity in quantities:
            yield f"{group}/{quantity.name}", getattr(record_of(run), quantity.name)
    for name in sorted(run.energy):
        yield f"energy/{name}", run.energy[name]
