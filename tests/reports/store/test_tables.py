"""Tables of results: names, units and values survive, and other programs read them."""

from __future__ import annotations

from pathlib import Path

import h5py
import pytest
import xarray

from iapb.errors import RunFileError
from reports.store import read_table, write_table
from reports.store.io import sealed
from reports.store.tables import read_record, write_record
from verification.table import titled

TABLE = titled(("point", "energy [J]", "world", "rank"), [(3, 0.5, "A", None), (1, 0.25, "ä", 2)])


def test_a_table_comes_back_and_xarray_reads_it(tmp_path: Path) -> None:
    path = write_table(tmp_path / "t.h5", "fig03", TABLE, title="Figure 3", command="iapb sweep")
    found = read_table(path, "fig03")
    assert found.titles == TABLE.titles and found["world"] == ["A", "ä"] and found["energy"] == [0.5, 0.25]
    assert found["rank"][1] == 2.0 and found["rank"][0] != found["rank"][0]
    assert read_table(write_table(path, "bare", titled(("x",)))).rows == ()
    write_table(path, "fig03", TABLE)
    with xarray.open_dataset(path, engine="h5netcdf", group="fig03") as dataset:
        assert dataset["energy"].dims == ("point",) and dataset["energy"].attrs["units"] == "J"
        assert float(dataset["energy"].sel(point=1)) == 0.25
    with pytest.raises(RunFileError, match="did you mean|expected"):
        read_table(path, "third")


def test_records_come_back_and_damage_is_found(tmp_path: Path) -> None:
    record = {"é": [1, 0.1, None, "a"]}
    path = write_record(tmp_path / "r.h5", record, "Records")
    assert read_record(path) == record
    content = path.read_bytes()
    path.write_bytes(content[:-100])
    with pytest.raises(RunFileError, match="checksum"):
        read_record(path)
    path.write_bytes(content)
    with h5py.File(path, "r+") as file:
        del file["records"]
        file["records"] = 1
    path.write_bytes(sealed(path.read_bytes()))
    with pytest.raises(RunFileError, match="records is missing"):
        read_record(path)
