"""Valid problem files, run files and tables to damage; and damage to HDF5 that its own checksums would not notice."""

from __future__ import annotations

import gzip
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from reports.fuzz.mutate import Rng, damaged_bytes

_LCP = "2\n2 1\n1 2\n-5 -6\n"
_SICONOS = "3\n0\n3\n3\n3\n3\n1 0 0\n2 1 0\n2 2 1\n-8 -6 -4\nexample of Fathi\n"
_MLCP = """\
# two contacts
numDof = 6
constraint types = MLCP_UNILATERAL_3D_FRICTIONLESS_CONSTRAINT MLCP_UNILATERAL_3D_FRICTIONLESS_CONSTRAINT
E = ((-1) (-2))
HCHt = ((2 1)
        (1 2))
mu = (0 0)
lambda = ((0) (1))
== END ==
"""


def problem_texts() -> dict[str, bytes]:
    """One small problem of each text format."""
    texts = {"two.lcp": _LCP, "fathi.dat": _SICONOS, "contacts.txt": _MLCP}
    return {name: text.encode() for name, text in texts.items()} | {"two.lcp.gz": gzip.compress(_LCP.encode(), mtime=0)}


@cache
def fclib_files() -> dict[str, bytes]:
    """A local and a global problem with friction."""
    from reference.complementarity.problem import ImpactProblem
    from reference.fclib import write_fclib

    rng = np.random.default_rng(0)
    problem = ImpactProblem.from_impact(np.eye(6), rng.normal(size=(6, 6)), rng.normal(size=6), 0.0, [0.3, 0.5])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "local.hdf5"
        write_fclib(path, problem, "sample", np.ones(6))
        _write_global(path.with_name("global.hdf5"), rng)
        return {each.name: each.read_bytes() for each in sorted(path.parent.iterdir())}


def _write_global(path: Path, rng: Rng) -> None:
    import h5py

    from reference.fclib import _write_rows

    with h5py.File(path, "w") as file:
        group = file.create_group("fclib_global")
        _write_rows(group.create_group("M"), np.eye(6))
        _write_rows(group.create_group("H"), rng.normal(size=(6, 3)))
        group["vectors/f"], group["vectors/w"], group["vectors/mu"] = np.ones(6), np.zeros(3), np.array([0.3])
        group["spacedim"] = np.array([3], np.int32)
        group["info/title"] = np.bytes_("sample")


@cache
def result_files() -> dict[str, bytes]:
    """A short run, and a table."""
    from reports.faults.sample import inputs_of, open_store, sample_run
    from reports.store.tables import Column, Table, write_table

    with tempfile.TemporaryDirectory() as folder:
        run = open_store(folder_path := Path(folder)).put(inputs_of(0), sample_run(), "sample")
        columns = (Column("x", np.arange(4.0), "m", "where"), Column("word", tuple("abcd"), "1", "what"))
        write_table(folder_path / "table.h5", Table("sample", columns))
        return {"run.h5": run.read_bytes(), "table.h5": (folder_path / "table.h5").read_bytes()}


def damaged_hdf5(sample: bytes, other: bytes, rng: Rng) -> bytes:
    """Damage to the bytes, or to what the file says: parts lost, renamed, of another shape or type."""
    return damaged_bytes(sample, rng) if rng.random() < 0.3 else _changed(sample, rng)


def damaged_hdf5_sealed(sample: bytes, other: bytes, rng: Rng) -> bytes:
    """Damage to what the file says, under a seal that is right: somebody else's program wrote it."""
    from reports.store.io import seal

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sealed.h5"
        path.write_bytes(_changed(sample, rng))
        seal(path)
        return path.read_bytes()


def _changed(content: bytes, rng: Rng) -> bytes:
    import io

    import h5py

    stream = io.BytesIO(content)
    with h5py.File(stream, "r+") as file:
        names: list[str] = []
        file.visit(names.append)
        for _ in range(int(rng.integers(1, 4))):
            name = names[int(rng.integers(len(names)))]
            if name in file:
                _change(file, name, rng)
    return stream.getvalue()


def _change(file: Any, name: str, rng: Rng) -> None:
    kind, wrong = int(rng.integers(5)), _WRONG[int(rng.integers(len(_WRONG)))]
    owner = file[name] if rng.random() < 0.5 else file
    if kind == 0 and len(owner.attrs):
        attribute = sorted(owner.attrs)[int(rng.integers(len(owner.attrs)))]
        if rng.random() < 0.5:
            del owner.attrs[attribute]
        elif isinstance(wrong, np.ndarray) and wrong.size < 100:
            owner.attrs[attribute] = wrong
        return
    if kind == 1:
        file.move(name, f"{name}_")
        return
    del file[name]
    if kind == 2:
        file.create_group(name)
    elif isinstance(wrong, tuple):  # stated to be large, never written: a few bytes on the disk
        file.create_dataset(name, shape=wrong, dtype=np.float64, chunks=(1024,) * len(wrong))
    elif kind >= 3:
        file[name] = wrong


_WRONG: tuple[Any, ...] = (
    np.zeros(0), np.zeros(3), np.array([-1], np.int32), np.array([2**31 - 1], np.int64), np.array([1e308, np.nan]),
    np.array([[1.0, 2.0], [3.0, 4.0]]), np.bytes_("word"), "text \u00e9", np.array([0, 7, -3], np.int32), (2**40,),
    (2**20, 2**20), np.array([3], np.int32), np.array([-2], np.int32), np.array([1 + 2j]), np.float64(0.5),
    np.array([True]),
)  # fmt: skip
