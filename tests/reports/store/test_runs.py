"""A run file: the way there and back, what other programs see, and what a damaged file is worth."""

from __future__ import annotations

import dataclasses
import io
import platform
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from iapb.errors import RunFileError
from iapb.run import Run
from reports.provenance import collect_provenance
from reports.store import content_hash, read_provenance, read_run, write_run
from reports.store.io import sealed
from reports.store.schema import FORMAT_VERSION

MakeRun = Callable[..., Run]
TURNED: dict[str, Any] = {
    "q": np.tile([1.0, 0.0, 0.0, 0.0], (21, 1)), "device_q": np.tile([1.0, 0.0, 0.0, 0.0], (21, 1)),
    "coordinate_names": ("base.w", "base.x", "base.y", "base.z"), "coordinate_units": ("1",) * 4,
    "velocity_names": ("base.rx", "base.ry", "base.rz"), "velocity_units": ("rad/s",) * 3, "tool_coordinates": (0, 4),
}  # a configuration that is longer than the velocity


def assert_same(left: Any, right: Any, place: str = "run") -> None:
    """Equal to the last bit, types included."""
    assert type(left) is type(right), place
    if dataclasses.is_dataclass(left):
        for field in dataclasses.fields(left):
            assert_same(getattr(left, field.name), getattr(right, field.name), f"{place}.{field.name}")
    elif isinstance(left, np.ndarray):
        assert (left.dtype, left.shape, left.tobytes()) == (right.dtype, right.shape, right.tobytes()), place
    elif isinstance(left, dict):
        assert_same(list(left.items()), list(right.items()), place)
    elif isinstance(left, tuple | list):
        assert len(left) == len(right), place
        for index, pair in enumerate(zip(left, right, strict=True)):
            assert_same(*pair, f"{place}[{index}]")
    else:
        assert left == right, place


@pytest.mark.parametrize("shape", [
    {}, {"contacts": 0, "impacts": 0}, {"tool_dofs": (0, 0)}, {"tool_dofs": (1, 3)}, {"complete": False}, TURNED,
    {"energy": {}, "effects": ()}, {"remarks": ("chosen",), "distrust": ("it sank é", "it flew")},
    {"steps": 5000, "contacts": 20000}, {"v": np.array([[np.nan, -0.0, np.inf]] * 21)},
])  # fmt: skip
def test_a_run_comes_back_bit_for_bit(tmp_path: Path, make_run: MakeRun, shape: dict[str, Any]) -> None:
    run = make_run(**shape)
    assert_same(read_run(write_run(tmp_path / "run.h5", run)), run)


def test_a_run_saves_itself_and_replaces_a_file_only_if_asked(tmp_path: Path, make_run: MakeRun) -> None:
    first, other = make_run(), make_run(seed=1)
    for run, replace, kept in ((first, False, first), (other, False, first), (other, True, other)):
        assert content_hash(read_run(run.save(tmp_path / "run.h5", replace=replace))) == content_hash(kept)


def test_the_content_hash_is_that_of_the_results_alone(tmp_path: Path, make_run: MakeRun) -> None:
    run = make_run()
    slower = dataclasses.replace(run, chunk_seconds=run.chunk_seconds * 3, kernel="python")
    assert content_hash(slower) == content_hash(run) == content_hash(make_run())
    with h5py.File(write_run(tmp_path / "a.h5", slower, provenance={"command": "other"})) as file:
        assert file.attrs["content_hash"] == content_hash(run)
    moved = make_run()
    moved.q[3, 1] = np.nextafter(moved.q[3, 1], np.inf)  # one unit in the last place
    assert content_hash(moved) != content_hash(run)


