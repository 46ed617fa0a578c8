"""Problem files: read as written, and damaged ones named."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy import sparse

from iapb.errors import ArgumentError
from reference.datasets import WITH_MECHANICS, DatasetError, problem_files, read_problem
from tests.reference.fclib_files import local_file, matrix_group

PROBLEMS = Path(__file__).parents[3] / "shared" / "problems"
shared = pytest.mark.skipif(not PROBLEMS.exists(), reason="shared problem files are not here")


def test_a_siconos_file_lists_columns(tmp_path: Path) -> None:
    (tmp_path / "a.dat").write_text("2\n0\n2 2 2 2\n1 2 3 4\n5 6\n")
    assert read_problem(tmp_path / "a.dat").problem.delassus.tolist() == [[1, 3], [2, 4]]


@shared
def test_every_file_is_read() -> None:
    files = problem_files(PROBLEMS)
    assert {path.suffix for path in files} == {".gz", ".dat", ".hdf5"}
    for path in files:
        stored = read_problem(path)
        assert stored.problem.name == path.name
        assert (
            path.name != "Box_Stacks-i0122-82-5.hdf5" or stored.stored_impulse is None
        )  # only a placeholder


def test_a_local_problem_is_read_as_its_file_says(tmp_path: Path) -> None:
    """W by compressed rows, q, one mu per contact, and the stored solution; one of zeros is a
    placeholder."""
    rows = np.random.default_rng(0).normal(size=(6, 4))
    impulse = np.linspace(0.1, 0.6, 6)
    for name, stored in (("solved.hdf5", impulse), ("none.hdf5", np.zeros(6)), ("none.h5", None)):
        local_file(tmp_path / name, rows @ rows.T, np.arange(6.0), [0.3, 0.5], stored)
        read = read_problem(tmp_path / name)
        assert (read.problem.contacts, read.problem.contact_size) == (2, 3)
        assert np.array_equal(read.problem.delassus, rows @ rows.T)
        assert np.array_equal(read.problem.offset, np.arange(6.0))
        assert np.array_equal(read.problem.friction, [0.3, 0.5])
        expected = impulse if stored is impulse else None
        assert np.array_equal(read.stored_impulse, expected)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("cut.lcp", b"2 1 0 0 1 -1", "with 5 numbers, expected"),
        ("words.lcp", b"2 1 0 zero 1 -1 -1", "could not convert"),
        ("empty.lcp", b"", "cannot be read"),
        ("torn.lcp.gz", gzip.compress(b"1 1 -1", mtime=0)[:-6], "cannot be read"),
        ("sparse.dat", b"2 1 2 2 2 2 1 1", "storage flag 1"),
        ("foreign.hdf5", b"not hdf5 at all", "cannot be read"),
        ("picture.png", b"", "unknown kind"),
    ],
)
def test_damaged_and_foreign_files_are_named(
    tmp_path: Path, name: str, content: bytes, says: str
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(DatasetError, match=f"{name}.*{says}"):
        read_problem(path)


def test_missing_files_and_folders(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="cannot be read"):
        read_problem(tmp_path / "absent.lcp")
    with pytest.raises(ArgumentError, match="existing folder"):
        problem_files(tmp_path / "absent")
    (tmp_path / "README.md").write_text("x")
    assert problem_files(tmp_path) == []


@pytest.mark.parametrize("coordinates", [60, 12_000])
def test_a_global_problem_is_condensed_whatever_its_number_of_coordinates(
    tmp_path: Path, coordinates: int
) -> None:
    """A dense M of 12,000 coordinates would take 1.2 GB; its 12,000 entries give the same W, entry
    by entry."""
    rng = np.random.default_rng(0)
    mass = rng.uniform(0.5, 2.0, coordinates)
    f = rng.normal(size=coordinates)
    h = sparse.random(coordinates, 24, 0.05, random_state=1, format="csc")
    with h5py.File(tmp_path / "large.hdf5", "w") as file:
        group = file.create_group("fclib_global")
        matrix_group(group.create_group("M"), sparse.diags(mass))
        matrix_group(group.create_group("H"), h)
        group["vectors/f"] = f
        group["vectors/w"] = np.zeros(24)
        group["vectors/mu"] = np.full(8, 0.3)
        group["spacedim"] = np.array([3], np.int32)
    problem = read_problem(tmp_path / "large.hdf5").problem
    dense = h.toarray()
    assert (problem.mass_matrix is None) == (coordinates > WITH_MECHANICS)
    w = dense.T @ (dense / mass[:, None])
    assert problem.delassus == pytest.approx(w, rel=1e-12, abs=1e-14)
    assert problem.gamma_minus == pytest.approx(dense.T @ (f / mass), rel=1e-12, abs=1e-14)


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [
        ("fclib_local/W/p", np.array([0, *[10**9] * 5, 0], np.int32), "pointers p decrease"),
        ("fclib_local/W/i", np.array([99, 0], np.int32), "indices"),
        ("fclib_local/W/nz", np.array([77]), "nz = 77"),
        ("fclib_local/spacedim", np.array([5]), "2 or 3"),
        ("fclib_local/W/m", np.array([10**6]), "at most"),
        ("fclib_local/vectors/q", np.array([np.nan]), "finite numbers"),
    ],
)
def test_a_damaged_fclib_file_is_named(tmp_path: Path, name: str, value: Any, says: str) -> None:
    local_file(
        tmp_path / "w.hdf5",
        np.diag([1.0, 0.0, 0.0, 1.0, 0.0, 0.0]),
        [1.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0],
    )
    with h5py.File(tmp_path / "w.hdf5", "r+") as file:
        del file[name]
        if value is not None:
            file[name] = value
    with pytest.raises(DatasetError, match=says):
        read_problem(tmp_path / "w.hdf5")
