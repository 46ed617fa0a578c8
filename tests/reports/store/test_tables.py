"""Tables behind figures: names, units and descriptions survive, and other programs read them."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

from iapb.errors import ArgumentError, RunFileError
from reports.store.io import sealed
from reports.store.tables import Column, Table, read_table, read_tables, write_table, write_tables

E = np.linspace(0, 1, 5)
TABLE = Table(
    "fig03",
    (
        Column("restitution", E, "1", "restitution coefficient"),
        Column("energy", E**2, "J", "kinetic energy after the collision"),
        Column("rank", np.arange(5), "1", "rows used"),
        Column("passive", E > 0.2, "1", "whether energy did not grow"),
        Column("contact", ("A", "A", "B", "B", "ä"), "1", "where"),
    ),
    title="Figure 3",
    runs=("a.h5", "b.h5"),
    command="iapb reproduce fig03",
)


def test_a_table_comes_back(tmp_path: Path) -> None:
    found = read_table(write_table(tmp_path / "t.h5", TABLE))
    assert [column.name for column in found.columns] == [column.name for column in TABLE.columns]
    for left, right in zip(found.columns, TABLE.columns, strict=True):
        assert (left.unit, left.description) == (right.unit, right.description)
        np.testing.assert_array_equal(left.values, right.values)
    assert (found.name, found.title, found.runs, found.command) == (TABLE.name, TABLE.title, TABLE.runs, TABLE.command)
    assert found["contact"] == TABLE["contact"]


def test_xarray_reads_it(tmp_path: Path) -> None:
    path = write_table(tmp_path / "t.h5", TABLE)
    with xarray.open_dataset(path, engine="h5netcdf", group="fig03") as dataset:
        energy = dataset["energy"]
        assert energy.dims == ("restitution",) and energy.attrs["units"] == "J"
        assert float(energy.sel(restitution=0.5)) == 0.25


def test_rows_that_repeat_get_a_number(tmp_path: Path) -> None:
    repeated = Table("t", (Column("world", ("PB", "PB"), "1", "w"), Column("x", np.zeros(2), "m", "x")))
    path = write_table(tmp_path / "t.h5", repeated)
    with xarray.open_dataset(path, engine="h5netcdf", group="t") as dataset:
        assert dataset["x"].dims == ("row",)
    assert [column.name for column in read_table(path).columns] == ["world", "x"]


def test_several_tables_share_a_file(tmp_path: Path) -> None:
    other = Table("other", (Column("empty", np.zeros(0), "m", "no rows"),))
    path = write_tables(tmp_path / "t.h5", (TABLE, other))
    assert list(read_tables(path)) == ["fig03", "other"]
    assert len(read_table(path, "other")["empty"]) == 0
    with pytest.raises(RunFileError, match="expected one of fig03, other"):
        read_table(path, "third")


def test_damage_is_found(tmp_path: Path) -> None:
    path = write_table(tmp_path / "t.h5", TABLE)
    with h5py.File(path, "r+") as file:
        file["fig03/energy"][0] = 1.0
    with pytest.raises(RunFileError, match="checksum"):
        read_table(path)
    path.write_bytes(sealed(path.read_bytes()))
    with pytest.raises(RunFileError, match="damaged"):
        read_table(path)


@pytest.mark.parametrize(
    "columns",
    [
        (),
        (Column("x", E, "1", ""), Column("x", E, "1", "")),
        (Column("x", E, "1", ""), Column("y", E[:2], "1", "")),
        (Column("a/b", E, "1", ""),),
        (Column("row", E, "1", ""),),
    ],
)
def test_what_is_no_table_is_refused(tmp_path: Path, columns: tuple[Column, ...]) -> None:
    with pytest.raises(ArgumentError, match="columns"):
        write_table(tmp_path / "t.h5", Table("t", columns))
    assert not list(tmp_path.iterdir())
