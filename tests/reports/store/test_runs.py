"""A run file: the way there and back, what other programs see, and what a damaged file is worth."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
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
from reports.store import read_run, write_run
from reports.store.io import sealed
from reports.store.keys import content_hash
from reports.store.runs import read_provenance

MakeRun = Callable[..., Run]


def assert_same(left: Any, right: Any, place: str = "run") -> None:
    """Equal to the last bit, types included."""
    if dataclasses.is_dataclass(left) and not isinstance(left, type):
        assert type(left) is type(right), place
        for field in dataclasses.fields(left):
            assert_same(getattr(left, field.name), getattr(right, field.name), f"{place}.{field.name}")
    elif isinstance(left, np.ndarray):
        assert left.dtype == right.dtype and left.shape == right.shape, place
        assert left.tobytes() == right.tobytes(), place
    elif isinstance(left, dict):
        assert list(left) == list(right), place
        for key in left:
            assert_same(left[key], right[key], f"{place}[{key}]")
    elif isinstance(left, tuple):
        assert len(left) == len(right), place
        for index, pair in enumerate(zip(left, right, strict=True)):
            assert_same(*pair, f"{place}[{index}]")
    else:
        assert left == right, place


@pytest.mark.parametrize(
    "shape",
    [
        {},
        {"contacts": 0, "impacts": 0},
        {"tool_dofs": (0, 0)},
        {"tool_dofs": (1, 3)},
        {"complete": False},
        {"energy": {}, "effects": ()},
        {"remarks": ("chosen",), "distrust": ("it sank é", "it flew")},
        {"steps": 5000, "contacts": 20000},
    ],
)
def test_a_run_comes_back_bit_for_bit(tmp_path: Path, make_run: MakeRun, shape: dict[str, Any]) -> None:
    run = make_run(**shape)
    assert_same(read_run(write_run(tmp_path / "run.h5", run)), run)


def test_a_configuration_may_be_longer_than_a_velocity(tmp_path: Path, make_run: MakeRun) -> None:
    names, units = ("base.w", "base.x", "base.y", "base.z"), ("1", "1", "1", "1")
    q = np.tile([1.0, 0.0, 0.0, 0.0], (21, 1))
    turns = {"velocity_names": ("base.rx", "base.ry", "base.rz"), "velocity_units": ("rad/s",) * 3}
    place = {"coordinate_names": names, "coordinate_units": units, "tool_coordinates": (0, 4)}
    run = make_run(q=q, device_q=q, **place, **turns)
    path = write_run(tmp_path / "run.h5", run)
    assert_same(read_run(path), run)
    with xarray.open_dataset(path, engine="h5netcdf", group="trajectory") as dataset:
        assert dataset["device_q"].shape == (21, 4) and dataset["device_q"].attrs["units"] == "1"
        assert dataset["v"].attrs["units"] == "rad/s"
        assert list(dataset["device_velocity"].values) == ["base.rx", "base.ry", "base.rz"]


def test_special_values_survive(tmp_path: Path, make_run: MakeRun) -> None:
    run = make_run()
    run.q[0] = (np.nan, -0.0, np.inf)
    assert_same(read_run(write_run(tmp_path / "run.h5", run)), run)


def test_the_content_hash_is_that_of_the_results_alone(make_run: MakeRun) -> None:
    run = make_run()
    slower = dataclasses.replace(run, chunk_seconds=run.chunk_seconds * 3, kernel="python")
    assert content_hash(slower) == content_hash(run) == content_hash(make_run())
    moved = make_run()
    moved.q[3, 1] = np.nextafter(moved.q[3, 1], np.inf)  # one unit in the last place
    assert content_hash(moved) != content_hash(run)


def test_two_writers_make_files_of_one_content(tmp_path: Path, make_run: MakeRun) -> None:
    hashes = set()
    for name in ("a.h5", "b.h5"):
        with h5py.File(write_run(tmp_path / name, make_run(), provenance={"command": name})) as file:
            hashes.add(file.attrs["content_hash"])
    assert len(hashes) == 1


def test_xarray_opens_it_with_units_and_dimensions(tmp_path: Path, make_run: MakeRun) -> None:
    run = make_run()
    with xarray.open_datatree(write_run(tmp_path / "run.h5", run), engine="h5netcdf") as tree:
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


def test_numbers_are_checksummed(tmp_path: Path, make_run: MakeRun) -> None:
    with h5py.File(write_run(tmp_path / "run.h5", make_run())) as file:

        def check(name: str, item: Any) -> None:
            if isinstance(item, h5py.Dataset) and h5py.check_string_dtype(item.dtype) is None:
                assert item.fletcher32 and item.shuffle and item.compression == "gzip", name

        file.visititems(check)


@settings(max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.floats(0, 1, exclude_max=True), flip=st.integers(1, 255))
def test_a_damaged_byte_is_harmless_or_found(
    tmp_path: Path, make_run: MakeRun, place: float, flip: int
) -> None:
    run = make_run()
    path = write_run(tmp_path / "run.h5", run, provenance={}, replace=True)
    content = bytearray(path.read_bytes())
    content[int(place * len(content))] ^= flip
    path.write_bytes(content)
    try:
        found = read_run(path)
    except RunFileError as error:
        assert str(path) in str(error)
    else:
        assert_same(found, run)


def test_a_damaged_array_is_named_as_damage(tmp_path: Path, make_run: MakeRun) -> None:
    """Even where the seal is forged: HDF5's own checksum stands behind it."""
    path = write_run(tmp_path / "run.h5", make_run())
    with h5py.File(path) as file:
        chunk = file["trajectory/q"].id.get_chunk_info(0)
    content = bytearray(path.read_bytes())
    content[chunk.byte_offset + chunk.size // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(RunFileError, match="damaged"):
        read_run(path)
    path.write_bytes(sealed(path.read_bytes()))
    with pytest.raises(RunFileError, match="filter"):
        read_run(path)


def test_a_forged_array_is_found_by_the_content_hash(tmp_path: Path, make_run: MakeRun) -> None:
    path = write_run(tmp_path / "run.h5", make_run())
    with h5py.File(path, "r+") as file:  # HDF5 writes a fitting checksum; our hash is of the run as it was
        file["trajectory/q"][2, 1] += 1e-12
    with pytest.raises(RunFileError, match="no checksum"):
        read_run(path)
    path.write_bytes(sealed(path.read_bytes()))
    with pytest.raises(RunFileError, match="content hash"):
        read_run(path)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.9])
def test_a_file_cut_short_is_refused(tmp_path: Path, make_run: MakeRun, share: float) -> None:
    path = write_run(tmp_path / "run.h5", make_run())
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(RunFileError):
        read_run(path)


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
    path = write_run(tmp_path / "run.h5", make_run(), provenance=facts)
    assert read_provenance(path) == facts
    for name in ("version", "commit", "dirty", "lock", "cpu", "blas", "numba", "seeds", "command"):
        assert facts[name]
    import platform

    text = " ".join(facts.values())
    assert str(Path(__file__).parents[3]) not in text and str(Path.home()) not in text
    assert platform.node() == "" or platform.node() not in text.split()