def test_xarray_opens_it_with_units_and_dimensions_and_numbers_are_checksummed(
    tmp_path: Path, make_run: MakeRun
) -> None:
    run = make_run()
    path = write_run(tmp_path / "run.h5", run)
    with xarray.open_datatree(path, engine="h5netcdf") as tree:
        assert set(tree.children) >= {"scene", "law", "trajectory", "steps", "contacts", "impacts", "energy"}
        for node in tree.subtree:
            for name, variable in node.dataset.data_vars.items():
                assert not any(str(dim).startswith("phony") for dim in variable.dims), f"{node.path}/{name}"
                assert variable.ndim == 0 or "units" in variable.attrs, f"{node.path}/{name}"
        velocity = tree["trajectory/v"]
        assert velocity.dims == ("time", "velocity") and velocity.attrs["units"] == "m/s, m/s, rad/s"
        np.testing.assert_array_equal(velocity.sel(velocity="peg.y"), run.v[:, 1])
        np.testing.assert_array_equal(tree["trajectory"].dataset["time"], run.time)
        assert tree["trajectory"].dataset["time"].attrs["units"] == "s"
        assert tree["energy/kinetic"].attrs["units"] == "J"
        assert str(tree["scene/source"].values) == run.scene_source

    def check(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and h5py.check_string_dtype(item.dtype) is None:
            assert item.fletcher32 and item.shuffle and item.compression == "gzip", name

    with h5py.File(path) as file:
        file.visititems(check)


@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.floats(0, 1, exclude_max=True), flip=st.integers(0, 255))
def test_a_file_with_a_damaged_byte_or_cut_short_is_refused_by_name(
    tmp_path: Path, make_run: MakeRun, place: float, flip: int
) -> None:
    path = write_run(tmp_path / "run.h5", make_run(), provenance={}, replace=True)
    content = bytearray(path.read_bytes())
    at = int(place * len(content))
    content[at] ^= flip
    path.write_bytes(content if flip else content[:at])
    with pytest.raises(RunFileError) as refused:
        read_run(path)
    assert str(path) in str(refused.value)


def test_behind_a_forged_seal_stand_other_checks(tmp_path: Path, make_run: MakeRun) -> None:
    path = write_run(tmp_path / "run.h5", make_run())
    whole = path.read_bytes()
    with h5py.File(path) as file:
        chunk = file["trajectory/q"].id.get_chunk_info(0)
    content = bytearray(whole)
    content[chunk.byte_offset + chunk.size // 2] ^= 1
    path.write_bytes(sealed(bytes(content)))
    with pytest.raises(RunFileError, match="filter"):  # HDF5's own checksum
        read_run(path)
    path.write_bytes(whole)
    with h5py.File(path, "r+") as file:
        file["trajectory/q"][2, 1] += 1e-12
    with pytest.raises(RunFileError, match="no checksum"):
        read_run(path)
    path.write_bytes(sealed(path.read_bytes()))
    with pytest.raises(RunFileError, match="content hash"):
        read_run(path)


def of_version(version: int, whole: bytes) -> bytes:
    """The file as another version of iapb would have sealed it."""
    stream = io.BytesIO(whole)
    with h5py.File(stream, "r+") as file:
        file.attrs["format_version"] = version
    return sealed(stream.getvalue())


def test_other_files_are_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(RunFileError, match="no such file"):
        read_run(tmp_path / "absent.h5")
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = 1
    with pytest.raises(RunFileError, match="not written by iapb"):
        read_run(tmp_path / "other.h5")
    (tmp_path / "other.h5").write_bytes(sealed((tmp_path / "other.h5").read_bytes()))
    with pytest.raises(RunFileError, match="expected 'iapb run'"):
        read_run(tmp_path / "other.h5")


def test_provenance_is_complete_and_names_no_machine(tmp_path: Path, make_run: MakeRun) -> None:
    facts = collect_provenance(seeds=(3, 4))
    assert read_provenance(write_run(tmp_path / "run.h5", make_run(), provenance=facts)) == facts
    for name in ("version", "commit", "dirty", "lock", "cpu", "blas", "numba", "seeds", "command"):
        assert facts[name]
    text = " ".join(facts.values())
    assert str(Path(__file__).parents[3]) not in text and str(Path.home()) not in text
    assert platform.node() == "" or platform.node() not in text.split()


@pytest.mark.parametrize("wrong", [
    lambda whole: b"", lambda whole: whole + b"tail", lambda whole: whole[:8], lambda whole: b"time,x\n0,1\n",
    partial(of_version, FORMAT_VERSION - 1), partial(of_version, FORMAT_VERSION + 1)])
def test_other_contents_and_versions_are_refused_by_name(
    wrong: Callable[[bytes], bytes], tmp_path: Path, make_run: MakeRun
) -> None:
    path = write_run(tmp_path / "run.h5", make_run())
    path.write_bytes(wrong(path.read_bytes()))
    with pytest.raises(RunFileError, match=path.name):
        read_run(path)
