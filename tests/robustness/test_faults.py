"""What may happen to a store, done to it: nothing finished is lost; and a careless writer would be caught."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

import tests.robustness.faults as faults
from iapb.errors import RunFileError
from reports.store.runs import read_run
from tests.robustness.faults import FAULTS, inputs_of, killed_writer, open_store, try_faults
from tests.robustness.kills import FOREIGN, foreign_hash, killed_command


def test_nothing_finished_is_lost(tmp_path: Path) -> None:
    records = try_faults(tmp_path, times=2)
    assert [record.fault for record in records] == list(FAULTS)
    for record in records:
        assert (record.survived, record.lost) == (record.tried, 0), record


@pytest.mark.parametrize("name", ["run", "store gc"])
def test_a_killed_command_loses_nothing_and_touches_nothing_foreign(tmp_path: Path, name: str) -> None:
    tried, survived, lost, _ = killed_command(name, tmp_path, 1)
    assert (tried, survived, lost) == (1, 1, 0)


def test_a_change_of_a_foreign_file_would_be_seen(tmp_path: Path) -> None:
    for name in FOREIGN:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(name)
    before = foreign_hash(tmp_path)
    (tmp_path / FOREIGN[-1]).unlink()
    assert foreign_hash(tmp_path) != before


def test_a_writer_that_writes_in_place_is_caught(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The planted fault: straight into the target, unsynced and unsealed, said to be finished beforehand."""
    def careless(folder: Path) -> None:
        store = open_store(folder)
        with store.place_of(inputs_of(0), "sample").path.open("wb") as file:
            (folder / "finished").write_text("0\n")
            while True:
                file.write(b"\x89HDF\r\n\x1a\n" * 100)
                file.flush()
                time.sleep(1e-3)

    monkeypatch.setattr(faults, "_write_for_ever", careless)
    monkeypatch.setattr(faults, "whole", lambda store, number: _readable(store.place_of(inputs_of(number)).path))
    tried, survived, lost, _ = killed_writer(tmp_path, 3)
    assert (tried, survived) == (3, 0) or lost > 0


def _readable(path: Path) -> bool:
    try:
        read_run(path)
    except RunFileError:
        return False
    return True
