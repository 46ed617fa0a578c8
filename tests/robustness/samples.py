"""Files as iapb and others write them, for tests that damage or forge them."""

import os
import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path

import h5py
import numpy as np

from iapb import find_scene, load_scene
from reference.worlds import run_world
from reports.store import RunStore, write_run
from reports.store.records import write_record
from tests.reference.fclib_files import local_file, matrix_group

# how often each fault is done, and a multiple of the wrong inputs
TIMES = int(os.environ.get("IAPB_FUZZ", "1"))


@cache
def sample_run():
    """The run itself, simulated once per process."""
    return run_world(load_scene(find_scene("peg_corner")).with_values({"duration": 0.4}), "IAPB")


def numbered(number):
    """A run that differs from the others in its results."""
    return replace(sample_run(), q=sample_run().q + float(number))


def open_store(folder):
    """A store whose keys do not depend on the code: hashing that takes longer than what is tried
    here."""
    return RunStore(folder, code="faults")


def put(folder, number=0):
    """Store the run of that number."""
    place = open_store(folder).place_of({"number": number}, "sample")
    return write_run(place.path, numbered(number), key=place.key)


@cache
def result_files():
    """A short run, and a table."""
    with tempfile.TemporaryDirectory() as folder:
        run = put(Path(folder))
        table = Path(folder) / "table.h5"
        write_record(table, [[0.5, "a"], [1.5, "b"]], {})
        return {"run.h5": run.read_bytes(), "table.h5": table.read_bytes()}


@cache
def fclib_files():
    """A local and a global problem with friction."""
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(6, 6))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "local.hdf5"
        local_file(path, rows @ rows.T, rng.normal(size=6), [0.3, 0.5], np.ones(6))
        with h5py.File(path.with_name("global.hdf5"), "w") as file:
            group = file.create_group("fclib_global")
            matrix_group(group.create_group("M"), np.eye(6))
            matrix_group(group.create_group("H"), rng.normal(size=(6, 3)))
            group["vectors/f"] = np.ones(6)
            group["vectors/w"] = np.zeros(3)
            group["vectors/mu"] = np.array([0.3])
            group["spacedim"] = np.array([3], np.int32)
            group["info/title"] = np.bytes_("sample")
        return {each.name: each.read_bytes() for each in sorted(path.parent.iterdir())}
